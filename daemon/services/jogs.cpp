#include "daemon/services/jogs.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "daemon/services/allowed.h"

namespace bushd::daemon {
namespace {

constexpr std::size_t kMostWaiting = 16;  // for the end of one jog

std::string ms_text(std::int64_t us) {
  return std::to_string(us / 1000) + " ms";
}

// Checks a request that begins, changes or renews a jog. What ends one is not refused for any of
// it.
Result<void> in_range(const api::Jog& request) {
  using Jog = api::Jog;
  if (request.per_s == 0 && !request.renew) return {};
  if (!Jog::kKeepaliveMs.has(request.keepalive_ms)) {
    return fail("keepalive time of " + std::to_string(request.keepalive_ms) + " ms" +
                allowed(Jog::kKeepaliveMs) + " ms");
  }
  if (!request.steps_after) return {};
  return fail("steps after the stop event belong to the request that ends the jog, of speed 0");
}

Result<void> check_steps_after(std::int64_t steps) {
  if (api::Jog::kStepsAfter.has(steps)) return {};
  return fail(std::to_string(steps) + " steps after the stop event" +
              allowed(api::Jog::kStepsAfter));
}

}  // namespace

void Jogs::request(std::int64_t now_us, const api::Asker& asker, const api::Jog& request) {
  const auto motor = installation_.find(request.motor);
  if (!motor) return asker.answer(api::Refused{motor.error().text()});
  if (const auto good = in_range(request); !good) {
    return asker.answer(api::Refused{request.motor + ": " + good.error().text()});
  }
  step(now_us);
  if (request.renew) return renew(now_us, asker, *motor);
  if (request.per_s == 0) return end(now_us, asker, *motor, request);
  run(now_us, asker, *motor, request);
}

bool Jogs::would_take(const api::Jog& request) const {
  const auto motor = installation_.find(request.motor);
  return motor && in_range(request) && course_of(*motor, request);
}

// Whoever holds a key pressed does not notice that others have stopped the motor: it stays at rest.
Result<void> Jogs::may_jog(std::int64_t now_us, MotorId motor, const api::Asker& asker) {
  for (Barred& barred : barred_) {
    if (barred.motor != motor || !barred.client.is_same_client(asker)) continue;
    barred.until_us = now_us + barred.keepalive_us;
    return fail("its jog was ended by others; let go first: send speed 0, or nothing for " +
                ms_text(barred.keepalive_us));
  }
  if (asker.session && asker.session->gone()) return fail("its client has gone");
  return interlocks_.may_move(motor);
}

Result<Jogs::Course> Jogs::course_of(MotorId id, const api::Jog& request) const {
  const motion::Motor& motor = installation_[id];
  const auto shortest_delay = motor.reach().shortest_delay_at(
      api::Speed{.per_s = std::abs(request.per_s), .in_steps = request.in_steps});
  if (!shortest_delay) return fail(shortest_delay.error());
  const bool mirrored = !request.in_steps && motor.scale().coordinates().scale().negative;
  const int direction = (request.per_s > 0) != mirrored ? 1 : -1;
  const std::int64_t target = motor.reach().farthest(direction, *shortest_delay);
  // Beyond it, one that moves back would turn round.
  const bool beyond = !motor.reach().stands_within_soft_limits();
  if (target == motor.position_steps() && (beyond || !motor.has_plan())) {
    return fail("stands at or beyond its soft limit, at " +
                motor.scale().coordinates().text(motor.position_steps()) +
                "; jog it the other way");
  }
  if (const auto may = motor.reach().may_move_to(target, *shortest_delay); !may)
    return fail(may.error());
  return Course{.direction = direction, .target = target, .shortest_delay = *shortest_delay};
}

void Jogs::run(std::int64_t now_us, const api::Asker& asker, MotorId id, const api::Jog& request) {
  const std::string& name = installation_[id].name();
  auto may = may_jog(now_us, id, asker);
  const auto course = may ? course_of(id, request) : fail(may.error());
  if (!course) return asker.answer(api::Refused{name + ": " + course.error().text()});
  const std::int64_t keepalive_us = request.keepalive_ms * 1000;
  const auto found = jogs_.find(id);
  if (found != jogs_.end() && found->second.opened_by.is_same_client(asker)) {
    if (is_stopped_by_others(id, found->second)) {
      return asker.answer(api::Refused{name + ": it is being stopped; wait for that result"});
    }
    found->second.keepalive_us = keepalive_us;
    return change(now_us, asker, id, *course);
  }
  asker.answer(api::Accepted{});
  moves_.jog(now_us, asker, id, course->target, course->shortest_delay);
  step(now_us);  // what it was doing has ended
  jogs_.insert_or_assign(id, Jog{.opened_by = asker,
                                 .renewed_by = asker,
                                 .keepalive_us = keepalive_us,
                                 .until_us = now_us + keepalive_us,
                                 .course = *course});
  say_limit(id);
}

void Jogs::say_limit(MotorId id) {
  const std::string at = installation_[id].scale().coordinates().text(jogs_.at(id).course.target);
  open_.say(id, api::Outcome::kReached,
            {.outcome = api::Outcome::kLimit,
             .reason = installation_[id].scale().soft_limits()
                           ? "stands at its soft limit, " + at
                           : "stands where its jog must end, at " + at});
}

void Jogs::change(std::int64_t now_us, const api::Asker& asker, MotorId id, const Course& course) {
  Jog& jog = jogs_.at(id);
  jog.renewed_by = asker;
  jog.until_us = now_us + jog.keepalive_us;
  for (const api::Asker& waiting : std::exchange(jog.waiting, {})) {
    waiting.answer(api::Completed{.outcome = api::Outcome::kStopped,
                                  .reason = installation_[id].name() + " jogs on",
                                  .detail = {}});
  }
  const bool again = std::exchange(jog.ends, false);
  jog.let_go = false;
  jog.after.reset();
  const bool same = course.direction == jog.course.direction &&
                    course.shortest_delay == jog.course.shortest_delay;
  asker.answer(api::Accepted{});
  if (!same || again) {
    jog.course = course;
    say_limit(id);
    open_.unsay(id, api::Outcome::kStopped);
    moves_.redirect(now_us, id, course.target, course.shortest_delay);
  }
  asker.answer(api::done(installation_[id].name() + (same && !again ? ": renewed" : ": changed")));
}

void Jogs::renew(std::int64_t now_us, const api::Asker& asker, MotorId id) {
  const auto found = jogs_.find(id);
  const bool own = found != jogs_.end() && found->second.opened_by.is_same_client(asker);
  if (!own || found->second.ends || is_stopped_by_others(id, found->second)) {
    static_cast<void>(may_jog(now_us, id, asker));  // it still holds its key
    return asker.answer(
        api::Refused{installation_[id].name() + ": no jog of this client is under way"});
  }
  Jog& jog = found->second;
  jog.renewed_by = asker;
  jog.until_us = now_us + jog.keepalive_us;
  asker.answer(api::Accepted{});
  // Without a limit it ends where a run is as long as it may be; but not as long as it is renewed.
  const motion::Motor& motor = installation_[id];
  const std::int64_t farthest =
      motor.reach().farthest(jog.course.direction, jog.course.shortest_delay);
  if (std::abs(farthest - jog.course.target) >
      std::abs(jog.course.target - motor.position_steps())) {
    jog.course.target = farthest;
    say_limit(id);
    moves_.redirect(now_us, id, farthest, jog.course.shortest_delay);
  }
  asker.answer(api::done(motor.name() + ": renewed"));
}

void Jogs::end(std::int64_t now_us, const api::Asker& asker, MotorId id, const api::Jog& request) {
  std::erase_if(barred_, [&](const Barred& barred) {
    return barred.motor == id && barred.client.is_same_client(asker);
  });
  asker.answer(api::Accepted{});
  const auto found = jogs_.find(id);
  const std::string& name = installation_[id].name();
  const auto good = request.steps_after ? check_steps_after(*request.steps_after) : Result<void>();
  const auto answer_now = [&](const std::string& what) {
    asker.answer(good ? api::done(name + " " + what)
                      : api::Completed{.outcome = api::Outcome::kFault,
                                       .reason = name + ": " + good.error().text() + "; it " + what,
                                       .detail = {}});
  };
  if (found == jogs_.end()) return answer_now("does not jog");
  Jog& jog = found->second;
  if (!good) answer_now("is ramped down at once");
  if (good && jog.waiting.size() >= kMostWaiting) {
    jog.waiting.front().answer(api::done("carried out; its end is not waited for"));
    jog.waiting.erase(jog.waiting.begin());
  }
  if (good) jog.waiting.push_back(asker);
  // What is done at once is not put off.
  if (is_stopped_by_others(id, jog) || (jog.ends && !jog.after)) return;
  const bool own = jog.opened_by.is_same_client(asker);
  jog.ends = true;
  jog.let_go = own;
  const OpenMoves::Saying ended{own ? api::Outcome::kDone : api::Outcome::kStopped,
                                own ? "ended by its client" : "ended by " + text_of(asker)};
  if (good && request.steps_after && !jog.after)
    return end_after(now_us, id, *request.steps_after, ended);
  jog.after.reset();
  ramp_down(now_us, id, ended);
}

void Jogs::end_after(std::int64_t now_us, MotorId id, std::int64_t steps,
                     const OpenMoves::Saying& ended) {
  Jog& jog = jogs_.at(id);
  const motion::Motor& motor = installation_[id];
  const motion::Axis& axis = motor.axis();
  const motion::Tick now = installation_.bus_of(installation_.mcu_of(id)).master.tick_at(now_us);
  const int direction = axis.direction();
  const std::int64_t from = axis.steps_at(now);
  const std::int64_t target = from + direction * steps;
  const std::string after = std::to_string(steps) + " steps after the stop event at " +
                            motor.scale().coordinates().text(from);
  if (now < axis.start_tick()) {
    return ramp_down(now_us, id, {ended.outcome, ended.reason + " before it began"});
  }
  if ((motor.reach().farthest(direction, jog.course.shortest_delay) - target) * direction < 0) {
    return ramp_down(
        now_us, id,
        {api::Outcome::kStopped, after + " would be beyond its soft limit; ramped down at once"});
  }
  jog.after = Jog::After{.steps = steps, .from = from};
  jog.course.target = target;
  const bool own = jog.let_go;
  open_.say(id, api::Outcome::kReached,
            {ended.outcome, "stands " + after + (own ? "" : ", " + ended.reason)});
  open_.unsay(id, api::Outcome::kStopped);
  moves_.redirect(now_us, id, target, jog.course.shortest_delay);
}

void Jogs::ramp_down(std::int64_t now_us, MotorId id, OpenMoves::Saying saying) {
  open_.say(id, api::Outcome::kStopped, std::move(saying));
  moves_.stop(now_us, {id});
}

bool Jogs::is_open(MotorId id, const Jog& jog) const {
  const api::Asker* by = open_.asker_of(id);
  return by != nullptr && by->session == jog.opened_by.session &&
         by->number == jog.opened_by.number;
}

bool Jogs::is_stopped_by_others(MotorId id, const Jog& jog) const {
  return installation_[id].stops() && !jog.ends;
}

void Jogs::follow(std::int64_t now_us, MotorId id, Jog& jog) {
  const motion::Motor& motor = installation_[id];
  const motion::Axis& axis = motor.axis();
  if (jog.after && !axis.stopping() && axis.is_planned() &&
      axis.planned_end_steps() != jog.course.target) {
    // It could only come back there.
    const Jog::After after = *std::exchange(jog.after, std::nullopt);
    return ramp_down(
        now_us, id,
        {api::Outcome::kStopped,
         "its table needs " + std::to_string(std::abs(axis.planned_end_steps() - after.from)) +
             " steps to stop from " + motor.scale().coordinates().text(after.from) +
             ", where the stop event was, not " + std::to_string(after.steps)});
  }
  if (jog.ends || axis.stopping()) return;
  const bool gone = jog.renewed_by.session && jog.renewed_by.session->gone();
  if (!gone && now_us < jog.until_us) return;
  jog.ends = true;
  ramp_down(now_us, id,
            {api::Outcome::kStopped, gone ? "ramped down, because its client has gone"
                                          : "ramped down, because its client has not renewed it "
                                            "within " +
                                                ms_text(jog.keepalive_us)});
}

void Jogs::has_ended(std::int64_t now_us, MotorId id, const Jog& jog) {
  const motion::Motor& motor = installation_[id];
  const std::string where =
      motor.name() + " stands at " + motor.scale().coordinates().text(motor.position_steps());
  const api::Asker* by = open_.asker_of(id);
  for (const api::Asker& waiting : jog.waiting) {
    waiting.answer(api::done(by == nullptr ? where : motor.name() + " was given a new target"));
  }
  const bool at_limit = by == nullptr && motor.position_steps() == jog.course.target;
  const bool taken_by_itself = by != nullptr && by->is_same_client(jog.opened_by);
  if (jog.let_go || at_limit || taken_by_itself) return;
  barred_.push_back({.motor = id,
                     .client = jog.opened_by,
                     .keepalive_us = jog.keepalive_us,
                     .until_us = std::max(now_us, jog.until_us)});
}

void Jogs::step(std::int64_t now_us) {
  std::erase_if(barred_, [now_us](const Barred& barred) { return now_us >= barred.until_us; });
  for (auto it = jogs_.begin(); it != jogs_.end();) {
    if (is_open(it->first, it->second)) {
      follow(now_us, it->first, it->second);
      ++it;
      continue;
    }
    const auto ended = jogs_.extract(it++);
    has_ended(now_us, ended.key(), ended.mapped());
  }
}

std::int64_t Jogs::next_wake_us() const {
  std::int64_t wake = INT64_MAX;
  for (const auto& [motor, jog] : jogs_) {
    const bool runs_down = installation_[motor].stops();
    if (!jog.ends && !runs_down) wake = std::min(wake, jog.until_us);
  }
  return wake;
}

}  // namespace bushd::daemon
