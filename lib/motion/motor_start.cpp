#include "motion/motor_start.h"

#include "base/output_bits.h"
#include "motion/motor.h"
#include "motion/report_words.h"

namespace bushd::motion {

bool MotorStart::is_missed(const bushd_report& report) const {
  const Axis& axis = motor_.axis_;
  const Output output = motor_.output();
  const bool ran_down = report.faults != 0;
  // No tick is missed of a move that was cancelled before its start.
  const bool cancelled = axis.end_tick() <= axis.start_tick();
  const bool limited = has_bit(report.forbidden_positive | report.forbidden_negative, output);
  // Another master may have ended it since.
  const bool moved = report.motor[output.value].position_steps != axis.from_steps();
  return motor_.has_plan() && !ran_down && !cancelled && !limited && !moved;
}

bool MotorStart::may_begin_anew() const {
  const auto& line = motor_.axis_.line();
  const bool streamed_line = line && !line->in_mcus;
  return motor_.moves() && !follows_trajectory(motor_) && !streamed_line;
}

bool MotorStart::awaits_new() {
  if (!may_begin_anew()) return false;
  auto* on_line = std::get_if<OnLine>(&motor_.activity_);
  if (on_line != nullptr) on_line->stands = true;
  if (is_withdrawn(motor_)) {
    // Nobody has stopped it.
    Axis& axis = motor_.axis_;
    const Tick start = axis.start_tick();
    if (on_line != nullptr) {
      axis.start_line(motor_.position_, *axis.line(), start, axis.shortest_delay());
    } else {
      axis.start(motor_.position_, axis.target_steps() - motor_.position_, start, 0,
                 axis.shortest_delay());
    }
  }
  motor_.moving_now().late = true;
  motor_.moving_now().withdrawn = false;
  return true;
}

bool MotorStart::withdraw() {
  if (!may_begin_anew() || is_late(motor_) || motor_.stops()) return false;
  if (motor_.axis_.open_change()) return false;
  motor_.moving_now().withdrawn = true;
  motor_.axis_.stop();
  return true;
}

std::string MotorStart::missed_text() const {
  return "its first ticks did not reach MCU " + motor_.setup_.mcu + " in time; it did not move";
}

}  // namespace bushd::motion
