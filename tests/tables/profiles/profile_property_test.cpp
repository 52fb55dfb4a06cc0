// The continuous profiles against their textbook formulas, for random parameters.
#include <gtest/gtest.h>

#include <functional>
#include <numeric>

#include "tables/profiles/random_spec.h"

namespace bushd::test {
namespace {

using tables::TableContent;
using tables::profiles::make_content;
using tables::profiles::Profile;
using tables::profiles::Spec;

constexpr double kNoise = 1e-6;  // of a time unit, or relative

TableContent made(const Spec& spec) {
  auto content = make_content(spec);
  RC_LOG() << "start " << spec.start_hz << " max " << spec.max_hz << " a "
           << spec.accel.acceleration.value_or(0) << "\n";
  if (!content) RC_FAIL(content.error().text());
  return *content;
}

// Codes of 16 bits cannot hold every ratio of speeds with the units that follow from the start.
Profile random_profile() {
  return *rc::gen::element(Profile::kConstant, Profile::kScurve, Profile::kExponential);
}

Spec random_motion() {
  switch (*rc::gen::inRange(0, 5)) {
    case 0:
      return random_piecewise_spec();
    case 1:
      return random_pto_spec();
    default:
      return random_spec(random_profile());
  }
}

TEST(Profiles, NeverFasterThanTheMaximum) {
  EXPECT_TRUE(rc::check("every delay at least that of the maximum speed", [] {
    const Spec spec = random_motion();
    const TableContent content = made(spec);
    for (const double delay : delays_of(content.accel, content.time_unit_ns)) {
      RC_ASSERT(delay * spec.max_hz >= 1 - kNoise);
    }
  }));
}

TEST(Profiles, BeginAtTheStartSpeedAndReachTheMaximum) {
  EXPECT_TRUE(rc::check("first and last code", [] {
    const Spec spec = random_motion();
    const TableContent content = made(spec);
    const double unit_s = content.time_unit_ns * 1e-9;
    RC_ASSERT(content.accel.front() == std::ceil(1 / spec.start_hz / unit_s - kNoise));
    RC_ASSERT(content.accel.back() == std::ceil(1 / spec.max_hz / unit_s - kNoise));
  }));
}

TEST(Profiles, AccelerationStaysWithinItsBound) {
  EXPECT_TRUE(rc::check("between any two neighbouring codes", [] {
    const Spec spec = random_motion();
    const TableContent content = made(spec);
    const double unit_s = content.time_unit_ns * 1e-9;
    const auto delays = delays_of(content.accel, content.time_unit_ns);
    for (std::size_t i = 0; i + 1 < delays.size(); ++i) {
      const double bound = rounded_bound(greatest_acceleration(spec), delays[i], delays[i + 1],
                                         unit_s * (1 + kNoise));
      RC_ASSERT(acceleration_between(delays[i], delays[i + 1]) <= bound * (1 + kNoise));
    }
  }));
}

TEST(Profiles, DecelerationIsTheMirrorImage) {
  EXPECT_TRUE(rc::check("unless told otherwise", [] { RC_ASSERT(!made(random_motion()).decel); }));
}

TEST(Profiles, DecelerationOfItsOwnIsThatProfileReversed) {
  EXPECT_TRUE(rc::check("as if it were the accelerating one", [] {
    Spec spec = random_spec(random_profile());
    spec.decel = spec.accel;
    spec.decel->profile = random_profile();
    spec.decel->acceleration = *spec.accel.acceleration * random_between(0.5, 2);
    spec.time_unit_ns = 20'000;
    const auto both = make_content(spec);
    RC_PRE(both.has_value());
    Spec other = spec;
    other.accel = *spec.decel;
    other.decel.reset();
    const TableContent mirrored = made(other);
    std::vector<std::uint16_t> decel = both->decel.value_or(both->accel);
    if (both->decel) std::reverse(decel.begin(), decel.end());
    RC_ASSERT(decel == mirrored.accel);
  }));
}

// When x(t), the integral of `speed` (which is constant from `end_s` on), passes 1, 2, ..: by
// Simpson's rule over short stretches.
std::vector<double> step_times(const std::function<double(double)>& speed, double end_s,
                               std::size_t count) {
  constexpr int kStretches = 200'000;
  std::vector<double> times;
  double x = 0;
  const double dt = end_s / kStretches;
  for (int i = 0; i < kStretches && times.size() < count; ++i) {
    const double t = i * dt;
    const double from = speed(t);
    const double to = speed(t + dt);
    const double dx = dt / 6 * (from + 4 * speed(t + dt / 2) + to);
    while (x + dx >= static_cast<double>(times.size() + 1) && times.size() < count) {
      const double share = (static_cast<double>(times.size() + 1) - x) / dx;
      // Within the stretch x is a parabola: one correction of the straight line is enough.
      times.push_back(t + dt * (share + share * (1 - share) * (to - from) / (to + from)));
    }
    x += dx;
  }
  while (times.size() < count) {
    times.push_back(end_s + (static_cast<double>(times.size() + 1) - x) / speed(end_s));
  }
  return times;
}

struct Formula {
  std::function<double(double)> speed;
  double end_s;
};

Formula textbook(const Spec& spec) {
  const double v0 = spec.start_hz;
  const double v1 = spec.max_hz;
  const double a = greatest_acceleration(spec);
  switch (spec.accel.profile) {
    case Profile::kExponential: {
      const double rate = a * (1 - 1 / spec.accel.fall) / (v1 - v0);
      const double end_s = std::log(spec.accel.fall) / rate;
      return {[=](double t) { return t >= end_s ? v1 : v0 + a / rate * (1 - std::exp(-rate * t)); },
              end_s};
    }
    case Profile::kScurve: {
      const double end_s = 2 * (v1 - v0) / a;
      return {[=](double t) {
                const double u = std::min(1.0, t / end_s);
                return v0 + (v1 - v0) * (u < 0.5 ? 2 * u * u : 1 - 2 * (1 - u) * (1 - u));
              },
              end_s};
    }
    case Profile::kPiecewise: {
      // Linear over time between the times and speeds at the legs' ends.
      std::vector<std::pair<double, double>> ends{{0, v0}};
      for (const auto& [steps, to_hz] : spec.accel.legs) {
        const auto& [time_s, from_hz] = ends.back();
        ends.emplace_back(time_s + 2 * steps / (from_hz + to_hz), to_hz);
      }
      return {[=](double t) {
                std::size_t i = 1;
                while (i + 1 < ends.size() && t > ends[i].first) ++i;
                const auto& [t0, from_hz] = ends[i - 1];
                const auto& [t1, to_hz] = ends[i];
                return from_hz + (to_hz - from_hz) * std::min(1.0, (t - t0) / (t1 - t0));
              },
              ends.back().first};
    }
    default:
      return {[=](double t) { return std::min(v1, v0 + a * t); }, (v1 - v0) / a};
  }
}

TEST(Profiles, TimeIsTheSumOfTheFormula) {
  const auto property = [] {
    const Spec spec = random_motion();
    const TableContent content = made(spec);
    const Formula formula = textbook(spec);
    const double unit_s = content.time_unit_ns * 1e-9;
    // The first step is made at the start speed, the others follow the formula.
    const auto times = step_times(formula.speed, formula.end_s, content.accel.size() - 1);
    double sum_s = 0;
    for (std::size_t k = 1; k < content.accel.size(); ++k) {
      sum_s += content.accel[k] * unit_s;
      const double exact_s = times[k - 1];
      RC_ASSERT(sum_s >= exact_s * (1 - 1e-5));
      RC_ASSERT(sum_s <= exact_s * (1 + 1e-5) + static_cast<double>(k) * unit_s);
    }
  };
  EXPECT_TRUE(rc::check("every step at its time, late by its roundings at most", property));
}

TEST(Profiles, TimeOrCodesAskedForAreMet) {
  EXPECT_TRUE(rc::check("by scaling the profile", [] {
    Spec spec = random_spec(random_profile());
    spec.accel.acceleration.reset();
    if (*rc::gen::arbitrary<bool>()) {
      spec.accel.codes = *rc::gen::inRange(3U, 3000U);
      const auto delays = side_delays_s(spec, tables::profiles::Side::kAccel);
      RC_ASSERT(delays.has_value());
      RC_ASSERT(delays->size() == *spec.accel.codes);
    } else {
      spec.accel.time_s = random_between(4, 4000) / (spec.start_hz + spec.max_hz);
      const auto delays = side_delays_s(spec, tables::profiles::Side::kAccel);
      RC_ASSERT(delays.has_value());
      // All but the first step, and of the last two only what lies within the time.
      const double whole = std::accumulate(delays->begin() + 1, delays->end(), 0.0);
      RC_ASSERT(whole >= *spec.accel.time_s * (1 - kNoise));
      RC_ASSERT(whole - delays->back() - (*delays)[delays->size() - 2] <=
                *spec.accel.time_s * (1 + kNoise));
    }
  }));
}

TEST(Profiles, SkippedBandIsPassedInNoMoreStepsAndTheRestIsAsBefore) {
  EXPECT_TRUE(rc::check("band inside the ramp", [] {
    Spec spec = random_spec(random_profile());
    RC_PRE(spec.max_hz > 1.5 * spec.start_hz);
    const auto plain = side_delays_s(spec, tables::profiles::Side::kAccel);
    const double low = random_between(spec.start_hz * 1.05, 0.9 * spec.max_hz);
    const double high = random_between(low * 1.01, 0.99 * spec.max_hz);
    RC_PRE(low < high && high < spec.max_hz);
    spec.skip = {.low_hz = low, .high_hz = high, .factor = random_between(1, 10)};
    const auto quick = side_delays_s(spec, tables::profiles::Side::kAccel);
    RC_ASSERT(plain.has_value() && quick.has_value());
    RC_ASSERT(quick->size() <= plain->size());
    for (std::size_t i = 0; i < quick->size() && 1 / (*plain)[i] < low; ++i) {
      if (i + 1 < plain->size() && 1 / (*plain)[i + 1] > low) break;  // reaches into the band
      RC_ASSERT(std::abs((*quick)[i] / (*plain)[i] - 1) < kNoise);
    }
  }));
}

}  // namespace
}  // namespace bushd::test
