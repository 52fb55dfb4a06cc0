// How long a move with a table takes.
#pragma once

#include <cstdint>

#include "engine/table.h"

namespace bushd::tables {

struct MoveTime {
  std::uint64_t time_ns = 0;       // from the move's start to its last step
  std::uint16_t fastest_code = 0;  // the shortest delay of the move; 0: no steps
};

// The sum of all delays. O(codes), whatever the number of steps.
MoveTime move_time(const bushd_table& table, std::uint32_t steps);

}  // namespace bushd::tables
