#include "witness.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace bushfaults {
namespace {

namespace api = bushd::api;

// A move of the random clients lasts some seconds, the longest fault ten, and then a link is given
// up within one.
constexpr bushd::sim::TimeNs kResultDueNs = 40'000'000'000;
// A daemon may not have heard for as long that a switch is active, and a move may take as long
// to its end.
constexpr bushd::sim::TimeNs kBarredNs = kResultDueNs;
// Until no request waits to be carried out; daemons pause in between.
constexpr bushd::sim::TimeNs kTurnDueNs = 15'000'000'000;
// Of those that have ended; motors ask for no older ones.
constexpr std::size_t kFinishedKept = 2000;

std::vector<std::string> names_of(const std::vector<api::MotorResult>& motors) {
  std::vector<std::string> names;
  for (const api::MotorResult& motor : motors) names.push_back(motor.motor);
  return names;
}

}  // namespace

Witness::Witness(const bushd::config::Config& config, const bushd::sim::Bus& bus,
                 const bushd::sim::Plant& plant, Recent& recent)
    : config_(config),
      plant_(plant),
      recent_(recent),
      positions_(config, bus, plant),
      starts_(config),
      units_(config) {
  for (const bushd::config::Motor& motor : config.motors) {
    motor_by_name_[motor.name] = motors_.size();
    motors_.push_back({motor.name, motor.mcu.value, motor.output.value, {}, {}, {}});
  }
  states_.resize(config.mcus.size());
  present_.resize(config.mcus.size(), true);
}

void Witness::violated(TimeNs now_ns, const std::string& what) {
  recent_.note(now_ns, "VIOLATION: " + what);
  if (!violation_) violation_ = Violation{now_ns, what};
}

const Witness::Motor* Witness::find(const std::string& name) const {
  const auto found = motor_by_name_.find(name);
  return found == motor_by_name_.end() ? nullptr : &motors_[found->second];
}

Witness::Motor* Witness::find(const std::string& name) {
  return const_cast<Motor*>(std::as_const(*this).find(name));
}

void Witness::daemon_started(TimeNs now_ns) {
  promise_.daemon_started();
  none_waits_ns_ = now_ns;
  asked_.clear();
  finished_.clear();
  for (Motor& motor : motors_) motor.move.reset();
  std::fill(states_.begin(), states_.end(), std::nullopt);
  positions_.daemon_started();
  units_.daemon_started(offsets_kept_);
}

void Witness::pressed(TimeNs now_ns, std::size_t motor) {
  motors_[motor].pressed_ns = now_ns;
}

void Witness::carried_out(TimeNs now_ns, const Request& request) {
  asked_[key_of(request.id())] = Asked{.request = request, .since_ns = now_ns};
}

void Witness::reply(TimeNs now_ns, const Key& key, const api::Reply& reply) {
  if (const auto wrong = promise_.answered(key, reply)) return violated(now_ns, *wrong);
  recent_.note(now_ns, text_of(key, reply));
  const auto found = asked_.find(key);
  if (found == asked_.end()) return;  // of a stop, long after another one with its number
  Asked& asked = found->second;
  if (std::holds_alternative<api::Accepted>(reply)) {
    asked.accepted = true;
    return accepted(now_ns, key, asked);
  }
  if (const auto* completed = std::get_if<api::Completed>(&reply)) {
    if (completed->reason.empty()) violated(now_ns, "a result without a reason");
    finished(now_ns, key, asked, *completed);
  } else {
    if (std::get<api::Refused>(reply).reason.empty()) {
      violated(now_ns, "a refusal without a reason");
    }
    check_refusal(now_ns, asked, std::get<api::Refused>(reply).reason);
    refused(asked);
  }
  asked.finished = true;
  finished_.push_back(key);
  forget_some();
}

void Witness::refused(const Asked& asked) {
  if (asked.request.is_move()) ++moves_by_result_["refused"];
  if (asked.request.ask == Ask::kHome) ++homings_by_result_["refused"];
}

void Witness::forget_some() {
  if (finished_.size() <= kFinishedKept) return;
  asked_.erase(finished_.front());
  finished_.pop_front();
}

void Witness::accepted(TimeNs now_ns, const Key& key, Asked& asked) {
  const Request& request = asked.request;
  check_limits(now_ns, asked);
  if (request.ask == Ask::kStop || request.ask == Ask::kEmergencyStop) {
    for (Motor& motor : motors_) {
      const auto& named = request.motors;
      const bool stops =
          named.empty() || std::find(named.begin(), named.end(), motor.name) != named.end();
      if (stops) motor.target.reset();
    }
  }
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    Motor& motor = *find(request.motors[i]);
    const std::int64_t stands = plant_steps(motor);
    if (request.is_move()) forget_unbegun(motor);
    if (request.ask == Ask::kSetPosition) position_accepted(request, i);
    if (request.ask == Ask::kConfirm) positions_.may_be_confirmed(index_of(motor));
    if (request.ask == Ask::kHome) positions_.may_be_homed(index_of(motor));
    if (request.ask == Ask::kMoveBy || request.ask == Ask::kArm) {
      const std::optional<std::int64_t> base = motor.move ? motor.target : stands;
      asked.target.push_back(base ? std::optional(*base + distance_asked(request, i))
                                  : std::nullopt);
    } else if (const auto position = position_asked(request, i);
               request.ask == Ask::kMoveTo && offset(motor) && position) {
      asked.target.emplace_back(*offset(motor) + *position);
    } else {
      asked.target.emplace_back();
    }
    asked.from.push_back(motor.move ? std::nullopt : std::optional(stands));
    asked.end.emplace_back();
    asked.first_step_ns.emplace_back();
    asked.began.push_back(request.ask != Ask::kArm);
    if (request.is_move()) take_over(motor, key, asked.target.back());
    if (request.is_move() && asked.target.back()) {
      steps_commanded_ += static_cast<std::uint64_t>(std::abs(*asked.target.back() - stands));
    }
  }
}

// One that has waited for the trigger in vain is at rest again before the others that waited with
// it have ended, and with them the move.
void Witness::forget_unbegun(Motor& motor) {
  if (!motor.move) return;
  const Asked& asked = asked_.at(*motor.move);
  if (!asked.began[asked.index_of(motor.name)]) motor.move.reset();
}

// A motor that moves belongs to the newest move; its part of the one before has ended.
void Witness::take_over(Motor& motor, const Key& by, std::optional<std::int64_t> target) {
  if (motor.move) {
    Asked& before = asked_.at(*motor.move);
    before.end[before.index_of(motor.name)] = End{"stopped", 0, true};
  }
  motor.move = by;
  motor.target = target;
}

void Witness::finished(TimeNs now_ns, const Key& key, const Asked& asked,
                       const api::Completed& completed) {
  const Request& request = asked.request;
  if (request.ask == Ask::kSetPosition && completed.outcome == api::Outcome::kDone) {
    for (std::size_t i = 0; i < request.motors.size(); ++i) {
      const std::size_t motor = index_of(*find(request.motors[i]));
      if (sets_offset(units_, motor, request)) continue;
      if (const auto set = position_asked(request, i)) positions_.was_set(motor, *set);
    }
  }
  const bool homes = request.ask == Ask::kHome;
  if (!homes && !request.is_move()) return;
  ++(homes ? homings_by_result_ : moves_by_result_)[std::string(word(completed.outcome))];
  const auto* motors = std::get_if<Motors>(&completed.detail);
  if (motors == nullptr || names_of(*motors) != request.motors) {
    return violated(now_ns, "a result of other motors: " + text_of(request));
  }
  if (homes) return homed(now_ns, *motors);
  moved(now_ns, key, asked, *motors);
}

void Witness::moved(TimeNs now_ns, const Key& key, const Asked& asked, const Motors& motors) {
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const api::MotorResult& result = motors[i];
    const auto& end = asked.end[i];
    if (asked.request.ask == Ask::kArm && !asked.began[i]) {
      // No line of the log tells how it ended, and it can have reached nothing.
      Motor& motor = *find(result.motor);
      if (motor.move == key) motor.move.reset();
      if (result.outcome != api::Outcome::kReached) continue;
    }
    if (end && end->agrees(result)) continue;
    violated(now_ns, fmt::format("{} ended otherwise than its result says: {} at {}", result.motor,
                                 word(result.outcome), result.position_steps));
  }
  const auto wrong = starts_.check(asked.request, asked.first_step_ns);
  if (wrong) violated(now_ns, *wrong);
}

void Witness::homed(TimeNs now_ns, const Motors& motors) {
  for (const api::MotorResult& result : motors) {
    if (result.outcome != api::Outcome::kReached) continue;
    const auto wrong = positions_.was_homed(index_of(*find(result.motor)), result.position_steps);
    if (wrong) violated(now_ns, *wrong);
  }
}

void Witness::move_log(TimeNs now_ns, const std::string& json_line) {
  const nlohmann::json line = nlohmann::json::parse(json_line);
  if (line.at("event") == "autonomous") {
    const std::size_t index = index_of(*find(line.at("motor").get<std::string>()));
    if (line.at("set")) positions_.homed(index, line.at("position_steps"));
    return;
  }
  const bool begins = line.at("event") == "move";
  if (!begins && line.at("event") != "result") return;
  Motor& motor = *find(line.at("motor").get<std::string>());
  if (begins && motor.move) {
    Asked& asked = asked_.at(*motor.move);
    asked.began[asked.index_of(motor.name)] = true;
  }
  if (begins) return;
  if (!motor.move) return violated(now_ns, motor.name + " ended without a move");
  Asked& asked = asked_.at(*motor.move);
  const End end{line.at("result"), line.at("position_steps")};
  if (end.word == "turned") return check_end(now_ns, motor, asked, end, std::nullopt);
  motor.move.reset();
  const std::size_t index = asked.index_of(motor.name);
  asked.end[index] = end;
  check_end(now_ns, motor, asked, end, asked.target[index]);
  // One that waited for the trigger and was stopped before its first step makes it in a streamed
  // tick, up to one late.
  const bool exact = asked.request.ask != Ask::kArm;
  const bool planned = end.word == "reached" || (end.word == "stopped" && exact);
  const auto& from = asked.from[index];
  if (planned && from && plant_steps(motor) != *from) {
    asked.first_step_ns[index] = plant_.first_step_ns(motor.mcu, motor.output);
    if (end.word == "reached") check_speed(now_ns, motor, asked, index);
  }
}

void Witness::check_end(TimeNs now_ns, const Motor& motor, const Asked& asked, const End& end,
                        std::optional<std::int64_t> target) {
  const std::int64_t stands = plant_steps(motor);
  const bool limited = end.word == "limit";
  const bool planned =
      end.word == "reached" || end.word == "stopped" || end.word == "turned" || limited;
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

void Witness::state(TimeNs now_ns, std::size_t mcu, const api::StateSnapshot& state) {
  if (config_.mcus[mcu].id != state.mcu) {
    return violated(now_ns, "a state of another MCU: " + state.mcu);
  }
  if (!states_[mcu] || states_[mcu]->state != state.state) {
    recent_.note(now_ns, fmt::format("{} {} {}", state.mcu, word(state.state), state.detail));
  }
  states_[mcu] = state;
  if (const auto wrong = positions_.check(now_ns, mcu, state)) violated(now_ns, *wrong);
  for (const api::MotorState& motor : state.motors) {
    const auto wrong = units_.check(index_of(*find(motor.name)), motor);
    if (wrong) violated(now_ns, *wrong);
  }
}

void Witness::check_deadlines(TimeNs now_ns) {
  for (const auto& [key, asked] : asked_) {
    if (asked.finished || asked.request.may_wait() || now_ns - asked.since_ns <= kResultDueNs) {
      continue;
    }
    violated(now_ns, fmt::format("no {} after {} s: {}", asked.accepted ? "result" : "reply",
                                 kResultDueNs / 1'000'000'000, text_of(asked.request)));
  }
  if (!promise_.waits()) none_waits_ns_ = now_ns;
  if (now_ns - none_waits_ns_ > kTurnDueNs) violated(now_ns, "requests wait for their turn");
}

bool Witness::ready(std::size_t mcu) const {
  return !present_[mcu] || (states_[mcu] && states_[mcu]->state == api::McuState::kReady);
}

bool Witness::all_ready() const {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (!ready(i)) return false;
  }
  return true;
}

std::string Witness::not_ready() const {
  std::string text;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (ready(i)) continue;
    text += text.empty() ? "" : ", ";
    text += config_.mcus[i].id + " is ";
    text +=
        states_[i] ? std::string(word(states_[i]->state)) + " " + states_[i]->detail : "unknown";
  }
  return text;
}

bool Witness::commands_open() const {
  return promise_.waits() || std::any_of(asked_.begin(), asked_.end(),
                                         [](const auto& entry) { return !entry.second.finished; });
}

std::uint64_t Witness::steps_unaccounted() const {
  std::uint64_t steps = 0;
  for (const auto& state : states_) {
    if (!state) continue;
    for (const api::MotorState& claim : state->motors) {
      const Motor& motor = *find(claim.name);
      const bool good = claim.trust == api::Trust::kKnown || claim.trust == api::Trust::kRestored;
      if (!offset(motor) || !good || claim.moving) continue;
      steps += static_cast<std::uint64_t>(
          std::abs(plant_steps(motor) - *offset(motor) - claim.position_steps));
    }
  }
  return steps;
}

}  // namespace bushfaults
