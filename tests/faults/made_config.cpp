#include "made_config.h"

#include <fmt/core.h>

#include <array>

#include "bus/bus_budget.h"
#include "mcu_programs.h"
#include "programs.h"
#include "sim/random.h"
#include "tables/table_file.h"
#include "units.h"

namespace bushfaults {
namespace {

// Full steps at up to 2500 steps/s, and one with a start within the tick; the faster tables need
// shorter ticks than a line for 32 motors can carry.
constexpr std::array<const char*, 4> kTables = {"bushd2-constant", "bushd2-scurve",
                                                "bushd2-exponential", "bushd2-resonance"};
constexpr std::array<std::uint32_t, 7> kBauds = {57'600,    115'200,   230'400,  500'000,
                                                 1'000'000, 2'000'000, 4'000'000};
constexpr std::uint32_t kUsualBaud = 500'000;
constexpr std::array<const char*, 3> kEmergencyStops = {"ramp", "immediate", "disable"};
constexpr std::uint32_t kInstallationStream = 400;  // of randomness
constexpr std::uint32_t kHomeStream = 401;
constexpr std::uint32_t kEmergencyStream = 402;
constexpr std::uint32_t kInputStream = 413;
constexpr std::uint32_t kDisablingStream = 415;
constexpr std::uint32_t kHomeSpeedStream = 407;
constexpr std::uint32_t kRequiredStream = 410;
constexpr std::uint32_t kLineStream = 414;
constexpr std::uint32_t kSwitchStream = 500;  // and the next ones, one for each motor
constexpr std::uint32_t kLimitStream = 5000;  // and the next ones, one for each motor

// Every choice is drawn, also where the way is given: so a run told all its ways is the same run.
bushd::config::Bus make_bus(const Ways& ways, std::uint64_t seed) {
  bushd::sim::Random random(seed, kInstallationStream);
  bushd::config::Bus bus{.name = "hall",
                         .port = "simulated",
                         .tick_us = ways.slow_line.value_or(false) ? kSlowTickUs : kTickUs};
  const bool table_runs = random.one_in(2);
  const bool table_ticks = random.one_in(2);
  const bool coarse = random.one_in(2);
  const bool immediate = random.one_in(2);
  // Behind the others, which keep what they were in a seed.
  const bool disables = random.one_in(2) && immediate;
  bus.table_runs = ways.table_runs.value_or(table_runs);
  bus.table_ticks = ways.table_ticks.value_or(table_ticks);
  bus.format = ways.format.value_or(coarse ? BUSHD_FORMAT_COARSE : BUSHD_FORMAT_FINE);
  bus.emergency_stop = ways.emergency_stop.value_or(disables    ? BUSHD_STOP_DISABLE
                                                    : immediate ? BUSHD_STOP_IMMEDIATE
                                                                : BUSHD_STOP_RAMP);
  return bus;
}

const std::optional<bushd::config::Input>& limit_of(const bushd::config::Motor& motor,
                                                    bool positive) {
  return positive ? motor.inputs.positive : motor.inputs.negative;
}

// Gives every second motor a speed, in its own unit.
void add_home_speed(bushd::config::Motor& motor, bushd::sim::Random& random) {
  const std::int64_t steps_per_s = random.magnitude(600, 4'000);
  if (random.one_in(2)) return;
  const bushd::units::Ratio& scale = motor.coordinates.scale().steps_per_unit;
  motor.home->speed =
      static_cast<double>(steps_per_s * scale.denominator) / static_cast<double>(scale.numerator);
}

}  // namespace

bushd::Result<bushd::config::Config> make_installation(std::size_t motors, std::size_t mcus,
                                                       const Ways& ways, std::uint64_t seed) {
  if (mcus == 0 || mcus > 255) return bushd::fail("--mcus must be 1 to 255");
  if (motors < mcus || motors > mcus * BUSHD_MOTORS_PER_MCU) {
    return bushd::fail(fmt::format("--motors must be {} to {} for {} MCUs: each has 1 to {} motors",
                                   mcus, mcus * BUSHD_MOTORS_PER_MCU, mcus, BUSHD_MOTORS_PER_MCU));
  }
  bushd::config::Config config;
  config.path = "bushfaults";
  config.state.required =
      ways.state_required.value_or(!bushd::sim::Random(seed, kRequiredStream).one_in(4));
  for (const char* name : kTables) {
    const auto path = bushd::tables::find(name, bushd::tables::shipped_directories());
    if (!path) return bushd::fail(path.error());
    const auto table = bushd::tables::load(*path);
    if (!table) return bushd::fail(table.error());
    config.groups.push_back({.name = name, .table_name = name, .table = *table});
  }
  std::vector<std::uint8_t> motors_of_mcu(mcus, 0);
  for (std::size_t i = 0; i < mcus; ++i) {
    config.mcus.push_back({.bus = {0},
                           .address = {static_cast<std::uint8_t>(i + 1)},
                           .id = fmt::format("hall:{}", i + 1)});
  }
  for (std::size_t i = 0; i < motors; ++i) {
    const std::size_t mcu = i % mcus;
    config.motors.push_back({.name = fmt::format("m{:02}", i + 1),
                             .mcu = {mcu},
                             .output = {motors_of_mcu[mcu]++},
                             .group = {i / mcus % kTables.size()}});
  }
  bushd::config::Bus bus = make_bus(ways, seed);
  for (const std::uint32_t baud : kBauds) {
    if (baud < kUsualBaud && !ways.slow_line.value_or(false)) continue;
    if (bushd::fieldbus::bus_load(baud, bus.tick_ns(), bus.format, motors_of_mcu) >
        bushd::fieldbus::kMaxBusLoad) {
      continue;
    }
    bus.baud = baud;
    config.buses.push_back(bus);
    return config;
  }
  return bushd::fail(fmt::format("no line can carry {} motors; use fewer", motors));
}

void furnish(bushd::config::Config& config, const FaultRates& faults, const CommandRates& commands,
             std::uint64_t seed) {
  const bool units =
      rate(commands, CommandKind::kUserMove) > 0 || rate(commands, CommandKind::kUserSet) > 0 ||
      rate(commands, CommandKind::kSpeed) > 0 || rate(commands, CommandKind::kLegMove) > 0 ||
      rate(commands, CommandKind::kJog) > 0 || rate(commands, CommandKind::kSettings) > 0;
  if (units) add_units(config, seed);
  if (rate(commands, CommandKind::kLegMove) > 0) add_backlash(config, seed);
  const bool shutter = rate(commands, CommandKind::kShutter) > 0;
  if (shutter || rate(commands, CommandKind::kCamac) > 0) add_crate(config);
  if (shutter) add_shutter(config);
  if (rate(commands, CommandKind::kMcuProgram) > 0) allow_mcu_programs(config, seed);
  if (rate(commands, CommandKind::kHome) > 0) add_homes(config, seed);
  if (rate(faults, FaultKind::kLimitSwitch) > 0) add_limit_switches(config);
  if (rate(faults, FaultKind::kEmergencyInput) > 0) add_emergency_inputs(config, seed);
}

void add_homes(bushd::config::Config& config, std::uint64_t seed) {
  bushd::sim::Random random(seed, kHomeStream);
  bushd::sim::Random speeds(seed, kHomeSpeedStream);
  for (std::size_t i = 0; i < config.motors.size(); i += 2) {
    bushd::config::Motor& motor = config.motors[i];
    if (is_of_shutter(config, i)) continue;
    bushd::config::Home home;
    home.positive = random.one_in(2);
    home.position_steps =
        static_cast<std::int32_t>(random.between(8'000, 15'000)) * (home.positive ? 1 : -1);
    home.most_steps = static_cast<std::uint32_t>(random.between(5'000, 40'000));
    const bool limit = !random.one_in(4);
    const bushd::config::Input own{.number = motor.output.value};
    if (limit) (home.positive ? motor.inputs.positive : motor.inputs.negative) = own;
    motor.inputs.home = motor.inputs.own = own;
    motor.home = home;
    add_home_speed(motor, speeds);
  }
  add_switches(config, seed);
}

// At inputs that no motor of its MCU has by its output. Where all are taken nothing is drawn.
void add_switches(bushd::config::Config& config, std::uint64_t seed) {
  bushd::sim::Random random(seed, kInputStream);
  std::vector<std::uint8_t> next_free(config.mcus.size(), 0);
  for (const bushd::config::Motor& motor : config.motors) ++next_free[motor.mcu.value];
  for (bushd::config::Motor& motor : config.motors) {
    std::uint8_t& free = next_free[motor.mcu.value];
    if (!motor.home || free + 2u > BUSHD_MOTORS_PER_MCU || random.one_in(4)) continue;
    motor.inputs.positive = {.number = free++, .active_open = random.one_in(2)};
    motor.inputs.negative = {.number = free++, .active_open = random.one_in(2)};
    const bool at_limit = random.one_in(3);
    if (at_limit) motor.inputs.home = limit_of(motor, motor.home->positive);
  }
}

// The contact settles within a slow step, which lasts 10 ms: longer, and nobody could find it to a
// step.
std::optional<bushd::sim::SwitchOptions> home_switch(const bushd::config::Config& config,
                                                     std::size_t motor, std::uint64_t seed) {
  const auto& home = config.motors[motor].home;
  const auto& input = config.motors[motor].inputs.home;
  if (!home || !input) return std::nullopt;
  bushd::sim::Random random(seed, kSwitchStream + static_cast<std::uint32_t>(motor));
  bushd::sim::SwitchOptions options;
  options.at_steps = random.between(1'000, 6'000) * (home->positive ? 1 : -1);
  options.positive_end = home->positive;
  options.hysteresis_steps = random.between(0, 20);
  options.bounce_ns = random.between(0, 6'000'000);
  options.seed = seed + motor;
  options.input = input->number;
  options.opens = input->active_open;
  return options;
}

std::vector<bushd::sim::SwitchOptions> limit_switches(const bushd::config::Config& config,
                                                      std::size_t index, std::uint64_t seed) {
  const bushd::config::Motor& motor = config.motors[index];
  const auto home = home_switch(config, index, seed);
  std::vector<bushd::sim::SwitchOptions> switches;
  if (!home) return switches;
  bushd::sim::Random random(seed, kLimitStream + static_cast<std::uint32_t>(index));
  for (const bool positive : {true, false}) {
    const auto& input = limit_of(motor, positive);
    if (!input || input->number == motor.inputs.home->number) continue;
    // A ramp beyond the home switch, and far away from it on the other side.
    const bool beyond_home = positive == motor.home->positive;
    const std::int64_t away = random.between(beyond_home ? 6'300 : 2'000, 9'000);
    switches.push_back({.at_steps = positive ? away : -away,
                        .positive_end = positive,
                        .hysteresis_steps = random.between(0, 20),
                        .bounce_ns = random.between(0, 6'000'000),
                        .seed = seed + 1000 * (index + 1) + (positive ? 1 : 0),
                        .opens = input->active_open,
                        .input = input->number});
  }
  return switches;
}

void add_emergency_inputs(bushd::config::Config& config, std::uint64_t seed) {
  bushd::sim::Random random(seed, kEmergencyStream);
  bushd::sim::Random disables(seed, kDisablingStream);
  for (bushd::config::Mcu& mcu : config.mcus) {
    mcu.emergency_input = !random.one_in(2)    ? BUSHD_EMERGENCY_INPUT_RAMP
                          : disables.one_in(2) ? BUSHD_EMERGENCY_INPUT_DISABLE
                                               : BUSHD_EMERGENCY_INPUT_IMMEDIATE;
  }
}

void add_limit_switches(bushd::config::Config& config) {
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    if (config.motors[i].home || is_of_shutter(config, i)) continue;
    const bushd::config::Input own{.number = config.motors[i].output.value};
    if (i % 3 != 1) config.motors[i].inputs.positive = own;
    if (i % 3 != 0) config.motors[i].inputs.negative = own;
  }
}

void add_all_ways(Ways& ways, std::uint64_t seed) {
  const bool slow = bushd::sim::Random(seed, kLineStream).one_in(3);
  if (!ways.slow_line) ways.slow_line = slow;
}

std::string ways_text(const bushd::config::Config& config) {
  const bushd::config::Bus& bus = config.buses[0];
  return fmt::format("--moves {} --frames {} --format {} --emergency {} --required {}{}",
                     bus.table_runs ? "table" : "stream", bus.table_ticks ? "auto" : "ticks",
                     bus.format == BUSHD_FORMAT_FINE ? "fine" : "coarse",
                     kEmergencyStops.at(bus.emergency_stop), config.state.required ? "yes" : "no",
                     bus.tick_us == kSlowTickUs ? " --line slow" : "");
}

}  // namespace bushfaults
