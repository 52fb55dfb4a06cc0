// One row for each key that can be changed in operation: its texts, its check, its help.
#include "config/setting.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "base/parse_number.h"
#include "config/config.h"
#include "engine/velocity.h"

namespace bushd::config {
namespace {

constexpr std::string_view kNone = "none";

// What an inline table of these keys has, in order.
constexpr std::array<std::string_view, 3> kVelocityNames = {"min_steps_per_s", "max_steps_per_s",
                                                            "steps_per_s2"};
constexpr std::array<std::string_view, 4> kCurrentsNames = {"ramp_ma", "cruise_ma", "hold_ma",
                                                            "decay"};

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

std::optional<double> number_of(std::string_view text) {
  return parse_number<double>(trimmed(text));
}

tl::unexpected<Error> refuse(SettingKey key, std::string_view text, std::string_view why = {});

Result<Settings> with_scale(Settings settings, SettingKey key, std::string_view text,
                            units::Scale scale) {
  auto coordinates = units::Coordinates::make(std::move(scale));
  if (!coordinates) return refuse(key, text, coordinates.error().message);
  settings.coordinates = std::move(*coordinates);
  return settings;
}

Result<Settings> with_offset(Settings settings, std::string_view text) {
  const auto offset = number_of(text);
  if (!offset) return refuse(SettingKey::kOffset, text);
  units::Scale scale = settings.coordinates.scale();
  scale.offset = *offset;
  return with_scale(std::move(settings), SettingKey::kOffset, text, std::move(scale));
}

Result<Settings> with_direction(Settings settings, std::string_view text) {
  const std::string_view word = trimmed(text);
  if (word != "positive" && word != "negative") return refuse(SettingKey::kDirection, text);
  units::Scale scale = settings.coordinates.scale();
  scale.negative = word == "negative";
  return with_scale(std::move(settings), SettingKey::kDirection, text, std::move(scale));
}

std::optional<units::SoftLimits> limits_of(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('[') && text.ends_with(']') && text.size() > 1) {
    text = text.substr(1, text.size() - 2);
  }
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  const auto low = number_of(text.substr(0, comma));
  const auto high = number_of(text.substr(comma + 1));
  if (!low || !high) return std::nullopt;
  return units::SoftLimits{*low, *high};
}

Result<Settings> with_soft_limits(Settings settings, std::string_view text) {
  if (trimmed(text) == kNone) {
    settings.soft_limits.reset();
    return settings;
  }
  const auto limits = limits_of(text);
  if (!limits) return refuse(SettingKey::kSoftLimits, text);
  if (const auto good = check_soft_limits(settings.coordinates, *limits); !good) {
    return fail(std::string(name_of(SettingKey::kSoftLimits)) + ": " + good.error().message);
  }
  settings.soft_limits = limits;
  return settings;
}

// The values of `names` in "{ name = value, ... }", or without names in their order; empty where
// there is none. Nothing if it is neither.
std::optional<std::vector<std::string_view>> values_of(std::string_view text,
                                                       std::span<const std::string_view> names) {
  text = trimmed(text);
  if (text.starts_with('{') && text.ends_with('}') && text.size() > 1) {
    text = text.substr(1, text.size() - 2);
  }
  std::vector<std::string_view> values(names.size());
  for (std::size_t i = 0; !text.empty(); ++i) {
    if (i == names.size()) return std::nullopt;
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view item = text.substr(0, comma);
    const bool ends = comma == text.size();
    text.remove_prefix(ends ? comma : comma + 1);
    if (!ends && trimmed(text).empty()) return std::nullopt;
    const std::size_t equals = item.find('=');
    const bool named = equals != std::string_view::npos;
    const auto name = named ? std::ranges::find(names, trimmed(item.substr(0, equals)))
                            : names.begin() + static_cast<std::ptrdiff_t>(i);
    if (name == names.end()) return std::nullopt;
    std::string_view& value = values[static_cast<std::size_t>(name - names.begin())];
    if (!value.empty()) return std::nullopt;
    value = trimmed(named ? item.substr(equals + 1) : item);
    if (value.empty()) return std::nullopt;
  }
  return values;
}

std::optional<std::int32_t> whole_number_of(std::string_view text, std::int64_t lowest,
                                            std::int64_t highest) {
  const auto value = parse_number<std::int32_t>(text);
  return value && *value >= lowest && *value <= highest ? value : std::nullopt;
}

Result<Settings> with_velocity(Settings settings, std::string_view text) {
  settings.drive.velocity.reset();
  if (trimmed(text) == kNone) return settings;
  const auto values = values_of(text, kVelocityNames);
  if (!values) return refuse(SettingKey::kVelocity, text);
  const auto least = whole_number_of((*values)[0], 1, kMostStepsPerS);
  const auto most = whole_number_of((*values)[1], least.value_or(1), kMostStepsPerS);
  const auto acceleration = whole_number_of((*values)[2], 1, BUSHD_VELOCITY_MOST);
  if (!least || !most || !acceleration) return refuse(SettingKey::kVelocity, text);
  settings.drive.velocity = Velocity{*least, *most, *acceleration};
  return settings;
}

Result<Settings> with_currents(Settings settings, std::string_view text) {
  settings.drive.currents.reset();
  if (trimmed(text) == kNone) return settings;
  const auto values = values_of(text, kCurrentsNames);
  if (!values) return refuse(SettingKey::kCurrents, text);
  Currents currents;
  const std::array ma = {&currents.ramp_ma, &currents.cruise_ma, &currents.hold_ma};
  for (std::size_t i = 0; i < ma.size(); ++i) {
    const auto value = whole_number_of((*values)[i], 1, BUSHD_MAX_CURRENT_MA);
    if (!value) return refuse(SettingKey::kCurrents, text);
    *ma[i] = static_cast<std::uint16_t>(*value);
  }
  const std::string_view decay = (*values)[3];
  currents.fast_decay = decay == "fast" || decay == "\"fast\"";
  if (!currents.fast_decay && !decay.empty() && decay != "slow" && decay != "\"slow\"") {
    return refuse(SettingKey::kCurrents, text);
  }
  settings.drive.currents = currents;
  return settings;
}

std::string text_of(const std::optional<Velocity>& velocity) {
  if (!velocity) return std::string(kNone);
  return fmt::format("{{ {} = {}, {} = {}, {} = {} }}", kVelocityNames[0],
                     velocity->min_steps_per_s, kVelocityNames[1], velocity->max_steps_per_s,
                     kVelocityNames[2], velocity->steps_per_s2);
}

std::string text_of(const std::optional<Currents>& currents) {
  if (!currents) return std::string(kNone);
  return fmt::format("{{ {} = {}, {} = {}, {} = {}, {} = \"{}\" }}", kCurrentsNames[0],
                     currents->ramp_ma, kCurrentsNames[1], currents->cruise_ma, kCurrentsNames[2],
                     currents->hold_ma, kCurrentsNames[3], currents->fast_decay ? "fast" : "slow");
}

std::string text_of(const std::optional<units::SoftLimits>& limits) {
  if (!limits) return std::string(kNone);
  return fmt::format("[{}, {}]", limits->low, limits->high);
}

Result<Settings> with_input_level(Settings settings, std::string_view text) {
  const std::string_view word = trimmed(text);
  if (word != "closed" && word != "open") return refuse(SettingKey::kInputActive, text);
  settings.drive.input_open = word == "open";
  return settings;
}

// Whether local inputs, or a keypad, at its MCU move it.
template <SettingKey kKey, bool Drive::* kMoves>
Result<Settings> with_people(Settings settings, std::string_view text) {
  const std::string_view word = trimmed(text);
  if (word != "true" && word != "false") return refuse(kKey, text);
  if (word == "true" && settings.max_speed) {
    return refuse(kKey, text,
                  "local motion goes by the table alone, and may be faster than max_speed; set "
                  "max_speed=none first");
  }
  if (word == "true" && settings.idle_disabled) {
    return refuse(
        kKey, text,
        "its MCU has idle_disable_s, and local inputs cannot enable disabled drivers; leave "
        "idle_disable_s out in bushd.toml first");
  }
  settings.drive.*kMoves = word == "true";
  return settings;
}

Result<Settings> with_max_speed(Settings settings, std::string_view text) {
  if (trimmed(text) == kNone) {
    settings.max_speed.reset();
    return settings;
  }
  const auto speed = number_of(text);
  if (!speed || !(*speed > 0)) return refuse(SettingKey::kMaxSpeed, text);
  if (const auto good = check_user_speed(settings.coordinates, *speed); !good) {
    return fail(fmt::format("{}: {}", name_of(SettingKey::kMaxSpeed), good.error().message));
  }
  if (settings.drive.moved_by_people()) {
    return refuse(SettingKey::kMaxSpeed, text,
                  "local motion goes by the table alone, and may be faster; set local=false and "
                  "keypad=false first, or give its group a slower table");
  }
  settings.max_speed = speed;
  return settings;
}

Result<Settings> with_acceleration(Settings settings, std::string_view text) {
  const auto share = number_of(text);
  if (!share || !check_acceleration_share(*share)) return refuse(SettingKey::kAcceleration, text);
  settings.drive.acceleration = *share;
  return settings;
}

Result<Settings> with_phase_sequence(Settings settings, std::string_view text) {
  const std::string_view word = trimmed(text);
  const auto& names = fieldbus::kSequenceNames;
  const auto found = std::ranges::find(names, word);
  const auto sequence = static_cast<std::uint8_t>(found - names.begin());
  if (found == names.end()) return refuse(SettingKey::kPhaseSequence, text);
  const bool other_windings =
      (sequence == BUSHD_PHASES_THREE) != (settings.drive.phase_sequence == BUSHD_PHASES_THREE);
  if (other_windings) return refuse(SettingKey::kPhaseSequence, text);
  settings.drive.phase_sequence = sequence;
  return settings;
}

bool always(const Settings&) {
  return true;
}
bool has_unit(const Settings& settings) {
  return settings.coordinates.has_unit();
}
bool has_mcu(const Settings& settings) {
  return settings.has_mcu;
}
bool has_phases(const Settings& settings) {
  return settings.phases;
}
constexpr std::string_view kNoUnit =
    "it has no unit, so its positions are steps; give it `unit` and `steps_per_unit` in "
    "bushd.toml first";
constexpr std::string_view kNoPeople = "its bus has no MCU with local inputs or a keypad";
constexpr std::string_view kNoPhases =
    "its MCU does not drive it by phases; give that `steps = \"phases\"` in bushd.toml first";

// All about a key but what takes it up.
struct Row {
  SettingKey key;
  std::string_view name;     // as in bushd.toml
  std::string_view allowed;  // for errors
  std::string_view help;     // behind the name: an example, or what it is
  bool is_word = false;      // in quotes in bushd.toml
  bool (*applies)(const Settings&) = always;
  std::string_view why_not = {};  // where it does not apply
  bool (*is_reported)(const Settings&) = always;
  std::string (*text)(const Settings&);
  Result<Settings> (*with)(Settings, std::string_view text);
};

constexpr std::array<Row, kSettingKeys.size()> kRows{{
    {.key = SettingKey::kOffset,
     .name = "offset",
     .allowed = "a number of user units",
     .help = "12.5",
     .applies = has_unit,
     .why_not = kNoUnit,
     .text =
         [](const Settings& now) {
           const double offset = now.coordinates.scale().offset;
           return fmt::format("{}", offset == 0 ? 0.0 : offset);
         },
     .with = with_offset},
    {.key = SettingKey::kDirection,
     .name = "direction",
     .allowed = "negative, positive",
     .help = "negative or positive",
     .is_word = true,
     .applies = has_unit,
     .why_not = kNoUnit,
     .text =
         [](const Settings& now) {
           return std::string(now.coordinates.scale().negative ? "negative" : "positive");
         },
     .with = with_direction},
    {.key = SettingKey::kSoftLimits,
     .name = "soft_limits",
     .allowed = "[LOWEST, HIGHEST] dial position, or none",
     .help = "-5,30 (on the dial), or none",
     .text = [](const Settings& now) { return text_of(now.soft_limits); },
     .with = with_soft_limits},
    {.key = SettingKey::kInputActive,
     .name = "input_active",
     .allowed = "closed, open",
     .help = "closed or open: its one input",
     .is_word = true,
     .applies = [](const Settings& now) { return now.has_one_input; },
     .why_not = "it needs a motor without `inputs`, and no other motor may use the input that has "
                "the number of its output; change `inputs` in bushd.toml",
     .is_reported = [](const Settings& now) { return now.drive.input_open; },
     .text =
         [](const Settings& now) { return std::string(now.drive.input_open ? "open" : "closed"); },
     .with = with_input_level},
    {.key = SettingKey::kLocal,
     .name = "local",
     .allowed = "true, false",
     .help = "true or false: local inputs of its MCU move it",
     .applies = has_mcu,
     .why_not = kNoPeople,
     .is_reported = [](const Settings& now) { return now.drive.local; },
     .text = [](const Settings& now) { return fmt::format("{}", now.drive.local); },
     .with = with_people<SettingKey::kLocal, &Drive::local>},
    {.key = SettingKey::kKeypad,
     .name = "keypad",
     .allowed = "true, false",
     .help = "true or false: the keypad of its MCU moves it",
     .applies = has_mcu,
     .why_not = kNoPeople,
     .is_reported = [](const Settings& now) { return now.drive.keypad; },
     .text = [](const Settings& now) { return fmt::format("{}", now.drive.keypad); },
     .with = with_people<SettingKey::kKeypad, &Drive::keypad>},
    {.key = SettingKey::kVelocity,
     .name = "velocity",
     .allowed = "MIN,MAX,ACCELERATION, whole numbers of 1..40000 steps/s, MIN to 40000 steps/s and "
                "1..8388607 steps/s^2, or none",
     .help = "MIN,MAX,ACCELERATION of local inputs, in steps/s and steps/s^2, or none",
     .applies = [](const Settings& now) { return now.drive.moved_by_people(); },
     .why_not = "no local inputs move it; set local=true or keypad=true first",
     .text = [](const Settings& now) { return text_of(now.drive.velocity); },
     .with = with_velocity},
    {.key = SettingKey::kCurrents,
     .name = "currents",
     .allowed = "RAMP,CRUISE,HOLD, whole numbers of 1..5110 mA, with slow or fast behind them, or "
                "none",
     .help = "RAMP,CRUISE,HOLD in mA, with slow or fast behind them, or none",
     .applies = has_phases,
     .why_not = kNoPhases,
     .text = [](const Settings& now) { return text_of(now.drive.currents); },
     .with = with_currents},
    {.key = SettingKey::kMaxSpeed,
     .name = "max_speed",
     .allowed = "a number above 0, of units per second (of steps per second without a unit), or "
                "none",
     .help = "2.5 in units a second, or none",
     .is_reported = [](const Settings& now) { return now.max_speed.has_value(); },
     .text =
         [](const Settings& now) {
           return now.max_speed ? fmt::format("{}", *now.max_speed) : std::string(kNone);
         },
     .with = with_max_speed},
    {.key = SettingKey::kAcceleration,
     .name = "acceleration",
     .allowed = "a number above 0 and at most 1, of the acceleration of its table",
     .help = "0.5 of that of its table",
     .is_reported = [](const Settings& now) { return now.drive.acceleration != 1; },
     .text = [](const Settings& now) { return fmt::format("{}", now.drive.acceleration); },
     .with = with_acceleration},
    {.key = SettingKey::kPhaseSequence,
     .name = "phase_sequence",
     .allowed = "wave, full, half; three-phase is for other windings",
     .help = "wave, full or half, of all motors of its MCU",
     .is_word = true,
     .applies = has_phases,
     .why_not = kNoPhases,
     .text =
         [](const Settings& now) {
           return std::string(fieldbus::kSequenceNames.at(now.drive.phase_sequence));
         },
     .with = with_phase_sequence},
}};

constexpr const Row& row_of(SettingKey key) {
  return kRows.at(static_cast<std::size_t>(key));
}
static_assert(std::ranges::all_of(kSettingKeys,
                                  [](SettingKey key) { return row_of(key).key == key; }),
              "each key has its row in its place");

tl::unexpected<Error> refuse(SettingKey key, std::string_view text, std::string_view why) {
  const Row& row = row_of(key);
  if (why.empty()) {
    return fail(fmt::format("{}: is \"{}\"; allowed: {}", row.name, text, row.allowed));
  }
  return fail(fmt::format("{}: {}; allowed: {}", row.name, why, row.allowed));
}

}  // namespace

Settings settings_of(const Motor& motor, const Mcu& mcu) {
  return {.coordinates = motor.coordinates,
          .soft_limits = motor.soft_limits,
          .drive = motor.drive,
          .phases = mcu.emission.settings.mode == BUSHD_EMISSION_PHASES,
          .has_mcu = !mcu.stand_in,
          .max_speed = motor.max_speed,
          .idle_disabled = mcu.idle_disable_s.has_value(),
          .has_one_input = motor.has_one_input,
          .written = motor.written};
}

std::string_view name_of(SettingKey key) {
  return row_of(key).name;
}

std::string help_of(SettingKey key) {
  return fmt::format("{}={}", row_of(key).name, row_of(key).help);
}

bool is_word(SettingKey key) {
  return row_of(key).is_word;
}

bool goes_first(SettingKey key, std::string_view value) {
  return key == SettingKey::kMaxSpeed && value == kNone;
}

std::optional<SettingKey> setting_key_of(std::string_view name) {
  for (const SettingKey key : kSettingKeys) {
    if (name_of(key) == name) return key;
  }
  return std::nullopt;
}

bool applies(const Settings& settings, SettingKey key) {
  return row_of(key).applies(settings);
}

bool is_reported(const Settings& settings, SettingKey key) {
  return applies(settings, key) && row_of(key).is_reported(settings);
}

std::string text_of(const Settings& settings, SettingKey key) {
  return row_of(key).text(settings);
}

std::string line_of(const Settings& settings, SettingKey key) {
  if (!settings.written[static_cast<std::size_t>(key)]) return {};
  return fmt::format("{} = {}", name_of(key), text_of(settings, key));
}

Result<Settings> with(Settings settings, SettingKey key, std::string_view text) {
  const Row& row = row_of(key);
  if (!row.applies(settings)) return fail(fmt::format("{}: {}", row.name, row.why_not));
  settings.written.set(static_cast<std::size_t>(key));
  return row.with(std::move(settings), text);
}

Result<void> check_soft_limits(const units::Coordinates& coordinates,
                               const units::SoftLimits& limits) {
  if (coordinates.first_step_from(limits.low) <= coordinates.last_step_to(limits.high)) return {};
  return fail(fmt::format("has no step from {} to {}; allowed: [lowest, highest] dial position",
                          limits.low, limits.high));
}

Result<void> check_acceleration_share(double share) {
  if (share > 0 && share <= 1) return {};
  return fail(fmt::format("is {}; allowed: a number above 0 and at most 1", share));
}

Result<void> check_user_speed(const units::Coordinates& coordinates, double speed) {
  if (!(speed > 0)) {
    return fail(fmt::format("is {}; allowed: a number above 0", speed));
  }
  constexpr std::uint32_t kAnyUnitNs = 1;
  if (const auto delay = coordinates.delay_at(speed, kAnyUnitNs); !delay) {
    return fail(delay.error().message);
  }
  return {};
}

}  // namespace bushd::config
