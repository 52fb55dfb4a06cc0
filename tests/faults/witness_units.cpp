// The part of the witness that is about units, limits and speeds.
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "witness.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;

constexpr std::int64_t kMost = INT32_MAX;

}  // namespace

bool Witness::sets_offset(const Units& units, std::size_t motor, const Request& request) {
  return request.user && !request.dial && units.has_unit(motor);
}

std::optional<std::int64_t> Witness::position_asked(const Request& request, std::size_t i) const {
  if (!request.user) return request.steps[i];
  const std::size_t motor = index_of(*find(request.motors[i]));
  if (request.dial) return units_.steps_of_dial(motor, request.steps[i]);
  return units_.steps_of_position(motor, request.steps[i]);
}

std::int64_t Witness::distance_asked(const Request& request, std::size_t i) const {
  if (!request.user) return request.steps[i];
  return units_.steps_of_distance(index_of(*find(request.motors[i])), request.steps[i]);
}

void Witness::position_accepted(const Request& request, std::size_t i) {
  const Motor& motor = *find(request.motors[i]);
  const std::size_t index = index_of(motor);
  if (sets_offset(units_, index, request)) {
    std::optional<std::int64_t> stands;
    if (trusted(motor) && offset(motor)) stands = plant_steps(motor) - *offset(motor);
    return units_.was_set(index, request.steps[i], stands);
  }
  if (const auto set = position_asked(request, i)) positions_.may_be_set(index, *set);
}

// The daemon's count is that of the plant.
bool Witness::trusted(const Motor& motor) const {
  const auto& state = states_[motor.mcu];
  if (!state) return false;
  const auto found = std::ranges::find(state->motors, motor.name, &api::MotorState::name);
  return found->trust == api::Trust::kKnown || found->trust == api::Trust::kRestored;
}

// As the daemon has said last.
std::int64_t Witness::said_steps(const Motor& motor) const {
  const auto& motors = states_[motor.mcu]->motors;
  return std::ranges::find(motors, motor.name, &api::MotorState::name)->position_steps;
}

// In the daemon's count.
std::optional<std::int64_t> Witness::target_asked(const Motor& motor, const Request& request,
                                                  std::size_t i) const {
  // How far a program goes nobody knows, and of a trajectory the last part may come later and be
  // refused: neither acceptance nor refusal is judged by that.
  if (!trusted(motor) || !offset(motor) || request.unknown_way) return std::nullopt;
  if (request.ask == Ask::kMoveTo) return position_asked(request, i);
  const auto base = base_of(motor);
  if (!base || std::abs(request.steps[i]) > kMost) return std::nullopt;
  return *base - *offset(motor) + distance_asked(request, i);
}

// A motor beyond a limit may be moved back: it was where it is, or where it was said to be.
void Witness::check_limits(TimeNs now_ns, const Asked& asked) {
  const Request& request = asked.request;
  if (!request.is_move()) return;
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    const Motor& motor = *find(request.motors[i]);
    const auto limits = units_.limits(index_of(motor));
    const auto target = limits ? target_asked(motor, request, i) : std::nullopt;
    if (!target) continue;
    const std::int64_t stands = plant_steps(motor) - *offset(motor);
    const std::int64_t said = said_steps(motor);
    const std::int64_t low = std::min({limits->low, stands, said});
    const std::int64_t high = std::max({limits->high, stands, said});
    for (const std::int64_t leg : legs_to(motor, request, *target + *offset(motor))) {
      const std::int64_t end = leg - *offset(motor);
      if (end >= low && end <= high) continue;
      violated(now_ns, fmt::format("{} was accepted to go to {}, and its limits are {} and {}: {}",
                                   motor.name, end, limits->low, limits->high, text_of(request)));
    }
  }
}

// "m03: target 12.3 mm is beyond the soft limit at 12 mm; ...", "m03: the start of its last
// approach, for backlash: target ...", "m03: stands at or beyond its soft limit, at ..."
void Witness::check_refusal(TimeNs now_ns, const Asked& asked, const std::string& reason) {
  const Request& request = asked.request;
  if (!request.points.empty()) return;  // each of them may be the reason
  if (reason.find(" beyond the soft limit") == std::string::npos &&
      reason.find(" beyond its soft limit, at") == std::string::npos) {
    return;
  }
  const auto named = std::ranges::find(request.motors, reason.substr(0, reason.find(':')));
  if (named == request.motors.end()) return violated(now_ns, "a limit of no motor: " + reason);
  const auto i = static_cast<std::size_t>(named - request.motors.begin());
  if (refused_for_good_reason(asked, *find(*named), i, reason)) return;
  violated(now_ns, "no reason to refuse: " + reason);
}

bool Witness::refused_for_good_reason(const Asked& asked, const Motor& motor, std::size_t i,
                                      const std::string& reason) const {
  const Request& request = asked.request;
  const auto limits = units_.limits(index_of(motor));
  if (!limits) return false;
  if (request.ask == Ask::kJog) {
    if (!trusted(motor) || !offset(motor)) return true;
    // Where it is, or was heard last.
    const auto [low, high] = std::minmax({plant_steps(motor) - *offset(motor), said_steps(motor)});
    return request.speed_micro > 0 ? high >= limits->high : low <= limits->low;
  }
  const auto target = target_asked(motor, request, i);
  if (!target) return true;
  const auto legs = legs_to(motor, request, *target + *offset(motor));
  const bool of_start = reason.find("for backlash") != std::string::npos;
  if (of_start && legs.size() == 1) return motor.move && motor.over;
  const std::int64_t end = (of_start ? legs.front() : legs.back()) - *offset(motor);
  return end < limits->low || end > limits->high;
}

// The speed of a run, from the first step to the last, which came before this is told.
void Witness::check_speed(TimeNs now_ns, const Motor& motor, const Asked& asked,
                          std::size_t index) {
  const std::size_t of = index_of(motor);
  const auto& legs = asked.legs[index];
  const bool last = !legs.empty() && asked.leg[index] + 1 == legs.size();
  const bool approach = last && asked.request.ask != Ask::kArm && units_.backlash_steps(of) != 0;
  const std::int64_t shortest_delay_ns = approach
                                             ? units_.approach_shortest_delay_ns(of, asked.request)
                                             : units_.shortest_delay_ns(of, asked.request);
  if (shortest_delay_ns == 0 || asked.jog || !motor.run_from) return;
  const std::int64_t steps = std::abs(plant_steps(motor) - *motor.run_from);
  // A tick, in which steps lie on a line; and crystals.
  const TimeNs least_ns =
      (steps - 1) * (shortest_delay_ns - shortest_delay_ns / 1000) - 2 * config_.buses[0].tick_ns();
  const TimeNs took_ns = now_ns - plant_.first_step_ns(motor.mcu, motor.output);
  if (took_ns >= least_ns) return;
  violated(now_ns,
           fmt::format("{} made {} steps in {} us, and one takes {} us at least: {}", motor.name,
                       steps, took_ns / 1000, shortest_delay_ns / 1000, text_of(asked.request)));
}

void Witness::check_home_speed(TimeNs now_ns, const Asked& asked, std::size_t index) {
  const Motor& motor = *find(asked.request.motors[index]);
  const auto& home = config_.motors[index_of(motor)].home;
  const auto& from = asked.from[index];
  if (!home || !home->speed || !from) return;
  const Request at_speed{.client = {},
                         .ask = Ask::kHome,
                         .speed_micro = static_cast<std::int64_t>(*home->speed * 1e6)};
  const std::int64_t shortest_delay_ns = units_.shortest_delay_ns(index_of(motor), at_speed);
  const std::int64_t steps = std::abs(plant_steps(motor) - *from);
  if (now_ns - asked.since_ns >= steps * (shortest_delay_ns - shortest_delay_ns / 1000)) return;
  violated(now_ns, fmt::format("{} made {} steps to its home, too fast", motor.name, steps));
}

// Its target is reached from the side that its backlash names, and from as far.
void Witness::check_approach(TimeNs now_ns, const Motor& motor, const Asked& asked,
                             std::size_t index) {
  const std::int64_t backlash = units_.backlash_steps(index_of(motor));
  if (backlash == 0 || asked.jog || asked.request.ask == Ask::kArm) return;
  const std::int64_t stands = plant_steps(motor);
  if (!motor.run_from) {
    return violated(now_ns, motor.name + " has made no last approach: " + text_of(asked.request));
  }
  const std::int64_t way = stands - *motor.run_from;
  const auto& legs = asked.legs[index];
  approaches_ += legs.size() > 1 ? 1u : 0u;
  const bool right_side = way == 0 || (way > 0) == (backlash > 0);
  // Paused on its way, it may have begun again nearer.
  if (right_side && (legs.size() < 2 || std::abs(way) <= std::abs(backlash))) return;
  violated(now_ns, fmt::format("{} came {} steps to its target, and its backlash is {}: {}",
                               motor.name, way, backlash, text_of(asked.request)));
}

// Two ticks: reports are of whole ones, and crystals differ.
void Witness::check_settled(TimeNs now_ns, const Motor& motor, const Asked& asked) {
  const auto& run_from = motor.run_from;
  const std::int64_t stands = plant_steps(motor);
  // What a stop, or a client that falls silent, ends does not wait.
  if (asked.jog || motor.stops || motor.pauses || !run_from || stands == *run_from) return;
  const std::int64_t settle_ns = config_.motors[index_of(motor)].settle_ms * 1'000'000;
  const TimeNs since_ns = now_ns - settle_ns + 2 * config_.buses[0].tick_ns();
  if (since_ns >= now_ns ||
      plant_.position_steps_before(motor.mcu, motor.output, since_ns) == stands) {
    return;
  }
  violated(now_ns, fmt::format("{} has not stood for {} ms: {}", motor.name, settle_ns / 1'000'000,
                               text_of(asked.request)));
}

}  // namespace bushfaults
