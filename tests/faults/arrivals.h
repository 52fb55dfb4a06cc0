// In which order requests arrive at a daemon: what a stop, an emergency stop, a pause or a hold
// finds there of its motors, it ends, wherever that waits. So none of it is accepted afterwards.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
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

  // A path arrives with its first part, and other paths of the client with these motors have other
  // numbers of points.
  using Path = std::tuple<std::string, std::vector<std::string>, std::size_t>;
  struct Place {
    std::uint64_t at;  // of all that had arrived
    std::int64_t number;
  };

  static Path path_of(const Request& request);
  std::optional<Place> place_of(const Request& request) const;

  std::uint64_t count_ = 0;
  std::map<Path, Place> first_parts_;
  std::map<Key, std::uint64_t> arrived_;
  std::map<Key, std::uint64_t> carried_out_;  // that end others: when
  std::vector<End> ends_;
};

}  // namespace bushfaults
