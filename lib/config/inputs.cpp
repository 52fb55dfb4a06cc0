#include "config/inputs.h"

#include <fmt/format.h>

#include "config/motor_inputs.h"
#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

// Whether a switch is active when it is open.
Result<void> read_active(const TomlReader& reader, std::string_view key, bool* open) {
  if (!reader.has(key)) return {};
  const auto active = read_word(reader, key, {"closed", "open"});
  if (!active) return fail(active.error());
  *open = *active == 1;
  return {};
}

}  // namespace

Result<void> read_inputs(const TomlReader& reader, Mcu* mcu) {
  if (reader.has("emergency_input")) {
    const auto action =
        read_word(reader, "emergency_input", {"ignore", "ramp", "immediate", "disable"});
    if (!action) return fail(action.error());
    static_assert(BUSHD_EMERGENCY_INPUT_IGNORED == 0 && BUSHD_EMERGENCY_INPUT_RAMP == 1 &&
                  BUSHD_EMERGENCY_INPUT_IMMEDIATE == 2 && BUSHD_EMERGENCY_INPUT_DISABLE == 3);
    mcu->emergency_input = static_cast<std::uint8_t>(*action);
  }
  if (auto read = read_active(reader, "emergency_active", &mcu->emergency_active_open); !read) {
    return read;
  }
  if (reader.has("emergency_active") && mcu->emergency_input == BUSHD_EMERGENCY_INPUT_IGNORED) {
    return fail(
        reader.error("emergency_active",
                     "says nothing while the input is ignored; allowed: beside "
                     "emergency_input = \"ramp\", \"immediate\" or \"disable\". Add one of them, "
                     "or remove this key"));
  }
  if (reader.has("debounce_ticks")) {
    const auto ticks = reader.integer("debounce_ticks", 0, BUSHD_MAX_DEBOUNCE_TICKS);
    if (!ticks) return fail(ticks.error());
    mcu->debounce_ticks = static_cast<std::uint8_t>(*ticks);
  }
  if (reader.has("overcurrent")) {
    const auto reading = reader.integer("overcurrent", 0, BUSHD_MAX_CURRENT);
    if (!reading) return fail(reading.error());
    mcu->overcurrent = static_cast<std::uint16_t>(*reading);
  }
  if (reader.has("enable_after_reset")) {
    const auto when = read_word(reader, "enable_after_reset", {"ready", "at_once", "no"});
    if (!when) return fail(when.error());
    mcu->enable_after_reset = static_cast<EnableAfterReset>(*when);
  }
  if (reader.has("ready")) {
    const auto when = read_word(reader, "ready", {"at-once", "after-homing"});
    if (!when) return fail(when.error());
    mcu->ready_after_homing = *when != 0;
  }
  return {};
}

Result<void> read_inputs(const TomlReader& reader, bool has_limits, Motor* motor) {
  bool own_open = false;
  if (auto read = read_active(reader, "input_active", &own_open); !read) return read;
  std::optional<bool> own_level;
  if (reader.has("input_active")) own_level = own_open;
  if (auto read = read_motor_inputs(reader, own_level, motor); !read) return read;
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
