#include "bare_judge.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <utility>

#include "positions.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;
using bushd::sim::TimeNs;

// A report, and what is behind it, is not older.
constexpr TimeNs kAgeNs = 1'500'000'000;
// Beyond its longest delay: a change of rate, what a mute adapter holds, a pause of its.
constexpr TimeNs kPortSilenceNs = 120'000'000;
// From a request to the first step, and from a stop to what was under way.
constexpr TimeNs kReactionNs = 300'000'000;
// What has arrived has its turn.
constexpr TimeNs kTurnNs = 1'500'000'000;
constexpr std::int64_t kHomeSteps = 1;  // how exactly a switch is found
constexpr TimeNs kRoundingNs = 1;       // times of edges are whole ns

std::vector<TimeNs> delays(const bushd_ramp& ramp, const bushd_table& table) {
  std::vector<TimeNs> all;
  for (std::uint32_t i = 0; i < ramp.count; ++i) {
    all.push_back(TimeNs{ramp.code[i]} * table.time_unit_ns);
  }
  all.push_back(TimeNs{table.cruise} * table.time_unit_ns);
  return all;
}

TimeNs at(const std::vector<TimeNs>& side, std::size_t i) {
  return side[std::min(i, side.size() - 1)];
}

}  // namespace

BareJudge::BareJudge(const bushd::config::Config& config, std::size_t first_motor, bool keeps,
                     Recent& recent, Violated violated)
    : first_(first_motor), keeps_(keeps), recent_(recent), violated_(std::move(violated)) {
  for (std::size_t i = first_motor; i < config.motors.size(); ++i) {
    const bushd::config::Motor& from = config.motors[i];
    const bushd_table table = config.table_of(from).view();
    Motor motor{.name = from.name,
                .mcu = from.mcu.value,
                .output = from.output.value,
                .accel_ns = delays(table.accel, table),
                .decel_ns = delays(table.decel, table)};
    motor.levels_ns = motor.decel_ns;
    const auto same = std::ranges::unique(motor.levels_ns);
    motor.levels_ns.erase(same.begin(), same.end());
    if (from.home) motor.slow_ns = 1'000'000'000 / from.home->slow_steps_per_s;
    const TimeNs longest =
        std::max({motor.accel_ns.front(), motor.decel_ns.front(), motor.slow_ns});
    motor.rest_ns = 2 * longest + kPortSilenceNs;
    // Bytes and changes of rate make it longer, codes of a board too.
    motor.ramp_ns = 2 * std::accumulate(motor.decel_ns.begin(), motor.decel_ns.end(), TimeNs{0}) +
                    2 * longest + kReactionNs;
    by_output_[{motor.mcu, motor.output}] = motors_.size();
    motors_.push_back(std::move(motor));
  }
}

void BareJudge::has_switch(std::size_t motor, std::int64_t at_steps, std::int64_t set_to) {
  motors_[motor - first_].home_offset = at_steps - set_to;
}

BareJudge::Motor* BareJudge::find(const std::string& name) {
  const auto found = std::ranges::find(motors_, name, &Motor::name);
  return found == motors_.end() ? nullptr : &*found;
}

// --- Steps

void BareJudge::edge(const bushd::sim::Edge& edge) {
  const auto found = by_output_.find({edge.mcu, edge.index});
  if (edge.signal == bushd::sim::Signal::kDir) {
    if (found != by_output_.end()) {
      Motor& motor = motors_[found->second];
      if (motor.positive != edge.level) judge_run(motor);
      motor.positive = edge.level;
    }
  } else if (edge.signal == bushd::sim::Signal::kStep && edge.level) {
    if (found == by_output_.end()) {
      return violated_(edge.time_ns,
                       fmt::format("a step at output {}, which has no motor", edge.index));
    }
    step(edge.time_ns, motors_[found->second]);
  }
}

void BareJudge::step(TimeNs time_ns, Motor& motor) {
  if (!motor.run.empty() && time_ns - motor.run.back() > motor.rest_ns &&
      motor.excused_ns < motor.run.back()) {
    judge_run(motor);
  }
  if (motor.run.empty()) {
    // What a daemon has handed over leaves within two of the longest delays and the port's silence.
    motor.cut = motor.gone_ns && time_ns - *motor.gone_ns <= motor.rest_ns;
    motor.changed = false;
  }
  motor.run.push_back(time_ns);
  motor.position += motor.positive ? 1 : -1;
  motor.path.push_back({time_ns, motor.position});
  ++steps_;
  const TimeNs until_ns = std::max({motor.caused_ns, motor.keys_ns, motor.excused_ns});
  if (motor.open == 0 && time_ns > until_ns + motor.ramp_ns) {
    violated(time_ns, motor,
             fmt::format("makes a step that nobody has asked for, {} ms after all that could",
                         (time_ns - until_ns) / 1'000'000));
  }
}

void BareJudge::judge_run(Motor& motor) {
  const std::size_t n = motor.run.size();
  for (std::size_t j = 2; j <= n; ++j) {
    const TimeNs decel = motor.cut       ? 0
                         : motor.changed ? at(motor.levels_ns, n - j)
                                         : at(motor.decel_ns, n - j);
    TimeNs least = std::max(at(motor.accel_ns, j - 1), decel);
    if (motor.homes) least = std::min(least, motor.slow_ns);
    const TimeNs interval = motor.run[j - 1] - motor.run[j - 2];
    if (interval + kRoundingNs >= least) continue;
    violated(motor.run[j - 1], motor,
             fmt::format("made step {} of {} {} us after the one before; its table allows {}", j, n,
                         interval / 1000, least / 1000));
    break;
  }
  if (n > 0) ++runs_;
  motor.run.clear();
  motor.cut = false;
  motor.homes = false;
  for (const auto& [number, open] : open_) {
    if (!open.homes) continue;
    for (const std::size_t i : open.motors) motors_[i].homes = true;
  }
}

void BareJudge::advance_to(TimeNs now_ns) {
  for (Motor& motor : motors_) {
    if (!motor.run.empty() && now_ns - motor.run.back() > motor.rest_ns &&
        motor.excused_ns < motor.run.back()) {
      judge_run(motor);
    }
    while (motor.path.size() > 1 && motor.path[1].time_ns < oldest_ns(now_ns)) {
      motor.path.pop_front();
    }
  }
}

void BareJudge::excused_until(std::size_t motor, TimeNs until_ns) {
  Motor& it = motors_[motor - first_];
  it.excused_ns = std::max(it.excused_ns, until_ns);
}

void BareJudge::cut_off(std::size_t motor) {
  motors_[motor - first_].cut = true;
}

void BareJudge::port_lost(std::size_t motor) {
  motors_[motor - first_].cut = motors_[motor - first_].lost = true;
}

void BareJudge::paused(TimeNs now_ns, TimeNs until_ns) {
  if (now_ns > paused_until_ns_) paused_ns_ = now_ns;
  paused_until_ns_ = std::max(paused_until_ns_, until_ns);
}

TimeNs BareJudge::oldest_ns(TimeNs now_ns) const {
  return (now_ns > paused_until_ns_ + kAgeNs ? now_ns : std::min(now_ns, paused_ns_)) - kAgeNs;
}

void BareJudge::change(std::size_t motor) {
  motors_[motor - first_].changed = true;
}

void BareJudge::keys_until(std::size_t motor, TimeNs until_ns) {
  motors_[motor - first_].keys_ns = until_ns;
  motors_[motor - first_].changed = true;
}

// --- Requests

void BareJudge::daemon_started(TimeNs) {
  for (Motor& motor : motors_) {
    motor.seen = api::McuState::kOffline;
    motor.lost = false;
    motor.trusted = motor.resting = false;
    if (!keeps_) {
      motor.offset.reset();
      motor.perhaps.clear();
      motor.perhaps_homed = false;
    }
  }
}

void BareJudge::daemon_gone(TimeNs now_ns) {
  for (auto& [number, open] : open_) close(now_ns, open);
  open_.clear();
  for (Motor& motor : motors_) {
    motor.cut = true;
    motor.gone_ns = now_ns;
    motor.keys_ns = std::min(motor.keys_ns, now_ns);
    motor.trusted = motor.resting = false;
  }
}

void BareJudge::begin(TimeNs, Open& open, const std::string& name,
                      std::optional<std::int64_t> target) {
  const Motor* motor = find(name);
  if (motor == nullptr) return;
  const auto index = static_cast<std::size_t>(motor - motors_.data());
  motors_[index].gone_ns.reset();
  open.motors.push_back(index);
  open.target.push_back(target);
}

void BareJudge::asked(TimeNs now_ns, std::int64_t number, const api::Request& request) {
  Open& open = open_[number];
  open = {.text = std::string(api::name_of(request)), .since_ns = now_ns, .order = ++requests_};
  recent_.note(now_ns, fmt::format("desk #{}: {}", number, open.text));
  if (const auto* move = std::get_if<api::Move>(&request)) {
    open.is_motion = true;
    for (const api::MotorAmount& each : move->motors) {
      const Motor& motor = *find(each.motor);
      const std::int64_t steps = std::get<std::int64_t>(each.amount);
      std::optional<std::int64_t> target;
      const bool sure = motor.offset && motor.perhaps.empty() && !motor.perhaps_homed;
      if (move->kind == api::Move::Kind::kAbsolute) {
        if (sure) target = *motor.offset + steps;
      } else if (motor.resting && motor.open == 0 && motor.run.empty()) {
        target = motor.position + steps;
      }
      begin(now_ns, open, each.motor, target);
      recent_.note(now_ns, fmt::format("desk #{}: {} {} {}, stands at {}", number, each.motor,
                                       move->kind == api::Move::Kind::kAbsolute ? "to" : "by",
                                       steps, motor.position));
    }
  } else if (const auto* home = std::get_if<api::Home>(&request)) {
    open.is_motion = open.homes = true;
    for (const std::string& name : home->motors) begin(now_ns, open, name, std::nullopt);
  } else if (const auto* jog = std::get_if<api::Jog>(&request)) {
    open.is_motion = true;
    begin(now_ns, open, jog->motor, std::nullopt);
  } else if (const auto* resume = std::get_if<api::Resume>(&request)) {
    for (const std::string& name : resume->motors) begin(now_ns, open, name, std::nullopt);
  } else if (const auto* set = std::get_if<api::SetPosition>(&request)) {
    const api::MotorAmount& each = set->motors.front();
    begin(now_ns, open, each.motor, std::nullopt);
    Motor& motor = *find(each.motor);
    open.set_offset = motor.position - std::get<std::int64_t>(each.amount);
    motor.perhaps.push_back(*open.set_offset);
  } else {
    asked_by_others(now_ns, request);
  }
  for (const std::size_t i : open.motors) {
    Motor& motor = motors_[i];
    ++motor.open;
    motor.touched_by = open.order;
    motor.changed = true;
    if (open.homes) motor.homes = motor.perhaps_homed = true;
  }
}

void BareJudge::asked_by_others(TimeNs now_ns, const api::Request& request) {
  const auto* stop = std::get_if<api::Stop>(&request);
  const auto* pause = std::get_if<api::Pause>(&request);
  const auto* hold = std::get_if<api::Hold>(&request);
  const auto* resume = std::get_if<api::Resume>(&request);
  const bool emergency = std::holds_alternative<api::EmergencyStop>(request);
  const api::MotorNames* names = stop != nullptr     ? &stop->motors
                                 : pause != nullptr  ? &pause->motors
                                 : hold != nullptr   ? &hold->motors
                                 : resume != nullptr ? &resume->motors
                                                     : nullptr;
  if (names == nullptr && !emergency) return;
  ++requests_;
  for (Motor& motor : motors_) {
    if (names != nullptr && !names->empty() &&
        std::ranges::find(*names, motor.name) == names->end()) {
      continue;
    }
    motor.touched_by = requests_;
    if (resume == nullptr) motor.stopped_ns = now_ns;
    motor.changed = true;
    if (emergency) motor.cut = true;
    if (resume != nullptr) motor.caused_ns = std::max(motor.caused_ns, now_ns);
  }
}

void BareJudge::close(TimeNs now_ns, Open& open) {
  for (const std::size_t i : open.motors) {
    --motors_[i].open;
    motors_[i].caused_ns = std::max(motors_[i].caused_ns, now_ns);
  }
}

void BareJudge::replied(TimeNs now_ns, std::int64_t number, const api::Reply& reply) {
  const auto found = open_.find(number);
  if (found == open_.end()) {
    return violated_(now_ns, fmt::format("desk #{} is answered after its end", number));
  }
  Open& open = found->second;
  if (std::holds_alternative<api::Accepted>(reply)) {
    if (std::exchange(open.accepted, true)) violated_(now_ns, "accepted twice: " + open.text);
    return;
  }
  if (const auto* refused = std::get_if<api::Refused>(&reply)) {
    recent_.note(now_ns, fmt::format("desk #{} refused: {}", number, refused->reason));
    if (open.accepted) violated_(now_ns, "refused after it was accepted: " + open.text);
    if (refused->reason.empty()) violated_(now_ns, "a refusal without a reason: " + open.text);
    ++results_["refused"];
    if (open.set_offset) std::erase(motors_[open.motors[0]].perhaps, *open.set_offset);
  } else {
    const auto& result = std::get<api::Completed>(reply);
    recent_.note(now_ns,
                 fmt::format("desk #{} {}: {}", number, word(result.outcome), result.reason));
    // What was stopped before it began has a result alone.
    const bool lone = open.is_motion && open.text != "jog" && !open.accepted;
    if (lone && result.outcome != api::Outcome::kStopped) {
      violated_(now_ns,
                fmt::format("{} before it was accepted: {}", word(result.outcome), open.text));
    }
    if (open.is_motion) ++results_[std::string(word(result.outcome))];
    completed(now_ns, open, result);
  }
  close(now_ns, open);
  open_.erase(found);
}

void BareJudge::completed(TimeNs now_ns, Open& open, const api::Completed& result) {
  if (open.set_offset && result.outcome == api::Outcome::kDone) {
    Motor& motor = motors_[open.motors[0]];
    motor.offset = *open.set_offset;
    motor.perhaps.clear();
    motor.perhaps_homed = false;
  } else if (open.set_offset) {
    std::erase(motors_[open.motors[0]].perhaps, *open.set_offset);
  }
  const auto* all = std::get_if<std::vector<api::MotorResult>>(&result.detail);
  if (!open.is_motion) return;
  // What its own client changes of a jog is answered at once.
  if (all == nullptr && open.text == "jog") return;
  if (all == nullptr || all->size() != open.motors.size()) {
    return violated_(now_ns, "not a result for each motor: " + open.text);
  }
  for (std::size_t i = 0; i < all->size(); ++i) ended(now_ns, open, i, (*all)[i]);
}

void BareJudge::ended(TimeNs now_ns, Open& open, std::size_t i, const api::MotorResult& result) {
  Motor& motor = motors_[open.motors[i]];
  if (motor.name != result.motor) return violated(now_ns, motor, "has the result of another motor");
  // Another one of the same request may have moved on, and this one by another request.
  const bool stands = motor.touched_by <= open.order;
  // One that waited behind a stop is told so at its turn.
  const bool stopped_before =
      !open.accepted && motor.stopped_ns && now_ns <= *motor.stopped_ns + kTurnNs;
  if (result.outcome == api::Outcome::kReached && open.target[i] && stands &&
      motor.position != *open.target[i]) {
    violated(now_ns, motor,
             fmt::format("is said to have reached its target, and stands {} steps off",
                         motor.position - *open.target[i]));
  }
  if (result.outcome == api::Outcome::kStopped && stands && !stopped_before &&
      open.text == "move") {
    violated(now_ns, motor, "is said to have been stopped, and nobody has stopped it");
  }
}

std::string BareJudge::open_text() const {
  std::string text;
  for (const auto& [number, open] : open_) {
    text += fmt::format("{}#{} {} of {} s", text.empty() ? "" : ", ", number, open.text,
                        in_seconds(open.since_ns));
  }
  return text;
}

bool BareJudge::rests(std::size_t motor) const {
  const Motor& it = motors_[motor - first_];
  return it.resting && it.run.empty();
}

// --- States

void BareJudge::state(TimeNs now_ns, const api::StateSnapshot& state) {
  ++states_checked_;
  const bool online = state.state != api::McuState::kOffline;
  for (const api::MotorState& claim : state.motors) {
    Motor* motor = find(claim.name);
    if (motor == nullptr) return violated_(now_ns, "a state of an unknown motor: " + claim.name);
    motor->seen = state.state;
    motor->resting = online && !claim.moving && claim.activity == api::Activity::kResting;
    check(now_ns, *motor, claim, online);
  }
}

bool BareJudge::was_there(TimeNs now_ns, const Motor& motor, std::int64_t at) const {
  std::int64_t low = motor.position;
  std::int64_t high = motor.position;
  for (std::size_t i = motor.path.size(); i-- > 0;) {
    low = std::min(low, motor.path[i].position);
    high = std::max(high, motor.path[i].position);
    if (motor.path[i].time_ns < oldest_ns(now_ns)) break;
    // Before this step it stood one step back.
    if (i > 0) continue;
    low = std::min(low, motor.path[0].position - 1);
    high = std::max(high, motor.path[0].position + 1);
  }
  return at >= low - motor.unseen && at <= high + motor.unseen;
}

void BareJudge::check(TimeNs now_ns, Motor& motor, const api::MotorState& claim, bool online) {
  motor.trusted = is_good(claim.trust);
  if (!motor.trusted) {
    if (claim.trust != api::Trust::kUncertain) return;
    if (std::exchange(motor.lost, false)) check_uncertain(now_ns, motor, claim);
    motor.offset.reset();
    return;
  }
  const auto agrees = [&](std::int64_t offset, std::int64_t off) {
    const std::int64_t at = claim.position_steps + offset;
    return motor.resting || !online ? std::abs(at - motor.position) <= off
                                    : was_there(now_ns, motor, at);
  };
  if (motor.offset && agrees(*motor.offset, 0)) return;
  for (const std::int64_t offset : motor.perhaps) {
    if (!agrees(offset, 0)) continue;
    if (motor.resting) {
      motor.offset = offset;
      motor.perhaps.clear();
    }
    return;
  }
  if (motor.perhaps_homed && motor.home_offset) {
    // It may have been set a while ago, and the claim is of now.
    for (std::int64_t off = -kHomeSteps; off <= kHomeSteps; ++off) {
      const std::int64_t offset = *motor.home_offset + off;
      if (!agrees(offset, 0)) continue;
      if (motor.resting) motor.offset = offset;
      return;
    }
  }
  violated(
      now_ns, motor,
      motor.offset
          ? fmt::format("is said to be at {} ({}, {}), and is at {}", claim.position_steps,
                        word(claim.trust), word(claim.activity), motor.position - *motor.offset)
          : fmt::format("is said to be at {} ({}), and nobody has said where it is; it is at {}",
                        claim.position_steps, word(claim.trust), motor.position));
}

// "... while 12 steps were under way: as many may be missing".
void BareJudge::check_uncertain(TimeNs now_ns, const Motor& motor, const api::MotorState& claim) {
  const std::string& reason = claim.uncertain_reason;
  if (reason.empty()) return violated(now_ns, motor, "is uncertain without a reason");
  const auto end = reason.find(" steps were under way");
  if (!motor.offset || end == std::string::npos) return;
  const auto begin = reason.rfind(' ', end - 1) + 1;
  const std::int64_t most = std::stoll(reason.substr(begin, end - begin));
  const std::int64_t off = motor.position - *motor.offset - claim.position_steps;
  if (std::abs(off) <= most) return;
  violated(now_ns, motor,
           fmt::format("is said to be at {}, uncertain by {} steps, and is at {}",
                       claim.position_steps, most, motor.position - *motor.offset));
}

}  // namespace bushfaults
