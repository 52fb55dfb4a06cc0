// How a motion ends, and what is said of that.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/output_bits.h"
#include "motion/motor.h"
#include "motion/report_words.h"
#include "words/remedy.h"

namespace bushd::motion {

// The way it goes is barred, and the MCU has not begun, or goes by a ramp of its own.
void Motor::notice_limit(const Report& report, std::vector<Event>& events) {
  // On a path or a trajectory it may have turned round since it came to its switch.
  int direction = axis_.direction();
  if (axis_.line() && axis_.line()->track) {
    if (!forbidden(direction)) direction = -direction;
    if (!forbidden(direction)) return;
  } else {
    if (axis_.goes(-direction) && forbidden(-direction)) direction = -direction;
    if (!forbidden(direction) || !axis_.goes(direction)) return;
  }
  const bool moving = has_bit(report.of_mcu.moving, output());
  const bool given_up =
      !moving && report.tick >= axis_.start_tick() && axis_.velocity_steps_per_s() != 0;
  // Its own ramp may be a step longer than what was planned.
  const bool outlasts = moving && report.tick >= axis_.end_tick();
  if (!given_up && !outlasts && axis_.executed_steps() == position_) return;
  moving_now().limit = direction;
  events.emplace_back(event::Drop{});
}

// It stands where it is to end, and nobody has stopped it: its limit switch ends nothing.
bool Motor::stands_at_target() const {
  return !stops() && further_.empty() && position_ == axis_.target_steps();
}

// Its MCU's own ramp was the shorter one. Who does not settle has ended.
bool Motor::awaits_plan_at_limit(const Report& report) const {
  const Tick over = axis_.over_tick();
  return stands_at_target() && report.tick < over && over <= report.tick + setup_.settle_ticks;
}

// Its MCU's own ramp, which may take a step longer, has led where its plan leads: it settles.
bool Motor::ends_by_plan_at_limit(const Report& report, std::vector<Event>& events) {
  if (!stands_at_target() || report.tick < axis_.over_tick()) return false;
  if (const auto change = axis_.executed(report.tick)) {
    events.emplace_back(event::Executed{*change});
  }
  if (axis_.executed_steps() != position_) return false;
  moving_now().limit = 0;
  moving_now().stood_since = report.tick;
  return true;
}

// It stands.
event::Ended Motor::end_at_limit() {
  if (stands_at_target()) return reached();
  if (stops() && !is_paused() && position_ == axis_.executed_steps()) {
    return stopped();
  }
  std::string reason =
      "stopped by " + switch_at(moving()->limit) + ", stands at " + std::to_string(position_);
  if (setup_.limit_immediate && position_ != axis_.from_steps()) {
    trust_.lose_steps("it was stopped immediately at its limit switch and may have overrun");
    reason += "; stopped immediately, it may have overrun, so check the position, and run " +
              words::set_remedy(name());
  }
  return ended(Outcome::kLimit, std::move(reason));
}

// It stands, and not by its plan.
event::Ended Motor::end_by_fault(const bushd_report& report) {
  // One that has not made a step, or stood, cannot overrun.
  const bool stepped = position_ != axis_.from_steps() && !rests_in_pause();
  const std::string mcu = "MCU " + setup_.mcu;
  if (moves() && moving()->position_mismatch) {
    return ended(Outcome::kFault, *trust_.uncertain_reason() + "; check the position, and run " +
                                      words::set_remedy(name()));
  }
  if ((report.faults & BUSHD_FAULT_OVERCURRENT) != 0 && !is<Armed>()) {
    const std::string why = mcu + " disabled its drivers because " + stop_cause(report);
    if (stepped) trust_.lose_steps(unpowered(report, setup_.mcu));
    return ended(Outcome::kFault,
                 stepped
                     ? why + "; check the position, and run " + words::set_remedy(name())
                     : "it did not move: " + why + "; find the cause, run 'bushctl clear', then " +
                           words::remedy("enable", name()));
  }
  constexpr unsigned kEmergencies =
      BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED;
  if ((report.faults & kEmergencies) != 0) {
    const std::string by = stopper(report, setup_.mcu);
    const bool disabled = has_disabled_drivers(report);
    const bool overran = (disabled || stops_immediately(report)) && stepped;
    if (!overran) return ended(Outcome::kStopped, "stopped by " + by);
    uncertain_if_stopped_immediately(report);
    return ended(Outcome::kStopped, "stopped immediately by " + by +
                                        (disabled ? ", which disabled its drivers" : "") +
                                        "; it may have overrun, so check the position, and run " +
                                        words::set_remedy(name()));
  }
  if (is<Armed>()) {
    return ended(Outcome::kLink, mcu + " disarmed it by itself because " + stop_cause(report));
  }
  return ended(Outcome::kLink, mcu + " ran it down by itself because " + stop_cause(report));
}

// Its MCU was told too late.
void Motor::follow_withdrawn() {
  if (!is_withdrawn(*this) || position_ == axis_.from_steps()) return;
  moving_now().withdrawn = false;
  if (is<OnLine>()) {
    moving_now().by_others = true;
  } else {
    axis_.aim(axis_.target_steps(), axis_.shortest_delay());
  }
}

std::optional<event::Ended> Motor::end(Outcome outcome, std::string reason) {
  if (!has_plan()) return std::nullopt;
  return ended(outcome, std::move(reason));
}

event::Ended Motor::ended(Outcome outcome, std::string reason) {
  const bool was_armed = is<Armed>();
  const OnLine* on_line = as<OnLine>();
  const bool was_paused = rests_in_pause() || (on_line != nullptr && on_line->stands);
  further_.clear();
  pause_ = Pause::kNo;
  jogs_ = false;
  axis_.finish();
  rest();
  return {.outcome = outcome,
          .reason = std::move(reason),
          .was_armed = was_armed,
          .was_paused = was_paused};
}

event::Ended Motor::reached() {
  event::Ended event = ended(Outcome::kReached, "stands at its target");
  event.by_plan = true;
  return event;
}

event::Ended Motor::ran_out() {
  event::Ended event = ended(
      Outcome::kStopped, axis_.trajectory()->trajectory->closed()
                             ? "its trajectory ended in motion; ramped down by its table"
                             : "no further rows of its trajectory came; ramped down by its table");
  event.by_plan = true;
  return event;
}

event::Ended Motor::stopped() {
  const bool by_others = is<OnLine>() && moving_now().by_others;
  event::Ended event =
      ended(Outcome::kStopped,
            by_others ? "ramped down with the others of its line" : "stopped on request");
  event.by_plan = true;
  return event;
}

}  // namespace bushd::motion
