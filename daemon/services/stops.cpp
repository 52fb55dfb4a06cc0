#include "daemon/services/stops.h"

#include <algorithm>
#include <utility>

namespace bushd::daemon {
namespace {

void note(std::string& text, const std::string& more) {
  if (!text.empty() && !more.empty()) text += "; ";
  text += more;
}

}  // namespace

void Stops::request(std::int64_t now_us, const api::Asker& asker, const api::Stop& request) {
  auto [motors, unknown] = installation_.find_known(request.motors, false);
  if (motors.empty()) return asker.answer(api::Refused{unknown});
  motors = installation_.with_lines(std::move(motors));
  const bool in_part = !unknown.empty() || may_run_on(motors, !request.motors.empty());
  if (!in_part) asker.answer(api::Accepted{});
  open_moves_.stopped_by(motors, text_of(asker));
  Stopping stopping{.asker = asker, .done = "done" + not_online_text(motors)};
  stop_local(stopping, motors);
  std::vector<MotorId> moving = motors;
  std::erase_if(moving, [this](MotorId motor) { return !can_be_stopped(motor); });
  stop(now_us, moving);
  if (in_part) {
    const bool any_moves = !moving.empty() || !stopping.local.empty();
    note(stopping.not_done, unknown);
    return asker.answer(result_in_part(motors, stopping.not_done, any_moves));
  }
  stopping.motors = std::move(moving);
  open_.add(std::move(stopping), stopped_without_end());
}

// Where all motors are meant, those count that were lost while they moved: racks may be without
// power for years.
bool Stops::may_run_on(const std::vector<MotorId>& motors, bool named) const {
  const auto is_online = [this](MotorId id) { return installation_.mcu_of(id).online(); };
  if (named || std::ranges::none_of(motors, is_online)) {
    return !std::ranges::all_of(motors, is_online);
  }
  return std::ranges::any_of(
      motors, [this](MotorId id) { return installation_[id].trust().lost_in_motion(); });
}

std::string Stops::not_online_text(const std::vector<MotorId>& motors) const {
  const std::string mcus = installation_.not_online(motors);
  return mcus.empty() ? "" : "; not online, so it is unknown whether they stand:" + mcus;
}

// It is told at once: who does not wait for the end of a stop is to know it, too.
api::Completed Stops::result_in_part(const std::vector<MotorId>& motors,
                                     const std::string& not_done, bool any_moves) const {
  return {
      .outcome = not_done.empty() ? api::Outcome::kLink : api::Outcome::kFault,
      .reason = std::string(any_moves ? "what moves is being stopped" : "what is online stands") +
                not_online_text(motors) + (not_done.empty() ? "" : "; " + not_done),
      .detail = {}};
}

// A stop that is the daemon's own leaves them alone: people need no daemon to move them. Their MCU
// is told whether they are seen to move or not: a press may have come since its last report.
void Stops::stop_local(Stopping& stopping, const std::vector<MotorId>& motors) {
  for (const MotorId id : motors) {
    const motion::Motor& motor = installation_[id];
    if (local_inputs_.may_move(id)) {
      if (local_inputs_.move(id)) {
        stopping.done +=
            "; " + motor.name() + ": its local inputs must be released before they move it again";
      }
      local_inputs_.stop(id);
      stopping.local.push_back(id);
    } else if (motor.is<motion::Local>()) {
      note(stopping.not_done, motor.name() + ": another master moves it; 'bushctl estop' stops it");
    }
  }
}

void Stops::follow_local(Stopping& stopping) {
  std::erase_if(stopping.local, [&](MotorId id) {
    if (local_inputs_.is_stopping(id)) return false;
    const motion::Motor& motor = installation_[id];
    const auto refusal = local_inputs_.refusal(id);
    if (refusal) {
      note(stopping.not_done, motor.name() + ": " + *refusal);
    } else if (!installation_.mcu_of(id).online()) {
      note(stopping.not_done, motor.name() + ": its MCU went offline before it was known to stand");
    }
    return true;
  });
}

void Stops::stop(std::int64_t now_us, const std::vector<MotorId>& motors) {
  for (const MotorId motor : motors) {
    homing_.stop(motor);
    travels_.stop(motor);
    programs_.stop(motor);
  }
  moves_.stop(now_us, motors);
}

bool Stops::can_be_stopped(MotorId motor) const {
  const motion::Motor& its = installation_[motor];
  return its.has_plan() || its.is<motion::Homing>() || its.is<motion::Travelling>() ||
         its.is<motion::InProgram>();
}

// However long a motor's ramp is, it ends: there is no deadline.
void Stops::follow() {
  open_.follow([this](Stopping& stopping) {
    std::erase_if(stopping.motors, [&](MotorId id) {
      const motion::Motor& motor = installation_[id];
      const Mcu& mcu = installation_.mcu_of(id);
      // A program that goes on without a host is stopped when its MCU is back.
      const bool away = motor.is<motion::InProgram>() && mcu.offline();
      if (away || !can_be_stopped(id)) {
        if (mcu.online()) return true;
        stopping.outcome = api::Outcome::kLink;
        stopping.done =
            "MCU " + mcu.name() +
            " was lost meanwhile, so it is unknown whether its motors stand: " + mcu.view().detail +
            (away ? "; its program is stopped as soon as it is heard" : "");
        return true;
      }
      if (!motor.moves() || motor.stops()) return false;
      const api::Asker* by = open_moves_.asker_of(id);
      stopping.done = motor.name() + " was given a new target" +
                      (by != nullptr ? " by " + text_of(*by) : "") + " while it ran down";
      return true;
    });
    follow_local(stopping);
    if (!stopping.motors.empty() || !stopping.local.empty()) return false;
    installation_.changed = true;
    const bool done = stopping.not_done.empty();
    stopping.asker.answer(
        api::Completed{.outcome = done ? stopping.outcome : api::Outcome::kFault,
                       .reason = done ? stopping.done : "not stopped: " + stopping.not_done,
                       .detail = {}});
    return true;
  });
}

}  // namespace bushd::daemon
