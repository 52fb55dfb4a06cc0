#include "daemon/services/camac_shutter.h"

#include "daemon/services/camac_motors.h"

namespace bushd::daemon {

bool CamacShutter::refuse(const std::string& why) {
  outputs_.log(LogLevel::kWarning, motor_,
               name_ + ": " + installation_[motor_].name() + ": " + why);
  return false;
}

bool CamacShutter::step(const camac::SingleStep& step) {
  const motion::Motor& motor = installation_[motor_];
  if (step.with_sensor)
    return refuse("no MCU watches a step sensor for a single step; use mode 00");
  if (motor.has_plan()) return refuse("moves, by another's request");
  auto may = interlocks_.may_move();
  if (may) may = interlocks_.may_move(motor_);
  if (may) may = motor.may_move_to(motor.position_steps() + (step.left ? -1 : 1));
  if (!may) return refuse(may.error().text());
  wanted_ = step;
  return true;
}

bool CamacShutter::travel(const camac::Travel&) {
  return refuse("no MCU travels between limits by itself; automatic modes are not available");
}

void CamacShutter::follow(std::int64_t now_us, camac::Bushd1& module) {
  const camac::MotorStatus limits = limits_of(installation_, motor_);
  module.limits(limits.right_limit, limits.left_limit);
  if (wanted_) {
    const std::int64_t steps = wanted_->left ? -1 : 1;
    wanted_.reset();
    moves_ = true;
    const api::Asker by{.session = session_, .number = session_->next_number()};
    ask_(now_us, by,
         api::Move{.kind = api::Move::Kind::kRelative,
                   .motors = {{installation_[motor_].name(), steps}}});
  }
  if (!moves_ || !session_->last_answer()) return;
  moves_ = false;
  const auto* completed = std::get_if<api::Completed>(&*session_->last_answer());
  if (completed != nullptr && completed->outcome == api::Outcome::kReached) {
    return module.step_done();
  }
  const auto* refused = std::get_if<api::Refused>(&*session_->last_answer());
  outputs_.log(LogLevel::kWarning, motor_,
               name_ + ": " + (refused != nullptr ? refused->reason : completed->reason));
  module.step_not_done();
}

}  // namespace bushd::daemon
