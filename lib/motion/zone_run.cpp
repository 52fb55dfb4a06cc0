#include "motion/zone_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "base/units/coordinates.h"
#include "motion/path.h"
#include "tables/table.h"

namespace bushd::motion {
namespace {

using tables::SpeedZones;

constexpr std::size_t kPlannedAtOnce = 1000;

tl::unexpected<Error> at_zone(std::size_t zone, std::string message) {
  return fail(Error{.message = std::move(message), .key = fmt::format("zones[{}]", zone)});
}

// Steps from 0, with the sign of the number.
std::int64_t whole_steps(const SpeedZones& zones, double place) {
  return std::llround(zones.steps_of(place));
}

}  // namespace

std::uint32_t ZoneRun::steps() const {
  std::uint32_t sum = 0;
  for (const Part& part : parts) sum += part.steps;
  return sum;
}

Result<ZoneRun> zone_run(const SpeedZones& zones, const bushd_table& table,
                         bushd_delay shortest_delay) {
  if (auto reached = tables::check_speeds(zones, table); !reached) return fail(reached.error());
  const std::int64_t begin = whole_steps(zones, zones.zones.front().from);
  const std::size_t count = zones.zones.size();
  Path path({{&table, shortest_delay}}, std::array{begin}, Path::Corners::kContinuous, count);
  std::int64_t from = begin;
  for (std::size_t i = 0; i < count; ++i) {
    const bool last = i + 1 == count;
    const std::int64_t to = whole_steps(zones, last ? zones.end : zones.zones[i + 1].from);
    if (to == from) {
      return at_zone(i, "has no step: it ends at the step at which it begins; make it longer");
    }
    const auto delay =
        units::Coordinates().delay_at(zones.steps_of(zones.zones[i].speed), table.time_unit_ns);
    if (!delay) return at_zone(i, delay.error().message);
    path.add(std::array{to}, std::array<bushd_delay, 1>{*delay});
    from = to;
  }
  while (!path.plan(kPlannedAtOnce)) {
  }
  ZoneRun run{.unit_ns = path.unit_ns(), .negative = from < begin};
  for (std::size_t i = 0; i < count; ++i) {
    for (const Delays& delays : path.profile(i)) run.delays.push_back(delays);
    run.parts.push_back({path.length_of(i), path.end_units(i) * path.unit_ns()});
  }
  return run;
}

Result<tables::TableContent> written_codes(const ZoneRun& run, const std::string& name) {
  // One delay after the other may be the same: what ends one part may begin the next one.
  Profile parts;
  for (const Delays& delays : run.delays) {
    if (!parts.empty() && parts.back().delay == delays.delay) {
      parts.back().steps += delays.steps;
    } else {
      parts.push_back(delays);
    }
  }
  const auto cruise = std::ranges::max_element(parts, {}, &Delays::steps);
  const std::uint32_t steps = run.steps();
  if (steps < 2) return fail("has a single step, and codes have two at least; make it longer");
  // Before codes are made of them: steps at other speeds may be more than memory has room for.
  const auto too_many = [](std::size_t codes) {
    return fail(
        fmt::format("has {} steps beside those of its longest part at one speed, each of "
                    "which takes a code; allowed: {}. Make its zones shorter, or use "
                    "fewer of them",
                    codes, tables::kMaxCodes));
  };
  if (steps - cruise->steps > tables::kMaxCodes) return too_many(steps - cruise->steps);
  tables::TableContent content{.name = name, .time_unit_ns = run.unit_ns, .decel = {{}}};
  const auto append = [](std::vector<std::uint16_t>& side, std::uint32_t times,
                         std::uint32_t delay) {
    side.insert(side.end(), times, static_cast<std::uint16_t>(delay));
  };
  for (auto part = parts.begin(); part != parts.end(); ++part) {
    if (part->delay > UINT16_MAX) {
      return fail(
          fmt::format("has a step of {} time units of its table; allowed: 65535. Use a "
                      "higher speed, or a table with a longer time unit",
                      part->delay));
    }
    if (part < cruise) append(content.accel, part->steps, part->delay);
    if (part > cruise) append(*content.decel, part->steps, part->delay);
  }
  const auto cruise_code = static_cast<std::uint16_t>(cruise->delay);
  std::vector<std::uint16_t>& accel = content.accel;
  std::vector<std::uint16_t>& decel = *content.decel;
  std::uint32_t left = cruise->steps;
  // Each side has a code. Sides that keep the order of a table have its rule, by which no step is
  // sooner than the cruise: where one is, a step of that ends the order.
  if (accel.empty()) {
    accel.push_back(cruise_code);
    --left;
  }
  if (left > 0 && decel.empty()) {
    decel.push_back(cruise_code);
    --left;
  }
  if (left > 0 && accel.back() < cruise_code) {
    accel.push_back(cruise_code);
    --left;
  } else if (left > 0 && decel.front() < cruise_code) {
    decel.insert(decel.begin(), cruise_code);
    --left;
  }
  content.cruise =
      left > 0 ? cruise_code
               : std::min(*std::ranges::min_element(accel), *std::ranges::min_element(decel));
  const std::size_t codes = accel.size() + decel.size();
  if (codes > tables::kMaxCodes) return too_many(codes);
  return content;
}

}  // namespace bushd::motion
