#include "config/output_levels.h"

#include <fmt/format.h>

#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::uint16_t kAllOutputs = 0xFFFF;

Result<bool> read_low(const TomlReader& reader, std::string_view key) {
  const auto level = read_word(reader, key, {"high", "low"});
  if (!level) return fail(level.error());
  return *level == 1;
}

struct LevelKey {
  std::string_view name;
  std::uint16_t bushd_set_outputs::* low;
};
constexpr LevelKey kStep = {"step_active", &bushd_set_outputs::step_low};
constexpr LevelKey kDirection = {"direction_active", &bushd_set_outputs::direction_low};

Result<void> read(const TomlReader& reader, const LevelKey& key, std::uint16_t outputs, Mcu* mcu) {
  if (!reader.has(key.name)) return {};
  if (mcu->emission.settings.mode == BUSHD_EMISSION_PHASES) {
    return fail(reader.error(
        key.name,
        fmt::format("says nothing with steps = \"phases\", on MCU \"{}\": its "
                    "outputs switch windings. Remove it; transistors that are on when low "
                    "need inverters",
                    mcu->id)));
  }
  const auto low = read_low(reader, key.name);
  if (!low) return fail(low.error());
  std::uint16_t& mask = mcu->outputs.*key.low;
  mask = static_cast<std::uint16_t>(*low ? mask | outputs : mask & ~outputs);
  if (*low) mcu->outputs_at = reader.error(key.name, "");
  return {};
}

}  // namespace

Result<void> read_output_levels(const TomlReader& reader, Mcu* mcu) {
  if (reader.has("enable_active")) {
    const auto low = read_low(reader, "enable_active");
    if (!low) return fail(low.error());
    mcu->outputs.enabled = *low ? BUSHD_ENABLED_LOW : BUSHD_ENABLED_HIGH;
    if (*low) mcu->outputs_at = reader.error("enable_active", "");
  }
  for (const LevelKey& key : {kStep, kDirection}) {
    if (auto done = read(reader, key, kAllOutputs, mcu); !done) return done;
  }
  return {};
}

Result<void> read_output_levels(const TomlReader& reader, Output output, Mcu* mcu) {
  for (const LevelKey& key : {kStep, kDirection}) {
    if (!reader.has(key.name)) continue;
    if (mcu->stand_in) {
      return fail(reader.error(
          key.name, fmt::format("does not apply at \"{}\", which has no STEP and DIR of its own; "
                                "remove it. Of a serial port that makes pulses direction_line has "
                                "a level: direction_line = {{ line = \"dtr\", active = \"off\" }}",
                                mcu->id)));
    }
    const bool shared = bushd_emission_has_common_dir(mcu->emission.settings.mode);
    if (shared && key.low == kDirection.low) {
      return fail(reader.error(
          key.name, fmt::format("stands at a motor, but the motors of MCU \"{}\" have one DIR "
                                "(direction = \"common\"): write it into its [[mcu]]",
                                mcu->id)));
    }
    const auto bit = static_cast<std::uint16_t>(1u << output.value);
    if (auto done = read(reader, key, bit, mcu); !done) return done;
  }
  return {};
}

}  // namespace bushd::config
