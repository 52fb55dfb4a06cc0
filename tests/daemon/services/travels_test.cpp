#include "daemon/services/travels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"
#include "daemon/services/stops.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

constexpr std::uint32_t kWay = 40;

// m01 and m02 have limit switches of their own at both ends, m03 has none.
std::string shutters() {
  const std::string first =
      test::with_keys(test::hall(1, 3), "m01",
                      "inputs = { positive = 3, negative = 4 }\n"
                      "unit = \"mm\"\nsteps_per_unit = 10\nsoft_limits = [-1, 8]\n");
  return test::with_keys(first, "m02", "inputs = { positive = 5, negative = 6 }\n");
}

struct TravelsBench : LiveBench {
  TravelsBench() : LiveBench(shutters()) { connect(travels); }
  void travel(std::int64_t number, const std::string& name, std::uint32_t steps = kWay,
              bushd_travel_kind kind = BUSHD_TRAVEL_LIMITS) {
    bushd_travel message{};
    message.kind = kind;
    message.direction = 1;
    message.steps = kind == BUSHD_TRAVEL_STEP ? 1 : steps;
    message.wait_us = 20'000;
    travels.request(asker(number), motor(name), message);
  }
  // The limit switch of m01 at the positive end is at these steps.
  bool run_with_limit_at(std::int64_t at, const std::function<bool()>& done) {
    return run_until([&] {
      const std::int64_t stands = shaft_steps("m01");
      const unsigned active = (stands >= at ? 1U << 3 : 0U) | (stands <= 0 ? 1U << 4 : 0U);
      line.mcu(0).set_inputs({static_cast<std::uint16_t>(active), 0});
      return done();
    });
  }
};

TEST(Travels, GoThereAndBackAndHaveOneResult) {
  TravelsBench bench;
  bench.travel(1, "m01");
  EXPECT_TRUE(bench.of("m01").is<motion::Travelling>());
  EXPECT_EQ(bench.travels.progress(bench.motor("m01")), nullptr) << "its MCU has not begun";
  bool seen = false;
  ASSERT_TRUE(bench.run_with_limit_at(kWay, [&] {
    const bushd_report* report = bench.travels.progress(bench.motor("m01"));
    if (report != nullptr && report->homing == BUSHD_TRAVEL_RETURN) seen = true;
    return bench.is_completed(1);
  }));
  EXPECT_TRUE(seen);
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kReached) << result.reason;
  EXPECT_EQ(bench.shaft_steps("m01"), 0);
  EXPECT_TRUE(bench.of("m01").is<motion::Resting>());
}

TEST(Travels, AStopEndsThem) {
  TravelsBench bench;
  bench.travel(1, "m01");
  ASSERT_TRUE(bench.run_with_limit_at(kWay, [&] { return bench.shaft_steps("m01") > 5; }));
  bench.travels.stop(bench.motor("m01"));
  bench.travels.stop(bench.motor("m02"));
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kStopped);
  EXPECT_LT(bench.shaft_steps("m01"), static_cast<std::int64_t>(kWay));
  bench.travel(2, "m01", 5);
  bench.travels.stop(bench.motor("m01"));
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kStopped) << "before its MCU was asked";
}

TEST(Travels, RefusalsSayWhy) {
  TravelsBench bench;
  bench.travel(1, "m03");
  EXPECT_THAT(bench.refusal(1), HasSubstr("m03: it needs a limit switch of its own at each end"));
  bench.travel(2, "m01", 90);
  EXPECT_THAT(bench.refusal(2), HasSubstr("m01: target 9.000 mm is beyond the soft limit"));
  bench.move(3, "m01", 40);
  bench.travel(4, "m01");
  EXPECT_THAT(bench.refusal(4), HasSubstr("m01: moves, by another's request"));
  EXPECT_EQ(bench.result(3).outcome, api::Outcome::kReached);
  bench.travel(5, "m03", 1, BUSHD_TRAVEL_STEP);
  bench.travel(6, "m01");
  EXPECT_THAT(bench.refusal(6), HasSubstr("MCU hall:1 has m03 travel; one at a time"));
  bench.travel(7, "m03", 1, BUSHD_TRAVEL_STEP);
  EXPECT_THAT(bench.refusal(7), HasSubstr("it travels by itself"));
  EXPECT_THAT(bench.result(5).reason, HasSubstr("its sensor has not seen the step in time"));
}

TEST(Travels, ALostMcuEndsThem) {
  TravelsBench bench;
  bench.travel(1, "m01");
  ASSERT_TRUE(bench.run_with_limit_at(kWay, [&] { return bench.shaft_steps("m01") > 5; }));
  bench.silent = true;
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kLink);
  EXPECT_THAT(result.reason, HasSubstr("it travelled by itself"));
}

}  // namespace
}  // namespace bushd::daemon
