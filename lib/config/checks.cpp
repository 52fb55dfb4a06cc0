#include "config/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>

#include "bus/bus_budget.h"
#include "config/motor_inputs.h"
#include "engine/emission.h"
#include "engine/run.h"
#include "engine/slots.h"
#include "tables/gentler.h"

namespace bushd::config {
namespace {

constexpr std::array<std::uint32_t, 30> kBaudRates = {
    50,     75,     110,     134,     150,     200,     300,     600,     1200,    1800,
    2400,   4800,   9600,    19200,   38400,   57600,   115200,  230400,  460800,  500000,
    576000, 921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

Result<void> check_populated(const Loading& loading, std::size_t index) {
  const Config& config = loading.config;
  const bool populated =
      std::ranges::any_of(config.mcus, [&](const Mcu& mcu) { return mcu.bus == BusId{index}; });
  if (populated) return {};
  const std::string& name = config.buses[index].name;
  return fail(loading.buses[index].error(
      "name", fmt::format("\"{}\" has no MCU; allowed: buses with at least one. Add a [[mcu]] with "
                          "bus = \"{}\", or remove the bus",
                          name, name)));
}

// T_step of its MCU leaves room for fewer steps than a tick has; slots may take another one away,
// which only the MCU can say.
Result<void> check_step_period(const Loading& loading, std::size_t index) {
  const Config& config = loading.config;
  const Motor& motor = config.motors[index];
  const Mcu& mcu = config.mcu_of(motor);
  const Bus& bus = config.bus_of(motor);
  if (mcu.emission.settings.step_us == 0) return {};
  const std::uint32_t dir_setup_us =
      std::min<std::uint32_t>(mcu.emission.settings.dir_setup_us, bus.tick_us);
  const std::uint32_t room = (bus.tick_us - dir_setup_us) / mcu.emission.settings.step_us;
  const bushd_table& view = config.table_of(motor).view();
  const std::uint32_t steps = bushd_table_max_steps_per_tick(&view, bus.tick_ns());
  if (steps <= room) return {};
  Error error = mcu.emission.step_at;
  error.message = fmt::format(
      "is {}: room for {} steps in the {} us tick of bus \"{}\", but motor \"{}\" makes up to {} "
      "by table \"{}\"; allowed: {} or less. Or use a slower table",
      mcu.emission.settings.step_us, room, bus.tick_us, bus.name, motor.name, steps,
      config.table_of(motor).name(), (bus.tick_us - dir_setup_us) / steps);
  return fail(std::move(error));
}

// A first step that waited for DIR would be followed by the next one too soon.
Result<void> check_dir_setup(const Loading& loading, std::size_t index) {
  const Config& config = loading.config;
  const Motor& motor = config.motors[index];
  const Mcu& mcu = config.mcu_of(motor);
  const bushd_emission& settings = mcu.emission.settings;
  if (settings.mode != BUSHD_EMISSION_EVEN || config.bus_of(mcu).kind != BusKind::kRs485) return {};
  const bushd_table& view = config.table_of(motor).view();
  std::uint32_t longest_us = fieldbus::longest_dir_setup_us(view);
  std::string whose = fmt::format(
      "motor \"{}\" makes the first step of table \"{}\" {:.6g} us after DIR, in a line after half "
      "of "
      "that",
      motor.name, config.table_of(motor).name(), 1e-3 * view.accel.code[0] * view.time_unit_ns);
  if (motor.drive.moved_by_people() && motor.drive.velocity) {
    const std::uint32_t of_loop_us =
        fieldbus::longest_dir_setup_us(motor.drive.velocity->min_steps_per_s * 64);
    if (of_loop_us < longest_us) {
      longest_us = of_loop_us;
      whose = fmt::format("motor \"{}\" turns at {} steps/s by its `velocity`", motor.name,
                          motor.drive.velocity->min_steps_per_s);
    }
  }
  if (settings.dir_setup_us <= longest_us) return {};
  Error error = mcu.emission.dir_setup_at;
  error.message = fmt::format(
      "is {} us, but {}: steps that wait for DIR would come closer together than the table says; "
      "allowed: {} us or less. Or begin more slowly",
      settings.dir_setup_us, whose, longest_us);
  return fail(std::move(error));
}

// What no MCU can do, however many slots it has; what some cannot, they say when they are asked.
Result<void> check_emission(const Loading& loading, std::size_t index) {
  const Mcu& mcu = loading.config.mcus[index];
  const Bus& bus = loading.config.bus_of(mcu);
  if (bus.kind != BusKind::kRs485) return {};
  const bushd_emission& settings = mcu.emission.settings;
  bushd_emission_grid grid;
  const auto fit = [&](std::uint16_t slots) {
    return bushd_emission_fit(&settings, bus.tick_ns(), slots, &grid);
  };
  const bushd_status status = fit(BUSHD_MIN_SLOTS);
  if (status == BUSHD_OK || fit(BUSHD_MAX_SLOTS) == BUSHD_OK) return {};
  // The longest slots, in a tick that is shortened to follow the bus.
  const std::uint32_t tick_us = (bus.tick_ns() - bus.tick_ns() / BUSHD_TICK_SLEW_DIVISOR) / 1000;
  const std::uint32_t half_slot_us = tick_us / (2 * BUSHD_MIN_SLOTS);
  Error error = mcu.emission.step_at;
  std::string fault =
      fmt::format("is {} us; allowed: what the {} us tick of bus \"{}\" holds besides dir_setup_us",
                  settings.step_us, bus.tick_us, bus.name);
  if (status == BUSHD_E_PULSE_WIDTH) {
    error = mcu.emission.pulse_at;
    fault = fmt::format(
        "is {} us; allowed: half a slot of the {} us tick of bus \"{}\", {} us at "
        "most. Use a longer tick_us",
        settings.pulse_us, bus.tick_us, bus.name, half_slot_us);
  } else if (status == BUSHD_E_DIR_SETUP) {
    const bool common = bushd_emission_has_common_dir(settings.mode);
    error = mcu.emission.dir_setup_at;
    fault = fmt::format(
        "is {} us; allowed: less than {} of the {} us tick of bus \"{}\", {} us at "
        "most. Use a longer tick_us",
        settings.dir_setup_us, common ? "half a slot" : "the length", bus.tick_us, bus.name,
        common ? half_slot_us : tick_us);
  }
  error.message = std::move(fault);
  return fail(std::move(error));
}

// Else it would be ready at once after all.
Result<void> check_ready(const Config& config, McuId id) {
  const Mcu& mcu = config.mcus[id.value];
  if (!mcu.ready_after_homing) return {};
  const bool homes = std::ranges::any_of(
      config.motors, [&](const Motor& motor) { return motor.mcu == id && motor.home.has_value(); });
  Error error = mcu.places.at("ready");
  if (homes && mcu.programs_at_power_on) {
    error.message = fmt::format(
        "is \"after-homing\", and programs_at_power_on lets a program of MCU \"{}\" move motors "
        "before they are homed; leave out one of the two",
        mcu.id);
    return fail(std::move(error));
  }
  if (homes) return {};
  error.message = fmt::format(
      "is \"after-homing\", but no motor of MCU \"{}\" has a home; give one home = {{...}}, or "
      "leave `ready` out",
      mcu.id);
  return fail(std::move(error));
}

// Its local inputs move nothing while the drivers are disabled, and cannot enable them.
Result<void> check_idle(const Loading& loading, std::size_t index) {
  const Motor& motor = loading.config.motors[index];
  const Mcu& mcu = loading.config.mcu_of(motor);
  if (!motor.drive.moved_by_people() || !mcu.idle_disable_s) return {};
  return fail(loading.motors[index].error(
      motor.drive.local ? "local" : "keypad",
      fmt::format("is true, but MCU \"{}\" has idle_disable_s: its inputs would not move the "
                  "motor once its drivers are disabled; leave out one of the two",
                  mcu.id)));
}

Result<void> check_speed(const Loading& loading, std::size_t index) {
  const Config& config = loading.config;
  const Motor& motor = config.motors[index];
  const Bus& bus = config.bus_of(motor);
  const tables::Table& table = config.table_of(motor);
  const bushd_table& view = table.view();
  const std::uint32_t steps = bushd_table_max_steps_per_tick(&view, bus.tick_ns());
  if (steps <= BUSHD_MAX_STEPS_PER_TICK) return {};
  const std::uint64_t shortest_ns = std::uint64_t{view.time_unit_ns} * bushd_table_fastest(&view);
  const std::uint64_t longest_tick_us = (shortest_ns * BUSHD_MAX_STEPS_PER_TICK - 1) / 1000;
  const std::string remedy =
      longest_tick_us * 1000 >= BUSHD_MIN_TICK_NS
          ? fmt::format("Use a slower table or tick_us = {} or less", longest_tick_us)
          : std::string("Use a slower table: no tick is short enough for this one");
  return fail(loading.motors[index].error(
      "group",
      fmt::format("the table \"{}\" of group \"{}\" makes up to {} steps in the {} us tick of bus "
                  "\"{}\"; allowed: {}. {}",
                  table.name(), config.group_of(motor).name, steps, bus.tick_us, bus.name,
                  BUSHD_MAX_STEPS_PER_TICK, remedy)));
}

// A board makes no step sooner than after one code, or one period of its converter.
Result<void> check_board_speed(const Loading& loading, std::size_t index) {
  const Config& config = loading.config;
  const Motor& motor = config.motors[index];
  const Bus& bus = config.bus_of(motor);
  if (bus.kind != BusKind::kCommutator) return {};
  const bushd_table& view = config.table_of(motor).view();
  const std::uint64_t fastest_ns = std::uint64_t{view.time_unit_ns} * bushd_table_fastest(&view);
  if (bus.converter) {
    const Converter& converter = *bus.converter;
    if (converter_period_ns(converter, converter.max_code) <= fastest_ns) return {};
    return fail(loading.motors[index].error(
        "group", fmt::format("the table \"{}\" has steps {} ns apart; allowed: {} ns and more, one "
                             "period at max_hz = {} of the converter of board \"{}\". Use a slower "
                             "table, or a converter with a higher max_hz",
                             config.table_of(motor).name(), fastest_ns,
                             converter_period_ns(converter, converter.max_code), converter.max_hz,
                             bus.name)));
  }
  const std::uint64_t code_ns = 1'000'000'000 / (250 * std::uint64_t{bus.start_hz});
  if (fastest_ns >= code_ns) return {};
  return fail(loading.motors[index].error(
      "group",
      fmt::format("the table \"{}\" has steps {} ns apart; allowed: {} ns and more, one "
                  "delay code of board \"{}\" with start_hz = {}. Use a slower table, or "
                  "a board with a higher F_start",
                  config.table_of(motor).name(), fastest_ns, code_ns, bus.name, bus.start_hz)));
}

Result<void> check_table_banks(const Loading& loading) {
  const Config& config = loading.config;
  tables::Gentler gentler;
  std::vector<std::set<const tables::Table*>> used(config.mcus.size());
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    const Motor& motor = config.motors[i];
    std::set<const tables::Table*>& of_mcu = used[motor.mcu.value];
    const auto table = gentler.of(config.group_of(motor).table, motor.drive.acceleration);
    if (!table) return fail(loading.motors[i].error("acceleration", table.error().message));
    of_mcu.insert(table->get());
    if (of_mcu.size() <= BUSHD_TABLE_BANKS) continue;
    return fail(loading.motors[i].error(
        "group",
        fmt::format("is one table too many for MCU \"{}\"; allowed: {} different tables among its "
                    "motors. Let groups share a table (and `acceleration`) or move the motor to "
                    "another MCU",
                    config.mcu_of(motor).id, BUSHD_TABLE_BANKS)));
  }
  return {};
}

// What the line has to carry whatever happens.
double load_of(const Bus& bus, std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
               std::span<const std::uint8_t> motors) {
  return bus.streams == Streams::kFit ? fieldbus::bus_load(baud, tick_ns, format, motors)
                                      : fieldbus::poll_load(baud, motors);
}

// What would help, by itself: the lowest faster rate, the shortest longer tick.
std::string line_remedy(const Bus& bus, std::span<const std::uint8_t> motors) {
  const auto fits = [&](std::uint32_t baud, std::uint32_t tick_us) {
    return load_of(bus, baud, tick_us * 1000u, bus.format, motors) <= fieldbus::kMaxBusLoad;
  };
  std::string remedy;
  for (const std::uint32_t baud : kBaudRates) {
    if (!fits(baud, bus.tick_us)) continue;
    remedy = fmt::format("baud = {} or more", baud);
    break;
  }
  std::uint32_t low = bus.tick_us;
  std::uint32_t high = BUSHD_MAX_TICK_NS / 1000;
  if (fits(bus.baud, high)) {
    while (high - low > 1) {
      const std::uint32_t middle = low + (high - low) / 2;
      (fits(bus.baud, middle) ? high : low) = middle;
    }
    remedy += fmt::format("{}tick_us = {} or more", remedy.empty() ? "" : ", or ", high);
  }
  if (bus.format == BUSHD_FORMAT_FINE &&
      load_of(bus, bus.baud, bus.tick_ns(), BUSHD_FORMAT_COARSE, motors) <= fieldbus::kMaxBusLoad) {
    remedy += fmt::format("{}format = \"coarse\"", remedy.empty() ? "" : ", or ");
  }
  if (bus.streams == Streams::kFit &&
      fieldbus::poll_load(bus.baud, motors) <= fieldbus::kMaxBusLoad) {
    remedy += fmt::format("{}streams = \"refuse\" or \"queue\"", remedy.empty() ? "" : ", or ");
  }
  return remedy.empty() ? "Spread the MCUs over more buses" : "Use " + remedy;
}

Result<void> check_line(const Loading& loading, std::size_t index) {
  const Config& config = loading.config;
  const Bus& bus = config.buses[index];
  if (bus.kind != BusKind::kRs485) return {};
  std::vector<std::uint8_t> motors;
  for (std::size_t i = 0; i < config.mcus.size(); ++i) {
    if (config.mcus[i].bus != BusId{index}) continue;
    motors.push_back(static_cast<std::uint8_t>(
        std::count_if(config.motors.begin(), config.motors.end(),
                      [&](const Motor& motor) { return motor.mcu == McuId{i}; })));
  }
  const double load = load_of(bus, bus.baud, bus.tick_ns(), bus.format, motors);
  if (load <= fieldbus::kMaxBusLoad) return {};
  const bool of_ticks = bus.streams == Streams::kFit;
  return fail(loading.buses[index].error(
      of_ticks ? "tick_us" : "baud",
      fmt::format("is {}: {} would take {:.1f} % of the bus at {} baud; allowed: {:.0f} %. {}",
                  of_ticks ? bus.tick_us : bus.baud,
                  of_ticks ? "ticks, polls and sync" : "polls and sync", load * 100, bus.baud,
                  fieldbus::kMaxBusLoad * 100, line_remedy(bus, motors))));
}

}  // namespace

std::span<const std::uint32_t> baud_rates() {
  return kBaudRates;
}

Result<void> check_together(const Loading& loading) {
  for (std::size_t i = 0; i < loading.config.buses.size(); ++i) {
    if (auto checked = check_populated(loading, i); !checked) return checked;
  }
  for (std::size_t i = 0; i < loading.config.mcus.size(); ++i) {
    if (auto checked = check_emission(loading, i); !checked) return checked;
    if (auto checked = check_ready(loading.config, {i}); !checked) return checked;
  }
  for (std::size_t i = 0; i < loading.config.motors.size(); ++i) {
    if (auto checked = check_speed(loading, i); !checked) return checked;
    if (auto checked = check_step_period(loading, i); !checked) return checked;
    if (auto checked = check_dir_setup(loading, i); !checked) return checked;
    if (auto checked = check_board_speed(loading, i); !checked) return checked;
    if (auto checked = check_idle(loading, i); !checked) return checked;
  }
  if (auto checked = check_motor_inputs(loading); !checked) return checked;
  if (auto checked = check_table_banks(loading); !checked) return checked;
  for (std::size_t i = 0; i < loading.config.buses.size(); ++i) {
    if (auto checked = check_line(loading, i); !checked) return checked;
  }
  return {};
}

}  // namespace bushd::config
