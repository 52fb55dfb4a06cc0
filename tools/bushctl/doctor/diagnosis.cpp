#include "diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/printable.h"

namespace bushctl::doctor {
namespace {

std::ptrdiff_t count(const Findings& findings, Level level) {
  return std::ranges::count(findings, level, &Finding::level);
}

std::string counted(std::ptrdiff_t number, const char* things) {
  return fmt::format("{} {}{}", number, things, number == 1 ? "" : "s");
}

}  // namespace

const char* word(Level level) {
  switch (level) {
    case Level::kOk:
      return "ok";
    case Level::kWarning:
      return "warning";
    case Level::kError:
      break;
  }
  return "error";
}

Findings diagnose(const Observations& seen) {
  Findings all;
  for (const auto check : {check_configuration, check_ports, check_lcm, check_clock, check_disk,
                           check_sockets, check_daemon, check_mcus, check_lines, check_positions}) {
    Findings found = check(seen);
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

bool any_error(const Findings& findings) {
  return count(findings, Level::kError) > 0;
}

std::vector<std::string> lines(const Findings& findings) {
  std::vector<std::string> out;
  for (const auto& [level, check, seen, remedy] : findings) {
    out.push_back(fmt::format("{:<8} {:<13}  {}", word(level), check, bushd::printable(seen)));
    if (!remedy.empty()) out.push_back(fmt::format("{:>22}  -> {}", "", bushd::printable(remedy)));
  }
  out.push_back(fmt::format("{}, {}", counted(count(findings, Level::kError), "error"),
                            counted(count(findings, Level::kWarning), "warning")));
  return out;
}

std::string json(const Findings& findings) {
  nlohmann::ordered_json out = {{"findings", nlohmann::ordered_json::array()},
                                {"errors", count(findings, Level::kError)},
                                {"warnings", count(findings, Level::kWarning)}};
  for (const auto& [level, check, seen, remedy] : findings) {
    nlohmann::ordered_json finding = {
        {"level", word(level)}, {"check", check}, {"seen", seen}, {"remedy", nullptr}};
    if (!remedy.empty()) finding["remedy"] = remedy;
    out["findings"].push_back(std::move(finding));
  }
  return bushd::json_text(out);
}

}  // namespace bushctl::doctor
