#include "daemon/services/link_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

struct LinkFaultsBench : LiveBench {
  LinkFaultsBench() : LiveBench(test::hall_with_emergency_input()) { connect(link_faults); }

  // m01 is ramped down by its MCU.
  void lose_the_link_in_a_move() {
    move(1, "m01", 5000);
    run_for(0.5);
    silent = true;
    run_for(0.4);  // longer than the MCU's queue, and too short for it to be given up
    silent = false;
  }
  bool clears() const {
    return !warnings.empty() && warnings.back().find("clearing the fault") != std::string::npos;
  }
  void press(std::uint8_t system) { line.mcu(0).set_inputs({0, system}); }

  LinkFaults link_faults{installation, emergency_stop, *this};
};

TEST(LinkFaults, AreClearedOnceTheMotorsStandAndThePositionsAreRead) {
  LinkFaultsBench bench;
  bench.lose_the_link_in_a_move();
  ASSERT_TRUE(bench.all_online());
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kLink);
  const std::int64_t at = bench.shaft_steps("m01");
  EXPECT_GT(at, 0);
  EXPECT_LT(at, 5000) << "it was ramped down by its MCU";
  EXPECT_EQ(bench.report_of("m01").faults, BUSHD_FAULT_LINK);
  ASSERT_TRUE(bench.run_until([&] { return bench.report_of("m01").faults == 0; }));
  EXPECT_THAT(bench.warnings, testing::Contains(HasSubstr("clearing the fault")));
  EXPECT_EQ(bench.of("m01").position_steps(), at);
  bench.move(2, "m01", 10);
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kReached);
}

// Clearing is on its way, and what it was asked for says nothing of the input. Pressed for two
// ticks and more, at every millisecond from before it was asked to after it has arrived.
TEST(LinkFaults, AnEmergencyInputIsNotClearedWithThem) {
  LinkFaultsBench first;
  first.lose_the_link_in_a_move();
  ASSERT_TRUE(first.run_until([&] { return first.clears(); }));
  const std::int64_t clears_us = first.now_us();
  for (std::int64_t ms = -30; ms <= 20; ++ms) {
    SCOPED_TRACE(std::to_string(ms) + " ms after clearing was asked for");
    LinkFaultsBench bench;
    bench.lose_the_link_in_a_move();
    bench.run_until([&] { return bench.now_us() >= clears_us + ms * 1000; });
    bench.press(BUSHD_INPUT_EMERGENCY);
    bench.run_for(0.006);
    bench.press(0);
    bench.run_for(1);
    ASSERT_NE(bench.report_of("m01").faults & BUSHD_FAULT_EMERGENCY_INPUT, 0);
  }
}

TEST(LinkFaults, AnEmergencyStopIsForPeopleToClear) {
  LinkFaultsBench bench;
  bench.emergency_stop.request(bench.now_us(), bench.asker(1), {});
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kDone);
  bench.run_for(2);
  EXPECT_EQ(bench.report_of("m01").faults, BUSHD_FAULT_EMERGENCY);
  EXPECT_THAT(bench.warnings, testing::Not(testing::Contains(HasSubstr("clearing the fault"))));
}

}  // namespace
}  // namespace bushd::daemon
