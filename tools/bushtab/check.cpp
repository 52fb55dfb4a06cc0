#include <fmt/core.h>

#include <cstdio>

#include "base/printable.h"
#include "commands.h"
#include "finding_text.h"
#include "json.h"
#include "open_table.h"

namespace bushtab {
namespace {

namespace profiles = bushd::tables::profiles;
using nlohmann::ordered_json;

bool is_error(const profiles::Finding& finding) {
  return finding.severity == profiles::Severity::kError;
}

ordered_json to_json(const profiles::Finding& finding) {
  ordered_json json = {{"severity", is_error(finding) ? "error" : "warning"},
                       {"rule", finding.rule},
                       {"side", finding.side},
                       {"index", nullptr},
                       {"value", finding.value},
                       {"limit", finding.limit},
                       {"message", finding.message}};
  if (finding.index) json["index"] = *finding.index;
  return json;
}

}  // namespace

int check(const Places& places, const Check& wanted) {
  const auto limits = load_limits(wanted.limits);
  if (!limits) return refuse(limits.error());

  int result = kDone;
  ordered_json all = ordered_json::array();
  for (const std::string& table : wanted.tables) {
    const auto opened = open_table(places, table);
    ordered_json entry = {{"table", table}, {"good", false}, {"findings", ordered_json::array()}};
    if (!opened) {
      entry["error"] = opened.error().text();
      result = refuse(opened.error());
      all.push_back(entry);
      continue;
    }
    const auto found = profiles::findings(**opened, *limits);
    bool good = true;
    for (const profiles::Finding& finding : found) {
      const bool refused = is_error(finding) || wanted.strict;
      good = good && !refused;
      entry["findings"].push_back(to_json(finding));
      if (!wanted.json) {
        fmt::print("{}: {}\n", bushd::printable(table), text_of(finding));
      }
    }
    entry["good"] = good;
    all.push_back(entry);
    if (!good) {
      result = kRefused;
    } else if (!wanted.json) {
      fmt::print("{}: good\n", bushd::printable(table));
    }
  }
  if (wanted.json) {
    print_json(all);
  }
  return result;
}

}  // namespace bushtab
