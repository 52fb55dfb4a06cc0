// What a dry run tells, against what the same move then takes and sends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"
#include "daemon/motion_frames.h"

namespace bushd::test {
namespace {

api::Request dry(const std::vector<std::string>& motors, const std::vector<std::int64_t>& steps) {
  return api::Move{.motors = motor_steps(motors, steps), .dry_run = true};
}

TEST(DryRun, TellsWhatTheMoveThenTakesAndSends) {
  for (const char* manner :
       {"fine", "coarse", "fine_table", "coarse_table", "fine_ticks", "coarse_ticks"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(hall(2, 4, manner));
    const std::vector<std::string> motors = {"m01", "m02", "m04", "m07"};
    const std::vector<std::int64_t> steps = {3000, -41, 0, -1700};
    MotionFrames sent;
    lab.on_send = [&sent](std::size_t, std::vector<std::uint8_t>& bytes) {
      sent.add(bytes);
      return true;
    };
    const Answer planned = lab.ask(dry(motors, steps));
    lab.run_for(0.5);
    ASSERT_EQ(planned.result, "done") << planned.reason;
    EXPECT_EQ(sent.frames, 0) << "nothing moves";
    ASSERT_TRUE(planned.plan);
    const api::MovePlan& plan = *planned.plan;
    ASSERT_TRUE(plan.traffic);

    ASSERT_EQ(lab.ask(Ask::kMoveBy, motors, steps).result, "reached");
    if (std::string(manner).find('_') == std::string::npos) {
      // States of runs hold for any time: a frame is due when less than 300 ms are queued, and
      // fills the queue up to 600 ms. So to each of two MCUs go T / 600 ms to T / 300 ms, and one
      // more for each motor that starts or ends.
      EXPECT_GT(plan.traffic->frames, 0);
      EXPECT_NEAR(static_cast<double>(plan.traffic->frames), static_cast<double>(sent.frames),
                  2 + static_cast<double>(plan.duration_us) / 300'000);
    } else {
      EXPECT_EQ(plan.traffic->frames, sent.frames);
      // A delimiter goes before a frame after silence.
      EXPECT_GE(plan.traffic->bytes, sent.bytes);
      EXPECT_LE(plan.traffic->bytes, sent.bytes + plan.traffic->frames);
    }
    // From the first tick to the end of the last one, as the log of moves has it.
    EXPECT_EQ(plan.duration_us, plan.ticks * 2560);
    EXPECT_LT(plan.duration_us - plan.motors[0].duration_us, 2560);
    EXPECT_DOUBLE_EQ(plan.motors[0].peak_steps_per_s, 2500);
    EXPECT_LT(plan.motors[1].peak_steps_per_s, 2500);
    EXPECT_EQ(plan.motors[2].peak_steps_per_s, 0);
    EXPECT_EQ(plan.motors[3].steps, -1700);
  }
}

TEST(DryRun, TakesAsLongAsTheMove) {
  ReadyLab lab(hall(1, 1));
  const Answer planned = lab.ask(dry({"m01"}, {1234}));
  const std::int64_t duration_us = planned.plan.value().duration_us;
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {1234});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 0; }));
  const std::int64_t first_step_us = lab.now_us();
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") == 1234; }));
  const std::int64_t took_us = lab.now_us() - first_step_us;
  // The first step comes 250 units of 40 us after the start, and an edge lies within its tick.
  EXPECT_NEAR(static_cast<double>(took_us), static_cast<double>(duration_us - 10'000), 2 * 2560);
  EXPECT_EQ(lab.wait(move).result, "reached");
}

TEST(DryRun, IsRefusedWhereTheMoveWouldBeAndForMotorsThatMove) {
  ReadyLab lab(hall(1, 2));
  EXPECT_THAT(lab.ask(dry({"nobody"}, {5})).reason, testing::HasSubstr("no motor"));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {2000});
  lab.run_for(0.3);
  const Answer refused = lab.ask(dry({"m01"}, {5}));
  EXPECT_EQ(refused.phase, Answer::kRefused);
  EXPECT_THAT(refused.reason, testing::HasSubstr("m01 moves"));
  EXPECT_EQ(lab.wait(move).result, "reached") << "the move goes on";
}

// Days of frames are not made to be counted.
TEST(DryRun, OfAVeryLongMoveTellsAllButTheFrames) {
  ReadyLab lab(hall(1, 1, "fine_ticks"));
  const Answer planned = lab.ask(dry({"m01"}, {1'000'000'000}));
  ASSERT_EQ(planned.result, "done");
  EXPECT_FALSE(planned.plan.value().traffic);
  EXPECT_NEAR(static_cast<double>(planned.plan.value().duration_us), 4e11, 1e9);
}

}  // namespace
}  // namespace bushd::test
