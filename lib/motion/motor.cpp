#include "motion/motor.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "base/output_bits.h"
#include "motion/report_words.h"
#include "words/remedy.h"

namespace bushd::motion {

std::string busy_text(const Motor& motor) {
  return motor.name() + (motor.is<Armed>() ? " waits for the trigger" : " moves");
}

void Motor::start(std::int64_t target, Tick start, bushd_delay shortest_delay) {
  activity_ = Moving{};
  pause_ = Pause::kNo;
  axis_.start(position_, target - position_, start, 0, shortest_delay);
}

void Motor::arm(std::uint8_t number, std::int64_t steps, bushd_delay shortest_delay) {
  activity_ = Armed{.number = number, .steps = steps};
  axis_.start(position_, steps, kNever, 0, shortest_delay);
}

void Motor::aim(std::int64_t target, bushd_delay shortest_delay) {
  pause_ = Pause::kNo;
  if (moves()) moving_now().withdrawn = false;
  axis_.aim(target, shortest_delay);
}

void Motor::follow(TrajectoryShare share, Tick start) {
  activity_ = Moving{};
  pause_ = Pause::kNo;
  further_.clear();
  asked_for_.reset();
  axis_.start_trajectory(std::move(share), start);
}

Leg Motor::take_leg() {
  if (position_ != axis_.target_steps() || further_.empty()) {
    return {.target = axis_.target_steps(), .shortest_delay = axis_.shortest_delay()};
  }
  const Leg next = further_.front();
  further_.erase(further_.begin());
  return next;
}

bool Motor::stands() const {
  return !has_plan() || rests_in_pause() || is_late(*this);
}

bool Motor::stops() const {
  return axis_.stopping() && !is_withdrawn(*this);
}

void Motor::pause() {
  if (auto* on_line = std::get_if<OnLine>(&activity_)) on_line->resumes = false;
  if (!moves()) return;
  if (is_late(*this)) {
    pause_ = Pause::kStands;
    return;
  }
  if (stops()) return;
  moving_now().withdrawn = false;
  pause_ = Pause::kRamps;
  axis_.stop();
}

void Motor::resume() {
  if (auto* on_line = std::get_if<OnLine>(&activity_)) {
    on_line->resumes = is_paused();
    return;
  }
  if (pause_ == Pause::kRamps) axis_.aim(axis_.target_steps(), axis_.shortest_delay());
  pause_ = Pause::kNo;
}

std::int64_t Motor::target_steps() const {
  if (!has_plan()) return position_;
  if (stops() && !is_paused()) return jogs_ && !axis_.is_planned() ? position_ : axis_.end_steps();
  if (jogs_) return position_;
  if (const OnLine* on_line = as<OnLine>()) return on_line->target_steps;
  const Armed* armed = as<Armed>();
  if (armed != nullptr && armed->on_line) return armed->on_line->target_steps;
  return further_.empty() ? axis_.target_steps() : further_.back().target;
}

void Motor::stop(std::optional<std::string> ended_by) {
  pause_ = rests_in_pause() ? Pause::kOver : Pause::kNo;
  if (moves()) {
    moving_now().by_others = false;
    moving_now().withdrawn = false;
    axis_.stop();
  }
  if (auto* armed = std::get_if<Armed>(&activity_)) {
    armed->stops = true;
    if (ended_by) armed->ended_by = std::move(ended_by);
  }
}

void Motor::rest() {
  if (autonomous_ || moved_by_other_) {
    activity_ = Local{};
  } else {
    activity_ = Resting{};
  }
}

bool Motor::stops_immediately(const bushd_report& report) const {
  return ((report.faults & BUSHD_FAULT_EMERGENCY) != 0 && setup_.emergency_stop_immediate) ||
         ((report.faults & BUSHD_FAULT_EMERGENCY_INPUT) != 0 && setup_.emergency_input_immediate);
}

// What has taken the power away says more than that the motor was stopped.
void Motor::uncertain_if_stopped_immediately(const bushd_report& report) {
  if (has_disabled_drivers(report)) {
    trust_.lose_steps(unpowered(report, setup_.mcu));
  } else if (stops_immediately(report)) {
    trust_.lose_steps(stopped_immediately(report, setup_.mcu));
  }
}

void Motor::take_limits(const bushd_report& report) {
  forbidden_up_ = has_bit(report.forbidden_positive, output());
  forbidden_down_ = has_bit(report.forbidden_negative, output());
}

// Positions are counts since the MCU's boot: a boot whose positions nobody has seen has lost them.
void Motor::goes_online(const bushd_report& report, bool first, bool restarted) {
  const std::int64_t before = std::exchange(position_, report.motor[output().value].position_steps);
  trust_.goes_online(report.boot_number);
  if (restarted) trust_.lose_steps("MCU " + setup_.mcu + " restarted");
  if (!first && !restarted) follow_count(before);
  // Nobody here has seen whether it moved when it was stopped.
  if (first || position_ != before) uncertain_if_stopped_immediately(report);
  take_limits(report);
  follow_autonomous(report, false);
}

void Motor::goes_offline(std::int64_t heard_utime_us, bool moved_by_people) {
  // What waits for a trigger may have had it, and people may use the inputs.
  const bool in_motion = !is<Resting>() || moved_by_people;
  trust_.goes_offline(heard_utime_us, in_motion);
  if (is<Local>()) activity_ = Resting{};
}

std::vector<Event> Motor::report(const Report& report) {
  std::vector<Event> events;
  const bool free = is<Resting>() || is<Local>();
  const std::int64_t before =
      std::exchange(position_, report.of_mcu.motor[output().value].position_steps);
  take_limits(report.of_mcu);
  if (has_plan()) follow(report, events);
  const bool by_itself = autonomous_ || has_bit(report.of_mcu.autonomous, output());
  // Whoever has asked for homing knows what the position of the motor is.
  if (by_itself) follow_count(before);
  if (is<InProgram>()) autonomous_ |= position_ != before;  // it may have begun and been cut since
  follow_autonomous(report.of_mcu, free && position_ != before);
  follow_asked_for();
  return events;
}

// Where it stands elsewhere, or people move it, what it was told before has ended.
void Motor::follow_asked_for() {
  if (!asked_for_ || has_plan()) return;
  if (autonomous_ || (is<Resting>() && asked_for_->whole != position_)) asked_for_.reset();
}

// No move has led to where it stands.
void Motor::follow_autonomous(const bushd_report& report, bool moved_without_plan) {
  const bool before = std::exchange(autonomous_, has_bit(report.autonomous, output()));
  // The MCU may still say so in the tick in which it was cut.
  if (before) uncertain_if_stopped_immediately(report);
  const bool free = is<Resting>() || is<Local>();
  // The bit alone may be that of a plan of this daemon's that has just ended.
  moved_by_other_ =
      free && has_bit(report.moving, output()) && (moved_by_other_ || moved_without_plan);
  if (free) rest();
}

void Motor::follow(const Report& report, std::vector<Event>& events) {
  const bool moving = has_bit(report.of_mcu.moving, output());
  if (is<Armed>() && !follow_armed(report, events)) return;
  if (has_bit(report.of_mcu.autonomous, output())) {
    // So it had no ticks of the move, and takes none.
    events.emplace_back(
        ended(Outcome::kStopped, "the local inputs of MCU " + setup_.mcu +
                                     " moved it before it could start; release them and move it "
                                     "again"));
    return;
  }
  if (report.of_mcu.faults != 0) {
    // The MCU takes no more ticks; what it has, it runs, and then down its own table.
    if (moves()) moving_now().faults |= report.of_mcu.faults;
    if (!moving) events.emplace_back(end_by_fault(report.of_mcu));
    return;
  }
  // It has not told of the emergency stop yet, with which its plan was given up.
  if (report.emergency_stop_open) return;
  Moving& now = moving_now();
  if (now.late && !moving && position_ == axis_.from_steps()) return;
  now.late = false;  // it moves all the same
  if (now.faults != 0) {
    // Another master has cleared them as soon as the motor stood.
    bushd_report before = report.of_mcu;
    before.faults = now.faults;
    if (!moving) events.emplace_back(end_by_fault(before));
    return;
  }
  if (now.limit == 0) {
    if (const auto change = axis_.executed(report.tick)) {
      events.emplace_back(event::Executed{*change});
    }
    notice_limit(report, events);
  }
  if (now.limit != 0) {
    if (moving || awaits_plan_at_limit(report)) return;
    if (!ends_by_plan_at_limit(report, events)) {
      events.emplace_back(end_at_limit());
      return;
    }
  }
  const std::int64_t planned = axis_.executed_steps();
  if (!now.position_mismatch && position_ != planned) {
    if (!moving && position_ == axis_.from_steps()) {
      // A motor at rest looks the same whether its start came and is over or never came.
      events.emplace_back(event::MissedStart{});
      return;
    }
    now.position_mismatch = true;
    trust_.lose_steps("MCU " + setup_.mcu + " counted position " + std::to_string(position_) +
                      " where the table leads to " + std::to_string(planned));
    if (report.other_master) {
      // It may go by that one's plan: a ramp-down from where it should be here would cross it.
      now.faults |= BUSHD_FAULT_LINK;
      events.emplace_back(event::Drop{});
      events.emplace_back(event::Mismatch{.stopped = false});
      return;
    }
    events.emplace_back(event::Mismatch{});
    axis_.stop();
  }
  follow_withdrawn();
  if (report.tick < axis_.over_tick()) {
    if (axis_.needs_change()) events.emplace_back(event::Replan{});
  } else if (now.position_mismatch) {
    if (!moving) events.emplace_back(end_by_fault(report.of_mcu));
  } else if (now.withdrawn) {
    if (!moving) events.emplace_back(event::MissedStart{});
  } else if (is<OnLine>()) {
    follow_end_of_line(report, events);
  } else {
    follow_end_of_run(report, events);
  }
}

// All motors of the line stand by now, for all that is planned.
void Motor::follow_end_of_line(const Report& report, std::vector<Event>& events) {
  OnLine& now = std::get<OnLine>(activity_);
  const bool there = axis_.line_planned_end() == axis_.line_target();
  if (there && now.last_run && !now.stands) {
    const bool stops = axis_.stopping() && !is_paused() && !now.by_others;
    const bool settles = !stops && report.tick < settled_from(axis_.over_tick());
    if (!settles) events.emplace_back(reached());
  } else if (is_paused()) {
    const bool stood = std::exchange(now.stands, true);
    pause_ = Pause::kStands;
    if (stood) return;
    if (now.resumes) {
      events.emplace_back(event::StandsOnLine{false});
    } else {
      events.emplace_back(event::Paused{});
    }
  } else if (axis_.stopping()) {
    events.emplace_back(stopped());
  } else if (!std::exchange(now.stands, true)) {
    events.emplace_back(event::StandsOnLine{there && now.to_point});
  }
}

// When it has stood for long enough, if its plan ends at `end`.
Tick Motor::settled_from(Tick end) const {
  return std::max(end, moving()->stood_since) + setup_.settle_ticks;
}

// It stands where its plan has led.
void Motor::follow_end_of_run(const Report& report, std::vector<Event>& events) {
  const bool there = position_ == axis_.target_steps();
  if (axis_.ran_out()) {
    events.emplace_back(ran_out());
  } else if (there && further_.empty()) {
    const bool stops = axis_.stopping() && !is_paused() && !moving_now().by_others;
    const bool settles = !stops && report.tick < settled_from(axis_.end_tick());
    if (!settles) events.emplace_back(reached());
  } else if (stands_paused()) {
    // Until it is resumed.
  } else if (is_paused()) {
    pause_ = Pause::kStands;
    events.emplace_back(event::Paused{});
  } else if (axis_.stopping()) {
    events.emplace_back(stopped());
  } else if (there) {
    events.emplace_back(event::NextLeg{});
  } else {
    // It was given a target that its table could not lead to without a rest.
    events.emplace_back(event::Turn{});
  }
}

// Returns whether the rest of the report is to be looked at: it has started, or a fault has put an
// end to it.
bool Motor::follow_armed(const Report& report, std::vector<Event>& events) {
  const bushd_report& mcu = report.of_mcu;
  const Armed armed = std::get<Armed>(activity_);
  const bool told = mcu.trigger_number == armed.number;
  if (told && mcu.trigger_state == BUSHD_TRIGGER_STARTED) {
    const Tick start = report.tick + static_cast<std::int32_t>(mcu.start_tick - mcu.tick);
    if (armed.on_line) {
      activity_ = *armed.on_line;
      LineShare share = *axis_.line();
      share.waits = false;
      axis_.start_line(axis_.from_steps(), share, start, axis_.shortest_delay(), mcu.start_ns);
    } else {
      activity_ = Moving{};
      axis_.start(axis_.from_steps(), armed.steps, start, mcu.start_ns, axis_.shortest_delay());
    }
    if (armed.stops) axis_.stop();
    moving_now().by_others = armed.stops && armed.ended_by.has_value();
    events.emplace_back(
        event::Started{.start = start, .late_ns = mcu.start_ns, .steps = armed.steps});
    return true;
  }
  if (mcu.faults != 0) return true;
  if (told && mcu.trigger_state == BUSHD_TRIGGER_ARMED && !armed.confirmed) {
    std::get<Armed>(activity_).confirmed = true;
    events.emplace_back(event::Waits{});
  }
  if (report.requests_open) return false;
  const std::string name = "MCU " + setup_.mcu;
  const bool refused_for_limit = !told && mcu.last_rejection == BUSHD_E_FORBIDDEN;
  if (refused_for_limit || (told && mcu.trigger_state == BUSHD_TRIGGER_FORBIDDEN)) {
    events.emplace_back(
        ended(Outcome::kLimit,
              "a limit switch forbids that direction, or that of another motor that waited with "
              "it; it did not move. Move that motor away from its switch, and arm again"));
  } else if (!told) {
    events.emplace_back(
        ended(Outcome::kFault,
              name + " did not arm it: " + bushd_status_text(mcu.last_rejection) +
                  "; 'bushctl status' tells how that MCU is, arm again when it is ready"));
  } else if (mcu.trigger_state == BUSHD_TRIGGER_DISARMED) {
    events.emplace_back(ended(Outcome::kStopped, !armed.ended_by
                                                     ? "disarmed before the trigger came"
                                                     : "disarmed, because " + *armed.ended_by));
  } else if (mcu.trigger_state == BUSHD_TRIGGER_LATE) {
    events.emplace_back(
        ended(Outcome::kFault,
              "the trigger came, but " + name +
                  " noticed it too late to begin in time; it did not move, arm it again"));
  } else if (mcu.trigger_state == BUSHD_TRIGGER_FAULT) {
    events.emplace_back(ended(Outcome::kFault,
                              "a fault of " + name + " disarmed it; 'bushctl status' tells which"));
  }
  return false;
}

// MCUs count in 32 bits, and go on at the other end: no motor makes so many steps between two
// reports. Nor may it stand beyond what can be set.
void Motor::follow_count(std::int64_t before) {
  if (std::abs(position_ - before) <= kMaxPosition && position_ >= -kMaxPosition) return;
  trust_.lose_steps("MCU " + setup_.mcu + " has moved it from " + std::to_string(before) +
                    " beyond +-" + std::to_string(kMaxPosition) +
                    " steps, where no more are counted");
}

}  // namespace bushd::motion
