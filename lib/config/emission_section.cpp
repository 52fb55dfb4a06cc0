#include "config/emission_section.h"

#include <fmt/format.h>

#include <array>
#include <string>

#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::int64_t kMaxUs = UINT16_MAX;
// Where the first step of a tick would begin together with the change of DIR: enough for slow
// drivers.
constexpr std::uint16_t kDirSetupUs = 5;

// A motor has to move for it, so it is measured only where that is asked for.
Result<void> read_settle(const TomlReader& reader, std::uint16_t* us) {
  constexpr std::string_view kKey = "settle_us";
  constexpr std::string_view kMeasured = "measured";
  *us = BUSHD_SETTLE_UNKNOWN;
  if (!reader.has(kKey)) return {};
  if (reader.is_string(kKey)) {
    const std::string rule = fmt::format("a whole number 0..{} us or \"{}\"", kMaxUs, kMeasured);
    const auto word = reader.string(kKey, rule);
    if (!word) return fail(word.error());
    if (*word != kMeasured) return refuse(reader, kKey, *word, rule);
    *us = BUSHD_SETTLE_MEASURED;
    return {};
  }
  if (auto read = Keys(reader).whole(kKey, us, 0, kMaxUs, "us").result(); !read) {
    read.error().message += fmt::format(" or \"{}\"", kMeasured);
    return read;
  }
  if (*us == 0) *us = BUSHD_SETTLE_UNKNOWN;
  return {};
}

// Indices of kStepsNames. `known_with` has a bit for each value that allows the key.
enum Steps : std::uint8_t { kEven, kBurst, kStaggered, kPhases };
constexpr unsigned bit(Steps steps) {
  return 1u << steps;
}
constexpr unsigned kPeriodic = bit(kBurst) | bit(kStaggered);
constexpr unsigned kPulses = bit(kEven) | kPeriodic;

struct Key {
  std::string_view name;
  unsigned known_with;
};
constexpr std::array<Key, 6> kKeys = {{
    {"step_us", kPeriodic},
    {"settle_us", bit(kStaggered)},
    {"dir_setup_us", kPulses},
    {"pulse_us", kPulses},
    {"phase_sequence", bit(kPhases)},
    {"hold_current", bit(kPhases)},
}};

std::string names_of(unsigned known_with) {
  std::string names;
  for (const Steps steps : {kEven, kBurst, kStaggered, kPhases}) {
    if ((known_with & bit(steps)) == 0) continue;
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", fieldbus::kStepsNames[steps]);
  }
  return names;
}

// A key that does nothing would be taken for one that does.
Result<void> refuse_idle_keys(const TomlReader& reader, Steps steps) {
  for (const Key& key : kKeys) {
    if (!reader.has(key.name) || (key.known_with & bit(steps)) != 0) continue;
    return fail(reader.error(key.name,
                             fmt::format("says nothing with steps = \"{}\"; allowed: only with {}",
                                         fieldbus::kStepsNames[steps], names_of(key.known_with))));
  }
  return {};
}

Result<std::uint8_t> read_mode(const TomlReader& reader) {
  Steps steps = kEven;
  bool common = false;
  const Keys keys = Keys(reader)
                        .word("steps", &steps, fieldbus::kStepsNames)
                        .word("direction", &common, fieldbus::kDirectionNames);
  if (!keys.result()) return fail(keys.result().error());
  // Steps at their own times cannot wait for the one DIR; windings have none.
  if (reader.has("direction") && (bit(steps) & kPeriodic) == 0 && (common || steps == kPhases)) {
    return fail(reader.error(
        "direction",
        fmt::format("is \"{}\" with steps = \"{}\"; allowed: {}",
                    fieldbus::kDirectionNames[common ? 1 : 0], fieldbus::kStepsNames[steps],
                    steps == kPhases ? "only with drivers, which have STEP and DIR; remove it"
                                     : "\"common\" only with steps = " + names_of(kPeriodic))));
  }
  if (auto idle = refuse_idle_keys(reader, steps); !idle) return fail(idle.error());
  switch (steps) {
    case kBurst:
      return common ? BUSHD_EMISSION_COMMON_DIR : BUSHD_EMISSION_BURST;
    case kStaggered:
      return common ? BUSHD_EMISSION_COMMON_STAGGERED : BUSHD_EMISSION_STAGGERED;
    case kPhases:
      return BUSHD_EMISSION_PHASES;
    default:
      return BUSHD_EMISSION_EVEN;
  }
}

}  // namespace

Result<void> refuse_emission_key(const TomlReader& reader) {
  constexpr std::string_view kKey = "emission";
  if (!reader.has(kKey)) return {};
  std::string instead = "steps and direction";
  if (reader.is_string(kKey)) {
    const auto word = reader.string(kKey, "");
    for (std::uint8_t mode = 0; word && mode < fieldbus::kEmissionNames.size(); ++mode) {
      if (fieldbus::kEmissionNames[mode] == *word) instead = fieldbus::emission_keys(mode);
    }
  }
  return fail(reader.error(kKey, fmt::format("is not a key; write {} in place of it", instead)));
}

Result<fieldbus::EmissionSetup> read_emission(const TomlReader& reader) {
  fieldbus::EmissionSetup setup;
  bushd_emission& settings = setup.settings;
  const auto mode = read_mode(reader);
  if (!mode) return fail(mode.error());
  settings.mode = *mode;
  const bool periodic = bushd_emission_has_periods(settings.mode);
  Keys keys(reader);
  if (periodic) keys.needed_whole("step_us", &settings.step_us, 1, kMaxUs, "us");
  if (!keys.result()) return fail(keys.result().error());
  if (bushd_emission_is_staggered(settings.mode)) {
    if (auto read = read_settle(reader, &settings.settle_us); !read) return fail(read.error());
  }
  if (periodic && !bushd_emission_has_common_dir(settings.mode)) {
    settings.dir_setup_us = kDirSetupUs;
  }
  if (settings.mode == BUSHD_EMISSION_PHASES) {
    settings.sequence = BUSHD_PHASES_FULL;
    settings.hold_current = true;
  }
  keys.whole("dir_setup_us", &settings.dir_setup_us, 0, kMaxUs, "us")
      .whole("pulse_us", &settings.pulse_us, 0, kMaxUs, "us")
      .word("phase_sequence", &settings.sequence, fieldbus::kSequenceNames)
      .flag("hold_current", &settings.hold_current);
  if (!keys.result()) return fail(keys.result().error());
  setup.mode_at = reader.error(reader.has("steps") ? "steps" : "", "");
  setup.step_at = reader.error("step_us", "");
  setup.dir_setup_at = reader.error("dir_setup_us", "");
  setup.pulse_at = reader.error("pulse_us", "");
  return setup;
}

}  // namespace bushd::config
