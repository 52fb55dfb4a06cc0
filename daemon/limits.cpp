// Motors that their limit switches stop: the MCU does it, here is learnt of it.
#include "daemon/core.h"
#include "daemon/faults.h"

namespace bushd::daemon {
namespace {

std::string switch_at(int direction) {
  return std::string("its limit switch at the ") + (direction > 0 ? "positive" : "negative") +
         " end";
}

}  // namespace

bushd_set_inputs Core::inputs_of(const Mcu& mcu) const {
  const config::Mcu& config = *mcu.config;
  bushd_set_inputs inputs{};
  inputs.debounce_ticks = config.debounce_ticks;
  inputs.emergency = config.emergency_input;
  inputs.overcurrent = config.overcurrent;
  inputs.enable_after_watchdog = config.enable_after_reset == config::EnableAfterReset::kAtOnce;
  if (config.emergency_active_open) inputs.system_inverted |= BUSHD_INPUT_EMERGENCY;
  for (std::size_t output = 0; output < BUSHD_MOTORS_PER_MCU; ++output) {
    if (mcu.motor_of[output] < 0) continue;
    const config::Motor& motor = config_.motors[static_cast<std::size_t>(mcu.motor_of[output])];
    const auto bit = static_cast<std::uint16_t>(1u << output);
    if (motor.limit_positive) inputs.limit_positive |= bit;
    if (motor.limit_negative) inputs.limit_negative |= bit;
    if (motor.limit_action == BUSHD_CUT) inputs.limit_cuts |= bit;
    if (motor.input_active_open) inputs.inverted |= bit;
  }
  return inputs;
}

std::string Core::refuse_direction(const Motor& motor, std::int64_t steps) const {
  const bushd_report& report = view_of(mcus_[motor.mcu]).report;
  if (motor.limit != 0) return switch_at(motor.limit) + " is stopping it; wait for that result";
  const int direction = steps < 0 ? -1 : 1;
  if (steps == 0 || !forbids(report, motor.config->output.value, direction)) return {};
  return switch_at(direction) + " bars the way; move it in the other direction";
}

// The way it goes is barred, and the MCU has not begun, or goes by a ramp of its own.
void Core::notice_limit(Motor& motor, const link::McuView& view) {
  const std::uint8_t output = motor.config->output.value;
  const int direction = motor.axis.direction();
  if (!forbids(view.report, output, direction)) return;
  const bool moving = (view.report.moving >> output & 1) != 0;
  const bool given_up =
      !moving && view.tick >= motor.axis.start_tick() && motor.axis.velocity_steps_per_s() != 0;
  // Its own ramp may be a step longer than what was planned.
  const bool outlasts = moving && view.tick >= motor.axis.end_tick();
  if (!given_up && !outlasts && motor.axis.executed_steps() == motor.position_steps) return;
  motor.limit = direction;
  const Mcu& mcu = mcus_[motor.mcu];
  master_of(mcu).drop(mcu.in_bus, output);
  changed_ = true;
}

// It stands.
void Core::end_at_limit(std::size_t index) {
  Motor& motor = motors_[index];
  if (!motor.axis.stopping() && motor.position_steps == motor.axis.wanted_steps()) {
    end_motor(index, motion::Outcome::kReached, "stands at its target");
    return;
  }
  if (motor.axis.stopping() && motor.position_steps == motor.axis.executed_steps()) {
    end_motor(index, motion::Outcome::kStopped, "stopped on request");
    return;
  }
  std::string reason = "stopped by " + switch_at(motor.limit) + ", stands at " +
                       std::to_string(motor.position_steps);
  if (motor.config->limit_action == BUSHD_CUT && motor.position_steps != motor.axis.from_steps()) {
    motor.doubt = "it was cut off at its limit switch and may have overrun";
    reason += "; cut off, it may have overrun, so check the position and set it";
  }
  end_motor(index, motion::Outcome::kLimit, reason);
}

}  // namespace bushd::daemon
