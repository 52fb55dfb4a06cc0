#include "witness.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace bushfaults {
namespace {

using bushd::motor_state_t;
using bushd::reply_t;
using bushd::state_t;

// A move of the random clients lasts some seconds, the longest fault ten, and then a link is given
// up within one.
constexpr bushd::sim::TimeNs kResultDueNs = 40'000'000'000;
// A daemon may not have heard for as long that a switch is active, and a move may take as long
// to its end.
constexpr bushd::sim::TimeNs kBarredNs = kResultDueNs;
// The daemon answers a command again while 64 newer ones of the client have come; here it is known
// for longer, even if some of those have been overtaken.
constexpr std::int64_t kNumbersAnswered = 64;
constexpr std::int64_t kNumbersKept = 200;

bool same(const reply_t& a, const reply_t& b) {
  return a.utime_us == b.utime_us && a.phase == b.phase && a.result == b.result &&
         a.reason == b.reason && a.motors == b.motors && a.motor_results == b.motor_results &&
         a.position_steps == b.position_steps;
}

std::string text_of(const reply_t& reply) {
  return fmt::format("  {} #{}: {} ({}) {} {}", reply.client_id.substr(0, 16), reply.number,
                     reply.phase == reply_t::ACCEPTED ? "accepted" : reply.result, reply.reason,
                     fmt::join(reply.motor_results, ","), fmt::join(reply.position_steps, ","));
}

}  // namespace

Witness::Witness(const bushd::config::Config& config, const bushd::sim::Bus& bus,
                 const bushd::sim::Plant& plant, Recent& recent)
    : config_(config),
      plant_(plant),
      recent_(recent),
      positions_(config, bus, plant),
      starts_(config) {
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

void Witness::daemon_started(TimeNs) {
  for (const auto& [key, asked] : asked_) forget(key, asked);
  asked_.clear();
  newest_.clear();
  repeating_.reset();
  for (Motor& motor : motors_) motor.move.reset();
  std::fill(states_.begin(), states_.end(), std::nullopt);
  positions_.daemon_started();
}

void Witness::pressed(TimeNs now_ns, std::size_t motor) {
  motors_[motor].pressed_ns = now_ns;
}

void Witness::request(TimeNs now_ns, const Request& request) {
  recent_.note(now_ns, text_of(request));
  const Key key{request.client, request.number};
  const auto [asked, fresh] = asked_.try_emplace(key);
  repeating_.reset();
  if (!fresh) {
    repeating_ = key;
    return;
  }
  asked->second.request = request;
  std::int64_t& newest = newest_[request.client];
  newest = std::max(newest, request.number);
  const auto old = asked_.find({request.client, request.number - kNumbersKept});
  if (old != asked_.end() && old->second.finished()) {
    forget(old->first, old->second);
    asked_.erase(old);
  }
}

void Witness::forget(const Key& key, const Asked& asked) {
  if (asked.accepted() && asked.request.counts_once()) carried_out_.insert(key);
}

void Witness::reply(TimeNs now_ns, const reply_t& reply) {
  const auto found = asked_.find({reply.client_id, reply.number});
  if (found == asked_.end())
    return violated(now_ns, "a reply that nobody asked for:" + text_of(reply));
  Asked& asked = found->second;
  if (reply.reason.empty()) violated(now_ns, "a reply without a reason:" + text_of(reply));
  const bool known = std::any_of(asked.replies.begin(), asked.replies.end(),
                                 [&](const reply_t& before) { return same(before, reply); });
  const bool repeating = repeating_ == found->first;
  // A number from before the daemon's memory is refused whenever it comes.
  const bool forgotten = newest_[reply.client_id] - reply.number >= kNumbersAnswered;
  const bool too_old = !asked.replies.empty() && reply.phase == reply_t::REFUSED &&
                       (asked.replies[0].phase == reply_t::REFUSED || forgotten);
  if (repeating && (known || too_old)) return;
  recent_.note(now_ns, text_of(reply));
  const bool first = asked.replies.empty();
  const bool in_order =
      first ? reply.phase != reply_t::RESULT
            : asked.replies.size() == 1 && asked.accepted() && reply.phase == reply_t::RESULT;
  if (!in_order) return violated(now_ns, "one reply too many:" + text_of(reply));
  asked.replies.push_back(reply);
  if (reply.phase == reply_t::ACCEPTED) {
    if (carried_out_.contains(found->first)) {
      violated(now_ns, "carried out a second time: " + text_of(asked.request));
    }
    asked.accepted_ns = now_ns;
    accepted(found->first, asked);
  } else if (reply.phase == reply_t::RESULT) {
    finished(now_ns, found->first, asked, reply);
  } else if (asked.request.is_move()) {
    ++moves_by_result_["refused"];
  } else if (asked.request.ask == Ask::kHome) {
    ++homings_by_result_["refused"];
  }
}

void Witness::accepted(const Key& key, Asked& asked) {
  const Request& request = asked.request;
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
    if (request.ask == Ask::kSetPosition) {
      positions_.may_be_set(index_of(motor), request.steps[i]);
    }
    if (request.ask == Ask::kHome) positions_.may_be_homed(index_of(motor));
    if (request.ask == Ask::kMoveBy || request.ask == Ask::kArm) {
      const std::optional<std::int64_t> base = motor.move ? motor.target : stands;
      asked.target.push_back(base ? std::optional(*base + request.steps[i]) : std::nullopt);
    } else if (request.ask == Ask::kMoveTo && offset(motor)) {
      asked.target.emplace_back(*offset(motor) + request.steps[i]);
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

void Witness::finished(TimeNs now_ns, const Key& key, const Asked& asked, const reply_t& result) {
  const Request& request = asked.request;
  if (request.ask == Ask::kSetPosition && result.result == "done") {
    for (std::size_t i = 0; i < request.motors.size(); ++i) {
      positions_.was_set(index_of(*find(request.motors[i])), request.steps[i]);
    }
  }
  if (request.ask == Ask::kHome) return homed(now_ns, asked, result);
  if (!request.is_move()) return;
  ++moves_by_result_[result.result];
  if (result.motors != request.motors) {
    return violated(now_ns, "a result of other motors:" + text_of(result));
  }
  for (std::size_t i = 0; i < result.motors.size(); ++i) {
    const auto& end = asked.end[i];
    if (request.ask == Ask::kArm && !asked.began[i]) {
      // No line of the log tells how it ended, and it can have reached nothing.
      Motor& motor = *find(result.motors[i]);
      if (motor.move == key) motor.move.reset();
      if (result.motor_results[i] != "reached") continue;
    }
    if (end && end->agrees(result.motor_results[i], result.position_steps[i])) continue;
    violated(now_ns, result.motors[i] + " ended otherwise than its result says:" + text_of(result));
  }
  const auto wrong = starts_.check(request, asked.first_step_ns);
  if (wrong) violated(now_ns, *wrong);
}

void Witness::homed(TimeNs now_ns, const Asked& asked, const reply_t& result) {
  ++homings_by_result_[result.result];
  if (result.motors != asked.request.motors) {
    return violated(now_ns, "a result of other motors:" + text_of(result));
  }
  for (std::size_t i = 0; i < result.motors.size(); ++i) {
    if (result.motor_results[i] != "reached") continue;
    const auto wrong =
        positions_.was_homed(index_of(*find(result.motors[i])), result.position_steps[i]);
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
  if (end.word == "turned") return check_end(now_ns, motor, end, std::nullopt);
  motor.move.reset();
  const std::size_t index = asked.index_of(motor.name);
  asked.end[index] = end;
  check_end(now_ns, motor, end, asked.target[index]);
  // One that waited for the trigger and was stopped before its first step makes it in a streamed
  // tick, up to one late.
  const bool exact = asked.request.ask != Ask::kArm;
  const bool planned = end.word == "reached" || (end.word == "stopped" && exact);
  const auto& from = asked.from[index];
  if (planned && from && plant_steps(motor) != *from) {
    asked.first_step_ns[index] = plant_.first_step_ns(motor.mcu, motor.output);
  }
}

void Witness::check_end(TimeNs now_ns, const Motor& motor, const End& end,
                        std::optional<std::int64_t> target) {
  const std::int64_t stands = plant_steps(motor);
  const bool limited = end.word == "limit";
  const bool planned =
      end.word == "reached" || end.word == "stopped" || end.word == "turned" || limited;
  if (limited && (!motor.pressed_ns || now_ns - *motor.pressed_ns > kBarredNs)) {
    violated(now_ns, motor.name + " ended at its limit, and nobody has pressed its switch");
  } else if (end.word == "fault") {
    violated(now_ns, fmt::format("{} ended in fault at {}", motor.name, end.position_steps));
  } else if (end.word == "reached" && target && *target != stands) {
    violated(now_ns, fmt::format("{} is said to have reached its target, and stands {} steps off",
                                 motor.name, stands - *target));
  } else if (planned && offset(motor) && stands - *offset(motor) != end.position_steps) {
    violated(now_ns, fmt::format("{} {} at {}, but stands at {}", motor.name, end.word,
                                 end.position_steps, stands - *offset(motor)));
  }
}

void Witness::state(TimeNs now_ns, const state_t& state) {
  std::size_t mcu = 0;
  while (mcu < config_.mcus.size() && config_.mcus[mcu].id != state.mcu) ++mcu;
  if (mcu == config_.mcus.size()) return violated(now_ns, "a state of an unknown MCU " + state.mcu);
  if (!states_[mcu] || states_[mcu]->mcu_state != state.mcu_state) {
    recent_.note(now_ns, fmt::format("{} {} {}", state.mcu, state.mcu_state, state.detail));
  }
  states_[mcu] = state;
  if (const auto wrong = positions_.check(now_ns, mcu, state)) violated(now_ns, *wrong);
}

void Witness::check_deadlines(TimeNs now_ns) {
  for (const auto& [key, asked] : asked_) {
    if (asked.replies.empty() && key.first.size() <= 64 && !key.first.empty()) {
      violated(now_ns, "no reply to " + text_of(asked.request));
    } else if (asked.accepted() && !asked.finished() && !asked.request.may_wait() &&
               now_ns - asked.accepted_ns > kResultDueNs) {
      violated(now_ns,
               fmt::format("no result {} s after it was accepted: {}",
                           (now_ns - asked.accepted_ns) / 1'000'000'000, text_of(asked.request)));
    }
  }
}

bool Witness::ready(std::size_t mcu) const {
  return !present_[mcu] || (states_[mcu] && states_[mcu]->mcu_state == "READY");
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
    text += states_[i] ? states_[i]->mcu_state + " " + states_[i]->detail : "unknown";
  }
  return text;
}

bool Witness::commands_open() const {
  return std::any_of(asked_.begin(), asked_.end(), [](const auto& entry) {
    return entry.second.accepted() && !entry.second.finished();
  });
}

std::uint64_t Witness::steps_unaccounted() const {
  std::uint64_t steps = 0;
  for (const auto& state : states_) {
    if (!state) continue;
    for (const motor_state_t& claim : state->motors) {
      const Motor& motor = *find(claim.name);
      if (!offset(motor) || claim.trust != "known" || claim.moving) continue;
      steps += static_cast<std::uint64_t>(
          std::abs(plant_steps(motor) - *offset(motor) - claim.position_steps));
    }
  }
  return steps;
}

}  // namespace bushfaults
