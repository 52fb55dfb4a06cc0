// In which order requests arrive at a daemon: what a stop, an emergency stop, a pause or a hold
// finds there of its motors, it ends, wherever that waits. So none of it is accepted afterwards.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "request.h"

namespace bushfaults {

class Arrivals {
 public:
  void daemon_started();
  // Again and again, perhaps: the first time counts.
  void arrives(const Request& request);
  void carried_out(const Request& request);
  // Why it was not to be. Notes what ends others.
  std::optional<std::string> accepted(const Request& request);

 private:
  struct End {
    std::uint64_t at;      // of those that had arrived
    std::int64_t session;  // of a client that has one
    std::int64_t number;
    std::vector<std::string> motors;  // none: all
  };
  static constexpr std::size_t kMostEnds = 200;
  static constexpr std::size_t kMostArrivals = 20'000;

  std::uint64_t count_ = 0;
  std::map<Key, std::uint64_t> arrived_;
  std::map<Key, std::uint64_t> carried_out_;  // that end others: when
  std::vector<End> ends_;
};

}  // namespace bushfaults
