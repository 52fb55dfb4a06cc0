#include "daemon/services/trigger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

struct TriggerBench : LiveBench {
  TriggerBench() { connect(trigger); }
  void arm(std::int64_t number, std::vector<api::MotorAmount> motors, std::int64_t delay_us = 700) {
    trigger.request(
        asker(number),
        api::Arm{.edge = api::Edge::kRising, .delay_us = delay_us, .motors = std::move(motors)});
  }
  Trigger trigger{installation, interlocks, moves, open_moves};
};

TEST(Trigger, MotorsMoveAfterTheEdge) {
  TriggerBench bench;
  bench.arm(1, {{"m01", 300}, {"m02", -40}});
  EXPECT_TRUE(bench.of("m01").is<motion::Armed>());
  bench.run_for(1);
  EXPECT_EQ(bench.shaft_steps("m01"), 0);
  bench.line.mcu(0).set_inputs({.motors = 0, .system = BUSHD_INPUT_TRIGGER});
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kReached) << result.reason;
  EXPECT_EQ(bench.shaft_steps("m01"), 300);
  EXPECT_EQ(bench.shaft_steps("m02"), -40);
}

TEST(Trigger, DisarmedMotorsMoveNoMore) {
  TriggerBench bench;
  bench.arm(1, {{"m01", 300}, {"m03", 200}});
  bench.run_for(0.5);
  bench.trigger.request(bench.asker(2), api::Disarm{{"m01"}});
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kDone);
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kStopped);
  EXPECT_THAT(result.reason, HasSubstr("disarmed"));
  for (std::size_t mcu = 0; mcu < 2; ++mcu) {
    bench.line.mcu(mcu).set_inputs({.motors = 0, .system = BUSHD_INPUT_TRIGGER});
  }
  bench.run_for(1);
  EXPECT_EQ(bench.shaft_steps("m01"), 0);
  EXPECT_EQ(bench.shaft_steps("m03"), 0) << "armed together, disarmed together";
}

TEST(Trigger, RefusalsSayWhy) {
  TriggerBench bench;
  bench.arm(1, {{"m01", 300}}, 49);
  EXPECT_THAT(bench.refusal(1), HasSubstr("allowed: 50 to 1650000"));
  bench.arm(2, {{"m01", 0}});
  EXPECT_THAT(bench.refusal(2), HasSubstr("m01: a move of no steps"));
  bench.arm(3, {{"m02", 5}});
  bench.arm(4, {{"m01", 5}});
  EXPECT_THAT(bench.refusal(4), HasSubstr("m02 waits for the trigger of MCU hall:1 already"));
  bench.move(5, "m03", 400);
  bench.arm(6, {{"m03", 5}});
  EXPECT_THAT(bench.refusal(6), HasSubstr("m03 moves; run 'bushctl stop m03' first"));
  EXPECT_EQ(bench.result(5).outcome, api::Outcome::kReached);
}

}  // namespace
}  // namespace bushd::daemon
