// Programs as an MCU has them: bytes (engine/program.h), and what they will do.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/units/coordinates.h"
#include "engine/table.h"
#include "programs/program.h"

namespace bushd::programs {

// What the configuration knows of a motor of the program.
struct MotorPlace {
  std::string name;
  std::uint8_t output = 0;
  std::uint8_t bank = 0;               // of its table
  const bushd_table* table = nullptr;  // passed bushd_table_check
  units::Coordinates coordinates{};
  std::int64_t least_steps = -INT32_MAX;  // soft limits, inwards
  std::int64_t most_steps = INT32_MAX;
  std::uint64_t shortest_delay_ns = 0;  // of its max_speed; 0: its table's
  std::int64_t at_steps = 0;            // where the program will find it
};

struct McuPlace {
  std::string name;
  std::size_t memory = 0;  // bytes for a program
  std::uint32_t tick_ns = 0;
  bool lines = true;           // BUSHD_CAN_LINE_RUN
  bool elementary = true;      // BUSHD_CAN_ELEMENTARY
  std::uint8_t line_bank = 0;  // of the table for lines
  const bushd_table* line_table =
      nullptr;          // any_line_table() of these motors, or its codes; null: no bank is free
  bool travels = true;  // BUSHD_CAN_TRAVEL, and for edges a trigger input
  bool has_trigger = true;
};

// Precondition: motors are those of the program, in its order, of one MCU, and their outputs
// differ. Errors name the frame and the motor: a speed that the table does not have or that is
// slower than 65535 time units, steps beyond 32 bits, a line where there can be none, no memory.
Result<std::vector<std::uint8_t>> compile(const Program& program, const McuPlace& mcu,
                                          std::span<const MotorPlace> motors);

// What it does. Of a repeat without end the first pass counts.
struct Rehearsal {
  static constexpr std::size_t kMostFrames = 1'000'000;
  struct Way {
    std::int64_t least_steps = 0;  // where it comes to, its beginning included
    std::int64_t most_steps = 0;
    std::int64_t end_steps = 0;
    std::uint64_t edges = 0;  // of STEP that rise
  };
  std::vector<Way> motors;
  std::uint64_t ticks = 0;  // without the time in which it waits for inputs
  std::uint64_t pulses = 0;
  bool endless = false;
  bool cut = false;  // there is more
  bool waits_for_inputs = false;
  std::size_t bytes = 0;
};

// Walks through the compiled bytes as the MCU does. Error: a frame that leads a motor beyond where
// it may go, with the frame, the pass and the figures. It is cut at the frame with which more than
// `most_frames` are carried out, each point of a line counted as one. O(frames carried out).
Result<Rehearsal> rehearse(const Program& program, const McuPlace& mcu,
                           std::span<const MotorPlace> motors, std::span<const std::uint8_t> bytes,
                           std::size_t most_frames = Rehearsal::kMostFrames);

}  // namespace bushd::programs
