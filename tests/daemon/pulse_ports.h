// A lab of serial ports that make pulses: their configuration, the table of their motors, and the
// profile of their runs. Times are those of the steps that virtual drives have made.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {

// 100 Hz to 2500 Hz in 60 codes of 40 us, both sides the same.
inline constexpr std::int64_t kPulseUnitNs = 40'000;
inline constexpr std::int64_t kPulseCruise = 10;
inline constexpr double kPulseFastestHz = 2500;
inline std::vector<std::int64_t> pulse_codes() {
  std::vector<std::int64_t> all;
  for (int i = 0; i < 60; ++i) all.push_back(std::llround(25'000.0 / (100 + 40.0 * i)));
  return all;
}

inline std::string pulse_table() {
  std::string text = "name = \"glacier\"\ntime_unit_ns = 40000\naccel = [";
  for (const std::int64_t code : pulse_codes()) text += std::to_string(code) + ", ";
  return text + std::to_string(kPulseCruise) + "]\n";
}

inline std::string pulse_group() {
  return "[[group]]\nname = \"axes\"\ntable = \"glacier\"\n";
}

// The bus `bus` at /dev/ttyS`number`, and its motor, of that group.
inline std::string pulse_port(const std::string& bus, int number, const std::string& motor,
                              const std::string& more_of_motor = {},
                              const std::string& more_of_bus = {}) {
  return "[[bus]]\nname = \"" + bus + "\"\nkind = \"serial-pulse\"\nport = \"/dev/ttyS" +
         std::to_string(number) +
         "\"\ndirection_line = \"dtr\"\n"
         "inputs = { home = \"cd\", positive = \"dsr\", negative = \"cts\" }\n" +
         more_of_bus + "[[motor]]\nname = \"" + motor + "\"\nmcu = \"" + bus +
         "\"\ngroup = \"axes\"\nhome = { direction = \"negative\", most_steps = 5000 }\n" +
         more_of_motor;
}

struct PulseLab : Lab {
  explicit PulseLab(const std::string& toml) : Lab(toml, pulse_table()) {}

  // What the drivers of all ports can. Before connect().
  void set_driver(bool any_rate, bool tells_empty, std::uint32_t base = 0) {
    pulse_driver.any_rate = any_rate;
    pulse_driver.base = base;
    pulse_driver.empty.reset();
    if (tells_empty) pulse_driver.empty = true;
  }

  std::vector<std::int64_t> times(std::size_t drive_index, std::size_t from = 0) {
    const auto& all = drive(drive_index).step_times_ns();
    return {all.begin() + static_cast<std::ptrdiff_t>(from), all.end()};
  }

  // Expects a motor's run from rest to rest: the interval before its step j is at least A(j-1),
  // D(N-j) and the cruise delay. Times are whole ns, so an interval is exact to one.
  void expect_table(const std::vector<std::int64_t>& made) const {
    const auto all = pulse_codes();
    const auto side = [&](std::size_t i) {
      return (i < all.size() ? all[i] : kPulseCruise) * kPulseUnitNs;
    };
    for (std::size_t j = 2; j <= made.size(); ++j) {
      const std::int64_t least =
          std::max({side(j - 1), side(made.size() - j), kPulseCruise * kPulseUnitNs});
      ASSERT_GE(made[j - 1] - made[j - 2] + 1, least)
          << "before step " << j << " of " << made.size();
    }
  }

  // Expects no interval shorter than the cruise delay, whatever the motor does.
  void expect_no_faster(std::size_t drive_index) {
    const auto made = times(drive_index);
    for (std::size_t j = 1; j < made.size(); ++j) {
      ASSERT_GE(made[j] - made[j - 1] + 1, kPulseCruise * kPulseUnitNs)
          << "drive " << drive_index << ", step " << j;
    }
  }
};

}  // namespace bushd::test
