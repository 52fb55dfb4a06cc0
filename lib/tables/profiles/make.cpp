#include "tables/profiles/make.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "tables/profiles/discrete.h"
#include "tables/profiles/shapes.h"
#include "tables/rounding.h"

namespace bushd::tables::profiles {
namespace {

// Binary fractions cannot hold most delays: this much of a unit beside a whole number is noise.
constexpr double kNoiseUnits = 1e-6;
constexpr double kLongestSideUnits = 2147483647.0;

constexpr std::array<std::string_view, 9> kNames{"constant", "recurrence",  "v64",
                                                 "scurve",   "exponential", "pto",
                                                 "torque",   "piecewise",   "serial"};

bool is_positive(double value) {
  return std::isfinite(value) && value > 0;
}

bool is_discrete(Profile profile) {
  return profile == Profile::kRecurrence || profile == Profile::kV64 || profile == Profile::kSerial;
}

bool uses_v64(const Spec& spec) {
  return spec.accel.profile == Profile::kV64 ||
         (spec.decel && spec.decel->profile == Profile::kV64);
}

Result<void> check_speeds(const Spec& spec) {
  const double stop_hz = spec.stop_hz.value_or(spec.start_hz);
  if (!is_positive(spec.start_hz) || !is_positive(spec.max_hz) || !is_positive(stop_hz)) {
    return fail("start, stop and maximum speed are needed; allowed: above 0");
  }
  if (std::max(spec.start_hz, stop_hz) > spec.max_hz) {
    return fail(
        fmt::format("starts at {:.6g} and stops at {:.6g} steps/s; allowed: up to "
                    "the maximum, {:.6g}",
                    spec.start_hz, stop_hz, spec.max_hz));
  }
  return {};
}

Result<void> check_skip(const Spec& spec) {
  if (!spec.skip) return {};
  const Skip& skip = *spec.skip;
  if (!is_positive(skip.low_hz) || !(skip.high_hz > skip.low_hz) || !std::isfinite(skip.high_hz)) {
    return fail("--skip is a band LO:HI with 0 < LO < HI");
  }
  const auto inside = [&](double hz) { return hz > skip.low_hz && hz < skip.high_hz; };
  for (const auto& [what, hz] : {std::pair{"start", spec.start_hz},
                                 {"stop", spec.stop_hz.value_or(spec.start_hz)},
                                 {"maximum", spec.max_hz}}) {
    if (!inside(hz)) continue;
    return fail(
        fmt::format("the {} speed {:.6g} lies in the band {:.6g}:{:.6g} that is to "
                    "be skipped; allowed: outside of it",
                    what, hz, skip.low_hz, skip.high_hz));
  }
  if (is_discrete(spec.accel.profile) || (spec.decel && is_discrete(spec.decel->profile))) {
    return fail("profiles recurrence, v64 and serial know no --skip; use constant");
  }
  if (skip.acceleration && skip.factor) {
    return fail("--skip-acceleration is an acceleration or xFACTOR, not both");
  }
  if ((skip.acceleration && !is_positive(*skip.acceleration)) ||
      (skip.factor && !(is_positive(*skip.factor) && *skip.factor >= 1))) {
    return fail("--skip-acceleration; allowed: above 0, a factor of 1 or more");
  }
  if (!skip.acceleration && !skip.factor && !spec.motor) {
    return fail(
        "--skip needs to know how quickly the band can be passed: "
        "--skip-acceleration A or xFACTOR, or the motor (--torque, --inertia)");
  }
  return {};
}

Result<void> check_side(const Spec& spec, const SideSpec& side) {
  const int given =
      side.acceleration.has_value() + side.time_s.has_value() + side.codes.has_value();
  const std::string_view profile = name_of(side.profile);
  if (side.profile == Profile::kTorque || side.profile == Profile::kPiecewise) {
    if (given > 0) {
      return fail(
          fmt::format("profile {} takes no acceleration, time or number of codes: they "
                      "follow from the {}",
                      profile, side.profile == Profile::kTorque ? "motor" : "segments"));
    }
    if (side.profile == Profile::kTorque && !spec.motor) {
      return fail("profile torque needs the motor: --torque FILE and --inertia");
    }
    return {};
  }
  if (given != 1) {
    return fail(
        fmt::format("profile {} needs one of --acceleration, --time and --codes, for each "
                    "side at most one",
                    profile));
  }
  if (side.profile == Profile::kPto && !side.time_s) {
    return fail("profile pto takes times: --time and --decel-time");
  }
  if ((side.acceleration && !is_positive(*side.acceleration)) ||
      (side.time_s && !is_positive(*side.time_s)) || (side.jerk && !is_positive(*side.jerk))) {
    return fail("accelerations, times and jerks; allowed: above 0");
  }
  if (side.codes && (*side.codes < 3 || *side.codes > kMaxCodes)) {
    return fail(fmt::format("--codes {}; allowed: 3..{}", *side.codes, kMaxCodes));
  }
  if (side.jerk && side.profile != Profile::kScurve) {
    return fail(fmt::format("profile {} has no --jerk; use scurve", profile));
  }
  return {};
}

Result<void> check(const Spec& spec) {
  if (auto good = check_speeds(spec); !good) return good;
  if (spec.code_bits != 8 && spec.code_bits != 16) {
    return fail(fmt::format(
        "{} bits a code; allowed: 16, or 8 as BUSHD has them. Codes on the bus and in an "
        "MCU have 16 bits; a slower start takes a longer --time-unit",
        spec.code_bits));
  }
  if (spec.motor) {
    if (auto good = check(*spec.motor); !good) return good;
  }
  if (auto good = check_side(spec, spec.accel); !good) return good;
  if (spec.decel) {
    if (auto good = check_side(spec, *spec.decel); !good) return good;
  }
  if (spec.accel.profile == Profile::kPto && !spec.decel) {
    return fail("profile pto takes times: --time and --decel-time");
  }
  if (uses_v64(spec) && spec.time_unit_ns.value_or(kV64UnitNs) != kV64UnitNs) {
    return fail("profile v64 counts in 25 us; allowed: --time-unit 25us, or leave it out");
  }
  if (spec.published &&
      (!is_discrete(spec.accel.profile) || spec.accel.profile == Profile::kSerial)) {
    return fail("--published is for profiles recurrence and v64, whose sources round down");
  }
  return check_skip(spec);
}

const SideSpec& spec_of(const Spec& spec, Side side) {
  return side == Side::kDecel && spec.decel ? *spec.decel : spec.accel;
}

// 1, 2, 2.5, 5, 10, .. ns, the whole ones.
std::uint32_t next_unit(std::uint32_t unit_ns) {
  for (std::uint64_t decade = 1;; decade *= 10) {
    for (const std::uint64_t tenths : {10U, 20U, 25U, 50U}) {
      const std::uint64_t candidate = tenths * decade / 10;
      if (candidate * 10 == tenths * decade && candidate > unit_ns) {
        return static_cast<std::uint32_t>(candidate);
      }
    }
  }
}

using Delays = std::vector<double>;

Result<std::uint32_t> unit_for(const Spec& spec, const Delays& accel, const Delays& decel) {
  if (spec.time_unit_ns) {
    if (*spec.time_unit_ns >= 1 && *spec.time_unit_ns <= kMaxTimeUnitNs) return *spec.time_unit_ns;
    return fail(fmt::format("--time-unit; allowed: 1 ns..{} ns", kMaxTimeUnitNs));
  }
  if (uses_v64(spec)) return kV64UnitNs;
  const double slowest_ns = std::max(accel.front(), decel.front()) * 1e9;
  if (spec.code_bits == 8) {
    return static_cast<std::uint32_t>(std::max(1.0, rounded_up_units(slowest_ns / kBushdSlowest)));
  }
  const auto side_ns = [](const Delays& delays) {
    return std::accumulate(delays.begin(), delays.end(), 0.0) * 1e9;
  };
  const double longest_ns = std::max(side_ns(accel), side_ns(decel));
  std::uint32_t unit_ns = 1;
  while (unit_ns < kMaxTimeUnitNs &&
         (slowest_ns > static_cast<double>(kCode.most) * unit_ns ||
          longest_ns + static_cast<double>(kMaxCodes) * unit_ns > kLongestSideUnits * unit_ns)) {
    unit_ns = next_unit(unit_ns);
  }
  return unit_ns;
}

Result<std::vector<std::uint16_t>> rounded(const Spec& spec, const Delays& delays,
                                           std::uint32_t unit_ns) {
  const double highest = spec.code_bits == 8 ? 255 : kCode.most;
  // A time unit that was asked for may be coarse, and that of v64 is its source's.
  const bool coarse = spec.code_bits == 16 && (spec.time_unit_ns || uses_v64(spec));
  const double lowest = coarse ? 1 : kBushdFastest;
  const auto code = [&](double delay_s) {
    const double units = delay_s * 1e9 / unit_ns;
    return spec.published ? std::floor(units + kNoiseUnits) : std::ceil(units - kNoiseUnits);
  };
  // The speeds that were asked for are those at both ends; between them a delay is a difference of
  // two times, in which the noise of a double is greater.
  const auto end_code = [&](double delay_s) {
    return spec.published ? code(delay_s) : rounded_up_units(delay_s * 1e9 / unit_ns);
  };
  const double cruise = end_code(delays.back());
  if (cruise < lowest) {
    return fail(fmt::format(
        "the maximum speed is code {:.0f} of {} ns; allowed: {:.0f} or more{}. Use a shorter "
        "--time-unit, a lower maximum or a faster start",
        cruise, unit_ns, lowest,
        coarse ? "" : ", so that one code changes the speed by 10 % at most"));
  }
  const double start = end_code(delays.front());
  if (start > highest) {
    return fail(
        fmt::format("the start speed is code {:.0f} of {} ns; allowed: up to {:.0f}. Use a "
                    "longer --time-unit or start faster",
                    start, unit_ns, highest));
  }
  std::vector<std::uint16_t> codes;
  codes.reserve(delays.size());
  for (const double delay_s : delays) {
    codes.push_back(static_cast<std::uint16_t>(std::clamp(code(delay_s), cruise, start)));
  }
  codes.front() = static_cast<std::uint16_t>(start);
  return codes;
}

}  // namespace

std::string_view name_of(Profile profile) {
  return kNames.at(static_cast<std::size_t>(profile));
}

std::optional<Profile> profile_of(std::string_view name) {
  const auto* found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<Profile>(found - kNames.begin());
}

Result<std::vector<double>> side_delays_s(const Spec& spec, Side side) {
  if (const auto good = check(spec); !good) return fail(good.error());
  const SideSpec& side_spec = spec_of(spec, side);
  const double from_hz =
      side == Side::kDecel ? spec.stop_hz.value_or(spec.start_hz) : spec.start_hz;
  if (from_hz == spec.max_hz && side_spec.profile != Profile::kPiecewise)
    return Delays{1.0 / from_hz};
  if (side_spec.profile == Profile::kRecurrence) return recurrence(side_spec, from_hz, spec.max_hz);
  if (side_spec.profile == Profile::kSerial) return serial(side_spec, side, from_hz, spec.max_hz);
  if (side_spec.profile == Profile::kV64)
    return v64(side_spec, from_hz, spec.max_hz, spec.published);
  const auto motion = continuous(spec, side_spec, side, from_hz);
  if (!motion) return fail(motion.error());
  auto delays = delays_s(*motion, kMaxCodes);
  if (delays.empty()) {
    return fail(
        fmt::format("makes {:.0f} codes a side; allowed: {} in all, because an MCU addresses the "
                    "codes of a table by 16 bits. Use a steeper ramp",
                    steps_of(*motion) + 2, kMaxCodes));
  }
  return delays;
}

Result<TableContent> make_content(const Spec& spec) {
  const auto accel = side_delays_s(spec, Side::kAccel);
  if (!accel) return fail(accel.error());
  // Only a motor brakes otherwise than it speeds up.
  const bool mirrored =
      !spec.decel && !spec.motor && spec.stop_hz.value_or(spec.start_hz) == spec.start_hz;
  const auto decel = mirrored ? accel : side_delays_s(spec, Side::kDecel);
  if (!decel) return fail(decel.error());
  const auto unit_ns = unit_for(spec, *accel, *decel);
  if (!unit_ns) return fail(unit_ns.error());
  auto accel_codes = rounded(spec, *accel, *unit_ns);
  if (!accel_codes) return fail(accel_codes.error());
  auto decel_codes = rounded(spec, *decel, *unit_ns);
  if (!decel_codes) return fail(decel_codes.error());

  TableContent content{.name = spec.name,
                       .time_unit_ns = *unit_ns,
                       .accel = std::move(*accel_codes),
                       .description = spec.description};
  if (*decel_codes != content.accel) {
    std::reverse(decel_codes->begin(), decel_codes->end());
    content.decel = std::move(*decel_codes);
  }
  if (const auto fault = tables::check(content)) {
    return fail(Error{.message = fault->message, .key = fault->key});
  }
  return content;
}

}  // namespace bushd::tables::profiles
