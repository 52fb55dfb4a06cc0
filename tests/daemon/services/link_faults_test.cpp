#include "daemon/services/link_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

struct LinkFaultsBench : LiveBench {
  LinkFaultsBench() { connect(link_faults); }
  LinkFaults link_faults{installation, emergency_stop, *this};
};

TEST(LinkFaults, AreClearedOnceTheMotorsStandAndThePositionsAreRead) {
  LinkFaultsBench bench;
  bench.move(1, "m01", 5000);
  bench.run_for(0.5);
  bench.silent = true;
  bench.run_for(0.4);  // longer than the MCU's queue, and too short for it to be given up
  bench.silent = false;
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
