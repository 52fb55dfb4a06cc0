#include "tables/profiles/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bushd::tables::profiles {
namespace {

constexpr int kBisections = 200;  // more than a double has digits

Result<Motion> scurve(const SideSpec& spec, double from_hz, double to_hz) {
  const double middle_hz = 0.5 * (from_hz + to_hz);
  if (!spec.jerk) return Motion{jerk(from_hz, middle_hz, 0, 1), jerk(middle_hz, to_hz, 1, 0)};
  if (!spec.acceleration) return fail("--jerk needs --acceleration; or give neither, but --time");
  const double limit = *spec.acceleration;
  const double rounded_hz = limit * limit / (2 * *spec.jerk);
  if (from_hz + rounded_hz >= middle_hz) {
    const double peak = std::sqrt(*spec.jerk * (to_hz - from_hz));
    return Motion{jerk(from_hz, middle_hz, 0, peak), jerk(middle_hz, to_hz, peak, 0)};
  }
  return Motion{jerk(from_hz, from_hz + rounded_hz, 0, limit),
                linear(from_hz + rounded_hz, to_hz - rounded_hz, limit, limit),
                jerk(to_hz - rounded_hz, to_hz, limit, 0)};
}

Result<Motion> piecewise(std::vector<Leg> legs, Side side, double from_hz, double to_hz) {
  const char* option = side == Side::kAccel ? "--segment" : "--decel-segment";
  if (legs.empty()) return fail(fmt::format("profile piecewise needs {} STEPS:SPEED", option));
  const double end_hz = side == Side::kAccel ? to_hz : from_hz;
  if (std::abs(legs.back().to_hz - end_hz) > 1e-9 * end_hz) {
    return fail(fmt::format("the last {} ends at {:.6g} steps/s; allowed: the {} speed, {:.6g}",
                            option, legs.back().to_hz,
                            side == Side::kAccel ? "maximum" : "start or stop", end_hz));
  }
  if (side == Side::kDecel) {  // listed from fast to slow, and made from slow to fast
    std::reverse(legs.begin(), legs.end());
    for (std::size_t i = 0; i + 1 < legs.size(); ++i) legs[i].to_hz = legs[i + 1].to_hz;
  }
  legs.back().to_hz = to_hz;
  Motion motion;
  double speed_hz = from_hz;
  for (const Leg& leg : legs) {
    if (!(leg.steps > 0)) return fail(fmt::format("{} of no steps; allowed: 1 or more", option));
    if (leg.to_hz < speed_hz) {
      return fail(fmt::format(
          "{} goes from {:.6g} to {:.6g} steps/s; allowed: speeds that {}", option, speed_hz,
          leg.to_hz, side == Side::kAccel ? "never fall" : "never rise along the braking"));
    }
    if (leg.to_hz == speed_hz) {
      motion.push_back(hold(speed_hz, leg.steps));
    } else {
      const double a = (leg.to_hz * leg.to_hz - speed_hz * speed_hz) / (2 * leg.steps);
      motion.push_back(linear(speed_hz, leg.to_hz, a, a));
    }
    speed_hz = leg.to_hz;
  }
  return motion;
}

// A profile with its greatest acceleration 1, or finished (`scalable` false).
struct Shape {
  Motion motion;
  bool scalable = true;
};

Result<Shape> shape(const Spec& spec, const SideSpec& side_spec, Side side, double from_hz) {
  const double to_hz = spec.max_hz;
  switch (side_spec.profile) {
    case Profile::kScurve: {
      auto motion = scurve(side_spec, from_hz, to_hz);
      if (!motion) return fail(motion.error());
      return Shape{std::move(*motion), !side_spec.jerk};
    }
    case Profile::kExponential:
      if (!(side_spec.fall > 1))
        return fail(
            "--fall is the acceleration at start divided by that at "
            "the top; allowed: above 1");
      return Shape{{linear(from_hz, to_hz, 1.0, 1.0 / side_spec.fall)}};
    case Profile::kPiecewise: {
      auto motion = piecewise(side_spec.legs, side, from_hz, to_hz);
      if (!motion) return fail(motion.error());
      return Shape{std::move(*motion), false};
    }
    case Profile::kTorque: {
      auto motion = fastest(*spec.motor, side, from_hz, to_hz);
      if (!motion) return fail(motion.error());
      return Shape{std::move(*motion), false};
    }
    default:
      return Shape{{linear(from_hz, to_hz, 1.0, 1.0)}};
  }
}

Result<Motion> through_band(const Motion& profile, const Skip& skip, const Spec& spec, Side side) {
  Motion motion = between(profile, 0.0, skip.low_hz);
  Motion inside = between(profile, skip.low_hz, skip.high_hz);
  const double from_hz = std::max(profile.front().from_hz, skip.low_hz);
  const double to_hz = std::min(profile.back().to_hz, skip.high_hz);
  if (to_hz <= from_hz) return profile;
  std::erase_if(inside, [&](const Segment& s) { return s.kind == Segment::Kind::kHold; });
  if (skip.acceleration) {
    inside = {linear(from_hz, to_hz, *skip.acceleration, *skip.acceleration)};
  } else if (skip.factor) {
    inside = stretched(inside, 1.0 / *skip.factor);
  } else {
    auto quick = fastest(*spec.motor, side, from_hz, to_hz);
    if (!quick) return fail(quick.error());
    inside = std::move(*quick);
  }
  motion.insert(motion.end(), inside.begin(), inside.end());
  const Motion rest = between(profile, skip.high_hz, std::numeric_limits<double>::infinity());
  motion.insert(motion.end(), rest.begin(), rest.end());
  return motion;
}

bool holds_in(const Motion& motion, const Skip& skip) {
  return std::any_of(motion.begin(), motion.end(), [&](const Segment& s) {
    return s.kind == Segment::Kind::kHold && s.from_hz > skip.low_hz && s.from_hz < skip.high_hz;
  });
}

}  // namespace

Result<Motion> continuous(const Spec& spec, const SideSpec& side_spec, Side side, double from_hz) {
  auto made = shape(spec, side_spec, side, from_hz);
  if (!made) return fail(made.error());
  if (spec.skip && holds_in(made->motion, *spec.skip)) {
    return fail("a segment holds a speed inside the band of --skip; allowed: outside of it");
  }
  const auto finish = [&](const Motion& profile) -> Result<Motion> {
    return spec.skip ? through_band(profile, *spec.skip, spec, side) : profile;
  };
  if (!made->scalable) return finish(made->motion);
  if (side_spec.acceleration) return finish(stretched(made->motion, 1.0 / *side_spec.acceleration));

  // The profile stretched until its time, or its number of steps, is the one asked for. One code is
  // the first step's, one is the first at maximum speed.
  const double wanted =
      side_spec.time_s ? *side_spec.time_s : static_cast<double>(*side_spec.codes) - 2.0;
  const auto measure = [&](double factor) -> Result<double> {
    const auto motion = finish(stretched(made->motion, factor));
    if (!motion) return fail(motion.error());
    return side_spec.time_s ? time_of(*motion) : steps_of(*motion);
  };
  const double whole = side_spec.time_s ? time_of(made->motion) : steps_of(made->motion);
  double low = 0.0;
  double high = wanted / whole;  // a band that is passed more quickly only shortens the motion
  while (spec.skip) {
    const auto at_high = measure(high);
    if (!at_high) return fail(at_high.error());
    if (*at_high >= wanted || high > 1e12 * wanted / whole) break;
    high *= 2;
  }
  for (int i = 0; i < kBisections && spec.skip; ++i) {
    const double middle = 0.5 * (low + high);
    const auto measured = measure(middle);
    if (!measured) return fail(measured.error());
    (*measured < wanted ? low : high) = middle;
  }
  auto motion = finish(stretched(made->motion, high));
  if (!motion) return fail(motion.error());
  const double reached = side_spec.time_s ? time_of(*motion) : steps_of(*motion);
  if (std::abs(reached - wanted) > 1e-6 * wanted) {
    return fail(
        "the band of --skip alone takes longer than the whole ramp is allowed to; use a "
        "greater --skip-acceleration, a longer --time or more --codes");
  }
  return motion;
}

}  // namespace bushd::tables::profiles
