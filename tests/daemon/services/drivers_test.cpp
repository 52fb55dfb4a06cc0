#include "daemon/services/drivers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

struct DriversBench : LiveBench {
  explicit DriversBench(const std::string& toml = test::hall(2, 2)) : LiveBench(toml) {
    connect(drivers);
  }
  Drivers drivers{installation, interlocks, emergency_stop};
  bool enabled(const std::string& motor) {
    return (report_of(motor).flags & BUSHD_FLAG_ENABLED) != 0;
  }
};

// People clear what they have been told of. An input that is pressed meanwhile is no part of it.
TEST(Drivers, ClearTheFaultsThatWereReported) {
  for (std::int64_t ms = -30; ms <= 20; ++ms) {
    SCOPED_TRACE(std::to_string(ms) + " ms after it was asked for");
    DriversBench bench(test::hall_with_emergency_input());
    bench.emergency_stop.request(bench.now_us(), bench.asker(1), {});
    EXPECT_EQ(bench.result(1).outcome, api::Outcome::kDone);
    bench.run_for(0.1);
    const std::int64_t asked_us = bench.now_us() + 40'000;
    bool asked = false;
    bool was_told = false;
    const auto run_to = [&](std::int64_t until_us) {
      bench.run_until([&] {
        if (bench.now_us() >= asked_us && !std::exchange(asked, true)) {
          was_told = (bench.report_of("m01").faults & BUSHD_FAULT_EMERGENCY_INPUT) != 0;
          bench.drivers.request(bench.now_us(), bench.asker(2), api::ClearFaults{});
        }
        return bench.now_us() >= until_us;
      });
    };
    run_to(asked_us + ms * 1000);
    bench.line.mcu(0).set_inputs({0, BUSHD_INPUT_EMERGENCY});
    run_to(bench.now_us() + 6000);
    bench.line.mcu(0).set_inputs({0, 0});
    run_to(std::max(bench.now_us(), asked_us) + 1'000'000);
    EXPECT_TRUE(bench.is_completed(2));
    ASSERT_EQ(bench.report_of("m01").faults, was_told ? 0 : BUSHD_FAULT_EMERGENCY_INPUT);
  }
}

TEST(Drivers, AreDisabledAndEnabledByMcu) {
  DriversBench bench;
  ASSERT_TRUE(bench.enabled("m01"));
  bench.drivers.request(bench.now_us(), bench.asker(1), api::Disable{{"m02"}});
  const api::Completed disabled = bench.result(1);
  EXPECT_EQ(disabled.outcome, api::Outcome::kDone);
  EXPECT_EQ(disabled.reason, "done; of the whole MCU hall:1, so of m01 too");
  EXPECT_FALSE(bench.enabled("m01")) << "the MCU has one output for all of them";
  EXPECT_TRUE(bench.enabled("m03"));
  bench.drivers.request(bench.now_us(), bench.asker(2), api::Enable{});
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kDone);
  EXPECT_TRUE(bench.enabled("m01"));
}

TEST(Drivers, StayEnabledWhileAMotorMoves) {
  DriversBench bench;
  bench.move(1, "m02", 500);
  bench.drivers.request(bench.now_us(), bench.asker(2), api::Disable{{"m01"}});
  EXPECT_THAT(bench.refusal(2), HasSubstr("m02 moves; run 'bushctl stop m02' first"));
  bench.drivers.request(bench.now_us(), bench.asker(3), api::Disable{{"m03"}});
  EXPECT_EQ(bench.result(3).outcome, api::Outcome::kDone) << "nothing moves there";
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kReached);
}

TEST(Drivers, NoMoveBeginsWhileTheyAreBeingDisabled) {
  DriversBench bench;
  bench.drivers.request(bench.now_us(), bench.asker(1), api::Disable{{"m01"}});
  EXPECT_THAT(bench.interlocks.may_move(bench.motor("m02")).error().text(),
              HasSubstr("the drivers of MCU hall:1 are being disabled"));
  EXPECT_TRUE(bench.interlocks.may_move(bench.motor("m03")));
  bench.result(1);
}

TEST(Drivers, OfAllAreThoseOfTheMcusThatAreOnline) {
  DriversBench bench;
  bench.line.mcu(1).reset(bench.now_us() * 1000, INT64_MAX, 9);
  ASSERT_TRUE(bench.run_until([&] { return bench.installation[McuId(1)].offline(); }));
  bench.drivers.request(bench.now_us(), bench.asker(1), api::Disable{});
  const api::Completed disabled = bench.result(1);
  EXPECT_EQ(disabled.outcome, api::Outcome::kDone);
  EXPECT_EQ(disabled.reason, "done; not online, so not done there: hall:2");
  EXPECT_FALSE(bench.enabled("m01"));
  bench.drivers.request(bench.now_us(), bench.asker(2), api::Enable{});
  EXPECT_THAT(bench.result(2).reason, HasSubstr("not done there: hall:2"));
  EXPECT_TRUE(bench.enabled("m01"));
  bench.drivers.request(bench.now_us(), bench.asker(3), api::ClearFaults{});
  EXPECT_THAT(bench.result(3).reason, HasSubstr("not done there: hall:2"));
  bench.drivers.request(bench.now_us(), bench.asker(4), api::Enable{{"m01", "m03"}});
  EXPECT_THAT(bench.refusal(4), HasSubstr("MCU hall:2 is offline")) << "it was meant";
}

TEST(Drivers, ClearOfAllIsOfThoseThatHaveAFault) {
  DriversBench bench(test::hall_with_emergency_input());
  bench.move(1, "m03", 500);
  bench.line.mcu(0).set_inputs({0, BUSHD_INPUT_EMERGENCY});
  ASSERT_TRUE(bench.run_until([&] { return bench.report_of("m01").faults != 0; }));
  bench.line.mcu(0).set_inputs({0, 0});
  bench.run_for(0.05);
  ASSERT_TRUE(bench.installation[bench.motor("m03")].has_plan()) << "it goes on";
  bench.drivers.request(bench.now_us(), bench.asker(2), api::ClearFaults{});
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kDone)
      << "no motor of the MCU with the fault moves";
  EXPECT_EQ(bench.report_of("m01").faults, 0);
  bench.drivers.request(bench.now_us(), bench.asker(3), api::ClearFaults{{"m03"}});
  EXPECT_THAT(bench.refusal(3), HasSubstr("m03 moves; run 'bushctl stop m03' first"));
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kReached);
}

TEST(Drivers, OfAllAreRefusedWhereNoMcuIsOnline) {
  DriversBench bench;
  bench.silent = true;
  ASSERT_TRUE(bench.run_until([&] {
    return bench.installation[McuId(0)].offline() && bench.installation[McuId(1)].offline();
  }));
  bench.drivers.request(bench.now_us(), bench.asker(1), api::ClearFaults{});
  EXPECT_THAT(bench.refusal(1), HasSubstr("MCU hall:1 is offline"));
}

TEST(Drivers, OfAnMcuThatIsOfflineAreRefused) {
  LiveBench bench;  // not connected
  Drivers drivers(bench.installation, bench.interlocks, bench.emergency_stop);
  drivers.request(0, bench.asker(1), api::Enable{{"m03"}});
  EXPECT_THAT(bench.refusal(1), HasSubstr("MCU hall:2 is offline"));
  drivers.request(0, bench.asker(2), api::ClearFaults{{"m09"}});
  EXPECT_THAT(bench.refusal(2), HasSubstr("there is no motor"));
}

}  // namespace
}  // namespace bushd::daemon
