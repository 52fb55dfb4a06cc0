// How many requests that end motion (api::ends_motion) have arrived, from whomever.
#pragma once

#include <cstdint>

namespace bushd::daemon {

class StopCount {
 public:
  std::uint64_t stops() const { return stops_; }
  // One more has. Returns its number.
  std::uint64_t count() { return ++stops_; }

 private:
  std::uint64_t stops_ = 0;
};

}  // namespace bushd::daemon
