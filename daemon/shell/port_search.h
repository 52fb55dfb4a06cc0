// A port that is written as a pattern may match devices that are none of the bus's: "/dev/ttyUSB*"
// with a GPS receiver at the lower number. One behind which nothing answers makes way for the next
// match, round and round, until the bus has answered; that one is kept. No I/O.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace bushd::daemon {

// Where to begin among the paths that a port may have now.
struct PortOrder {
  std::string path{};   // "": with the first
  bool behind = false;  // with the one behind `path`, which is not tried itself
};

// Precondition: `matches` are sorted.
std::vector<std::string> in_order(std::vector<std::string> matches, const PortOrder& order);

class PortSearch {
 public:
  // How long a port gets: boards that their adapter resets when it is opened (Arduinos) answer some
  // seconds later, and MCUs that are offline are asked by turns (link::Connector).
  static constexpr std::int64_t kBootUs = 3'000'000;
  static constexpr std::int64_t kMcuUs = 1'000'000;  // for each MCU of the bus

  // `port` as configured, of a bus with so many MCUs.
  PortSearch(const std::string& port, std::size_t mcus);

  PortOrder first() const { return {.path = found_, .behind = false}; }
  PortOrder next() const { return {.path = path_, .behind = true}; }

  void opened(std::int64_t now_us, const std::string& path);
  void lost();
  // The bus has answered at this port.
  void found();
  // No other match opens now.
  void no_other(std::int64_t now_us) { due_us_ = now_us + time_us_; }
  // The next match is to be tried.
  bool due(std::int64_t now_us) const { return now_us >= due_us_; }
  std::int64_t due_us() const { return due_us_; }
  std::int64_t time_us() const { return time_us_; }

  // It has not been said since the bus was found, or its port lost: wrong devices are told once
  // each, not every few seconds.
  bool is_news(const std::string& text) { return told_.insert(text).second; }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  std::int64_t time_us_;
  bool searches_;
  std::string path_;
  std::string found_;  // where the bus was last
  std::int64_t due_us_ = kNever;
  std::set<std::string> told_;
};

}  // namespace bushd::daemon
