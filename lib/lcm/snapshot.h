// The whole, put together from its parts: the daemon sends one state_t per MCU and one health_t per
// bus.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "bushd/health_t.hpp"
#include "bushd/state_t.hpp"

namespace bushd::lcm {

struct Snapshot {
  std::int64_t sequence = 0;
  std::vector<state_t> mcus;  // by `part`; never empty
};

struct Health {
  std::int64_t sequence = 0;
  std::vector<health_t> buses;  // by `part`; never empty
};

template <class Whole, class Part>
class Collector {
 public:
  // More than any configuration has; a part beyond is dropped, so that a hostile sender cannot make
  // us keep parts without end.
  static constexpr std::int32_t kMaxParts = 4096;

  // The whole that this part completes. A part of another one than that being collected drops the
  // latter: the daemon sends the parts of one in a row, so the rest of it is lost.
  std::optional<Whole> add(Part part);

 private:
  std::int64_t sequence_ = 0;
  std::int32_t parts_ = 0;
  std::map<std::int32_t, Part> collected_;  // by part
};

using SnapshotCollector = Collector<Snapshot, state_t>;
using HealthCollector = Collector<Health, health_t>;

}  // namespace bushd::lcm
