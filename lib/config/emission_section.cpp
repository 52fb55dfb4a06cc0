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

Result<void> read_us(const TomlReader& reader, std::string_view key, std::int64_t lowest,
                     std::uint16_t* us) {
  const auto value = reader.integer(key, lowest, kMaxUs, "us");
  if (!value) return fail(value.error());
  *us = static_cast<std::uint16_t>(*value);
  return {};
}

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
  if (auto read = read_us(reader, kKey, 0, us); !read) {
    read.error().message += fmt::format(" or \"{}\"", kMeasured);
    return read;
  }
  if (*us == 0) *us = BUSHD_SETTLE_UNKNOWN;
  return {};
}

struct Key {
  std::string_view name;
  std::uint8_t first_mode;  // the modes that know it
  std::uint8_t last_mode;
};
constexpr std::array<Key, 6> kKeys = {{
    {"step_us", BUSHD_EMISSION_BURST, BUSHD_EMISSION_STAGGERED},
    {"settle_us", BUSHD_EMISSION_STAGGERED, BUSHD_EMISSION_STAGGERED},
    {"dir_setup_us", BUSHD_EMISSION_EVEN, BUSHD_EMISSION_STAGGERED},
    {"pulse_us", BUSHD_EMISSION_EVEN, BUSHD_EMISSION_STAGGERED},
    {"phase_sequence", BUSHD_EMISSION_PHASES, BUSHD_EMISSION_PHASES},
    {"hold_current", BUSHD_EMISSION_PHASES, BUSHD_EMISSION_PHASES},
}};

// A key that does nothing would be taken for one that does.
Result<void> refuse_idle_keys(const TomlReader& reader, std::uint8_t mode) {
  for (const Key& key : kKeys) {
    if (!reader.has(key.name) || (mode >= key.first_mode && mode <= key.last_mode)) continue;
    std::string modes;
    for (std::uint8_t m = key.first_mode; m <= key.last_mode; ++m) {
      modes += fmt::format("{}\"{}\"", modes.empty() ? "" : ", ", fieldbus::kEmissionNames[m]);
    }
    return fail(reader.error(key.name, fmt::format("says nothing with emission = \"{}\"; allowed: "
                                                   "only with {}",
                                                   fieldbus::kEmissionNames[mode], modes)));
  }
  return {};
}

}  // namespace

Result<fieldbus::EmissionSetup> read_emission(const TomlReader& reader) {
  fieldbus::EmissionSetup setup;
  bushd_emission& settings = setup.settings;
  if (reader.has("emission")) {
    const auto mode = read_word(reader, "emission", fieldbus::kEmissionNames);
    if (!mode) return fail(mode.error());
    settings.mode = static_cast<std::uint8_t>(*mode);
  }
  if (auto idle = refuse_idle_keys(reader, settings.mode); !idle) return fail(idle.error());
  const bool periodic =
      settings.mode >= BUSHD_EMISSION_BURST && settings.mode <= BUSHD_EMISSION_STAGGERED;
  if (periodic) {
    if (auto read = read_us(reader, "step_us", 1, &settings.step_us); !read) {
      return fail(read.error());
    }
  }
  const auto optional_us = [&](std::string_view key, std::int64_t lowest,
                               std::uint16_t* us) -> Result<void> {
    return reader.has(key) ? read_us(reader, key, lowest, us) : Result<void>{};
  };
  if (settings.mode == BUSHD_EMISSION_STAGGERED) {
    if (auto read = read_settle(reader, &settings.settle_us); !read) return fail(read.error());
  }
  if (settings.mode == BUSHD_EMISSION_BURST || settings.mode == BUSHD_EMISSION_STAGGERED) {
    settings.dir_setup_us = kDirSetupUs;
  }
  if (auto read = optional_us("dir_setup_us", 0, &settings.dir_setup_us); !read) {
    return fail(read.error());
  }
  if (auto read = optional_us("pulse_us", 0, &settings.pulse_us); !read) return fail(read.error());
  if (settings.mode == BUSHD_EMISSION_PHASES) {
    settings.sequence = BUSHD_PHASES_FULL;
    settings.hold_current = true;
  }
  if (reader.has("phase_sequence")) {
    const auto sequence = read_word(reader, "phase_sequence", fieldbus::kSequenceNames);
    if (!sequence) return fail(sequence.error());
    settings.sequence = static_cast<std::uint8_t>(*sequence);
  }
  if (reader.has("hold_current")) {
    const auto hold = reader.boolean("hold_current");
    if (!hold) return fail(hold.error());
    settings.hold_current = *hold;
  }
  setup.mode_at = reader.error(reader.has("emission") ? "emission" : "", "");
  setup.step_at = reader.error("step_us", "");
  setup.dir_setup_at = reader.error("dir_setup_us", "");
  setup.pulse_at = reader.error("pulse_us", "");
  return setup;
}

}  // namespace bushd::config
