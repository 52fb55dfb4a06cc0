// Random specs of tables, and what a table's codes say.
#pragma once

#include <rapidcheck.h>

#include <cmath>
#include <vector>

#include "tables/laws/make.h"

namespace bushd::test {

inline double random_between(double low, double high) {
  constexpr int kGrain = 1'000'000;
  return low + (high - low) * *rc::gen::inRange(0, kGrain + 1) / kGrain;
}

// Evenly spread over decades.
inline double random_scale(double low, double high) {
  return std::exp(random_between(std::log(low), std::log(high)));
}

// A start of 1..2000 steps/s and up to 100 times that, with a law that reaches it in 2..5000 steps.
inline tables::laws::Spec random_spec(tables::laws::Law law) {
  tables::laws::Spec spec{.name = "random"};
  spec.start_hz = random_scale(1, 2000);
  spec.max_hz = spec.start_hz * random_scale(1.01, 100);
  const double steps = random_scale(2, 5000);
  spec.accel.law = law;
  spec.accel.acceleration =
      (spec.max_hz * spec.max_hz - spec.start_hz * spec.start_hz) / (2 * steps);
  return spec;
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
