// Keeps floods out of the log: of each cause some lines at once and then one now and then, with how
// many were left out between. No I/O and no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace bushd::daemon {

class LogLimit {
 public:
  static constexpr std::uint64_t kAtOnce = 100;  // lines of a cause
  static constexpr std::int64_t kPeriodUs = 10'000'000;
  // Causes that are told apart. More at a time are one: whoever makes up causes has one limit.
  static constexpr std::size_t kCauses = 64;

  // The line to be written; nothing if it is one too many.
  std::optional<std::string> take(std::int64_t now_us, const std::string& text);
  // What is to be said of floods that are over, or go on. To be called now and then.
  struct LeftOut {
    std::uint64_t lines;
    std::string newest;
    std::string text() const;  // a line for people
  };
  std::vector<LeftOut> due(std::int64_t now_us);

  // What lines of one cause have in common: numbers and those who asked differ.
  static std::string cause_of(const std::string& text);

 private:
  struct Cause {
    std::int64_t since_us = 0;  // of the period that counts
    std::uint64_t lines = 0;    // in it
    LeftOut left_out{};
  };
  std::map<std::string, Cause> causes_;
};

}  // namespace bushd::daemon
