#include "config/currents.h"

#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

Result<void> read_ma(const TomlReader& reader, std::string_view key, std::uint16_t* ma) {
  const auto value = reader.integer(key, 1, BUSHD_MAX_CURRENT_MA, "mA");
  if (!value) return fail(value.error());
  *ma = static_cast<std::uint16_t>(*value);
  return {};
}

}  // namespace

Result<std::optional<Currents>> read_currents(const TomlReader& motor, const Mcu& mcu) {
  constexpr std::string_view kKey = "currents";
  if (!motor.has(kKey)) return std::nullopt;
  if (mcu.emission.settings.mode != BUSHD_EMISSION_PHASES) {
    return fail(motor.error(kKey,
                            "says nothing of a driver with STEP and DIR; allowed: only with "
                            "steps = \"phases\" of its MCU"));
  }
  auto reader =
      motor.section(kKey, "a table such as { ramp_ma = 1500, cruise_ma = 1000, hold_ma = 300 }");
  if (!reader) return fail(reader.error());
  if (auto known = reader->only({"ramp_ma", "cruise_ma", "hold_ma", "decay"}); !known) {
    return fail(known.error());
  }
  Currents currents;
  for (const auto& [key, ma] :
       {std::pair{"ramp_ma", &currents.ramp_ma}, std::pair{"cruise_ma", &currents.cruise_ma},
        std::pair{"hold_ma", &currents.hold_ma}}) {
    if (auto read = read_ma(*reader, key, ma); !read) return fail(read.error());
  }
  if (reader->has("decay")) {
    const auto decay = read_word(*reader, "decay", {"slow", "fast"});
    if (!decay) return fail(decay.error());
    currents.fast_decay = *decay == 1;
  }
  return currents;
}

}  // namespace bushd::config
