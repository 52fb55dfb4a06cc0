#include "config/currents.h"

#include "config/words.h"

namespace bushd::config {

using tables::TomlReader;

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
  Currents currents;
  const Keys keys =
      Keys(*reader)
          .only({"ramp_ma", "cruise_ma", "hold_ma", "decay"})
          .needed_whole("ramp_ma", &currents.ramp_ma, 1, BUSHD_MAX_CURRENT_MA, "mA")
          .needed_whole("cruise_ma", &currents.cruise_ma, 1, BUSHD_MAX_CURRENT_MA, "mA")
          .needed_whole("hold_ma", &currents.hold_ma, 1, BUSHD_MAX_CURRENT_MA, "mA")
          .word("decay", &currents.fast_decay, {"slow", "fast"});
  if (!keys.result()) return fail(keys.result().error());
  return currents;
}

}  // namespace bushd::config
