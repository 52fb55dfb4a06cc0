#include "motion/motor_line.h"

#include <utility>

#include "motion/motor.h"

namespace bushd::motion {

void MotorLine::start(const OnLine& on_line, LineShare share, Tick start,
                      bushd_delay shortest_delay) {
  motor_.activity_ = on_line;
  motor_.pause_ = Motor::Pause::kNo;
  motor_.further_.clear();
  motor_.axis_.start_line(motor_.position_, std::move(share), start, shortest_delay);
}

void MotorLine::aim(const OnLine& on_line, std::uint32_t line_step, bushd_delay shortest_delay) {
  motor_.activity_ = on_line;
  motor_.axis_.aim_on_line(line_step, shortest_delay);
}

void MotorLine::arm(std::uint8_t number, const OnLine& on_line, LineShare share,
                    bushd_delay shortest_delay) {
  motor_.axis_.start_line(motor_.position_, std::move(share), Motor::kNever, shortest_delay);
  const std::int64_t steps = motor_.axis_.target_steps() - motor_.position_;
  motor_.activity_ = Armed{.number = number, .steps = steps, .on_line = on_line};
}

}  // namespace bushd::motion
