// Random specs of tables, and what a table's codes say.
#pragma once

#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tables/profiles/make.h"

namespace bushd::test {

inline double random_between(double low, double high) {
  constexpr int kGrain = 1'000'000;
  return low + (high - low) * *rc::gen::inRange(0, kGrain + 1) / kGrain;
}

// Evenly spread over decades.
inline double random_scale(double low, double high) {
  return std::exp(random_between(std::log(low), std::log(high)));
}

// A start of 1..2000 steps/s and up to 100 times that, with a profile that reaches it in 2..5000
// steps.
inline tables::profiles::Spec random_spec(tables::profiles::Profile profile) {
  tables::profiles::Spec spec{.name = "random"};
  spec.start_hz = random_scale(1, 2000);
  spec.max_hz = spec.start_hz * random_scale(1.01, 100);
  const double steps = random_scale(2, 5000);
  spec.accel.profile = profile;
  spec.accel.acceleration =
      (spec.max_hz * spec.max_hz - spec.start_hz * spec.start_hz) / (2 * steps);
  return spec;
}

// Its ramp in some stretches, the first may be at the start speed; back the same way.
inline tables::profiles::Spec random_piecewise_spec() {
  tables::profiles::Spec spec = random_spec(tables::profiles::Profile::kPiecewise);
  spec.accel.acceleration.reset();
  auto& legs = spec.accel.legs;
  double speed_hz = spec.start_hz;
  if (*rc::gen::arbitrary<bool>()) legs.push_back({random_scale(1, 100), speed_hz});
  for (int more = *rc::gen::inRange(0, 4); more > 0; --more) {
    speed_hz = random_between(speed_hz, spec.max_hz);
    legs.push_back({random_scale(1, 1000), speed_hz});
  }
  legs.push_back({random_scale(2, 1000), spec.max_hz});
  spec.decel = spec.accel;
  auto& back = spec.decel->legs;
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const std::size_t there = legs.size() - 1 - i;
    back[i] = {legs[there].steps, there == 0 ? spec.start_hz : legs[there - 1].to_hz};
  }
  return spec;
}

inline tables::profiles::Spec random_pto_spec() {
  tables::profiles::Spec spec = random_spec(tables::profiles::Profile::kPto);
  spec.accel.time_s = (spec.max_hz - spec.start_hz) / *spec.accel.acceleration;
  spec.accel.acceleration.reset();
  spec.decel = spec.accel;
  return spec;
}

// The greatest acceleration of the accelerating side.
inline double greatest_acceleration(const tables::profiles::Spec& spec) {
  if (spec.accel.acceleration) return *spec.accel.acceleration;
  if (spec.accel.time_s) return (spec.max_hz - spec.start_hz) / *spec.accel.time_s;
  double greatest = 0;
  double from_hz = spec.start_hz;
  for (const tables::profiles::Leg& leg : spec.accel.legs) {
    greatest = std::max(greatest, (leg.to_hz * leg.to_hz - from_hz * from_hz) / (2 * leg.steps));
    from_hz = leg.to_hz;
  }
  return greatest;
}

inline std::vector<double> delays_of(const std::vector<std::uint16_t>& codes,
                                     std::uint32_t time_unit_ns) {
  std::vector<double> delays;
  for (const std::uint16_t code : codes) delays.push_back(1e-9 * code * time_unit_ns);
  return delays;
}

// The greatest acceleration that two neighbouring delays of a motion with |a| <= `bound` can show.
//
// If the exact delays are p and q, the mean speeds over them are 1/p and 1/q, and the middles of
// the two stretches are (p + q) / 2 apart, so 1/q - 1/p <= bound (p + q) / 2. Rounding up makes
// P < p + u and Q < q + u out of them, with the time unit u; Q >= q and p > P - u, so
//   1/Q - 1/P <= 1/q - 1/p + (1/p - 1/P) <= bound (P + Q) / 2 + (1/(P - u) - 1/P).
inline double rounded_bound(double bound, double slower_s, double faster_s, double unit_s) {
  const double mean_s = 0.5 * (slower_s + faster_s);
  return bound + (1 / (slower_s - unit_s) - 1 / slower_s) / mean_s;
}

inline double acceleration_between(double slower_s, double faster_s) {
  return (1 / faster_s - 1 / slower_s) / (0.5 * (slower_s + faster_s));
}

}  // namespace bushd::test
