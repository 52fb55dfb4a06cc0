// The part of the witness that is about motions: what is accepted, each run of it, and its end.
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

#include "witness.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;

// A daemon may not have heard for as long that a switch is active, and a move may take as long
// to its end.
constexpr bushd::sim::TimeNs kBarredNs = 40'000'000'000;

std::vector<std::string> names_of(const std::vector<api::MotorResult>& motors) {
  std::vector<std::string> names;
  for (const api::MotorResult& motor : motors) names.push_back(motor.motor);
  return names;
}

}  // namespace

bool Witness::End::agrees(const api::MotorResult& result) const {
  // One that stands, paused, may end by what happens to its MCU.
  const bool of_mcu =
      paused && (result.outcome == api::Outcome::kLink || result.outcome == api::Outcome::kFault);
  // It may be stopped where it stands on its way, on a line or before another leg.
  const bool on_way = (word == "turned" || legs_follow) && result.outcome == api::Outcome::kStopped;
  // It has missed its start, and may end before another one.
  const bool not_begun = word == "late" && result.outcome != api::Outcome::kReached;
  return (of_mcu || on_way || not_begun || word == api::word(result.outcome)) &&
         (moves_on || position_steps == result.position_steps);
}

void Witness::accepted(TimeNs now_ns, const Key& key, Asked& asked) {
  const Request& request = asked.request;
  check_limits(now_ns, asked);
  if (const auto wrong = arrivals_.accepted(request)) violated(now_ns, *wrong);
  if (request.ask == Ask::kEmergencyStop) beginnings_.emergency_stop(now_ns);
  if (request.is_stop()) stop_accepted(request);
  if (request.ask == Ask::kDisarm) disarm_accepted(request);
  if (request.ask == Ask::kPause || request.ask == Ask::kResume) pause_accepted(now_ns, request);
  if (request.ask == Ask::kHold || request.ask == Ask::kRelease) hold_accepted(request);
  if (request.ask == Ask::kConfigure) configure_accepted(asked);
  if (request.ask == Ask::kJog) return jog_accepted(now_ns, key, asked);
  if (request.ask == Ask::kPutProgram) return put_accepted(request);
  if (request.ask == Ask::kRunPrograms) return programs_accepted(now_ns, key, asked);
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    Motor& motor = *find(request.motors[i]);
    if (request.is_move() || request.ask == Ask::kHome) {
      accepted_motion(now_ns, key, asked, i);
    } else if (request.ask == Ask::kSetPosition) {
      leave_program(now_ns, motor, request);
      position_accepted(request, i);
      motor.set_ns = now_ns;
      motor.range.reset();
    } else if (request.ask == Ask::kConfirm) {
      positions_.may_be_confirmed(index_of(motor));
      motor.range.reset();
    }
  }
  if (request.is_move() && request.line) begin_way(asked);
}

void Witness::accepted_motion(TimeNs now_ns, const Key& key, Asked& asked, std::size_t i) {
  const Request& request = asked.request;
  Motor& motor = *find(request.motors[i]);
  const std::int64_t stands = plant_steps(motor);
  if (motor.held) violated(now_ns, motor.name + " is held, and may move: " + text_of(request));
  leave_program(now_ns, motor, request);
  motor.is_asked_for(now_ns);
  forget_unbegun(motor);
  std::optional<std::int64_t> target;
  if (request.ask == Ask::kMoveBy || request.ask == Ask::kArm) {
    const auto base = base_of(motor);
    if (base) target = *base + distance_asked(request, i);
  } else if (const auto position = position_asked(request, i);
             request.ask == Ask::kMoveTo && offset(motor) && position) {
    target = *offset(motor) + *position;
  }
  if (request.unknown_way) target.reset();
  // One that is stopped where it was paused may not have ended so far.
  const bool known = target && !(motor.move && motor.over && motor.stops);
  asked.legs.push_back(known ? legs_to(motor, request, *target) : std::vector<std::int64_t>());
  asked.leg.push_back(0);
  asked.target.push_back(target);
  asked.from.push_back(motor.moves() ? std::nullopt : std::optional(stands));
  asked.end.emplace_back();
  asked.first_step_ns.emplace_back();
  asked.began.push_back(request.ask != Ask::kArm);
  asked.told.push_back(false);
  asked.stops.push_back(false);
  // The trigger begins it before anybody tells; what came before is over.
  if (request.ask == Ask::kArm && on_run && on_run_end) {
    on_run(now_ns, motor.mcu, motor.output, {.on_line = request.line, .waited = false});
    if (request.line) on_run_end(now_ns, motor.mcu, motor.output, "stopped");
    if (request.line) {
      on_run(now_ns, motor.mcu, motor.output, {.on_line = true, .waited = false});
    }
  }
  if (is_shutter(motor) && request.client != ShutterModel::kClient) shutter_.disturbed();
  if (request.ask == Ask::kHome) {
    motor.move.reset();
    motor.range.reset();
    return positions_.may_be_homed(index_of(motor));
  }
  if (!motor.moves()) motor.range.reset();
  take_over(now_ns, motor, key, target);
  keep_within(now_ns, motor);
  if (target) steps_commanded_ += static_cast<std::uint64_t>(std::abs(*target - stands));
}

// What a relative move counts from, as the plant counts.
std::optional<std::int64_t> Witness::base_of(const Motor& motor) const {
  const bool rests = motor.over && !motor.pauses && !motor.goes_on;
  if (!motor.move || rests) return plant_steps(motor);
  // Nobody has told of several motors whether one that was to wait for the trigger still does. One
  // that rests may be paused, or have come to its end while others move.
  const bool waits = waits_for_trigger(motor);
  const bool of_several = asked_.at(*motor.move).request.motors.size() > 1;
  if (of_several && (motor.over || waits)) return std::nullopt;
  return motor.target;
}

// As the EPICS motor record does it. One that moves always makes both.
std::vector<std::int64_t> Witness::legs_to(const Motor& motor, const Request& request,
                                           std::int64_t target) const {
  const std::size_t index = index_of(motor);
  const std::int64_t backlash = units_.backlash_steps(index);
  const std::int64_t way = target - plant_steps(motor);
  const bool rests = !motor.moves();
  const bool straight = !request.points.empty() || request.trajectory != 0;
  if (straight || request.ask == Ask::kArm || backlash == 0 || (rests && way == 0)) return {target};
  const bool near =
      std::abs(way) <= std::abs(backlash) || !units_.approach_is_slower(index, request);
  if (rests && (way > 0) == (backlash > 0) && near) return {target};
  return {target - backlash, target};
}

// Precondition: it has a move. As far as anybody has told.
bool Witness::waits_for_trigger(const Motor& motor) const {
  const Asked& asked = asked_.at(*motor.move);
  return !asked.began.empty() && !asked.began[asked.index_of(motor.name)];
}

// One that has waited for the trigger in vain is at rest again before the others that waited with
// it have ended, and with them the move.
void Witness::forget_unbegun(Motor& motor) {
  if (motor.move && waits_for_trigger(motor)) motor.move.reset();
}

// A motor that moves belongs to the newest move; its part of the one before has ended.
void Witness::take_over(TimeNs now_ns, Motor& motor, const Key& by,
                        std::optional<std::int64_t> target) {
  // What its module asks for itself replaces only what a daemon that is gone was asked for.
  const bool by_module = std::get<1>(by) == Crates::kBushd2Client;
  if (is_of_module(motor) && !by_module) crates_.motor_taken(now_ns);
  if (motor.moves() || motor.stands_paused()) {
    Asked& before = asked_.at(*motor.move);
    before.end[before.index_of(motor.name)] = End{
        .word = "stopped", .position_steps = 0, .moves_on = true, .paused = motor.stands_paused()};
  }
  motor.run_from.reset();
  motor.move = by;
  motor.target = target;
  motor.over = motor.goes_on = motor.stops = motor.pauses = false;
  motor.idle_checks = 0;
}

// Soft limits hold for all that it does until something else is asked of it. One that moves
// may turn round, and first rest where it might have gone before.
void Witness::keep_within(TimeNs now_ns, Motor& motor) {
  const auto before = std::exchange(motor.range, std::nullopt);
  const auto limits = units_.limits(index_of(motor));
  if (!limits || !offset(motor) || !trusted(motor)) return;
  const std::int64_t stands = plant_steps(motor) - *offset(motor);
  const std::int64_t said = said_steps(motor);
  motor.range = Range{.low = std::min({limits->low, stands, said}) + *offset(motor),
                      .high = std::max({limits->high, stands, said}) + *offset(motor),
                      .since_ns = now_ns};
  if (!before) return;
  motor.range->low = std::min(motor.range->low, before->low);
  motor.range->high = std::max(motor.range->high, before->high);
}

// A fault with "; set: m01, m02; not set: m03" in its reason sets only those that it says.
void Witness::position_set(const Request& request, const api::Completed& completed) {
  std::string names = completed.reason;
  names.erase(0, std::min(names.find("; set: "), names.size()));
  names.erase(std::min(names.find("; not set: "), names.size()));
  const auto is_set = [&](const std::string& motor) {
    return completed.outcome == api::Outcome::kDone || names.find(motor) != std::string::npos;
  };
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    if (!is_set(request.motors[i])) continue;
    const std::size_t motor = index_of(*find(request.motors[i]));
    if (sets_offset(units_, motor, request)) continue;
    if (const auto set = position_asked(request, i)) positions_.was_set(motor, *set);
  }
}

void Witness::finished(TimeNs now_ns, const Key& key, const Asked& asked,
                       const api::Completed& completed) {
  const Request& request = asked.request;
  const bool done = completed.outcome == api::Outcome::kDone;
  if (request.ask == Ask::kSetPosition) position_set(request, completed);
  if (request.ask == Ask::kConfigure) configured(now_ns, asked, completed);
  if (request.ask == Ask::kPause) paused(now_ns, key, completed.reason);
  if (request.is_stop() && done) stop_is_done(asked, completed.reason);
  if (request.ask == Ask::kJog && asked.jog) jogged(now_ns, asked, completed);
  if (request.ask == Ask::kPutProgram) put_finished(request, completed);
  if (request.ask == Ask::kRunPrograms) programs_ended(now_ns, key, asked, completed);
  if (request.ask == Ask::kCamac) {
    crate_answered(now_ns, request, std::get<api::CamacResult>(completed.detail));
  }
  const bool homes = request.ask == Ask::kHome;
  if (homes || request.is_move()) {
    ++(homes ? homings_by_result_ : moves_by_result_)[std::string(word(completed.outcome))];
    const auto* motors = std::get_if<Motors>(&completed.detail);
    if (motors == nullptr || names_of(*motors) != request.motors) {
      return violated(now_ns, "a result of other motors: " + text_of(request));
    }
    if (homes) {
      homed(now_ns, asked, *motors);
    } else {
      moved(now_ns, asked, completed, *motors);
    }
  }
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    Motor* motor = find(request.motors[i]);
    if (motor == nullptr || motor->move != key) continue;
    motor->move.reset();
    const bool waited = request.ask == Ask::kArm && request.line && !asked.began[i];
    const auto* results = std::get_if<Motors>(&completed.detail);
    if (!waited || results == nullptr || !on_run_end) continue;
    // The trigger may have begun it, and nobody has told before its MCU was lost.
    on_run_end(now_ns, motor->mcu, motor->output, std::string(word((*results)[i].outcome)));
  }
}

// A stop that could not stop all; or what a stop has ended before it began.
void Witness::over_at_once(TimeNs now_ns, const Key& key, Asked& asked,
                           const api::Completed& completed) {
  if (asked.request.ends_motion()) {
    accepted(now_ns, key, asked);
    return finished(now_ns, key, asked, completed);
  }
  const auto says = [&completed](std::string_view part) {
    return completed.reason.find(part) != std::string::npos;
  };
  const bool rows = asked.request.ask == Ask::kRows && says("any more") && says("was stopped by");
  const bool stopped =
      completed.outcome == api::Outcome::kStopped && (rows || says("nothing has moved"));
  if (!stopped) violated(now_ns, "a result, and it was not accepted: " + text_of(asked.request));
  ++moves_by_result_["stopped before it began"];
}

void Witness::moved(TimeNs now_ns, const Asked& asked, const api::Completed& completed,
                    const Motors& motors) {
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const api::MotorResult& result = motors[i];
    const auto& end = asked.end[i];
    const auto& legs = asked.legs[i];
    // No line of the log tells how one that never began ended, and it can have reached nothing.
    const bool unbegun = asked.request.ask == Ask::kArm && !asked.began[i];
    if (unbegun && result.outcome != api::Outcome::kReached) continue;
    if (!end || !end->agrees(result)) {
      violated(now_ns, fmt::format("{} ended otherwise than its result says: {} at {}",
                                   result.motor, word(result.outcome), result.position_steps));
    } else if (result.outcome == api::Outcome::kReached && !legs.empty() &&
               (end->stands != legs.back() ||
                static_cast<std::size_t>(result.legs) != legs.size())) {
      violated(now_ns,
               fmt::format("{} is said to have reached its target in {} legs of {}, and "
                           "stands {} steps off",
                           result.motor, result.legs, legs.size(), end->stands - legs.back()));
    }
    if (completed.reason.starts_with(result.motor + ": stopped on request") && !asked.stops[i]) {
      violated(now_ns, "nobody has stopped it: " + completed.reason);
    }
  }
  check_way(now_ns, asked, completed);
  const auto wrong = starts_.check(asked.request, asked.first_step_ns);
  if (wrong) violated(now_ns, *wrong);
}

void Witness::homed(TimeNs now_ns, const Asked& asked, const Motors& motors) {
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const api::MotorResult& result = motors[i];
    if (result.outcome != api::Outcome::kReached) continue;
    const std::size_t motor = index_of(*find(result.motor));
    // Others of the request were homed after it, and it may have been set since.
    const bool set = motors_[motor].set_ns > asked.since_ns;
    const auto wrong = set ? std::nullopt : positions_.was_homed(motor, result.position_steps);
    if (wrong) violated(now_ns, *wrong);
    check_home_speed(now_ns, asked, i);
  }
}

void Witness::move_log(TimeNs now_ns, const std::string& json_line) {
  const nlohmann::json line = nlohmann::json::parse(json_line);
  if (line.at("event") == "autonomous") {
    const std::size_t index = index_of(*find(line.at("motor").get<std::string>()));
    if (line.at("set")) positions_.homed(index, line.at("position_steps"));
    return;
  }
  if (line.at("event") == "request") {
    return asked_by_module(now_ns, line.at("client"), line.at("request"),
                           line.at("motors").front());
  }
  const bool begins = line.at("event") == "move";
  const bool changes = line.at("event") == "stop" || line.at("event") == "retarget";
  if (!begins && !changes && line.at("event") != "result") return;
  Motor& motor = *find(line.at("motor").get<std::string>());
  if (changes) return run_changed(motor, line.at("tick"));
  if (begins && on_run) {
    const bool on_line =
        line.contains("line") || line.contains("path") || line.contains("trajectory");
    const bool waited = motor.move && waits_for_trigger(motor);
    on_run(now_ns, motor.mcu, motor.output, {.on_line = on_line, .waited = waited});
  }
  if (begins && motor.move) return run_begins(now_ns, motor);
  if (begins) return;
  if (on_run_end) on_run_end(now_ns, motor.mcu, motor.output, line.at("result"));
  if (!motor.move) return violated(now_ns, motor.name + " ended without a move");
  run_ended(now_ns, motor,
            {.word = line.at("result"), .position_steps = line.at("position_steps")});
}

void Witness::run_begins(TimeNs now_ns, Motor& motor) {
  Asked& asked = asked_.at(*motor.move);
  const std::size_t index = asked.index_of(motor.name);
  const bool waited = waits_for_trigger(motor);
  asked.began[index] = true;
  if (motor.over && !motor.goes_on) violated(now_ns, motor.name + " moves on after its end");
  motor.over = motor.goes_on = false;
  if (!asked.polyline.empty()) run_of_way_begins(now_ns, asked);
  // The trigger may have begun it a while ago.
  motor.run_from = waited ? asked.from[index] : plant_steps(motor);
  if (waited && asked.request.line) pause_with_others(motor, asked);
}

// Some motors of its line have begun earlier, and may be paused: it is, too.
void Witness::pause_with_others(Motor& motor, const Asked& asked) {
  for (const std::string& name : asked.request.motors) {
    const Motor& other = *find(name);
    if (other.move != motor.move || !other.pauses) continue;
    motor.pauses = true;
    motor.paused_by = other.paused_by;
  }
}

void Witness::run_ended(TimeNs now_ns, Motor& motor, End end) {
  Asked& asked = asked_.at(*motor.move);
  const std::size_t index = asked.index_of(motor.name);
  const auto& legs = asked.legs[index];
  std::size_t& leg = asked.leg[index];
  if (motor.over) return violated(now_ns, motor.name + " ended twice");
  motor.over = true;
  end.stands = plant_steps(motor);
  const bool on_way = end.word == "turned" && asked.request.line;
  end.paused = on_way || (end.word == "stopped" && motor.pauses);
  std::optional<std::int64_t> target;
  if (end.word == "reached" && !legs.empty()) target = legs[leg];
  check_end(now_ns, motor, asked, end, target);
  const auto& range = motor.range;
  const bool by_plan = end.word == "reached" || end.word == "turned";
  if (by_plan && range && second_ns_ < range->since_ns &&
      (end.stands < range->low || end.stands > range->high)) {
    violated(now_ns, motor.name + " has come to rest beyond its limits");
  }
  const bool exact = asked.request.ask != Ask::kArm;
  const bool late = end.word == "late";
  const bool planned =
      end.word == "reached" || end.word == "turned" || (end.word == "stopped" && exact);
  const auto& from = asked.from[index];
  // One that waited for the trigger and was stopped before its first step makes it in a streamed
  // tick, up to one late. Another daemon may have moved it since.
  const bool alone = second_ns_ < asked.since_ns;
  if (planned && alone && !asked.told[index] && from && end.stands != *from) {
    asked.first_step_ns[index] = plant_.first_step_ns(motor.mcu, motor.output);
  }
  if (!late) asked.told[index] = true;
  if (end.word == "reached") check_speed(now_ns, motor, asked, index);
  const bool last = leg + 1 >= legs.size();
  const bool unknown = legs.empty() && units_.backlash_steps(index_of(motor)) != 0;
  motor.goes_on = end.word == "turned" || late || (end.word == "reached" && (!last || unknown));
  end.legs_follow = end.word == "reached" && motor.goes_on;
  if (end.word == "reached" && last && !unknown) {
    check_approach(now_ns, motor, asked, index);
    check_settled(now_ns, motor, asked);
  }
  // A pause may come where a leg ends.
  const bool there = end.word == "reached" || (end.paused && !last && end.stands == legs[leg]);
  if (there && !last) ++leg;
  if (end.word != "stopped") motor.pauses = false;
  if (end.paused) ++times_paused_;
  if (is_of_shutter_module(motor) && !end.paused && !motor.goes_on) {
    asked.end[index] = std::move(end);
    motor.move.reset();
    return;
  }
  if (is_of_module(motor) && !end.paused && !motor.goes_on) {
    module_ended(now_ns, motor, end, legs.size() == 1 && asked.from[index] == motor.run_from);
  }
  asked.end[index] = std::move(end);
}

void Witness::check_end(TimeNs now_ns, const Motor& motor, const Asked& asked, const End& end,
                        std::optional<std::int64_t> target) {
  const std::int64_t stands = end.stands;
  const bool limited = end.word == "limit";
  const bool planned = end.word == "reached" || end.word == "stopped" || end.word == "turned" ||
                       end.word == "late" || limited;
  if (limited && (!motor.pressed_ns || now_ns - *motor.pressed_ns > kBarredNs)) {
    violated(now_ns, motor.name + " ended at its limit, and nobody has pressed its switch");
  } else if (end.word == "fault" && second_ns_ < asked.since_ns) {
    violated(now_ns, fmt::format("{} ended in fault at {}", motor.name, end.position_steps));
  } else if (end.word == "reached" && target && *target != stands) {
    violated(now_ns, fmt::format("{} is said to have reached its target, and stands {} steps off",
                                 motor.name, stands - *target));
  } else if (planned && offset(motor) && stands - *offset(motor) != end.position_steps) {
    violated(now_ns, fmt::format("{} {} at {}, but stands at {}", motor.name, end.word,
                                 end.position_steps, stands - *offset(motor)));
  }
}

}  // namespace bushfaults
