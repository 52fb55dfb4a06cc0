#include "tables/profiles/discrete.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bushd::tables::profiles {
namespace {

constexpr double kPrecision = 1e-12;  // of the steepness that is searched for
constexpr double kV64IntervalS = 25e-6;
constexpr std::int64_t kV64Dividend = 2'560'000;
constexpr std::int64_t kV64UpdateIntervals = 625;
constexpr std::int64_t kV64MaxSpeed = 8'388'607;  // signed 24 bits

// Empty: more than kMaxCodes.
std::vector<double> recurrence_of(double k, double start_hz, double max_hz) {
  std::vector<double> delays;
  double speed_hz = start_hz;
  while (speed_hz < max_hz && delays.size() < kMaxCodes) {
    delays.push_back(1.0 / speed_hz);
    speed_hz += k / speed_hz;
  }
  if (delays.size() == kMaxCodes) return {};
  delays.push_back(1.0 / max_hz);
  return delays;
}

tl::unexpected<Error> too_long() {
  return fail(
      fmt::format("makes more than {} codes, and an MCU addresses the codes of a table by "
                  "16 bits; use a greater acceleration or a shorter time",
                  kMaxCodes));
}

}  // namespace

Result<std::vector<double>> recurrence(const SideSpec& side, double start_hz, double max_hz) {
  const auto made = [&](double k) { return recurrence_of(k, start_hz, max_hz); };
  if (side.acceleration) {
    auto delays = made(*side.acceleration);
    if (delays.empty()) return too_long();
    return delays;
  }
  // The smallest k whose ramp is not longer than asked: time and codes both fall with k.
  const auto fits = [&](double k) {
    const auto delays = made(k);
    if (delays.empty()) return false;
    if (side.codes) return delays.size() <= *side.codes;
    return std::accumulate(delays.begin(), delays.end() - 1, 0.0) <= *side.time_s;
  };
  double low = 0.0;
  double high = max_hz * max_hz;  // one step is enough
  if (!fits(high)) {
    return fail(
        "not even a jump to the maximum after one step is as short as asked; use a longer "
        "--time or more --codes");
  }
  while (high - low > kPrecision * high) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? high : low) = middle;
  }
  return made(high);
}

Result<std::vector<double>> v64(const SideSpec& side, double start_hz, double max_hz,
                                bool published) {
  if (side.codes) return fail("profile v64 takes --acceleration or --time, not --codes");
  const auto minimum = static_cast<std::int64_t>(std::floor(start_hz * 64 + 1e-6));
  const auto maximum = static_cast<std::int64_t>(std::floor(max_hz * 64 + 1e-6));
  const double wanted = side.acceleration ? *side.acceleration : (max_hz - start_hz) / *side.time_s;
  const auto change = static_cast<std::int64_t>(std::min(std::floor(wanted + 1e-6), 1e7));
  if (minimum < 1 || maximum > kV64MaxSpeed || change < 1) {
    return fail(
        fmt::format("profile v64 counts speed in 1/64 step/s up to {} and acceleration in whole "
                    "steps/s^2; allowed: speeds of 1/64..{} steps/s and 1 steps/s^2 or more",
                    kV64MaxSpeed, kV64MaxSpeed / 64));
  }
  std::vector<double> delays;
  std::int64_t now = 0;  // intervals
  std::int64_t speed = minimum;
  while (true) {
    const std::int64_t delay =
        published ? kV64Dividend / speed : (kV64Dividend + speed - 1) / speed;
    if (delay < 1)
      return fail(
          "profile v64: the maximum is less than one interval of 25 us a step; "
          "allowed: up to 40000 steps/s");
    delays.push_back(static_cast<double>(delay) * kV64IntervalS);
    if (speed == maximum) return delays;
    if (delays.size() == kMaxCodes) return too_long();
    now += delay;
    speed = std::min(maximum, minimum + change * (now / kV64UpdateIntervals));
  }
}

Result<std::vector<double>> serial(const SideSpec& side, Side which, double start_hz,
                                   double max_hz) {
  constexpr std::uint32_t kStepsOfAByte = 5;
  const bool up = which == Side::kAccel;
  if (!side.codes) return fail("profile serial takes --codes, the steps of its bytes");
  const std::uint32_t bytes = *side.codes / kStepsOfAByte;
  const std::uint32_t last = *side.codes % kStepsOfAByte;
  if (up && last != 0) {
    return fail(fmt::format(
        "--codes {}: profile serial speeds up by bytes of five steps; allowed: multiples of 5",
        *side.codes));
  }
  if (!up && last == 0) {
    return fail(fmt::format(
        "--decel-codes {}: profile serial slows down by bytes of five steps and a last one of 1 to "
        "4; allowed: all but multiples of 5",
        *side.codes));
  }
  std::vector<double> delays(last, 1.0 / start_hz);
  const double change_hz = (max_hz - start_hz) / (up ? bytes : bytes + 1);
  for (std::uint32_t i = up ? 0 : 1; i < (up ? bytes : bytes + 1); ++i) {
    delays.insert(delays.end(), kStepsOfAByte, 1.0 / (start_hz + i * change_hz));
  }
  delays.push_back(1.0 / max_hz);
  return delays;
}

}  // namespace bushd::tables::profiles
