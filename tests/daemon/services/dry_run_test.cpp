// The plan by itself; daemon/dry_run_test.cpp compares it with the move.
#include "daemon/services/dry_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"
#include "daemon/services/stops.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;

TEST(DryRunService, IsTheMoveOnCopies) {
  LiveBench bench;
  Stops stops(bench.installation, bench.moves, bench.homing, bench.travels, bench.programs,
              bench.local_inputs, bench.open_moves);
  bench.connect(stops);
  DryRun dry_run(bench.installation, bench.now_us(),
                 {{bench.motor("m01"), 1000, 0}, {bench.motor("m04"), 0, 0}});
  while (dry_run.step()) {
  }
  const api::MovePlan plan = dry_run.take_plan();
  ASSERT_EQ(plan.motors.size(), 2u);
  EXPECT_EQ(plan.motors[0].motor, "m01");
  EXPECT_GT(plan.motors[0].peak_steps_per_s, 0);
  EXPECT_EQ(plan.motors[1].duration_us, 0) << "it stands there already";
  EXPECT_EQ(plan.duration_us, plan.ticks * 2560);
  EXPECT_GE(plan.duration_us, plan.motors[0].duration_us);
  bench.move(1, "m01", 1000);
  EXPECT_EQ(bench.of("m01").axis().end_tick() - bench.of("m01").axis().start_tick(), plan.ticks);
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kReached);
}

}  // namespace
}  // namespace bushd::daemon
