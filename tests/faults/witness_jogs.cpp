// The part of the witness that is about jogs, pauses, holds and settings.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "times.h"
#include "witness.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;
using bushd::sim::TimeNs;

// The longest ramp, and all that may keep the daemon from it: the line, its own pauses.
constexpr TimeNs kJogOverNs = 12 * kSecond;
// A move of the random clients lasts some seconds, the longest fault ten, and then a link is given
// up within one.
constexpr TimeNs kResultDueNs = 40 * kSecond;
// Until no request waits to be carried out; daemons pause in between.
constexpr TimeNs kTurnDueNs = 15 * kSecond;
// Checks, a second apart. An MCU that has heard nothing for long has come to rest by then.
constexpr int kIdleChecks = 4;
// Between the tick in which the daemon takes the event to be and what the plant has done by then:
// at 2500 steps/s, in the latency of the worst adapter, by which a daemon may misjudge the bus's
// time, and two ticks.
constexpr std::int64_t kEventSteps = 60;
// What an MCU does that hears nobody: an edge that comes within a second is taken, its motor begins
// after at most 1.65 s, and ramps down from there, at most as long as the longest delay and the
// ramp of the slowest table here.
constexpr TimeNs kSilentAfterNs = 5 * kSecond;

}  // namespace

bool Witness::concerns(const Request& request, const Motor& motor) const {
  if (request.names_or_all(motor.name)) return true;
  if (motor.program) {
    // What is asked of one motor of a program is asked of all.
    const auto& programs = asked_.at(*motor.program).request;
    return std::ranges::any_of(motors_, [&](const Motor& other) {
      return other.mcu == motor.mcu && programs.names(other.name) && request.names(other.name);
    });
  }
  if (!motor.move || !asked_.at(*motor.move).request.line) return false;
  return std::ranges::any_of(motors_, [&](const Motor& other) {
    return other.move == motor.move && request.names(other.name);
  });
}

void Witness::stop_accepted(const Request& request) {
  for (Motor& motor : motors_) {
    if (request.ask == Ask::kStop && !concerns(request, motor)) continue;
    motor.target.reset();
    motor.stops = true;
    motor.pauses = false;
    if (is_of_module(motor) && motor.over) crates_.motion_ended(false);
    if (!motor.move) continue;
    Asked& asked = asked_.at(*motor.move);
    asked.stops[asked.index_of(motor.name)] = true;
  }
}

// What it names stands, unless it says otherwise, and makes no step until somebody asks for one.
void Witness::stop_is_done(const Asked& asked, const std::string& reason) {
  for (const char* otherwise : {"unknown", "lost", "new target", "not waited for"}) {
    if (reason.find(otherwise) != std::string::npos) return;
  }
  for (Motor& motor : motors_) {
    const bool named =
        asked.request.ask == Ask::kEmergencyStop || asked.request.names_or_all(motor.name);
    if (!named || is_shutter(motor) || motor.asked_ns >= asked.since_ns) continue;
    if (motor.program_may_go_on) continue;
    motor.stopped_at = plant_steps(motor);
  }
}

// Where some of a line wait no more, those that have begun are stopped.
void Witness::disarm_accepted(const Request& request) {
  for (const Motor& motor : motors_) {
    if (!motor.move || !concerns(request, motor)) continue;
    Asked& asked = asked_.at(*motor.move);
    const bool waits = asked.request.ask == Ask::kArm && asked.request.line;
    if (waits) asked.stops[asked.index_of(motor.name)] = true;
  }
}

// What is being stopped, and what waits for the trigger, is left alone. Jogs end.
void Witness::pause_accepted(TimeNs now_ns, const Request& request) {
  for (Motor& motor : motors_) {
    if (!concerns(request, motor)) continue;
    if (motor.program && request.ask == Ask::kResume) motor.is_asked_for(now_ns);
    if (motor.program) motor.stops |= request.ask == Ask::kPause;  // one that has not begun ends
    if (!motor.move) continue;
    Asked& asked = asked_.at(*motor.move);
    if (request.ask == Ask::kResume) {
      motor.is_asked_for(now_ns);
      if (std::exchange(motor.pauses, false)) motor.goes_on |= motor.over;
      asked.due_since_ns = now_ns;
    } else if (asked.jog) {
      motor.stops = true;
    } else if (!motor.over && !motor.stops && asked.began[asked.index_of(motor.name)]) {
      motor.pauses = true;
      motor.paused_by = key_of(request.id());
    }
  }
}

void Witness::paused(TimeNs now_ns, const Key& key, const std::string& reason) {
  if (reason.find("not waited for") != std::string::npos) return;
  // "paused: 1 motor; not paused, at their targets: m13, m14"
  const std::size_t left = reason.find("not paused");
  for (Motor& motor : motors_) {
    if (motor.paused_by != key || !motor.pauses || !motor.moves()) continue;
    if (left != std::string::npos && reason.find(motor.name, left) != std::string::npos) {
      motor.pauses = false;
      continue;
    }
    // If another one of its line does not go on, all ramp down for good.
    if (asked_.at(*motor.move).request.line) continue;
    violated(now_ns, motor.name + " is said to be paused, and moves");
  }
}

void Witness::hold_accepted(const Request& request) {
  for (Motor& motor : motors_) {
    if (!request.names_or_all(motor.name)) continue;
    motor.held = request.ask == Ask::kHold;
    motor.held_by = key_of(request.id());
    motor.held_on_disk = false;
    motor.held_at.reset();
    motor.idle_checks = 0;
    if (!motor.held || !motor.move) continue;
    // What waits for the trigger waits no more, and is stopped if that has come.
    Asked& asked = asked_.at(*motor.move);
    const std::size_t i = asked.index_of(motor.name);
    if (asked.request.ask != Ask::kArm || asked.began[i]) continue;
    asked.stops[i] = true;
    motor.stops = true;
    motor.target.reset();
  }
}

// It outlives the daemon, if that has a store.
void Witness::hold_done(const Key& key, const api::Completed& result) {
  for (Motor& motor : motors_) {
    if (motor.held && motor.held_by == key) {
      motor.held_on_disk = result.outcome == api::Outcome::kDone;
    }
  }
}

Witness::Asked* Witness::open_jog(const Motor& motor) {
  if (!motor.move) return nullptr;
  Asked& asked = asked_.at(*motor.move);
  return asked.jog ? &asked : nullptr;
}

void Witness::jog_accepted(TimeNs now_ns, const Key& key, Asked& asked) {
  const Request& request = asked.request;
  Motor& motor = *find(request.motors.front());
  Asked* open = open_jog(motor);
  const bool own = open != nullptr && open->request.client == request.client;
  if (request.renew && !own) return violated(now_ns, "renewed without a jog: " + text_of(request));
  if (request.renew) {
    open->jog->renewed_ns = now_ns;
    return;
  }
  if (request.speed_micro == 0) {
    if (open == nullptr) return;
    motor.stops = true;
    open->jog->let_go |= own;
    if (open->jog->ends_after) return;  // that is not put off
    open->jog->ends_after = request.steps_after;
    open->jog->ends_from = plant_steps(motor);
    return;
  }
  if (motor.held) violated(now_ns, motor.name + " is held, and jogs: " + text_of(request));
  const std::int64_t shortest_delay_ns = units_.shortest_delay_ns(index_of(motor), request);
  if (own) {
    motor.stops = false;
    open->jog->let_go = false;
    open->jog->ends_after.reset();
    open->jog->renewed_ns = now_ns;
    open->jog->keepalive_ms = request.keepalive_ms;
    open->jog->shortest_delay_ns = std::min(open->jog->shortest_delay_ns, shortest_delay_ns);
    return keep_within(now_ns, motor);
  }
  asked.jog = JogOpen{.renewed_ns = now_ns,
                      .keepalive_ms = request.keepalive_ms,
                      .shortest_delay_ns = shortest_delay_ns};
  accepted_motion(now_ns, key, asked, 0);
}

void Witness::jogged(TimeNs now_ns, const Asked& asked, const api::Completed& completed) {
  ++jogs_by_result_[std::string(word(completed.outcome))];
  const auto* motors = std::get_if<Motors>(&completed.detail);
  if (motors == nullptr || motors->size() != 1 ||
      motors->front().motor != asked.request.motors.front()) {
    return violated(now_ns, "a result of other motors: " + text_of(asked.request));
  }
  const api::MotorResult& result = motors->front();
  const auto& end = asked.end.front();
  if (!end || (!end->moves_on && end->position_steps != result.position_steps)) {
    return violated(now_ns, fmt::format("{} ended otherwise than its result says: {} at {}",
                                        result.motor, word(result.outcome), result.position_steps));
  }
  // One that is late may be ended before it begins anew.
  const bool late = end->word == "late" && result.outcome != bushd::api::Outcome::kReached;
  const bool planned = end->word == "reached" || end->word == "stopped" || late;
  if (!planned && end->word != word(result.outcome)) {
    violated(now_ns, result.motor + " ended by " + end->word + ": " + completed.reason);
  }
  if (!end->moves_on) check_jog_end(now_ns, *find(result.motor), asked, completed);
}

// "m03: stands 100 steps after the stop event at 12.5 mm": it has made as many as that, from where
// it was when that was asked for.
void Witness::check_steps_after(TimeNs now_ns, const Motor& motor, const Asked& asked,
                                const std::string& reason) {
  constexpr std::string_view kAfter = " steps after the stop event at ";
  const auto at = reason.find(kAfter);
  if (at == std::string::npos || reason.find(": stands ") == std::string::npos) return;
  const JogOpen& jog = *asked.jog;
  const std::int64_t stands = asked.end.front()->stands;
  const std::int64_t since = std::abs(stands - jog.ends_from);
  const double from_user = std::stod(reason.substr(at + kAfter.size()));
  const auto from = units_.steps_of_position(index_of(motor), std::llround(from_user * 1'000'000));
  const std::int64_t made = from && offset(motor) ? std::abs(stands - *offset(motor) - *from)
                                                  : jog.ends_after.value_or(0);
  if (made == jog.ends_after && std::abs(since - made) <= kEventSteps) return;
  violated(now_ns, fmt::format("it made {} steps, and {} since it was asked to end: {}", made,
                               since, reason));
}

void Witness::check_jog_end(TimeNs now_ns, const Motor& motor, const Asked& asked,
                            const api::Completed& completed) {
  const JogOpen& jog = *asked.jog;
  const End& end = *asked.end.front();
  const std::string& reason = completed.reason;
  const auto limits = units_.limits(index_of(motor));
  if (reason.find("stands at its soft limit") != std::string::npos && offset(motor)) {
    const std::int64_t at = end.stands - *offset(motor);
    if (!limits || (at != limits->low && at != limits->high)) {
      violated(now_ns, fmt::format("it stands at {}, where no limit is: {}", at, reason));
    }
  }
  if (reason.find("has not renewed it") != std::string::npos &&
      now_ns < jog.renewed_ns + jog.keepalive_ms * kMs) {
    violated(now_ns, "it was renewed in time: " + reason);
  }
  if (completed.outcome == api::Outcome::kDone && !jog.let_go) {
    violated(now_ns, "its client has not let go: " + reason);
  }
  if (reason.find("stopped on request") != std::string::npos && !motor.stops) {
    violated(now_ns, "nobody has stopped it: " + reason);
  }
  check_steps_after(now_ns, motor, asked, reason);
  const auto& from = asked.from.front();
  const std::int64_t most =
      (now_ns - asked.since_ns) / std::max<std::int64_t>(jog.shortest_delay_ns, 1);
  if (from && std::abs(end.stands - *from) > most + most / 1000 + 1) {
    violated(now_ns, fmt::format("{} jogged {} steps, and {} are possible in that time", motor.name,
                                 std::abs(end.stands - *from), most));
  }
}

void Witness::configure_accepted(Asked& asked) {
  const Request& request = asked.request;
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    Motor& motor = *find(request.motors[i]);
    asked.changes.push_back(units_.configured(index_of(motor), request.settings[i]));
    motor.range.reset();
  }
  for (const std::string& name : request.motors) {
    const Motor& motor = *find(name);
    const auto limits = units_.limits(index_of(motor));
    // Nothing is said of one that is not online.
    const auto& state = states_[motor.mcu];
    const bool known = trusted(motor) && offset(motor) && state->state != api::McuState::kOffline &&
                       state->state != api::McuState::kBusy;
    const std::int64_t at = known ? plant_steps(motor) - *offset(motor) : 0;
    const bool outside = limits && (at < limits->low || at > limits->high);
    asked.outside.push_back(known ? std::optional(outside) : std::nullopt);
  }
}

// What has been said to be done is found by a daemon that starts.
void Witness::configured(TimeNs now_ns, const Asked& asked, const api::Completed& completed) {
  const Request& request = asked.request;
  const bool told = completed.reason.find("beyond its soft limits") != std::string::npos;
  const auto outside = [](const auto& one) { return one == true; };
  const bool unknown = std::ranges::any_of(asked.outside, [](const auto& one) { return !one; });
  if (!unknown && told != std::ranges::any_of(asked.outside, outside)) {
    violated(now_ns, "whether it stands beyond its limits: " + completed.reason);
  }
  if (completed.outcome != api::Outcome::kDone) return;  // the disk has not taken it
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    units_.is_on_disk(index_of(*find(request.motors[i])), asked.changes[i]);
  }
}

void Witness::watch(TimeNs now_ns) {
  watch_ways();
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    Motor& motor = motors_[i];
    const std::int64_t stands = plant_steps(motor);
    const bool alone = goes_on_alone(motor);
    const auto wrong = beginnings_.watch(now_ns, i, stands, alone);
    if (wrong) violated(now_ns, motor.name + *wrong);
    const bool moved = std::exchange(motor.watched_at, stands) != stands;
    if (!moved || alone || now_ns - heard_ns_[motor.mcu] <= kSilentAfterNs) continue;
    violated(now_ns, motor.name + " moves, and its MCU has heard nobody for long");
  }
  const bool second = second_ns_ >= 0 && now_ns - second_ns_ < 5 * kSecond;
  for (Motor& motor : motors_) {
    if (second) motor.held_at.reset();
    if (second) motor.stopped_at.reset();
    const std::int64_t stands = plant_steps(motor);
    if (motor.range && second_ns_ < motor.range->since_ns &&
        (stands < motor.range->low - motor.own_ramp_excess ||
         stands > motor.range->high + motor.own_ramp_excess)) {
      violated(now_ns, fmt::format("{} is at {}, and its limits are {} and {}, in steps since the "
                                   "beginning",
                                   motor.name, stands, motor.range->low, motor.range->high));
    }
    if (motor.stopped_at && *motor.stopped_at != stands) {
      violated(now_ns, fmt::format("{} is said to be stopped, at {}, and moves to {}", motor.name,
                                   *motor.stopped_at, stands));
    }
    if (motor.held_at && *motor.held_at != stands) {
      violated(now_ns, fmt::format("{} is held at {}, and moves to {}", motor.name, *motor.held_at,
                                   stands));
    }
    if (!motor.stands_paused() || second) continue;
    const Asked& asked = asked_.at(*motor.move);
    const auto& end = asked.end[asked.index_of(motor.name)];
    if (end && end->stands == stands) continue;
    violated(now_ns, motor.name + " is paused, and moves");
  }
}

void Witness::check_deadline(TimeNs now_ns, const Key& key, Asked& asked) {
  const Request& request = asked.request;
  for (const std::string& name : request.motors) {
    Motor* motor = find(name);
    if (motor == nullptr || motor->move != key) continue;
    motor->idle_checks = -1;
    if (motor->pauses) asked.due_since_ns = now_ns;
  }
  if (request.ask == Ask::kHome) {
    for (const std::string& name : request.motors) {
      if (Motor* motor = find(name)) motor->idle_checks = -1;
    }
  }
  if (request.may_wait()) return;
  if (asked.jog) {
    if (now_ns - asked.jog->renewed_ns <= asked.jog->keepalive_ms * kMs + kJogOverNs) return;
    return violated(now_ns, "its client is dead, and it goes on: " + text_of(request));
  }
  if (now_ns - asked.due_since_ns <= kResultDueNs) return;
  violated(now_ns, fmt::format("no {} after {} s: {}", asked.accepted ? "result" : "reply",
                               kResultDueNs / kSecond, text_of(request)));
}

void Witness::check_deadlines(TimeNs now_ns) {
  for (auto& [key, asked] : asked_) {
    if (!asked.finished) check_deadline(now_ns, key, asked);
  }
  for (Motor& motor : motors_) {
    ++motor.idle_checks;
    if (motor.program || motor.program_may_go_on) motor.idle_checks = 0;
    if (is_of_module(motor) && motor.pauses) crates_.wait_since(now_ns);
    if (motor.held && !motor.held_at && motor.idle_checks > kIdleChecks) {
      motor.held_at = plant_steps(motor);
    }
    if (motor.idle_checks == 0) motor.held_at.reset();
  }
  if (const auto wrong = crates_.check_deadline(now_ns)) violated(now_ns, *wrong);
  if (const auto wrong = shutter_.check_deadline(now_ns)) violated(now_ns, *wrong);
  if (!promise_.waits()) none_waits_ns_ = now_ns;
  if (now_ns - none_waits_ns_ > kTurnDueNs) violated(now_ns, "requests wait for their turn");
}

}  // namespace bushfaults
