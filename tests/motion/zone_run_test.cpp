#include "motion/zone_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "engine/run.h"
#include "tables/random_table.h"
#include "tables/table.h"

namespace bushd::motion {
namespace {

using tables::SpeedZones;
using tables::TableContent;
using test::random_in;
using testing::HasSubstr;

std::vector<std::uint32_t> all_delays(const ZoneRun& run) {
  std::vector<std::uint32_t> all;
  for (const Delays& delays : run.delays) all.insert(all.end(), delays.steps, delays.delay);
  return all;
}

// The code behind this delay on a side that is given from slow to fast: the first that is at most
// as long, or the next one if it is just that.
std::uint32_t next_code(const std::vector<std::uint16_t>& side, std::uint32_t cruise,
                        std::uint32_t delay) {
  const auto code = [&](std::size_t i) {
    return i < side.size() ? std::max<std::uint32_t>(side[i], cruise) : cruise;
  };
  std::size_t i = 0;
  while (i < side.size() && code(i) > delay) ++i;
  return code(i) == delay ? code(i + 1) : code(i);
}

// By the zones and the codes alone: no step is sooner than its zone allows, and from each one to
// the next, and back from the last, by one code of the table.
std::vector<std::uint32_t> as_zones_say(const TableContent& content, const SpeedZones& zones) {
  std::vector<std::uint32_t> slowest;
  for (std::size_t i = 0; i < zones.zones.size(); ++i) {
    const double to = i + 1 < zones.zones.size() ? zones.zones[i + 1].from : zones.end;
    const auto steps = static_cast<std::size_t>(std::fabs(to - zones.zones[i].from));
    const auto delay =
        static_cast<std::uint32_t>(std::ceil(1e9 / (zones.zones[i].speed * content.time_unit_ns)));
    slowest.insert(slowest.end(), steps, delay);
  }
  const std::uint32_t cruise = content.cruise.value_or(content.accel.back());
  std::vector<std::uint16_t> down = content.accel;
  if (content.decel) down.assign(content.decel->rbegin(), content.decel->rend());
  const auto pass = [&](const std::vector<std::uint16_t>& side, auto begin, auto end) {
    std::uint32_t ramp = std::max<std::uint32_t>(side.front(), cruise);
    for (auto step = begin; step != end; ++step) {
      *step = std::max(*step, ramp);
      ramp = next_code(side, cruise, *step);
    }
  };
  std::vector<std::uint32_t> up_from = slowest;
  std::vector<std::uint32_t> down_to = slowest;
  pass(content.accel, up_from.begin(), up_from.end());
  pass(down, down_to.rbegin(), down_to.rend());
  std::vector<std::uint32_t> greater;
  for (std::size_t i = 0; i < slowest.size(); ++i)
    greater.push_back(std::max(up_from[i], down_to[i]));
  return greater;
}

// Codes that fall one by one: a table that repeats a code says nothing of where a zone begins in
// the repeats.
TableContent falling(int count, int fastest, int most_apart) {
  TableContent content{.name = "t", .time_unit_ns = 1000};
  int code = fastest;
  for (int i = 0; i < count; ++i) {
    content.accel.push_back(static_cast<std::uint16_t>(code));
    code += random_in(1, most_apart);
  }
  std::ranges::reverse(content.accel);
  return content;
}

SpeedZones any_zones(const TableContent& content, int direction) {
  SpeedZones zones{.table = "t"};
  int at = 0;
  for (int i = random_in(1, 6); i > 0; --i) {
    const int delay = random_in(content.accel.back(), 2 * content.accel.front());
    // In the middle between two codes: the slower one counts.
    zones.zones.push_back({static_cast<double>(direction * at), 1e9 / (1000.0 * delay - 500)});
    at += random_in(1, 80);
  }
  zones.end = direction * at;
  return zones;
}

TEST(ZoneRun, IsAsFastAsItsZonesAndTheTableAllowAndNoFaster) {
  EXPECT_TRUE(rc::check("any zones", [] {
    TableContent content = falling(random_in(1, 40), random_in(100, 400), 3);
    if (random_in(0, 1) == 0) {
      content.decel = falling(random_in(1, 40), content.accel.back(), 3).accel;
      std::ranges::reverse(*content.decel);
    }
    const auto table = tables::make(content);
    RC_ASSERT(table.has_value());
    const SpeedZones zones = any_zones(content, random_in(0, 1) == 0 ? 1 : -1);
    const auto run = zone_run(zones, (*table)->view());
    RC_ASSERT(run.has_value());
    RC_ASSERT(run->negative == (zones.end < 0));
    const auto wanted = as_zones_say(content, zones);
    RC_ASSERT(all_delays(*run) == wanted);
    std::uint64_t ns = 0;
    std::size_t step = 0;
    for (const ZoneRun::Part& part : run->parts) {
      for (std::uint32_t i = 0; i < part.steps; ++i) ns += std::uint64_t{wanted[step++]} * 1000;
      RC_ASSERT(part.end_ns == ns);
    }
  }));
}

// What an MCU makes of the codes is the run, step by step.
TEST(ZoneRun, AsCodesIsMadeByTheEngineWithTheSameDelays) {
  EXPECT_TRUE(rc::check("any zones", [] {
    const TableContent content = falling(random_in(1, 30), random_in(100, 400), 4);
    const auto table = tables::make(content);
    const auto run = zone_run(any_zones(content, 1), (*table)->view());
    RC_ASSERT(run.has_value());
    RC_PRE(run->steps() >= 2);
    const auto codes = written_codes(*run, "codes");
    RC_ASSERT(codes.has_value());
    const auto made = tables::make_any_law(*codes);
    RC_ASSERT(made.has_value());
    const bushd_table& view = (*made)->view();
    RC_ASSERT(view.accel.count + view.decel.count <= run->steps());
    std::vector<std::uint32_t> delays(run->steps(), view.cruise);
    for (std::uint32_t i = 0; i < view.accel.count; ++i) delays[i] = view.accel.code[i];
    for (std::uint32_t i = 0; i < view.decel.count; ++i)
      delays[delays.size() - 1 - i] = view.decel.code[i];
    RC_ASSERT(delays == all_delays(*run));
    if (!bushd_table_is_written(&view)) {
      for (std::uint32_t j = 1; j <= run->steps(); ++j)
        RC_ASSERT(bushd_table_delay(&view, j, run->steps()) == delays[j - 1]);
    }
  }));
}

TEST(ZoneRun, KeepsToTheShortestDelayOfTheMotor) {
  const auto table = tables::make({.name = "t", .time_unit_ns = 1000, .accel = {400, 300, 200}});
  const SpeedZones zones{.table = "t", .zones = {{0, 2000}, {10, 5000}}, .end = 20};
  const auto run = zone_run(zones, (*table)->view(), 350);
  ASSERT_TRUE(run) << run.error().text();
  const auto delays = all_delays(*run);
  EXPECT_EQ(*std::ranges::min_element(delays), 350u);
}

TEST(ZoneRun, WhatCannotBeMadeIsRefused) {
  const auto table = tables::make({.name = "t", .time_unit_ns = 1000, .accel = {400, 200}});
  const auto refusal = [&](const SpeedZones& zones) {
    const auto run = zone_run(zones, (*table)->view());
    if (!run) return run.error().text();
    const auto codes = written_codes(*run, "codes");
    return codes ? std::string("taken") : codes.error().text();
  };
  EXPECT_THAT(refusal({.table = "t", .zones = {{0, 6000}}, .end = 9}),
              HasSubstr("zones[0]: has 6000 steps/s, and the table \"t\" reaches 5000"));
  EXPECT_THAT(refusal({.table = "t", .zones = {{0, 100}, {1.2, 200}, {1.4, 100}}, .end = 9}),
              HasSubstr("zones[1]: has no step"));
  EXPECT_THAT(refusal({.table = "t", .zones = {{0, 1e-4}}, .end = 9}), HasSubstr("zones[0]: "));
  EXPECT_THAT(refusal({.table = "t", .zones = {{0, 10}}, .end = 9}),
              HasSubstr("has a step of 100000 time units of its table; allowed: 65535"));
  EXPECT_THAT(refusal({.table = "t", .zones = {{0, 1000}}, .end = 1}),
              HasSubstr("has a single step"));
  // Codes of a billion steps are not made.
  EXPECT_THAT(refusal({.table = "t", .zones = {{0, 5000}, {1e9, 4000}}, .end = 2e9}),
              HasSubstr("steps beside those of its longest part at one speed"));
}

}  // namespace
}  // namespace bushd::motion
