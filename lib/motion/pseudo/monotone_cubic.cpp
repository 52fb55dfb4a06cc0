#include "motion/pseudo/monotone_cubic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>

namespace bushd::pseudo {
namespace {

// At an end: of the parabola through three points, no steeper than three times the chord, and never
// against it.
double end_slope(double near_width, double far_width, double near_chord, double far_chord) {
  const double slope = ((2 * near_width + far_width) * near_chord - near_width * far_chord) /
                       (near_width + far_width);
  if (slope * near_chord <= 0) return 0;
  return std::abs(slope) > 3 * std::abs(near_chord) ? 3 * near_chord : slope;
}

}  // namespace

std::optional<MonotoneCubic::Flaw> MonotoneCubic::flaw(const std::vector<double>& x,
                                                       const std::vector<double>& y) {
  if (x.size() < 2) return Flaw{0, "a curve takes two points or more"};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) return Flaw{i, "is not finite"};
    if (i == 0) continue;
    if (!(x[i] > x[i - 1])) {
      return Flaw{i, fmt::format("{} does not rise from {}", x[i], x[i - 1])};
    }
    if (!(y[1] > y[0] ? y[i] > y[i - 1] : y[i] < y[i - 1])) {
      return Flaw{i, fmt::format("{} after {}; all must rise, or all fall", y[i], y[i - 1])};
    }
  }
  return std::nullopt;
}

MonotoneCubic::MonotoneCubic(std::vector<double> x, std::vector<double> y)
    : x_(std::move(x)), y_(std::move(y)), slope_(x_.size()) {
  const std::size_t last = x_.size() - 1;
  const auto width = [&](std::size_t i) { return x_[i + 1] - x_[i]; };
  const auto chord = [&](std::size_t i) { return (y_[i + 1] - y_[i]) / width(i); };
  if (last == 1) {
    slope_[0] = slope_[1] = chord(0);
    return;
  }
  slope_[0] = end_slope(width(0), width(1), chord(0), chord(1));
  slope_[last] = end_slope(width(last - 1), width(last - 2), chord(last - 1), chord(last - 2));
  for (std::size_t i = 1; i < last; ++i) {
    const double before = 2 * width(i) + width(i - 1);
    const double after = width(i) + 2 * width(i - 1);
    slope_[i] = (before + after) / (before / chord(i - 1) + after / chord(i));
  }
}

// Hermite's form, from the end that is nearer, so that both points are met exactly.
double MonotoneCubic::piece(std::size_t i, double t) const {
  const double width = x_[i + 1] - x_[i];
  const double rise = y_[i + 1] - y_[i];
  const double begins = width * slope_[i];
  const double ends = width * slope_[i + 1];
  const double u = 1 - t;
  if (t <= 0.5) return y_[i] + t * (begins * u * u + t * (rise * (3 - 2 * t) - ends * u));
  return y_[i + 1] - u * (ends * t * t + u * (rise * (3 - 2 * u) - begins * t));
}

double MonotoneCubic::at(double x) const {
  if (x <= first_x()) return first_y();
  if (x >= last_x()) return last_y();
  const auto next = std::upper_bound(x_.begin(), x_.end(), x);
  const auto i = static_cast<std::size_t>(next - x_.begin()) - 1;
  return piece(i, (x - x_[i]) / (x_[i + 1] - x_[i]));
}

// By halves: sixty of them are the digits of a double, whatever the shape.
double MonotoneCubic::where(double y) const {
  const double sign = rises() ? 1 : -1;
  if (sign * y <= sign * first_y()) return first_x();
  if (sign * y >= sign * last_y()) return last_x();
  const auto beyond = [&](double value) { return sign * value > sign * y; };
  const auto next = std::partition_point(y_.begin(), y_.end(), std::not_fn(beyond));
  const auto i = static_cast<std::size_t>(next - y_.begin()) - 1;
  double low = 0;
  double high = 1;
  for (int half = 0; half < 60; ++half) {
    const double middle = (low + high) / 2;
    (beyond(piece(i, middle)) ? high : low) = middle;
  }
  return x_[i] + low * (x_[i + 1] - x_[i]);
}

}  // namespace bushd::pseudo
