#include "bare_config.h"

#include <fmt/core.h>

#include <array>

#include "sim/random.h"

namespace bushfaults {
namespace {

constexpr std::uint32_t kBareStream = 600;      // of randomness
constexpr std::uint32_t kBareHomeStream = 601;  // and the next ones, one for each motor
constexpr std::array<std::uint32_t, 4> kBoardBauds = {9'600, 19'200, 57'600, 115'200};

bushd_stop_mode stop_mode(bushd::sim::Random& random) {
  return random.one_in(2) ? BUSHD_STOP_IMMEDIATE : BUSHD_STOP_RAMP;
}

void add_port(bushd::config::Config& config, bushd::sim::Random& random, std::size_t number) {
  bushd::config::Bus bus{.name = fmt::format("com{}", number),
                         .kind = bushd::config::BusKind::kSerialPulse,
                         .port = "simulated"};
  bus.emergency_stop = stop_mode(random);
  bus.serial_pulse.rts = random.one_in(2);
  bus.serial_pulse.inputs.home = bushd::config::Input{.number = 0};
  bus.serial_pulse.inputs.positive = bushd::config::Input{.number = 1};
  bus.serial_pulse.inputs.negative = bushd::config::Input{.number = 2};
  bushd::config::Home home;
  home.positive = random.one_in(2);
  home.position_steps = static_cast<std::int32_t>(random.between(-5'000, 5'000));
  home.most_steps = 30'000;
  config.motors.push_back({.name = fmt::format("p{}", number),
                           .mcu = {config.mcus.size()},
                           .output = {0},
                           .group = {random.below(config.groups.size())},
                           .inputs = bus.serial_pulse.inputs,
                           .home = home});
  config.mcus.push_back({.bus = {config.buses.size()}, .address = {1}, .id = bus.name});
  config.buses.push_back(bus);
}

void add_board(bushd::config::Config& config, bushd::sim::Random& random, std::size_t number) {
  bushd::config::Bus bus{.name = fmt::format("board{}", number),
                         .kind = bushd::config::BusKind::kCommutator,
                         .port = "simulated",
                         .baud = random.pick(kBoardBauds),
                         .start_hz = static_cast<std::uint32_t>(random.between(40, 100)),
                         .answer_ms = 100};
  bus.emergency_stop = stop_mode(random);
  for (std::size_t i = 0; i < kBareBoardMotors; ++i) {
    config.motors.push_back({.name = fmt::format("b{}{}", number, static_cast<char>('a' + i)),
                             .mcu = {config.mcus.size()},
                             .output = {static_cast<std::uint8_t>(i * 3)},
                             .group = {random.below(config.groups.size())}});
  }
  config.mcus.push_back({.bus = {config.buses.size()}, .address = {1}, .id = bus.name});
  config.buses.push_back(bus);
}

}  // namespace

bushd::Result<bushd::config::Config> with_bare(const bushd::config::Config& config,
                                               const BareOptions& options, std::uint64_t seed) {
  bushd::config::Config whole = config;
  bushd::sim::Random random(seed, kBareStream);
  for (std::size_t i = 1; i <= options.serial_pulse; ++i) add_port(whole, random, i);
  for (std::size_t i = 1; i <= options.boards; ++i) add_board(whole, random, i);
  if (config.motors.size() + options.keypads > whole.motors.size()) {
    return bushd::fail(fmt::format(
        "--keypads {}: there are {} motors for them; use more of --serial-pulse or --boards",
        options.keypads, whole.motors.size() - config.motors.size()));
  }
  for (std::size_t i = 0; i < options.keypads; ++i) {
    whole.keypads.push_back(
        {.port = "simulated",
         .motor = {config.motors.size() + i},
         .latched = random.one_in(3),
         .keepalive_ms = static_cast<std::uint32_t>(random.between(150, 1'000))});
  }
  return whole;
}

std::optional<bushd::sim::SwitchOptions> bare_home_switch(const bushd::config::Config& config,
                                                          std::size_t motor, std::uint64_t seed) {
  const auto& home = config.motors[motor].home;
  if (!home) return std::nullopt;
  bushd::sim::Random random(seed, kBareHomeStream + static_cast<std::uint32_t>(motor));
  return bushd::sim::SwitchOptions{
      .at_steps = random.between(200, 2'000) * (home->positive ? 1 : -1),
      .positive_end = home->positive,
      .hysteresis_steps = random.between(0, 20),
      .bounce_ns = random.between(0, 4'000'000),
      .seed = seed + motor,
      .input = std::uint8_t{0}};
}

std::string bare_text(const BareOptions& options) {
  if (!options.any()) return {};
  return fmt::format(
      "--serial-pulse {} --boards {} --keypads {} --controller-faults {} --controller-commands {} ",
      options.serial_pulse, options.boards, options.keypads, options.faults_per_hour,
      options.commands_per_hour);
}

}  // namespace bushfaults
