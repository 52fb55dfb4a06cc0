// The whole state, put together from its parts: the daemon sends one state_t per MCU.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "bushd/state_t.hpp"

namespace bushd::lcm {

struct Snapshot {
  std::int64_t sequence = 0;
  std::vector<state_t> mcus;  // by `part`; never empty
};

class SnapshotCollector {
 public:
  // More MCUs than any configuration has; a part beyond is dropped, so that a hostile sender cannot
  // make us keep parts without end.
  static constexpr std::int32_t kMaxParts = 4096;

  // The snapshot that this part completes. A part of another snapshot than the one being collected
  // drops the latter: the daemon sends the parts of one in a row, so the rest of it is lost.
  std::optional<Snapshot> add(state_t part);

 private:
  std::int64_t sequence_ = 0;
  std::int32_t parts_ = 0;
  std::map<std::int32_t, state_t> collected_;  // by part
};

}  // namespace bushd::lcm
