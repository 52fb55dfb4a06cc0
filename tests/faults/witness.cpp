#include "witness.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "own_ramp.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;

// So many requests that have ended are kept; motors ask for no older ones.
constexpr std::size_t kFinishedKept = 2000;

}  // namespace

Witness::Witness(const bushd::config::Config& config, const bushd::sim::Bus& bus,
                 const bushd::sim::Plant& plant, Recent& recent)
    : config_(config),
      plant_(plant),
      recent_(recent),
      positions_(config, bus, plant),
      starts_(config),
      units_(config),
      crates_(config),
      shutter_(config) {
  for (const bushd::config::Motor& motor : config.motors) {
    motor_by_name_[motor.name] = motors_.size();
    const bushd::config::Bus& bus_of = config.bus_of(motor);
    std::int64_t excess = 0;
    for (const bushd::config::Group& group : config.groups) {
      excess = std::max(excess,
                        own_ramp_excess(group.table->view(), bus_of.tick_us * 1000, bus_of.format));
    }
    motors_.push_back({.name = motor.name,
                       .mcu = motor.mcu.value,
                       .output = motor.output.value,
                       .own_ramp_excess = excess});
  }
  states_.resize(config.mcus.size());
  present_.resize(config.mcus.size(), true);
  heard_ns_.resize(config.mcus.size(), 0);
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

void Witness::daemon_ends(TimeNs now_ns) {
  beginnings_.daemon_ends(now_ns);
  stop_accepted({.client = {}, .ask = Ask::kStop});
}

void Witness::arrives(const Request& request) {
  arrivals_.arrives(request);
}

void Witness::daemon_started(TimeNs now_ns) {
  arrivals_.daemon_started();
  beginnings_.other_daemon();
  promise_.daemon_started();
  none_waits_ns_ = now_ns;
  asked_.clear();
  finished_.clear();
  for (Motor& motor : motors_) {
    motor.move.reset();
    motor.over = motor.stops = motor.pauses = false;
    motor.held = offsets_kept_ && motor.held_on_disk;
    motor.idle_checks = 0;
    motor.held_at.reset();
    motor.stopped_at.reset();
  }
  std::fill(states_.begin(), states_.end(), std::nullopt);
  forget_programs();
  positions_.daemon_started();
  units_.daemon_started(offsets_kept_);
  crates_.daemon_started(now_ns, offsets_kept_);
  shutter_.daemon_started(now_ns, offsets_kept_);
}

void Witness::pressed(TimeNs now_ns, std::size_t motor) {
  motors_[motor].pressed_ns = now_ns;
}

void Witness::carried_out(TimeNs now_ns, const Request& request) {
  arrivals_.carried_out(request);
  if (request.ask == Ask::kClearFaults) beginnings_.faults_are_cleared();
  asked_[key_of(request.id())] =
      Asked{.request = request, .since_ns = now_ns, .due_since_ns = now_ns};
}

void Witness::reply(TimeNs now_ns, const Key& key, std::size_t kind, const api::Reply& reply) {
  if (const auto wrong = promise_.answered(key, kind, reply)) return violated(now_ns, *wrong);
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
    if (asked.request.ask == Ask::kHold) hold_done(key, *completed);
    if (asked.accepted) {
      finished(now_ns, key, asked, *completed);
    } else {
      over_at_once(now_ns, key, asked, *completed);
    }
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
  if (asked.request.ask == Ask::kJog) ++jogs_by_result_["refused"];
  if (asked.request.ask == Ask::kRunPrograms) ++programs_by_result_["refused"];
}

void Witness::forget_some() {
  if (finished_.size() <= kFinishedKept) return;
  asked_.erase(finished_.front());
  finished_.pop_front();
}

void Witness::state(TimeNs now_ns, std::size_t mcu, const api::StateSnapshot& state) {
  if (config_.mcus[mcu].id != state.mcu) {
    return violated(now_ns, "a state of another MCU: " + state.mcu);
  }
  if (!states_[mcu] || states_[mcu]->state != state.state) {
    recent_.note(now_ns, fmt::format("{} {} {}", state.mcu, word(state.state), state.detail));
  }
  states_[mcu] = state;
  if (state.state == api::McuState::kReady && state.program.empty()) {
    for (Motor& motor : motors_) motor.program_may_go_on &= motor.mcu != mcu;
  }
  if (const auto wrong = positions_.check(now_ns, mcu, state)) violated(now_ns, *wrong);
  for (const api::MotorState& motor : state.motors) {
    const auto wrong = units_.check(index_of(*find(motor.name)), motor);
    if (wrong) violated(now_ns, *wrong);
    if (is_shutter(*find(motor.name))) shutter_.said(now_ns, motor);
  }
}

void Witness::description(TimeNs now_ns, const api::Description& said) {
  for (const api::MotorDescription& motor : said.motors) {
    const auto wrong = units_.check(index_of(*find(motor.name)), motor);
    if (wrong) violated(now_ns, *wrong);
  }
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
  return promise_.waits() || crates_.any_open() ||
         std::any_of(asked_.begin(), asked_.end(),
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
