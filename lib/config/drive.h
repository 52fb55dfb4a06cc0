// What the MCU makes of a motor beyond its steps' times, and may be changed in operation.
#pragma once

#include <cstdint>
#include <optional>

namespace bushd::config {

// Peak currents of the windings of a motor that its MCU drives by phases.
struct Currents {
  std::uint16_t ramp_ma = 0;
  std::uint16_t cruise_ma = 0;
  std::uint16_t hold_ma = 0;
  bool fast_decay = false;

  friend bool operator==(const Currents&, const Currents&) = default;
};

// Local motion by the velocity loop of engine/velocity.h.
inline constexpr std::int64_t kMostStepsPerS = 40'000;  // a step in each interval of 25 us
struct Velocity {
  std::int32_t min_steps_per_s = 0;
  std::int32_t max_steps_per_s = 0;
  std::int32_t steps_per_s2 = 0;

  friend bool operator==(const Velocity&, const Velocity&) = default;
};

struct Drive {
  std::optional<Currents> currents = {};  // with phases only
  std::optional<Velocity> velocity = {};  // counts where people move it
  bool local = false;                     // the MCU's FORWARD and REVERSE inputs move it
  bool keypad = false;                    // the keypad at the MCU moves it
  bool input_open = false;                // its one input is active when open
  std::uint8_t phase_sequence = 0;        // bushd_phase_sequence; all motors of an MCU have one
  double acceleration = 1;                // of that of its table, above 0 and at most 1

  bool moved_by_people() const { return local || keypad; }

  friend bool operator==(const Drive&, const Drive&) = default;
};

}  // namespace bushd::config
