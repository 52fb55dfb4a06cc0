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

// In the daemon's count.
std::optional<std::int64_t> Witness::target_asked(const Motor& motor, const Request& request,
                                                  std::size_t i) const {
  if (!trusted(motor) || !offset(motor)) return std::nullopt;
  if (request.ask == Ask::kMoveTo) return position_asked(request, i);
  const auto base = motor.move ? motor.target : plant_steps(motor);
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
    const auto& motors = states_[motor.mcu]->motors;
    const std::int64_t said =
        std::ranges::find(motors, motor.name, &api::MotorState::name)->position_steps;
    if (*target >= std::min({limits->low, stands, said}) &&
        *target <= std::max({limits->high, stands, said})) {
      continue;
    }
    violated(now_ns, fmt::format("{} was accepted to go to {}, and its limits are {} and {}: {}",
                                 motor.name, *target, limits->low, limits->high, text_of(request)));
  }
}

// "m03: target 12.3 mm is beyond the soft limit at 12 mm; ..."
void Witness::check_refusal(TimeNs now_ns, const Asked& asked, const std::string& reason) {
  const Request& request = asked.request;
  if (reason.find("is beyond the soft limit") == std::string::npos) return;
  const auto named = std::ranges::find(request.motors, reason.substr(0, reason.find(':')));
  if (named == request.motors.end()) return violated(now_ns, "a limit of no motor: " + reason);
  const Motor& motor = *find(*named);
  const auto limits = units_.limits(index_of(motor));
  if (!limits) return violated(now_ns, "there is no such limit: " + reason);
  const auto i = static_cast<std::size_t>(named - request.motors.begin());
  const auto target = target_asked(motor, request, i);
  if (!target || *target < limits->low || *target > limits->high) return;
  violated(now_ns, fmt::format("refused, and {} is within {} and {}: {}", *target, limits->low,
                               limits->high, reason));
}

// From the first step to the last, which came before this is told.
void Witness::check_speed(TimeNs now_ns, const Motor& motor, const Asked& asked,
                          std::size_t index) {
  const std::int64_t floor_ns = units_.floor_ns(index_of(motor), asked.request);
  if (floor_ns == 0) return;
  const std::int64_t steps = std::abs(plant_steps(motor) - *asked.from[index]);
  // A tick, in which steps lie on a line; and crystals.
  const TimeNs least_ns =
      (steps - 1) * (floor_ns - floor_ns / 1000) - 2 * config_.buses[0].tick_ns();
  const TimeNs took_ns = now_ns - *asked.first_step_ns[index];
  if (took_ns >= least_ns) return;
  violated(now_ns,
           fmt::format("{} made {} steps in {} us, and one takes {} us at least: {}", motor.name,
                       steps, took_ns / 1000, floor_ns / 1000, text_of(asked.request)));
}

}  // namespace bushfaults
