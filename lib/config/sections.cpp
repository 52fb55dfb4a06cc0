#include "config/sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string_view>
#include <utility>

#include "config/board_section.h"
#include "config/bus_section.h"
#include "config/checks.h"
#include "config/coordinates.h"
#include "config/crates.h"
#include "config/currents.h"
#include "config/emission_section.h"
#include "config/home.h"
#include "config/idle_section.h"
#include "config/inputs.h"
#include "config/keypad_section.h"
#include "config/output_levels.h"
#include "config/port_check.h"
#include "config/programs_section.h"
#include "config/pseudo_section.h"
#include "config/serial_pulse_section.h"
#include "config/state_section.h"
#include "config/table_shelf.h"
#include "config/velocity.h"
#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

// A prefix becomes the beginning of LCM channel names, which have 63 characters at most.
constexpr std::size_t kMaxPrefix = 48;
constexpr std::string_view kPrefixRule =
    "1..48 characters of A-Z a-z 0-9 _ . -, the first one no -";

Result<std::string> read_name(const TomlReader& reader) {
  auto name = reader.string("name", kNameRule);
  if (!name || is_name(*name, kLongestName)) return name;
  return refuse(reader, "name", *name, kNameRule);
}

// The elements of `[[key]]`; a section that may be left out and is yields none.
Result<std::vector<TomlReader>> read_array(const TomlReader& root, const std::string& file,
                                           const std::string& key, bool needed) {
  if (!needed && !root.has(key)) return std::vector<TomlReader>();
  auto elements = read_elements(root, file, key, key);
  if (elements && needed && elements->empty()) {
    return fail(root.error(key, fmt::format("is empty; allowed: sections [[{}]]", key)));
  }
  return elements;
}

// Names already taken and the line that took them.
class Taken {
 public:
  // Takes `value`, or says where it was taken.
  Result<void> take(const TomlReader& reader, std::string_view key, const std::string& value,
                    std::string_view what) {
    const int line = reader.error(key, "").line;
    const auto [first, is_new] = lines_.emplace(value, line);
    if (is_new) return {};
    return fail(reader.error(key, fmt::format("{} is already taken in line {}; allowed: each once",
                                              what, first->second)));
  }

 private:
  std::map<std::string, int> lines_;
};

template <class T, class Key>
std::string known(const std::vector<T>& elements, Key key) {
  std::string list;
  for (const T& element : elements) {
    list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", element.*key);
  }
  return list.empty() ? "nothing, as none is defined" : list;
}

template <class Index, class T, class Key>
Result<Index> resolve(const TomlReader& reader, std::string_view key,
                      const std::vector<T>& elements, Key name) {
  const auto wanted = reader.string(key, known(elements, name));
  if (!wanted) return fail(wanted.error());
  const auto found = std::find_if(elements.begin(), elements.end(),
                                  [&](const T& element) { return element.*name == *wanted; });
  if (found == elements.end()) return refuse(reader, key, *wanted, known(elements, name));
  return Index{static_cast<std::size_t>(found - elements.begin())};
}

Result<void> read_lcm(const TomlReader& reader, Config* config) {
  const auto is_url = [](const std::string& url) {
    constexpr std::array<std::string_view, 3> kProviders = {"udpm://", "tcpq://", "memq://"};
    return std::ranges::any_of(kProviders,
                               [&](std::string_view start) { return url.starts_with(start); });
  };
  return Keys(reader)
      .only({"url", "prefix", "commands"})
      .text("url", &config->lcm.url, "a URL beginning with udpm://, tcpq:// or memq://", is_url)
      .text("prefix", &config->lcm.prefix, kPrefixRule,
            [](const std::string& prefix) { return is_name(prefix, kMaxPrefix); })
      .flag("commands", &config->lcm.commands)
      .result();
}

Result<void> read_control(const TomlReader& reader, Config* config) {
  const auto is_path = [](const std::string& path) {
    constexpr std::size_t kMaxPath = 107;  // as long as the kernel takes
    return path.empty() || (path.starts_with('/') && path.size() <= kMaxPath);
  };
  if (reader.has("group")) config->control.group_at = reader.error("group", "");
  return Keys(reader)
      .only({"path", "group"})
      .text("path", &config->control.path,
            "an absolute path of up to 107 characters, or \"\" for no socket", is_path)
      .text("group", &config->control.group, "the name of a group of users")
      .result();
}

// A section that there is once, or not at all.
Result<void> read_section(const TomlReader& root, std::string_view key, Config* config,
                          Result<void> (*read)(const TomlReader&, Config*)) {
  if (!root.has(key)) return {};
  const toml::table* section = root.table(key);
  if (section == nullptr) {
    return fail(root.error(key, fmt::format("is not a section; allowed: one [{}]", key)));
  }
  return read(TomlReader(*section, config->path, std::string(key)), config);
}

Result<void> read_buses(Loading* loading) {
  Taken names;
  for (const TomlReader& reader : loading->buses) {
    Bus bus;
    if (auto read = read_bus_kind(reader, &bus); !read) return read;
    auto name = read_name(reader);
    if (!name) return fail(name.error());
    bus.name = std::move(*name);
    if (auto taken = names.take(reader, "name", bus.name, bus.name); !taken) return taken;
    constexpr std::string_view kPortRule =
        "the path of a serial port, such as \"/dev/ttyUSB0\" or \"/dev/ttyUSB*\"";
    auto port = reader.string("port", kPortRule);
    if (!port) return fail(port.error());
    if (port->empty() || port->find('\0') != std::string::npos) {
      return refuse(reader, "port", "", kPortRule);
    }
    bus.port = std::move(*port);
    if (auto once = check_bus_port(reader, bus.port, loading->config.buses); !once) return once;
    bus.places = KeyPlaces(reader, {"port", "format", "tick_us", "emergency_stop"});
    if (auto read = read_manners(reader, &bus); !read) return read;
    loading->config.buses.push_back(std::move(bus));
  }
  return {};
}

constexpr std::int64_t kMostKeypadMs = 10'000;  // some 50000 of the shortest ticks

Result<void> read_mcus(const std::vector<TomlReader>& readers, Config* config) {
  Taken ids;
  for (const TomlReader& reader : readers) {
    if (auto old = refuse_emission_key(reader); !old) return old;
    if (auto known = reader.only({"bus",
                                  "address",
                                  "steps",
                                  "direction",
                                  "step_us",
                                  "settle_us",
                                  "dir_setup_us",
                                  "pulse_us",
                                  "phase_sequence",
                                  "hold_current",
                                  "emergency_input",
                                  "emergency_active",
                                  "debounce_ticks",
                                  "overcurrent",
                                  "enable_after_reset",
                                  "ready",
                                  "idle_disable_s",
                                  "enable_settle_ms",
                                  "keypad_ms",
                                  "programs_without_host",
                                  "programs_at_power_on",
                                  "enable_active",
                                  "step_active",
                                  "direction_active"});
        !known) {
      return known;
    }
    const auto bus = resolve<BusId>(reader, "bus", config->buses, &Bus::name);
    if (!bus) return fail(bus.error());
    if (config->buses[bus->value].kind == BusKind::kCommutator) {
      const std::string& name = config->buses[bus->value].name;
      return fail(reader.error(
          "bus", fmt::format("\"{0}\" is a commutator board, which has no MCUs; allowed: buses of "
                             "kind \"rs485\". Remove this section; its motors have mcu = \"{0}\"",
                             name)));
    }
    const auto address = reader.integer("address", 1, 255);
    if (!address) return fail(address.error());
    Mcu mcu{.bus = *bus,
            .address = {static_cast<std::uint8_t>(*address)},
            .id = fmt::format("{}:{}", config->buses[bus->value].name, *address)};
    mcu.places = KeyPlaces(reader, {"address", "ready", "emergency_input"});
    auto emission = read_emission(reader);
    if (!emission) return fail(emission.error());
    mcu.emission = std::move(*emission);
    mcu.has_phase_sequence = reader.has("phase_sequence");
    if (auto read = read_output_levels(reader, &mcu); !read) return read;
    const std::string what =
        fmt::format("address {} of bus \"{}\"", *address, config->buses[bus->value].name);
    if (auto taken = ids.take(reader, "address", mcu.id, what); !taken) return taken;
    if (auto read = read_inputs(reader, &mcu); !read) return read;
    if (auto read = read_idle(reader, &mcu); !read) return read;
    const Keys keypad = Keys(reader).whole("keypad_ms", &mcu.keypad_ms, 0, kMostKeypadMs, "ms");
    if (!keypad.result()) return keypad.result();
    if (auto read = read_programs(reader, &mcu); !read) return read;
    config->mcus.push_back(std::move(mcu));
  }
  return {};
}

// A bus that needs no [[mcu]] stands in for its one.
Result<void> add_stand_ins(const std::vector<TomlReader>& readers, Config* config) {
  for (std::size_t i = 0; i < config->mcus.size(); ++i) {
    const Bus& bus = config->bus_of(config->mcus[i]);
    if (bus.kind != BusKind::kSerialPulse) continue;
    return fail(readers[i].error(
        "bus", fmt::format("is \"{}\", a serial port with one motor, which has no MCU; remove this "
                           "section, and give the motor mcu = \"{}\"",
                           bus.name, bus.name)));
  }
  for (std::size_t i = 0; i < config->buses.size(); ++i) {
    if (config->buses[i].kind == BusKind::kRs485) continue;
    config->mcus.push_back(
        {.bus = {i}, .address = {1}, .id = config->buses[i].name, .stand_in = true});
  }
  return {};
}

Result<void> read_groups(Loading* loading) {
  Taken names;
  TableShelf shelf(loading->config.path);
  for (const TomlReader& reader : loading->groups) {
    if (auto known = reader.only({"name", "table"}); !known) return known;
    auto name = read_name(reader);
    if (!name) return fail(name.error());
    if (auto taken = names.take(reader, "name", *name, *name); !taken) return taken;
    auto table_name = reader.string("table", "the name of a table");
    if (!table_name) return fail(table_name.error());
    auto table = shelf.get(reader, *name, *table_name);
    if (!table) return fail(table.error());
    loading->config.groups.push_back({.name = std::move(*name),
                                      .table_name = std::move(*table_name),
                                      .table = std::move(*table)});
  }
  return {};
}

// Four outputs of the MCU are one motor.
Result<void> check_phase_output(const TomlReader& reader, const Mcu& mcu, std::int64_t output) {
  constexpr std::int64_t kLast = BUSHD_MOTORS_PER_MCU / BUSHD_PHASE_OUTPUTS - 1;
  if (mcu.emission.settings.mode != BUSHD_EMISSION_PHASES || output <= kLast) return {};
  return fail(reader.error(
      "output", fmt::format("is {}; allowed: 0..{} on MCU \"{}\", where phases take {} outputs a "
                            "motor",
                            output, kLast, mcu.id, BUSHD_PHASE_OUTPUTS)));
}

// What it does at its MCU.
Result<void> read_motion_of_its_own(const TomlReader& reader, Motor* motor) {
  if (reader.has("home")) {
    const auto home = read_home(reader);
    if (!home) return fail(home.error());
    motor->home = *home;
  }
  return Keys(reader)
      .flag("never_disable", &motor->never_disable)
      .flag("local", &motor->drive.local)
      .flag("keypad", &motor->drive.keypad)
      .result();
}

bool another_names_its_input(const Config& config, const Motor& motor) {
  return std::ranges::any_of(config.motors, [&motor](const Motor& other) {
    if (&other == &motor || other.mcu != motor.mcu) return false;
    const MotorInputs& its = other.inputs;
    return std::ranges::any_of(std::array{its.positive, its.negative, its.home, its.step},
                               [&motor](const std::optional<Input>& input) {
                                 return input && input->number == motor.inputs.own->number;
                               });
  });
}

Result<void> read_motors(Loading* loading) {
  Config& config = loading->config;
  Taken names;
  Taken spoken_names;
  Taken outputs;
  for (const TomlReader& reader : loading->motors) {
    if (auto known = reader.only({"name",         "mcu",
                                  "output",       "group",
                                  "limit",        "limit_action",
                                  "input_active", "home",
                                  "inputs",       "local",
                                  "restored",     "description",
                                  "unit",         "steps_per_unit",
                                  "direction",    "offset",
                                  "precision",    "soft_limits",
                                  "max_speed",    "never_disable",
                                  "backlash",     "backlash_speed",
                                  "settle_ms",    "currents",
                                  "velocity",     "keypad",
                                  "step_active",  "direction_active",
                                  "acceleration"});
        !known) {
      return known;
    }
    auto name = read_name(reader);
    if (!name) return fail(name.error());
    if (auto taken = names.take(reader, "name", *name, *name); !taken) return taken;
    if (auto taken = spoken_names.take(reader, "name", lower_case(*name),
                                       *name + ", but for upper and lower case,");
        !taken) {
      return taken;
    }
    const auto mcu = resolve<McuId>(reader, "mcu", config.mcus, &Mcu::id);
    if (!mcu) return fail(mcu.error());
    const Bus& bus = config.bus_of(config.mcus[mcu->value]);
    const bool one_motor = bus.kind == BusKind::kSerialPulse;
    const auto output =
        one_motor ? Result<std::int64_t>(0) : reader.integer("output", 0, BUSHD_MOTORS_PER_MCU - 1);
    if (!output) return fail(output.error());
    if (bus.kind == BusKind::kCommutator) {
      if (auto good = check_board_motor(reader, bus.name, *output); !good) return good;
    }
    if (auto room = check_phase_output(reader, config.mcus[mcu->value], *output); !room)
      return room;
    const std::string& id = config.mcus[mcu->value].id;
    const std::string what = one_motor ? fmt::format("the one motor of bus \"{}\"", id)
                                       : fmt::format("output {} of MCU \"{}\"", *output, id);
    if (auto taken = outputs.take(reader, one_motor ? "mcu" : "output", what, what); !taken) {
      return taken;
    }
    const auto group = resolve<GroupId>(reader, "group", config.groups, &Group::name);
    if (!group) return fail(group.error());
    Motor motor{.name = std::move(*name),
                .mcu = *mcu,
                .output = {static_cast<std::uint8_t>(*output)},
                .group = *group};
    motor.places =
        KeyPlaces(reader, {"output", "group", "inputs", "currents", "velocity", "keypad"});
    if (auto read = read_output_levels(reader, motor.output, &config.mcus[mcu->value]); !read) {
      return read;
    }
    if (auto read = read_motion_of_its_own(reader, &motor); !read) return read;
    const bool has_limits = bus.kind == BusKind::kCommutator;
    if (auto read = one_motor ? take_serial_pulse(reader, bus, &motor)
                              : read_inputs(reader, has_limits, &motor);
        !read) {
      return read;
    }
    if (auto read = read_restored(reader, &motor); !read) return read;
    auto currents = read_currents(reader, config.mcus[mcu->value]);
    if (!currents) return fail(currents.error());
    motor.drive.currents = *currents;
    auto velocity = read_velocity(reader, motor);
    if (!velocity) return fail(velocity.error());
    motor.drive.velocity = *velocity;
    if (auto read = read_coordinates(reader, &motor); !read) return read;
    if (auto checked = check_home_in_units(reader, motor); !checked) return checked;
    const bool has_mcu = !config.mcus[mcu->value].stand_in;
    motor.has_one_input = has_mcu && motor.inputs.own && !reader.has("inputs");
    motor.drive.input_open = motor.has_one_input && motor.inputs.own->active_open;
    motor.drive.phase_sequence = config.mcus[mcu->value].emission.settings.sequence;
    for (std::size_t i = 0; i < kSettingKeys.size(); ++i) {
      motor.written[i] = reader.has(name_of(kSettingKeys[i]));
    }
    motor.written[static_cast<std::size_t>(SettingKey::kPhaseSequence)] =
        config.mcus[mcu->value].has_phase_sequence;
    config.motors.push_back(std::move(motor));
  }
  for (Motor& motor : config.motors) {
    motor.has_one_input = motor.has_one_input && !another_names_its_input(config, motor);
  }
  return {};
}

Result<void> read_pseudos(const std::vector<TomlReader>& readers, Loading* loading) {
  Taken names;  // beside those of motors, for they are told apart by nothing else
  Config& config = loading->config;
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    const std::string& name = config.motors[i].name;
    if (auto taken = names.take(loading->motors[i], "name", lower_case(name), name); !taken) {
      return taken;
    }
  }
  for (const TomlReader& reader : readers) {
    auto pseudo = read_pseudo(reader, config);
    if (!pseudo) return fail(pseudo.error());
    for (const PseudoAxis& axis : pseudo->axes) {
      if (auto taken = names.take(reader, "name", lower_case(axis.name), axis.name); !taken) {
        return taken;
      }
    }
    config.pseudos.push_back(std::move(*pseudo));
  }
  return {};
}

}  // namespace

Result<void> read_sections(const TomlReader& root, Loading* loading) {
  const std::string& file = loading->config.path;
  if (auto known = root.only(
          {"lcm", "control", "state", "bus", "mcu", "group", "motor", "pseudo", "crate", "keypad"});
      !known) {
    return known;
  }
  Config* const config = &loading->config;
  if (auto read = read_section(root, "lcm", config, read_lcm); !read) return read;
  if (auto read = read_section(root, "control", config, read_control); !read) return read;
  if (auto read = read_section(root, "state", config, read_state); !read) return read;
  auto buses = read_array(root, file, "bus", true);
  if (!buses) return fail(buses.error());
  loading->buses = std::move(*buses);
  const auto mcus = read_array(root, file, "mcu", false);
  if (!mcus) return fail(mcus.error());
  auto groups = read_array(root, file, "group", false);
  if (!groups) return fail(groups.error());
  loading->groups = std::move(*groups);
  auto motors = read_array(root, file, "motor", true);
  if (!motors) return fail(motors.error());
  loading->motors = std::move(*motors);
  if (auto read = read_buses(loading); !read) return read;
  if (auto read = read_mcus(*mcus, &loading->config); !read) return read;
  if (auto added = add_stand_ins(*mcus, &loading->config); !added) return added;
  if (auto read = read_groups(loading); !read) return read;
  const auto pseudos = read_array(root, file, "pseudo", false);
  if (!pseudos) return fail(pseudos.error());
  if (auto read = read_motors(loading); !read) return read;
  if (auto read = read_pseudos(*pseudos, loading); !read) return read;
  const auto keypads = read_array(root, file, "keypad", false);
  if (!keypads) return fail(keypads.error());
  for (const TomlReader& reader : *keypads) {
    auto keypad = read_keypad(reader, loading->config);
    if (!keypad) return fail(keypad.error());
    loading->config.keypads.push_back(std::move(*keypad));
  }
  return read_crates(root, &loading->config);
}

}  // namespace bushd::config
