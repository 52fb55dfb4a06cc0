#include "daemon/services/moves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"
#include "daemon/services/stops.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using test::LiveBench;
using testing::HasSubstr;

struct MovesBench : LiveBench {
  explicit MovesBench() { connect(stops); }  // Moves itself is always served
  void move_to(std::int64_t number, std::vector<api::MotorAmount> motors) {
    moves.request(now_us(), asker(number),
                  api::Move{.kind = api::Move::Kind::kAbsolute, .motors = std::move(motors)});
  }
  Stops stops{installation, moves, homing, travels, programs, local_inputs, open_moves};
};

TEST(MovesService, MotorsOfABusStartInTheSameTick) {
  MovesBench bench;
  bench.move_to(1, {{"m01", 300}, {"m03", -200}});
  EXPECT_EQ(bench.of("m01").axis().start_tick(), bench.of("m03").axis().start_tick());
  EXPECT_GE(bench.moves.rest_by_us(bench.now_us()), bench.now_us());
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kReached);
  const auto motors = std::get<std::vector<api::MotorResult>>(result.detail);
  ASSERT_EQ(motors.size(), 2u);
  EXPECT_EQ(motors[1].motor, "m03");
  EXPECT_EQ(motors[1].position_steps, -200);
  EXPECT_EQ(bench.shaft_steps("m01"), 300);
  EXPECT_EQ(bench.shaft_steps("m03"), -200);
}

TEST(MovesService, AMotorThatMovesGoesToItsNewTarget) {
  MovesBench bench;
  bench.move_to(1, {{"m01", 3000}});
  bench.run_for(0.5);
  bench.move(2, "m01", -2900);
  EXPECT_EQ(bench.of("m01").target_steps(), 100) << "counted from the target";
  const api::Completed first = bench.result(1);
  EXPECT_EQ(first.outcome, api::Outcome::kStopped);
  EXPECT_THAT(first.reason, HasSubstr("was given a new target by command 2 of test"));
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kReached);
  EXPECT_EQ(bench.shaft_steps("m01"), 100);
}

TEST(MovesService, OneMotorThatCannotMoveRefusesAll) {
  MovesBench bench;
  bench.move_to(1, {{"m01", 10}, {"m02", 5 * motion::Motor::kMaxPosition}});
  EXPECT_THAT(bench.refusal(1), HasSubstr("m02: "));
  EXPECT_THAT(bench.refusal(1), HasSubstr("out of range; allowed: +-2147483647"));
  EXPECT_TRUE(bench.of("m01").is<motion::Resting>());
  EXPECT_TRUE(bench.open_moves.empty());
}

TEST(MovesService, AMoveEndsWhenItsMcuGoesOffline) {
  MovesBench bench;
  bench.move_to(1, {{"m01", 5000}});
  bench.run_for(0.5);
  bench.line.reboot(0, 2'000'000'000);
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kLink);
  EXPECT_THAT(result.reason, HasSubstr("hall:1"));
}

TEST(MovesService, ADryRunTellsAndMovesNothing) {
  MovesBench bench;
  bench.moves.request(
      bench.now_us(), bench.asker(1),
      api::Move{.kind = api::Move::Kind::kRelative, .motors = {{"m01", 1000}}, .dry_run = true});
  const api::Completed result = bench.result(1);
  const auto plan = std::get<api::MovePlan>(result.detail);
  ASSERT_EQ(plan.motors.size(), 1u);
  EXPECT_GT(plan.motors[0].duration_us, 0);
  EXPECT_LE(plan.motors[0].duration_us, plan.duration_us);
  ASSERT_TRUE(plan.traffic);
  EXPECT_GT(plan.traffic->frames, 0);
  EXPECT_TRUE(bench.of("m01").is<motion::Resting>());
  EXPECT_TRUE(bench.lines.empty());
}

}  // namespace
}  // namespace bushd::daemon
