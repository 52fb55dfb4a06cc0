#include "daemon/services/health_publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"
#include "daemon/services/stops.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using test::LiveBench;

TEST(HealthPublisher, TellsOfEveryBusOnceASecond) {
  Bench bench;
  HealthPublisher publisher(bench.installation, bench);
  publisher.step(0);
  ASSERT_EQ(bench.health.size(), 1u);
  EXPECT_EQ(bench.health[0].bus, "hall");
  EXPECT_EQ(bench.health[0].port_state, "not yet opened");
  ASSERT_EQ(bench.health[0].mcus.size(), 2u);
  EXPECT_EQ(bench.health[0].latency.back().below_us, INT64_MAX);
  publisher.step(HealthPublisher::kPeriodUs - 1);
  EXPECT_EQ(bench.health.size(), 1u);
  EXPECT_EQ(publisher.next_wake_us(), HealthPublisher::kPeriodUs);
  publisher.step(HealthPublisher::kPeriodUs);
  EXPECT_EQ(bench.health.size(), 2u);
}

TEST(HealthPublisher, CountsLossesAndRestarts) {
  LiveBench bench;
  Stops stops(bench.installation, bench.moves, bench.homing, bench.travels, bench.programs,
              bench.local_inputs, bench.open_moves);
  bench.connect(stops);
  HealthPublisher publisher(bench.installation, bench);
  bench.silent = true;
  bench.run_for(0.2);
  bench.silent = false;
  bench.line.reboot(1, 10'000'000);
  ASSERT_TRUE(bench.run_until([&] { return !bench.all_online(); }));
  ASSERT_TRUE(bench.run_until([&] { return bench.all_online(); }));
  publisher.step(bench.now_us());
  const api::HealthSnapshot& health = bench.health.back();
  EXPECT_GT(health.mcus.at(0).timeouts, 0u);
  EXPECT_EQ(health.mcus.at(0).restarts, 0u);
  EXPECT_EQ(health.mcus.at(1).restarts, 1u);
}

}  // namespace
}  // namespace bushd::daemon
