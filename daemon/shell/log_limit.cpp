#include "daemon/shell/log_limit.h"

#include <string_view>
#include <utility>

namespace bushd::daemon {
namespace {

constexpr const char* kOthers = "";  // the cause of all that are one too many

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace

std::string LogLimit::cause_of(const std::string& text) {
  // Behind " of " and " by " there is who asked, whose name is his own choice.
  std::string_view rest = text;
  for (const std::string_view word : {" by ", " of "}) rest = rest.substr(0, rest.find(word));
  std::string cause;
  for (const char c : rest) {
    if (!is_digit(c)) {
      cause += c;
    } else if (cause.empty() || cause.back() != '#') {
      cause += '#';
    }
  }
  return cause;
}

std::optional<std::string> LogLimit::take(std::int64_t now_us, const std::string& text) {
  std::string key = cause_of(text);
  if (!causes_.contains(key) && causes_.size() >= kCauses) key = kOthers;
  const auto [found, first] = causes_.try_emplace(std::move(key));
  Cause& cause = found->second;
  if (first) cause.since_us = now_us;
  if (cause.lines < kAtOnce) {
    ++cause.lines;
    return text;
  }
  ++cause.left_out.lines;
  cause.left_out.newest = text;
  return std::nullopt;
}

std::string LogLimit::LeftOut::text() const {
  return std::to_string(lines) + " more lines in " + std::to_string(kPeriodUs / 1'000'000) +
         " s like: " + newest;
}

std::vector<LogLimit::LeftOut> LogLimit::due(std::int64_t now_us) {
  std::vector<LeftOut> all;
  for (auto it = causes_.begin(); it != causes_.end();) {
    Cause& cause = it->second;
    if (now_us - cause.since_us < kPeriodUs) {
      ++it;
      continue;
    }
    if (cause.left_out.lines == 0) {
      it = causes_.erase(it);
      continue;
    }
    all.push_back(std::move(cause.left_out));
    // It may go on: of the next period this only, until one has passed without any.
    cause = {.since_us = now_us, .lines = kAtOnce};
    ++it;
  }
  return all;
}

}  // namespace bushd::daemon
