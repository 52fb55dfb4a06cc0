#include "config/inputs.h"

#include <fmt/format.h>

#include "config/motor_inputs.h"
#include "config/words.h"

namespace bushd::config {

using tables::TomlReader;

Result<void> read_inputs(const TomlReader& reader, Mcu* mcu) {
  static_assert(BUSHD_EMERGENCY_INPUT_IGNORED == 0 && BUSHD_EMERGENCY_INPUT_RAMP == 1 &&
                BUSHD_EMERGENCY_INPUT_IMMEDIATE == 2 && BUSHD_EMERGENCY_INPUT_DISABLE == 3);
  const Keys emergency =
      Keys(reader)
          .word("emergency_input", &mcu->emergency_input,
                {"ignore", "ramp", "immediate", "disable"})
          .word("emergency_active", &mcu->emergency_active_open, {"closed", "open"});
  if (!emergency.result()) return emergency.result();
  if (reader.has("emergency_active") && mcu->emergency_input == BUSHD_EMERGENCY_INPUT_IGNORED) {
    return fail(
        reader.error("emergency_active",
                     "says nothing while the input is ignored; allowed: beside "
                     "emergency_input = \"ramp\", \"immediate\" or \"disable\". Add one of them, "
                     "or remove this key"));
  }
  return Keys(reader)
      .whole("debounce_ticks", &mcu->debounce_ticks, 0, BUSHD_MAX_DEBOUNCE_TICKS)
      .whole("overcurrent", &mcu->overcurrent, 0, BUSHD_MAX_CURRENT)
      .word("enable_after_reset", &mcu->enable_after_reset, {"ready", "at_once", "no"})
      .word("ready", &mcu->ready_after_homing, {"at-once", "after-homing"})
      .result();
}

Result<void> read_inputs(const TomlReader& reader, bool has_limits, Motor* motor) {
  std::optional<bool> own_open;
  const Keys own = Keys(reader).word("input_active", &own_open, {"closed", "open"});
  if (!own.result()) return own.result();
  if (auto read = read_motor_inputs(reader, own_open, motor); !read) return read;
  return read_limit_action(reader, has_limits, motor);
}

Result<void> read_limit_action(const TomlReader& reader, bool has_limits, Motor* motor) {
  if (!reader.has("limit_action")) return {};
  const auto action = read_word(reader, "limit_action", {"ramp", "immediate"});
  if (!action) return fail(action.error());
  if (!has_limits && !motor->inputs.positive && !motor->inputs.negative) {
    return fail(reader.error("limit_action",
                             "applies only with a limit; allowed: "
                             "beside limit = \"positive\", \"negative\" or "
                             "\"both\", or inputs = { positive = N, negative = N }"));
  }
  motor->limit_action = *action == 0 ? BUSHD_STOP_RAMP : BUSHD_STOP_IMMEDIATE;
  return {};
}

}  // namespace bushd::config
