#include "config/crates.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::int64_t kLastCrate = 62;  // of a serial highway
constexpr std::int64_t kLastStation = 23;
constexpr std::int64_t kLeastStartHz = 1;
constexpr std::int64_t kMostStartHz = 100;
constexpr std::size_t kMostOfModule = 32;
constexpr std::size_t kMotorsPerPage = 8;

// Where each motor has its place, for what follows.
struct Place {
  std::string module;  // "station 5 of crate 1"
  std::size_t page;    // which of the module's programs moves it: kBushd2 has four
};
using Places = std::map<std::size_t, Place>;  // by MotorId

// Which motor has this name, for a key or an element of it.
Result<MotorId> find_motor(const TomlReader& reader, std::string_view key,
                           std::optional<std::size_t> index, const std::string& name,
                           const Config& config) {
  const auto found = std::ranges::find(config.motors, name, &Motor::name);
  if (found != config.motors.end()) {
    return MotorId{static_cast<std::size_t>(found - config.motors.begin())};
  }
  return fail(
      reader.error(key, index, fmt::format("is \"{}\"; allowed: names of [[motor]]", name)));
}

// A motor obeys one module.
Result<void> take(const TomlReader& reader, std::string_view key, std::optional<std::size_t> index,
                  MotorId motor, Place place, const Config& config, Places* places) {
  const auto [first, is_new] = places->emplace(motor.value, std::move(place));
  if (is_new) return {};
  return fail(reader.error(key, index,
                           fmt::format("motor \"{}\" is already one of {}; allowed: each once",
                                       config[motor].name, first->second.module)));
}

Result<void> read_motors(const TomlReader& reader, const std::string& where, const Config& config,
                         CamacModule* module, Places* places) {
  constexpr std::string_view kRule = "1..32 names of motors";
  const auto names = reader.array("motors", kRule);
  if (!names) return fail(names.error());
  if ((*names)->empty() || (*names)->size() > kMostOfModule) {
    return fail(
        reader.error("motors", fmt::format("has {}; allowed: {}", (*names)->size(), kRule)));
  }
  for (std::size_t i = 0; i < (*names)->size(); ++i) {
    const toml::node& node = *(*names)->get(i);
    if (!node.is_string()) {
      return fail(reader.error(
          "motors", i, fmt::format("is {}; allowed: the name of a motor", tables::describe(node))));
    }
    const auto motor = find_motor(reader, "motors", i, node.as_string()->get(), config);
    if (!motor) return fail(motor.error());
    const Place place{.module = where, .page = i / kMotorsPerPage};
    if (auto taken = take(reader, "motors", i, *motor, place, config, places); !taken) return taken;
    module->motors.push_back(*motor);
  }
  return {};
}

Result<void> read_bushd2(const TomlReader& reader, const std::string& where, const Config& config,
                         CamacModule* module, Places* places) {
  const Keys keys =
      Keys(reader)
          .only({"station", "type", "without_computer", "f_start_hz", "motors"})
          .whole("f_start_hz", &module->f_start_hz, kLeastStartHz, kMostStartHz, "Hz");
  if (!keys.result()) return keys.result();
  return read_motors(reader, where, config, module, places);
}

Result<void> read_bushd1(const TomlReader& reader, const std::string& where, const Config& config,
                         CamacModule* module, Places* places) {
  static_assert(static_cast<int>(CamacModule::AdjustableDelay::kOpening) == 1);
  const Keys keys = Keys(reader)
                        .only({"station", "type", "without_computer", "adjustable_delay", "motor"})
                        .word("adjustable_delay", &module->adjustable_delay, {"return", "opening"});
  if (!keys.result()) return keys.result();
  const auto name = reader.string("motor", "the name of a motor");
  if (!name) return fail(name.error());
  const auto motor = find_motor(reader, "motor", std::nullopt, *name, config);
  if (!motor) return fail(motor.error());
  module->motors.push_back(*motor);
  const Place place{.module = where, .page = 0};
  return take(reader, "motor", std::nullopt, *motor, place, config, places);
}

// That motion goes on when nobody can stop it takes two consents.
Result<void> check_consent(const TomlReader& reader, const Config& config,
                           const CamacModule& module) {
  if (!module.without_computer) return {};
  for (const MotorId motor : module.motors) {
    const Mcu& mcu = config.mcu_of(config[motor]);
    if (mcu.programs_without_host) continue;
    return fail(reader.error(
        "without_computer",
        fmt::format("is true, and MCU {} of motor \"{}\" may not go on without a host; set "
                    "programs_without_host = true in its [[mcu]], or leave without_computer out",
                    mcu.id, config[motor].name)));
  }
  return {};
}

Result<void> read_module(const TomlReader& reader, const Config& config, Crate* crate,
                         Places* places) {
  const auto station = reader.integer("station", 1, kLastStation);
  if (!station) return fail(station.error());
  const int number = static_cast<int>(*station);
  if (std::ranges::find(crate->modules, number, &CamacModule::station) != crate->modules.end()) {
    return fail(reader.error("station", fmt::format("station {} of crate {} is already taken; "
                                                    "allowed: each once",
                                                    number, crate->number)));
  }
  static_assert(static_cast<int>(CamacModule::Type::kBushd2) == 1);
  CamacModule module{.station = number};
  const Keys keys = Keys(reader)
                        .needed_word("type", &module.type, {"bushd-1", "bushd-2"})
                        .flag("without_computer", &module.without_computer);
  if (!keys.result()) return keys.result();
  const std::string where = fmt::format("station {} of crate {}", number, crate->number);
  const auto read = module.type == CamacModule::Type::kBushd1 ? read_bushd1 : read_bushd2;
  if (auto good = read(reader, where, config, &module, places); !good) return good;
  if (auto good = check_consent(reader, config, module); !good) return good;
  crate->modules.push_back(std::move(module));
  return {};
}

// The codes of a program become the table of the motor's group: nobody else may be in it.
Result<void> check_groups(const TomlReader& root, const Config& config, const Places& places) {
  for (const auto& [number, place] : places) {
    const Motor& motor = config.motors[number];
    for (std::size_t i = 0; i < config.motors.size(); ++i) {
      const Motor& other = config.motors[i];
      if (other.group != motor.group) continue;
      const auto at = places.find(i);
      if (at != places.end() && at->second.module == place.module &&
          at->second.page == place.page) {
        continue;
      }
      return fail(root.error(
          "crate",
          fmt::format("motor \"{}\" of {} moves by programs, which become the table of group "
                      "\"{}\", and motor \"{}\" has the same group but not program {} of that "
                      "module; allowed: groups whose motors all have one program. Give them "
                      "groups of their own",
                      motor.name, place.module, config.group_of(motor).name, other.name,
                      place.page)));
    }
  }
  return {};
}

}  // namespace

Result<void> read_crates(const TomlReader& root, Config* config) {
  if (!root.has("crate")) return {};
  const auto crates = read_elements(root, config->path, "crate", "crate");
  if (!crates) return fail(crates.error());
  Places places;
  for (std::size_t i = 0; i < crates->size(); ++i) {
    const TomlReader& reader = (*crates)[i];
    if (auto known = reader.only({"number", "module"}); !known) return known;
    const auto number = reader.integer("number", 1, kLastCrate);
    if (!number) return fail(number.error());
    Crate crate{.number = static_cast<int>(*number)};
    if (std::ranges::find(config->crates, crate.number, &Crate::number) != config->crates.end()) {
      return fail(reader.error(
          "number", fmt::format("crate {} is already there; allowed: each once", crate.number)));
    }
    const auto modules =
        read_elements(reader, config->path, "module", fmt::format("crate[{}].module", i));
    if (!modules) return fail(modules.error());
    for (const TomlReader& module : *modules) {
      if (auto read = read_module(module, *config, &crate, &places); !read) return read;
    }
    config->crates.push_back(std::move(crate));
  }
  return check_groups(root, *config, places);
}

}  // namespace bushd::config
