#include "tables/move_time.h"

#include <algorithm>

namespace bushd::tables {

MoveTime move_time(const bushd_table& table, std::uint32_t steps) {
  // Between the sides all delays are the cruise delay.
  const std::uint32_t ramps = table.accel.count + table.decel.count;
  const std::uint32_t cruising = steps > ramps ? steps - ramps : 0;
  std::uint64_t units = std::uint64_t{cruising} * table.cruise;
  std::uint16_t fastest = cruising > 0 ? table.cruise : 0;
  const auto add = [&](std::uint32_t step) {
    const std::uint16_t delay = bushd_table_delay(&table, step, steps);
    units += delay;
    fastest = fastest == 0 ? delay : std::min(fastest, delay);
  };
  const std::uint32_t head = cruising > 0 ? table.accel.count : steps;
  for (std::uint32_t j = 1; j <= head; ++j) add(j);
  if (cruising > 0) {
    for (std::uint32_t j = steps - table.decel.count + 1; j <= steps && j > 0; ++j) add(j);
  }
  return {units * table.time_unit_ns, fastest};
}

}  // namespace bushd::tables
