#include "sim/power_stage.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace bushd::sim {
namespace {

// Within it the back EMF is constant.
constexpr TimeNs kStrideNs = 2'000;
// Longer than the chopper's period.
constexpr TimeNs kPhaseNs = 30'000;
// A motor that has not stepped for so much longer than before stands.
constexpr TimeNs kSlower = 4;

// Where the windings draw the rotor, in turns; they are a quarter apart.
double direction_of(std::uint8_t windings) {
  double x = 0;
  double y = 0;
  for (std::size_t w = 0; w < PowerStage::kWindings; ++w) {
    if ((windings >> w & 1) == 0) continue;
    x += w == 0 ? 1 : w == 2 ? -1 : 0;
    y += w == 1 ? 1 : w == 3 ? -1 : 0;
  }
  return std::atan2(y, x) / (2 * std::numbers::pi);
}

}  // namespace

// A winding that the chopper has cut comes on again within its period; one whose phase is over does
// not. So a change counts when it has lasted for longer, and all that has changed by then is one
// step.
void PowerStage::follow_phase() {
  std::uint8_t on = 0;
  for (std::size_t w = 0; w < kWindings; ++w) {
    if ((outputs_ >> w & 1) != 0) last_on_ns_[w] = now_ns_;
    const bool recently = last_on_ns_[w] >= 0 && now_ns_ - last_on_ns_[w] < kPhaseNs;
    if (recently) on = static_cast<std::uint8_t>(on | 1u << w);
  }
  if (on == phase_) return;
  if (!changes_at_ns_) changes_at_ns_ = now_ns_ + kPhaseNs;
  if (now_ns_ < *changes_at_ns_) return;
  changes_at_ns_.reset();
  take_step(on);
}

void PowerStage::take_step(std::uint8_t windings) {
  const bool begins = phase_ == 0;
  phase_ = windings;
  if (windings == 0) return;
  const double angle = direction_of(windings);
  turn_ = begins ? 0 : angle - angle_ - std::round(angle - angle_);
  angle_ = angle;
  step_ns_ = begins ? 0 : now_ns_ - stepped_ns_;
  stepped_ns_ = now_ns_;
}

double PowerStage::back_emf_v(std::size_t winding, TimeNs at_ns) const {
  const TimeNs since_ns = at_ns - stepped_ns_;
  if (step_ns_ == 0 || turn_ == 0 || since_ns > kSlower * step_ns_) return 0;
  const double full_steps = std::abs(turn_) * rules_.full_steps_per_turn;
  const double hz = full_steps * 1e9 / static_cast<double>(step_ns_);
  const double share =
      std::min(1.0, static_cast<double>(since_ns) / static_cast<double>(step_ns_)) - 0.5;
  const double lag = turn_ > 0 ? 0.25 : -0.25;
  const double rotor = angle_ - lag + turn_ * share;
  const double ahead = static_cast<double>(winding) / kWindings - rotor;
  // Against the current of a winding that draws the rotor on, whichever way it turns.
  const double sign = turn_ > 0 ? 1 : -1;
  return sign * rules_.back_emf_v_per_hz * hz * std::sin(2 * std::numbers::pi * ahead);
}

double PowerStage::after(std::size_t winding, double current_a, TimeNs at_ns, TimeNs ns) const {
  const bool on = (outputs_ >> winding & 1) != 0;
  if (!on && current_a <= 0) return 0;
  const double emf_v = back_emf_v(winding, at_ns);
  double ohm = rules_.resistance_ohm;
  double volt = -emf_v;
  if (on) {
    volt += rules_.supply_v;
    ohm += rules_.switch_ohm + rules_.sense_ohm;
  } else {
    volt -= fast_ ? rules_.supply_v + 2 * rules_.diode_v : rules_.diode_v;
  }
  const double end_a = volt / ohm;
  const double share = std::exp(-static_cast<double>(ns) * 1e-9 * ohm / rules_.inductance_h);
  return std::max(0.0, end_a + (current_a - end_a) * share);
}

void PowerStage::advance(TimeNs now_ns) {
  assert(now_ns >= now_ns_);
  while (now_ns_ < now_ns) {
    const TimeNs stride_ns = std::min(kStrideNs, now_ns - now_ns_);
    for (std::size_t w = 0; w < kWindings; ++w) {
      current_a_[w] = after(w, current_a_[w], now_ns_, stride_ns);
    }
    now_ns_ += stride_ns;
    follow_phase();
  }
}

void PowerStage::set_outputs(TimeNs now_ns, std::uint8_t outputs) {
  advance(now_ns);
  outputs_ = outputs;
}

void PowerStage::set_fast_decay(TimeNs now_ns, bool fast) {
  advance(now_ns);
  fast_ = fast;
}

void PowerStage::set_reference(TimeNs now_ns, double reference_a) {
  advance(now_ns);
  reference_a_ = reference_a;
}

std::optional<std::size_t> PowerStage::winding_on(std::size_t pair) const {
  for (const std::size_t w : {pair, pair + kPairs}) {
    if ((outputs_ >> w & 1) != 0) return w;
  }
  return std::nullopt;
}

bool PowerStage::trips(std::size_t pair) const {
  const auto winding = winding_on(pair);
  return winding && current_a_[*winding] >= reference_a_;
}

std::optional<TimeNs> PowerStage::next_trip_ns(std::size_t pair, TimeNs horizon_ns) const {
  const auto winding = winding_on(pair);
  if (!winding) return std::nullopt;
  double current_a = current_a_[*winding];
  for (TimeNs at_ns = now_ns_; at_ns < now_ns_ + horizon_ns; at_ns += kStrideNs) {
    if (current_a >= reference_a_) return at_ns;
    const double next_a = after(*winding, current_a, at_ns, kStrideNs);
    if (next_a >= reference_a_) {
      // Within a stride it is as good as a straight line, rounded up to the next ns.
      const double share = (reference_a_ - current_a) / (next_a - current_a);
      return at_ns + static_cast<TimeNs>(std::ceil(share * static_cast<double>(kStrideNs)));
    }
    current_a = next_a;
  }
  return std::nullopt;
}

}  // namespace bushd::sim
