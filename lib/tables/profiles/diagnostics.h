// What may go wrong with a table on a given motor, MCU and bus. A table that can be run at all has
// passed check(); these rules need to know more, and each is asked for by its limit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tables/profiles/motor.h"
#include "tables/table.h"

namespace bushd::tables::profiles {

struct Limits {
  // Between neighbouring delays; 0: any. None: 2, or any if the motor is known, which says more.
  std::optional<double> speed_ratio{};
  double resolution = 0.1;           // change of speed by one code at the cruise speed
  std::optional<double> start_hz{};  // the fastest that the motor can start and stop at
  std::optional<double> max_hz{};
  std::optional<double> acceleration{};      // steps/s^2
  std::optional<unsigned> code_bits{};       // 8: codes 10..250, as in BUSHD-2
  std::optional<std::uint32_t> mcu_codes{};  // table memory of an MCU
  std::optional<std::uint32_t> tick_ns{};    // of the bus
  std::optional<std::uint32_t> slots{};      // of a tick; with tick_ns
  std::optional<Motor> motor{};
};

enum class Severity { kWarning, kError };

struct Diagnostic {
  Severity severity = Severity::kWarning;
  std::string rule{};                  // speed_ratio, resolution, start_speed, max_speed, ..
  std::string side{};                  // accel, decel, cruise or empty: the whole table
  std::optional<std::size_t> index{};  // of the code, in the order of the file
  double value = 0;                    // in the unit of the rule; torque: Nm
  double limit = 0;
  std::string message{};  // value, rule and remedy in a sentence
};

// At most one diagnostic for each rule and side: its worst place. O(codes).
std::vector<Diagnostic> diagnostics(const Table& table, const Limits& limits);

}  // namespace bushd::tables::profiles
