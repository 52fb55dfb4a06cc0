// The configuration that bushfaults makes for the daemon: one bus with some MCUs, motors spread
// evenly over their outputs, and the shipped tables dealt out among them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/result.h"
#include "config/config.h"
#include "kinds.h"
#include "sim/switch.h"

namespace bushfaults {

inline constexpr std::uint32_t kTickUs = 2560;
inline constexpr std::uint32_t kSlowTickUs = 5000;

// How motors are told their moves; what is not given is chosen by the seed.
struct Ways {
  std::optional<bool> table_runs;   // moves = "table", or "stream"
  std::optional<bool> table_ticks;  // frames = "auto", or "ticks"
  std::optional<bushd_format> format;
  std::optional<bushd_stop_mode> emergency_stop;
  std::optional<bool> state_required;  // [state] required
  // Ticks of kSlowTickUs, at the slowest rate that carries all motors; chosen only with all kinds.
  std::optional<bool> slow_line;
};

// Refuses what does not fit: more motors than outputs, or than any line can carry.
bushd::Result<bushd::config::Config> make_installation(std::size_t motors, std::size_t mcus,
                                                       const Ways& ways, std::uint64_t seed);

// With what faults and commands of these rates need: see below.
void furnish(bushd::config::Config& config, const FaultRates& faults, const CommandRates& commands,
             std::uint64_t seed);

// Every second motor has a switch to run into and can be homed, some at a speed; most of these
// switches are limits too. Where an MCU has inputs left, most of these motors have limit switches
// of their own at both ends.
void add_homes(bushd::config::Config& config, std::uint64_t seed);
void add_switches(bushd::config::Config& config, std::uint64_t seed);
// Where the plant has the switch of such a motor, by its index.
std::optional<bushd::sim::SwitchOptions> home_switch(const bushd::config::Config& config,
                                                     std::size_t motor, std::uint64_t seed);

// Where the plant has those of its limits that are not its home switch.
std::vector<bushd::sim::SwitchOptions> limit_switches(const bushd::config::Config& config,
                                                      std::size_t motor, std::uint64_t seed);

// Gives all MCUs emergency inputs; they ramp or stop immediately.
void add_emergency_inputs(bushd::config::Config& config, std::uint64_t seed);

// At one end of most motors, at both of the others.
void add_limit_switches(bushd::config::Config& config);

// What of the ways is not given, and is not usual, by the seed.
void add_all_ways(Ways& ways, std::uint64_t seed);

// The ways of its bus, as options of bushfaults.
std::string ways_text(const bushd::config::Config& config);

}  // namespace bushfaults
