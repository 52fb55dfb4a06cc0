// Runs that an MCU makes by itself: of a motor's table, or of a line.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <variant>

#include "engine/message.h"

namespace bushd::link {

struct TableRun {
  std::int32_t steps;              // either sign, not 0
  bushd_delay shortest_delay = 0;  // of bushd_run_start
};

// A motor's part of a run that all motors of its line follow, on whatever MCU. All but the last two
// are the same for all that begin at one tick on an MCU, the numbers of banks aside for all of the
// line (engine/message_line.h).
struct LineRun {
  std::uint8_t bank;           // of the run's table
  bool elementary;             // by engine/elementary.h, not by engine/line.h
  bushd_delay shortest_delay;  // a code (engine/table.h)
  std::uint32_t longest;
  std::uint32_t from;
  std::uint32_t steps;
  std::int64_t ticks;  // until the run's last step
  std::uint32_t increment;
  int direction;  // +1, -1
};

using McuRun = std::variant<TableRun, LineRun>;

// What the motors of an MCU have in common of a line's run.
inline bushd_line_part line_part_of(const LineRun& run) {
  return {.bank = run.bank,
          .elementary = run.elementary,
          .shortest_delay = static_cast<std::uint16_t>(run.shortest_delay),
          .longest = run.longest,
          .from = run.from,
          .steps = run.steps,
          .count = 0,
          .entries = nullptr};
}

// `bank`: of the table that the motor has.
inline bushd_table_run_entry entry_of(std::uint8_t motor, std::uint8_t bank, TableRun run) {
  return {.motor = motor,
          .bank = bank,
          .direction = static_cast<std::int8_t>(run.steps < 0 ? -1 : 1),
          .steps = static_cast<std::uint32_t>(std::abs(std::int64_t{run.steps})),
          .shortest_delay = run.shortest_delay};
}

}  // namespace bushd::link
