#include "daemon/services/stops.h"

#include <utility>

namespace bushd::daemon {

void Stops::request(std::int64_t now_us, const api::Asker& asker, const api::Stop& request) {
  auto motors = installation_.find_or_all(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  asker.answer(api::Accepted{});
  *motors = installation_.with_lines(std::move(*motors));
  open_moves_.stopped_by(*motors, text_of(asker));
  std::erase_if(*motors, [this](MotorId motor) { return !can_be_stopped(motor); });
  stop(now_us, *motors);
  if (open_.size() >= kMaxOpen) {
    open_.front().asker.answer(api::Completed{
        .outcome = api::Outcome::kStopped,
        .reason = "carried out; so many stops are under way that its end is not waited for",
        .detail = {}});
    open_.pop_front();
  }
  open_.push_back({.asker = asker, .motors = std::move(*motors)});
}

void Stops::stop(std::int64_t now_us, const std::vector<MotorId>& motors) {
  for (const MotorId motor : motors) {
    homing_.stop(motor);
    travels_.stop(motor);
  }
  moves_.stop(now_us, motors);
}

bool Stops::can_be_stopped(MotorId motor) const {
  const motion::Motor& its = installation_[motor];
  return its.has_plan() || its.is<motion::Homing>() || its.is<motion::Travelling>();
}

// However long a motor's ramp is, it ends: there is no deadline.
void Stops::follow() {
  std::erase_if(open_, [this](Stopping& stopping) {
    std::erase_if(stopping.motors, [&](MotorId id) {
      const motion::Motor& motor = installation_[id];
      if (!can_be_stopped(id)) return true;
      if (!motor.moves() || motor.axis().stopping()) return false;
      const api::Asker* by = open_moves_.asker_of(id);
      stopping.done = motor.name() + " was given a new target" +
                      (by != nullptr ? " by " + text_of(*by) : "") + " while it ran down";
      return true;
    });
    if (!stopping.motors.empty()) return false;
    installation_.changed = true;
    stopping.asker.answer(
        api::Completed{.outcome = api::Outcome::kDone, .reason = stopping.done, .detail = {}});
    return true;
  });
}

}  // namespace bushd::daemon
