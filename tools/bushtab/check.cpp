#include <fmt/core.h>

#include <cstdio>

#include "base/printable.h"
#include "commands.h"
#include "diagnostic_text.h"
#include "json.h"
#include "open_table.h"

namespace bushtab {
namespace {

namespace profiles = bushd::tables::profiles;
using nlohmann::ordered_json;

bool is_error(const profiles::Diagnostic& diagnostic) {
  return diagnostic.severity == profiles::Severity::kError;
}

ordered_json to_json(const profiles::Diagnostic& diagnostic) {
  ordered_json json = {{"severity", is_error(diagnostic) ? "error" : "warning"},
                       {"rule", diagnostic.rule},
                       {"side", diagnostic.side},
                       {"index", nullptr},
                       {"value", diagnostic.value},
                       {"limit", diagnostic.limit},
                       {"message", diagnostic.message}};
  if (diagnostic.index) json["index"] = *diagnostic.index;
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
    ordered_json entry = {
        {"table", table}, {"good", false}, {"diagnostics", ordered_json::array()}};
    if (!opened) {
      entry["error"] = opened.error().text();
      result = refuse(opened.error());
      all.push_back(entry);
      continue;
    }
    const auto found = profiles::diagnostics(**opened, *limits);
    bool good = true;
    for (const profiles::Diagnostic& diagnostic : found) {
      const bool refused = is_error(diagnostic) || wanted.strict;
      good = good && !refused;
      entry["diagnostics"].push_back(to_json(diagnostic));
      if (!wanted.json) {
        fmt::print("{}: {}\n", bushd::printable(table), text_of(diagnostic));
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
