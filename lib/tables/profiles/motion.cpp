#include "tables/profiles/motion.h"

#include <algorithm>
#include <cmath>

namespace bushd::tables::profiles {
namespace {

constexpr int kNewtonIterations = 60;
// A share of a segment's time: below that a double cannot tell two times apart.
constexpr double kTimeResolution = 1e-15;

double slope(const Segment& s) {
  return (s.to_acceleration - s.from_acceleration) / (s.to_hz - s.from_hz);
}

double jerk_of(const Segment& s) {
  return (s.to_acceleration - s.from_acceleration) / s.time_s;
}

// (e^x - 1) / x and (e^x - 1 - x) / x^2, without the loss of digits near 0.
double first_remainder(double x) {
  return std::abs(x) < 1e-12 ? 1.0 : std::expm1(x) / x;
}

double second_remainder(double x) {
  if (std::abs(x) > 0.1) return (std::expm1(x) - x) / (x * x);
  double term = 0.5;
  double sum = 0.0;
  for (int n = 3; n < 14; ++n) {
    sum += term;
    term *= x / n;
  }
  return sum;
}

}  // namespace

double Segment::speed(double t) const {
  switch (kind) {
    case Kind::kLinear:
      return from_hz + from_acceleration * t * first_remainder(slope(*this) * t);
    case Kind::kJerk:
      return from_hz + t * (from_acceleration + 0.5 * jerk_of(*this) * t);
    case Kind::kHold:
      break;
  }
  return from_hz;
}

double Segment::position(double t) const {
  switch (kind) {
    case Kind::kLinear:
      return t * (from_hz + from_acceleration * t * second_remainder(slope(*this) * t));
    case Kind::kJerk:
      return t * (from_hz + t * (0.5 * from_acceleration + jerk_of(*this) * t / 6.0));
    case Kind::kHold:
      break;
  }
  return from_hz * t;
}

double Segment::time_at(double wanted) const {
  if (kind == Kind::kHold) return wanted / from_hz;
  double low = 0.0;
  double high = time_s;
  double t = std::min(high, wanted / from_hz);
  for (int i = 0; i < kNewtonIterations && high - low > kTimeResolution * time_s; ++i) {
    const double error = position(t) - wanted;
    (error > 0 ? high : low) = t;
    double next = t - error / speed(t);
    if (next < low || next > high) next = 0.5 * (low + high);
    if (std::abs(next - t) <= kTimeResolution * time_s) return next;
    t = next;
  }
  return t;
}

double Segment::acceleration_at(double speed_hz) const {
  switch (kind) {
    case Kind::kLinear:
      return from_acceleration + slope(*this) * (speed_hz - from_hz);
    case Kind::kJerk: {
      const double share = (speed_hz - from_hz) / (to_hz - from_hz);
      const double from = from_acceleration * from_acceleration;
      const double to = to_acceleration * to_acceleration;
      return std::sqrt(std::max(0.0, from + (to - from) * share));
    }
    case Kind::kHold:
      break;
  }
  return 0.0;
}

Segment linear(double from_hz, double to_hz, double from_acceleration, double to_acceleration) {
  Segment s{.kind = Segment::Kind::kLinear,
            .from_hz = from_hz,
            .to_hz = to_hz,
            .from_acceleration = from_acceleration,
            .to_acceleration = to_acceleration};
  const double change = to_acceleration / from_acceleration - 1.0;
  const double logarithm = std::abs(change) < 1e-12 ? 1.0 : std::log1p(change) / change;
  s.time_s = (to_hz - from_hz) / from_acceleration * logarithm;
  s.steps = s.position(s.time_s);
  return s;
}

Segment jerk(double from_hz, double to_hz, double from_acceleration, double to_acceleration) {
  Segment s{.kind = Segment::Kind::kJerk,
            .from_hz = from_hz,
            .to_hz = to_hz,
            .from_acceleration = from_acceleration,
            .to_acceleration = to_acceleration};
  s.time_s = 2.0 * (to_hz - from_hz) / (from_acceleration + to_acceleration);
  s.steps = s.position(s.time_s);
  return s;
}

Segment hold(double speed_hz, double steps) {
  return {.kind = Segment::Kind::kHold,
          .from_hz = speed_hz,
          .to_hz = speed_hz,
          .time_s = steps / speed_hz,
          .steps = steps};
}

double steps_of(const Motion& motion) {
  double steps = 0.0;
  for (const Segment& segment : motion) steps += segment.steps;
  return steps;
}

double time_of(const Motion& motion) {
  double time_s = 0.0;
  for (const Segment& segment : motion) time_s += segment.time_s;
  return time_s;
}

Motion stretched(const Motion& motion, double factor) {
  Motion out = motion;
  for (Segment& segment : out) {
    segment.from_acceleration /= factor;
    segment.to_acceleration /= factor;
    segment.time_s *= factor;
    segment.steps *= factor;
  }
  return out;
}

Motion between(const Motion& motion, double low_hz, double high_hz) {
  Motion out;
  for (const Segment& s : motion) {
    const double from = std::max(s.from_hz, low_hz);
    const double to = std::min(s.to_hz, high_hz);
    const bool holds_inside = s.kind == Segment::Kind::kHold && low_hz < to && to < high_hz;
    if (holds_inside) {
      out.push_back(s);
    } else if (from < to) {
      const auto make = s.kind == Segment::Kind::kJerk ? jerk : linear;
      out.push_back(make(from, to, s.acceleration_at(from), s.acceleration_at(to)));
    }
  }
  return out;
}

std::vector<double> delays_s(const Motion& motion, std::size_t most) {
  const double steps = steps_of(motion);
  // A motion of a whole number of steps has no step that is partly beyond it.
  const double noise = 1e-9 * std::max(1.0, steps);
  const double whole = std::ceil(steps - noise);
  if (motion.empty() || !(whole + 2.0 <= static_cast<double>(most))) return {};
  const auto last = static_cast<std::size_t>(whole);
  std::vector<double> delays{1.0 / motion.front().from_hz};
  delays.reserve(last + 2);
  auto segment = motion.begin();
  double segment_begins_at = 0.0;
  double segment_begins_s = 0.0;
  double before_s = 0.0;
  for (std::size_t k = 1; k <= last; ++k) {
    double left = static_cast<double>(k) - segment_begins_at;
    while (segment != motion.end() && left > segment->steps) {
      left -= segment->steps;
      segment_begins_at += segment->steps;
      segment_begins_s += segment->time_s;
      ++segment;
    }
    const double time_s = segment_begins_s + (segment == motion.end() ? left / motion.back().to_hz
                                                                      : segment->time_at(left));
    delays.push_back(std::min(delays.back(), time_s - before_s));
    before_s = time_s;
  }
  delays.push_back(1.0 / motion.back().to_hz);
  return delays;
}

}  // namespace bushd::tables::profiles
