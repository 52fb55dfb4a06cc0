// A run of a motor's table that its MCU makes by itself.
#pragma once

#include <cstdint>
#include <cstdlib>

#include "engine/message.h"

namespace bushd::link {

struct TableRun {
  std::int32_t steps;       // either sign, not 0
  std::uint16_t floor = 0;  // of bushd_run_start
};

// `slot`: of the table that the motor has.
inline bushd_table_run_entry entry_of(std::uint8_t motor, std::uint8_t slot, TableRun run) {
  return {.motor = motor,
          .slot = slot,
          .direction = static_cast<std::int8_t>(run.steps < 0 ? -1 : 1),
          .steps = static_cast<std::uint32_t>(std::abs(std::int64_t{run.steps})),
          .floor = run.floor};
}

}  // namespace bushd::link
