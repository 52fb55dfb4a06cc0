#include "tables/edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "tables/rounding.h"

namespace bushd::tables {
namespace {

using Codes = std::vector<std::uint16_t>;

constexpr double kNoise = 1e-6;
constexpr double kPathNoise = 1e-9;  // of a step; a side's path is up to 131070 steps
constexpr int kHalvings = 60;        // of a path that a double holds
constexpr double kLongestCode = kCode.most;
// The share of a speed that rounding may take; a finer time unit is taken beyond it.
constexpr double kMostShortfall = 0.01;
constexpr double kLongestSide = std::numeric_limits<std::int32_t>::max();

Result<TableContent> checked(TableContent content) {
  // A mirror image need not be written out.
  if (content.decel && std::equal(content.decel->rbegin(), content.decel->rend(),
                                  content.accel.begin(), content.accel.end())) {
    content.decel.reset();
  }
  const auto fault = check(content);
  if (!fault) return content;
  const std::string index = fault->index ? fmt::format("[{}]", *fault->index) : "";
  return fail(Error{.message = fault->message, .key = fault->key + index});
}

// Changes one side, and leaves the other and the cruise delay as they are.
Codes& side_of(TableContent& content, SideKey side) {
  if (!content.decel) content.decel = Codes(content.accel.rbegin(), content.accel.rend());
  return side == SideKey::kAccel ? content.accel : *content.decel;
}

tl::unexpected<Error> no_index(SideKey side, std::size_t index, std::size_t size) {
  return fail(fmt::format("{} has no index {}; allowed: 0..{}",
                          side == SideKey::kAccel ? "accel" : "decel", index, size - 1));
}

// Both sides of a mirrored table change, so that it stays one.
Result<Codes*> editable(TableContent& content, SideKey side, std::size_t index, bool end_too) {
  const bool mirrored = !content.decel;
  Codes& codes = mirrored && side == SideKey::kAccel ? content.accel : side_of(content, side);
  if (index < codes.size() + (end_too ? 1 : 0)) return &codes;
  return no_index(side, index, codes.size());
}

Result<std::uint16_t> rounded_up(double units, std::uint32_t time_unit_ns) {
  const double code = rounded_up_units(units);
  if (code < 1 || units < 1 - kNoise) {
    return fail(fmt::format(
        "a delay becomes {:.3g} time units; allowed: 1 or more, as nothing shorter can be said. {}",
        units,
        time_unit_ns > 1 ? "Use a shorter time unit (\"bushtab resample --time-unit\")"
                         : "No time unit is shorter than 1 ns: use a slower table"));
  }
  if (code <= kLongestCode) return static_cast<std::uint16_t>(code);
  return fail(
      fmt::format("a delay becomes {:.0f} time units; allowed: up to {}. Use a longer time "
                  "unit (\"bushtab resample --time-unit\")",
                  code, kCode.most));
}

// Precondition: the content's time unit is that of the new codes.
Result<TableContent> with_all_codes(TableContent content, double factor) {
  const auto scale = [&](std::uint16_t& code) -> Result<void> {
    const auto scaled = rounded_up(code * factor, content.time_unit_ns);
    if (!scaled) return fail(scaled.error());
    code = *scaled;
    return {};
  };
  for (std::uint16_t& code : content.accel) {
    if (auto done = scale(code); !done) return fail(done.error());
  }
  for (std::size_t i = 0; content.decel && i < content.decel->size(); ++i) {
    if (auto done = scale((*content.decel)[i]); !done) return fail(done.error());
  }
  if (content.cruise) {
    if (auto done = scale(*content.cruise); !done) return fail(done.error());
  }
  return checked(std::move(content));
}

// The longest and the shortest code, and what the longer side takes, in time units.
struct Extent {
  double slowest = 0;
  double fastest = kLongestCode;
  double side_sum = 0;
  double side_codes = 0;
};

Extent extent_of(const TableContent& content) {
  Extent extent;
  const auto add_code = [&](std::uint16_t code) {
    extent.slowest = std::max<double>(extent.slowest, code);
    extent.fastest = std::min<double>(extent.fastest, code);
  };
  const auto add_side = [&](const Codes& side) {
    double sum = 0;
    for (const std::uint16_t code : side) {
      add_code(code);
      sum += code;
    }
    extent.side_sum = std::max(extent.side_sum, sum);
    extent.side_codes = std::max(extent.side_codes, static_cast<double>(side.size()));
  };
  add_side(content.accel);
  if (content.decel) add_side(*content.decel);
  if (content.cruise) add_code(*content.cruise);
  return extent;
}

// Whether codes times `factor` are not longer than a code and a side may be. Rounding up adds less
// than one time unit a code.
bool holds_long(const Extent& extent, double factor) {
  return rounded_up_units(extent.slowest * factor) <= kLongestCode &&
         extent.side_sum * factor + extent.side_codes <= kLongestSide;
}

// The finest unit in which delays times `factor` can be told.
double finest_unit_ns(const TableContent& content, const Extent& extent, double factor) {
  const double sums = kLongestSide - extent.side_codes;
  const double share = std::max(extent.slowest / kLongestCode, extent.side_sum / sums);
  double unit_ns = std::max(1.0, std::ceil(content.time_unit_ns * factor * share * (1 - 1e-12)));
  while (unit_ns <= kMaxTimeUnitNs &&
         !holds_long(extent, content.time_unit_ns * factor / unit_ns)) {
    ++unit_ns;
  }
  return unit_ns;
}

Result<TableContent> in_unit(const TableContent& content, double factor, double unit_ns) {
  TableContent scaled = content;
  scaled.time_unit_ns = static_cast<std::uint32_t>(unit_ns);
  return with_all_codes(std::move(scaled), content.time_unit_ns * factor / unit_ns);
}

// Delays times `factor` in the unit that costs least by rounding: the finest one, unless one of a
// few next to it, or the old unit times the factor, in which codes stay as they are, hits them
// better.
Result<TableContent> in_best_unit(const TableContent& content, double factor, double finest_ns) {
  constexpr int kTried = 64;
  auto best = in_unit(content, factor, finest_ns);
  if (!best) return best;
  double least = greatest_shortfall(content, *best, 1 / factor);
  const auto try_unit = [&](double unit_ns) {
    if (least == 0 || unit_ns < finest_ns || unit_ns > kMaxTimeUnitNs) return;
    auto scaled = in_unit(content, factor, unit_ns);
    if (!scaled) return;
    const double shortfall = greatest_shortfall(content, *scaled, 1 / factor);
    if (shortfall >= least * (1 - kPathNoise)) return;  // the finer one
    least = shortfall;
    best = std::move(*scaled);
  };
  try_unit(std::round(content.time_unit_ns * factor));
  for (int i = 1; i < kTried; ++i) try_unit(finest_ns + i);
  return best;
}

// A side as a curve: the square of the speed over the path, straight between the nodes of its
// codes, so of constant acceleration there. Speeds in steps a time unit; slow to fast.
struct Curve {
  std::vector<double> path;
  std::vector<double> square;

  // Precondition: `segment` is that of the path or one before it; it goes along.
  double square_at(double at, std::size_t& segment) const {
    while (segment + 2 < path.size() && path[segment + 1] < at) ++segment;
    const double share = (at - path[segment]) / (path[segment + 1] - path[segment]);
    return square[segment] + std::clamp(share, 0.0, 1.0) * (square[segment + 1] - square[segment]);
  }
};

// The path between the middles, in time, of two neighbouring steps: their mean speed times half of
// both delays. A little more than one step, as the faster one gets further in its half.
double path_between(double speed, double next_speed) {
  const double sum = speed + next_speed;
  return sum * sum / (4 * speed * next_speed);
}

// A delay tells the speed in the middle of its time, and the acceleration from there to the next
// middle is constant (as in "bushtab check" and "show --steps"): the nodes lie in these middles.
Curve curve_of(const Codes& codes, double stretch) {
  Curve curve{{0.0}, {1.0 / codes[0] / codes[0]}};
  for (std::size_t i = 1; i < codes.size(); ++i) {
    const double way = path_between(1.0 / codes[i - 1], 1.0 / codes[i]);
    curve.path.push_back(curve.path.back() + way * stretch);
    curve.square.push_back(1.0 / codes[i] / codes[i]);
  }
  return curve;
}

// The place on the curve of the step after that at `from`: where the path between the two is what
// lies between them. Infinity: beyond the end.
double next_place(const Curve& curve, double from, std::size_t segment) {
  const double speed = std::sqrt(curve.square_at(from, segment));
  const auto beyond = [&](double at) {
    std::size_t there = segment;
    return at - from - path_between(speed, std::sqrt(curve.square_at(at, there)));
  };
  // No step is nearer than one step. In a segment there is one such place at most.
  std::size_t end = segment + 1;
  while (end < curve.path.size() && beyond(curve.path[end]) < -kPathNoise) ++end;
  if (end == curve.path.size()) return std::numeric_limits<double>::infinity();
  if (beyond(curve.path[end]) <= kPathNoise) return curve.path[end];
  double low = std::max(from, curve.path[end - 1]);
  double high = curve.path[end];
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (beyond(middle) < 0 ? low : high) = middle;
  }
  return high;
}

// Appends the delay of that speed, never slower than the step before: rounding must not do that.
void append_delay(Codes& codes, double square) {
  const double delay = std::ceil(1 / std::sqrt(square) - kNoise);
  codes.push_back(std::min(codes.back(), static_cast<std::uint16_t>(delay)));
}

// The speeds of a side on a curve that is `stretch` times as long, slow to fast. The squares of the
// speeds rise by 1 / stretch of what they did over the same path, so no acceleration is greater
// than 1 / stretch of the greatest before, but for the rounding of codes.
Result<Codes> stretched(const Codes& codes, double stretch) {
  if (codes.size() == 1) return Codes{codes.front()};
  const Curve curve = curve_of(codes, stretch);
  const auto too_many = [&] {
    return fail(fmt::format("a side would have {:.0f} codes; allowed: 1..{}",
                            1 + static_cast<double>(codes.size() - 1) * stretch, kMaxCodes));
  };
  if (curve.path.back() > 2 * static_cast<double>(kMaxCodes)) return too_many();
  Codes out{codes.front()};
  std::size_t segment = 0;
  for (double at = next_place(curve, 0, 0); at < curve.path.back() - kPathNoise;
       at = next_place(curve, at, segment)) {
    append_delay(out, curve.square_at(at, segment));
    if (out.size() >= kMaxCodes) return too_many();
  }
  out.push_back(codes.back());
  return out;
}

// A side of `count` codes with the same speeds, slow to fast: the square of the speed is that of
// the old side at the same share of its steps.
Codes resampled(const Codes& codes, std::size_t count) {
  if (codes.size() == 1 || count == 1) return Codes(count, codes.back());
  Curve curve;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    curve.path.push_back(static_cast<double>(i));
    curve.square.push_back(1.0 / codes[i] / codes[i]);
  }
  const double ratio = static_cast<double>(codes.size() - 1) / static_cast<double>(count - 1);
  Codes out{codes.front()};
  std::size_t segment = 0;
  for (std::size_t k = 1; k + 1 < count; ++k) {
    append_delay(out, curve.square_at(static_cast<double>(k) * ratio, segment));
  }
  out.push_back(codes.back());
  return out;
}

// Changes both sides, given slow to fast.
template <class Change>
Result<TableContent> with_sides(TableContent content, const Change& change) {
  auto accel = change(content.accel);
  if (!accel) return fail(accel.error());
  if (content.decel) {
    auto decel = change(Codes(content.decel->rbegin(), content.decel->rend()));
    if (!decel) return fail(decel.error());
    content.decel = Codes(decel->rbegin(), decel->rend());
  }
  content.accel = std::move(*accel);
  return checked(std::move(content));
}

Result<void> check_factor(double factor) {
  if (std::isfinite(factor) && factor > 0) return {};
  return fail(fmt::format("a factor of {}; allowed: above 0", factor));
}

}  // namespace

Result<TableContent> set_codes(TableContent content, SideKey side, std::size_t index,
                               std::span<const std::uint16_t> codes) {
  const auto edited = editable(content, side, index + codes.size() - 1, false);
  if (!edited) return fail(edited.error());
  std::copy(codes.begin(), codes.end(), (*edited)->begin() + static_cast<std::ptrdiff_t>(index));
  return checked(std::move(content));
}

Result<TableContent> insert_codes(TableContent content, SideKey side, std::size_t index,
                                  std::span<const std::uint16_t> codes) {
  const auto edited = editable(content, side, index, true);
  if (!edited) return fail(edited.error());
  (*edited)->insert((*edited)->begin() + static_cast<std::ptrdiff_t>(index), codes.begin(),
                    codes.end());
  return checked(std::move(content));
}

Result<TableContent> delete_codes(TableContent content, SideKey side, std::size_t index,
                                  std::size_t count) {
  if (count == 0 || count > kMaxCodes)
    return fail("a number of codes to delete; allowed: 1 or more");
  const auto edited = editable(content, side, index + count - 1, false);
  if (!edited) return fail(edited.error());
  const auto from = (*edited)->begin() + static_cast<std::ptrdiff_t>(index);
  (*edited)->erase(from, from + static_cast<std::ptrdiff_t>(count));
  return checked(std::move(content));
}

Result<TableContent> scale_speed(TableContent content, double factor) {
  if (const auto good = check_factor(factor); !good) return fail(good.error());
  const Extent extent = extent_of(content);
  std::optional<TableContent> in_old_unit;
  if (holds_long(extent, 1 / factor) && extent.fastest / factor >= 1 - kNoise) {
    auto scaled = with_all_codes(content, 1 / factor);
    if (!scaled) return scaled;
    if (greatest_shortfall(content, *scaled, factor) <= kMostShortfall) return scaled;
    in_old_unit = std::move(*scaled);
  }
  const double unit_ns = finest_unit_ns(content, extent, 1 / factor);
  const double units = content.time_unit_ns / factor / unit_ns;
  const bool too_short = extent.fastest * units < 1 - kNoise;
  // No unit tells them better.
  if (in_old_unit && (too_short || unit_ns >= content.time_unit_ns)) return *in_old_unit;
  if (unit_ns > kMaxTimeUnitNs) {
    return fail(
        fmt::format("the slowest delay becomes {:.6g} s; allowed: up to {:.6g} s, {} time units "
                    "of 1 s. Use a factor of {:.3g} or more",
                    extent.slowest * content.time_unit_ns * 1e-9 / factor, kLongestCode, kCode.most,
                    factor * unit_ns / kMaxTimeUnitNs * (1 + 1e-2)));
  }
  if (unit_ns > 1 && too_short) {
    return fail(fmt::format(
        "the slowest delay is {:.0f} times the fastest one, so no time unit tells both by codes of "
        "{}..{} at this factor. Use one that is a whole number or 1 over a whole number, or "
        "delete slow codes",
        extent.slowest / extent.fastest, kCode.least, kCode.most));
  }
  return in_best_unit(content, 1 / factor, unit_ns);
}

Result<TableContent> scale_acceleration(TableContent content, double factor) {
  if (const auto good = check_factor(factor); !good) return fail(good.error());
  // A cruise delay that is faster than a side is its last step: that one is accelerated to as well.
  const std::uint16_t cruise = content.cruise.value_or(content.accel.back());
  return with_sides(std::move(content), [&](Codes codes) -> Result<Codes> {
    const bool to_cruise = cruise < codes.back();
    if (to_cruise) codes.push_back(cruise);
    auto out = stretched(codes, 1 / factor);
    if (out && to_cruise) out->pop_back();
    return out;
  });
}

Result<TableContent> resample_unit(TableContent content, std::uint32_t time_unit_ns) {
  if (time_unit_ns < 1 || time_unit_ns > kMaxTimeUnitNs) {
    return fail(fmt::format("a time unit of {} ns; allowed: 1..{}", time_unit_ns, kMaxTimeUnitNs));
  }
  const double factor = static_cast<double>(content.time_unit_ns) / time_unit_ns;
  content.time_unit_ns = time_unit_ns;
  return with_all_codes(std::move(content), factor);
}

Result<TableContent> resample_codes(TableContent content, std::size_t codes) {
  if (codes < 1 || codes > kMaxCodes) {
    return fail(fmt::format("a side would have {} codes; allowed: 1..{}", codes, kMaxCodes));
  }
  return with_sides(std::move(content),
                    [codes](const Codes& side) -> Result<Codes> { return resampled(side, codes); });
}

double greatest_shortfall(const TableContent& before, const TableContent& after, double factor) {
  double greatest = 0;
  const double units = static_cast<double>(before.time_unit_ns) / after.time_unit_ns / factor;
  const auto compare = [&](std::uint16_t old_code, std::uint16_t new_code) {
    greatest = std::max(greatest, 1 - old_code * units / new_code);
  };
  for (std::size_t i = 0; i < before.accel.size(); ++i) compare(before.accel[i], after.accel[i]);
  if (before.decel && after.decel) {
    for (std::size_t i = 0; i < before.decel->size(); ++i) {
      compare((*before.decel)[i], (*after.decel)[i]);
    }
  }
  if (before.cruise && after.cruise) compare(*before.cruise, *after.cruise);
  return greatest;
}

Result<TableContent> reverse(TableContent content) {
  if (!content.decel) return content;
  if (!content.cruise) content.cruise = content.accel.back();
  Codes accel(content.decel->rbegin(), content.decel->rend());
  content.decel = Codes(content.accel.rbegin(), content.accel.rend());
  content.accel = std::move(accel);
  return checked(std::move(content));
}

}  // namespace bushd::tables
