#include "diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/printable.h"

namespace bushctl::doctor {
namespace {

constexpr std::size_t kToldByName = 3;

std::ptrdiff_t count(const Findings& findings, Level level) {
  return std::ranges::count(findings, level, &Finding::level);
}

std::string counted(std::ptrdiff_t number, const char* things) {
  return fmt::format("{} {}{}", number, things, number == 1 ? "" : "s");
}

// With NAME in place of what it is about: those that have this in common can be told at once.
std::string general(const std::string& remedy, const std::string& about) {
  if (about.empty()) return remedy;
  std::string out = remedy;
  for (auto at = out.find(about); at != std::string::npos; at = out.find(about, at + 4)) {
    out.replace(at, about.size(), "NAME");
  }
  return out;
}

bool alike(const Finding& a, const Finding& b) {
  return !a.of_several.empty() && a.level == b.level && a.check == b.check &&
         a.of_several == b.of_several && general(a.remedy, a.about) == general(b.remedy, b.about);
}

Finding of_all(const std::vector<Finding>& findings) {
  Finding one = findings.front();
  one.seen = fmt::format("{} {}: {}, {}, {} and {} more. {}", findings.size(), one.of_several,
                         findings[0].about, findings[1].about, findings[2].about,
                         findings.size() - kToldByName, one.seen);
  one.remedy = general(one.remedy, one.about);
  return one;
}

Findings told_at_once(const Findings& findings) {
  Findings out;
  std::vector<bool> told(findings.size(), false);
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (told[i]) continue;
    std::vector<Finding> group{findings[i]};
    for (std::size_t j = i + 1; j < findings.size(); ++j) {
      if (alike(findings[i], findings[j])) group.push_back(findings[j]);
    }
    if (group.size() <= kToldByName) {
      out.push_back(findings[i]);
      continue;
    }
    out.push_back(of_all(group));
    for (std::size_t j = i; j < findings.size(); ++j) {
      if (alike(findings[i], findings[j])) told[j] = true;
    }
  }
  return out;
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
                           check_sockets, check_daemon, check_mcus, check_buses, check_positions}) {
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
  for (const Finding& told : told_at_once(findings)) {
    out.push_back(
        fmt::format("{:<8} {:<13}  {}", word(told.level), told.check, bushd::printable(told.seen)));
    if (told.remedy.empty()) continue;
    out.push_back(fmt::format("{:>22}  -> {}", "", bushd::printable(told.remedy)));
  }
  out.push_back(fmt::format("{}, {}", counted(count(findings, Level::kError), "error"),
                            counted(count(findings, Level::kWarning), "warning")));
  return out;
}

std::string json(const Findings& findings) {
  nlohmann::ordered_json out = {{"findings", nlohmann::ordered_json::array()},
                                {"errors", count(findings, Level::kError)},
                                {"warnings", count(findings, Level::kWarning)}};
  for (const Finding& found : findings) {
    nlohmann::ordered_json finding = {{"level", word(found.level)},
                                      {"check", found.check},
                                      {"seen", found.seen},
                                      {"remedy", nullptr}};
    if (!found.remedy.empty()) finding["remedy"] = found.remedy;
    out["findings"].push_back(std::move(finding));
  }
  return bushd::json_text(out);
}

}  // namespace bushctl::doctor
