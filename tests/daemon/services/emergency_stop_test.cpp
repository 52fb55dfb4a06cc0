#include "daemon/services/emergency_stop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"
#include "daemon/services/drivers.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

TEST(EmergencyStop, AFloodIsCarriedOutAndItsMemoryIsBounded) {
  LiveBench bench;  // not connected
  EmergencyStop& emergency_stop = bench.emergency_stop;
  constexpr std::size_t kMore = 10;
  for (std::size_t i = 0; i < kMostAwaited + kMore; ++i) {
    emergency_stop.request(0, bench.asker(static_cast<std::int64_t>(i)), {});
  }
  EXPECT_TRUE(emergency_stop.under_way());
  std::size_t given_up = 0;
  for (const auto& [number, reply] : bench.client->answers) {
    if (std::holds_alternative<api::Completed>(reply)) ++given_up;
  }
  EXPECT_EQ(given_up, kMore) << "the oldest are not waited for any more";
  emergency_stop.step(1);
  EXPECT_FALSE(emergency_stop.under_way());
  EXPECT_EQ(bench.completed().outcome, api::Outcome::kDone);
}

TEST(EmergencyStop, IsLatchedUntilFaultsAreCleared) {
  LiveBench bench;
  Drivers drivers(bench.installation, bench.interlocks, bench.emergency_stop);
  bench.connect(drivers);
  bench.move(1, "m01", 3000);
  bench.run_for(0.3);
  bench.emergency_stop.request(bench.now_us(), bench.asker(2), {});
  EXPECT_TRUE(bench.emergency_stop.under_way());
  drivers.request(bench.now_us(), bench.asker(3), api::ClearFaults{});
  EXPECT_THAT(bench.refusal(3), HasSubstr("an emergency stop is under way"));
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kDone);
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kStopped);
  EXPECT_EQ(bench.shaft_steps("m01"), bench.of("m01").position_steps());
  EXPECT_LT(bench.shaft_steps("m01"), 3000);
  for (const char* motor : {"m01", "m03"}) {
    EXPECT_NE(bench.report_of(motor).faults & BUSHD_FAULT_EMERGENCY, 0) << motor;
  }
  bench.move(4, "m03", 10);
  EXPECT_NE(bench.refusal(4), "not refused");
  drivers.request(bench.now_us(), bench.asker(5), api::ClearFaults{});
  EXPECT_EQ(bench.result(5).outcome, api::Outcome::kDone);
  bench.move(6, "m03", 10);
  EXPECT_EQ(bench.result(6).outcome, api::Outcome::kReached);
}

}  // namespace
}  // namespace bushd::daemon
