#include "sim/rotor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bushd::sim {
namespace {

constexpr TimeNs kStepNs = 2000;
constexpr double kFullStepRad = std::numbers::pi / 2;  // electrical

double pull_out_nm(const std::vector<RotorRules::Point>& curve, double speed_steps_per_s) {
  const RotorRules::Point* low = &curve.front();
  if (speed_steps_per_s <= low->speed_steps_per_s) return low->torque_nm;
  for (const RotorRules::Point& high : curve) {
    if (speed_steps_per_s <= high.speed_steps_per_s) {
      return std::lerp(low->torque_nm, high.torque_nm,
                       (speed_steps_per_s - low->speed_steps_per_s) /
                           (high.speed_steps_per_s - low->speed_steps_per_s));
    }
    low = &high;
  }
  return 0;
}

}  // namespace

Rotor::Rotor(const RotorRules& rules)
    : rules_(&rules),
      step_rad_(kFullStepRad * rules.full_steps_per_turn / rules.steps_per_turn),
      pole_pairs_(rules.full_steps_per_turn / 4),
      peak_factor_(step_rad_ / 2 / std::sin(step_rad_ / 2)) {
  const double stiffness_nm_per_rad = pole_pairs_ * peak_factor_ * rules.pull_out.front().torque_nm;
  turn_field_every(0);
  damping_nms_ = 2 * rules.damping_ratio * std::sqrt(stiffness_nm_per_rad * rules.inertia_kgm2);
}

void Rotor::step(TimeNs t_ns, bool forward) {
  advance_to(t_ns);
  interval_ns_ = last_step_ns_ && forward == forward_ ? t_ns - *last_step_ns_ : 0;
  last_step_ns_ = t_ns;
  forward_ = forward;
  steps_ += forward ? 1 : -1;
  lag_rad_ += forward ? step_rad_ : -step_rad_;
  turn_field_every(interval_ns_);
}

void Rotor::advance_to(TimeNs t_ns) {
  while (now_ns_ < t_ns) {
    const TimeNs dt_ns = std::min(kStepNs, t_ns - now_ns_);
    now_ns_ += dt_ns;
    // A step that is overdue tells that the field has become slower.
    const bool overdue = interval_ns_ > 0 && now_ns_ - *last_step_ns_ > interval_ns_;
    if (overdue) turn_field_every(now_ns_ - *last_step_ns_);
    integrate(static_cast<double>(dt_ns) * 1e-9);
    greatest_lag_rad_ = std::max(greatest_lag_rad_, std::abs(lag_rad_));
    if (!slipped_ns_ && greatest_lag_rad_ > 2 * kFullStepRad) slipped_ns_ = now_ns_;
  }
}

void Rotor::turn_field_every(TimeNs interval_ns) {
  const double field_hz = interval_ns == 0 ? 0 : 1e9 / static_cast<double>(interval_ns);
  field_rad_per_s_ =
      (forward_ ? field_hz : -field_hz) * 2 * std::numbers::pi / rules_->steps_per_turn;
  peak_nm_ = peak_factor_ * pull_out_nm(rules_->pull_out, field_hz);
}

void Rotor::integrate(double dt_s) {
  const double torque_nm =
      peak_nm_ * std::sin(lag_rad_) + damping_nms_ * (field_rad_per_s_ - speed_rad_per_s_);
  const double free = speed_rad_per_s_ + dt_s * torque_nm / rules_->inertia_kgm2;
  // Friction slows down, to a stand at most.
  const double slowed = std::abs(free) - dt_s * rules_->friction_nm / rules_->inertia_kgm2;
  speed_rad_per_s_ = std::copysign(std::max(0.0, slowed), free);
  lag_rad_ -= pole_pairs_ * dt_s * speed_rad_per_s_;
}

double Rotor::lag_full_steps() const {
  return lag_rad_ / kFullStepRad;
}

double Rotor::greatest_lag_full_steps() const {
  return greatest_lag_rad_ / kFullStepRad;
}

std::int64_t Rotor::lost_full_steps() const {
  return 4 * std::llround(lag_full_steps() / 4);
}

std::int64_t Rotor::position_full_steps() const {
  const double full_steps = static_cast<double>(steps_) * step_rad_ / kFullStepRad;
  return std::llround(full_steps - lag_full_steps());
}

}  // namespace bushd::sim
