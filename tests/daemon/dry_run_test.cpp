// What a dry run tells, against what the same move then takes and sends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"
#include "daemon/motion_frames.h"

namespace bushd::test {
namespace {

command_t dry(std::vector<std::string> motors, std::vector<std::int64_t> steps) {
  command_t command{};
  command.kind = command_t::MOVE_RELATIVE;
  command.dry_run = 1;
  command.motors = std::move(motors);
  command.steps = std::move(steps);
  return command;
}

TEST(DryRun, TellsWhatTheMoveThenTakesAndSends) {
  for (const char* manner :
       {"fine", "coarse", "fine_table", "coarse_table", "fine_ticks", "coarse_ticks"}) {
    SCOPED_TRACE(manner);
    Lab lab(hall(2, 4, manner));
    lab.connect();
    const std::vector<std::string> motors = {"m01", "m02", "m04", "m07"};
    const std::vector<std::int64_t> steps = {3000, -41, 0, -1700};
    MotionFrames sent;
    lab.on_send = [&sent](std::size_t, std::vector<std::uint8_t>& bytes) {
      sent.add(bytes);
      return true;
    };
    const reply_t planned = lab.wait(lab.send(dry(motors, steps)));
    lab.run_for(0.5);
    ASSERT_EQ(planned.result, "done") << planned.reason;
    EXPECT_EQ(sent.frames, 0) << "nothing moves";
    ASSERT_EQ(planned.plan.size(), 1u);
    const move_plan_t& plan = planned.plan[0];

    ASSERT_EQ(lab.wait(lab.send(command_t::MOVE_RELATIVE, motors, steps)).result, "reached");
    if (std::string(manner).find('_') == std::string::npos) {
      // States of runs hold for any time: a frame is due when less than 300 ms are queued, and
      // fills the queue up to 600 ms. So to each of two MCUs go T / 600 ms to T / 300 ms, and one
      // more for each motor that starts or ends.
      EXPECT_GT(plan.frames, 0);
      EXPECT_NEAR(static_cast<double>(plan.frames), static_cast<double>(sent.frames),
                  2 + static_cast<double>(plan.duration_us) / 300'000);
    } else {
      EXPECT_EQ(plan.frames, sent.frames);
      // A delimiter goes before a frame after silence.
      EXPECT_GE(plan.bytes, sent.bytes);
      EXPECT_LE(plan.bytes, sent.bytes + plan.frames);
    }
    // From the first tick to the end of the last one, as the log of moves has it.
    EXPECT_EQ(plan.duration_us, plan.ticks * 2560);
    EXPECT_LT(plan.duration_us - plan.motor_duration_us[0], 2560);
    EXPECT_DOUBLE_EQ(plan.peak_steps_per_s[0], 2500);
    EXPECT_LT(plan.peak_steps_per_s[1], 2500);
    EXPECT_EQ(plan.peak_steps_per_s[2], 0);
    EXPECT_EQ(plan.steps[3], -1700);
  }
}

TEST(DryRun, TakesAsLongAsTheMove) {
  Lab lab(hall(1, 1));
  lab.connect();
  const reply_t planned = lab.wait(lab.send(dry({"m01"}, {1234})));
  const std::int64_t duration_us = planned.plan.at(0).duration_us;
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {1234});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 0; }));
  const std::int64_t first_step_us = lab.now_us();
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") == 1234; }));
  const std::int64_t took_us = lab.now_us() - first_step_us;
  // The first step comes 250 units of 40 us after the start, and an edge lies within its tick.
  EXPECT_NEAR(static_cast<double>(took_us), static_cast<double>(duration_us - 10'000), 2 * 2560);
  EXPECT_EQ(lab.wait(move).result, "reached");
}

TEST(DryRun, IsRefusedWhereTheMoveWouldBeAndForMotorsThatMove) {
  Lab lab(hall(1, 2));
  lab.connect();
  EXPECT_THAT(lab.wait(lab.send(dry({"nobody"}, {5}))).reason, testing::HasSubstr("no motor"));
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {2000});
  lab.run_for(0.3);
  const reply_t refused = lab.wait(lab.send(dry({"m01"}, {5})));
  EXPECT_EQ(refused.phase, reply_t::REFUSED);
  EXPECT_THAT(refused.reason, testing::HasSubstr("m01 moves"));
  EXPECT_EQ(lab.wait(move).result, "reached") << "the move goes on";
  command_t command = dry({}, {});
  command.kind = command_t::STOP;
  EXPECT_THAT(lab.wait(lab.send(command)).reason, testing::HasSubstr("only moves"));
}

// Days of frames are not made to be counted.
TEST(DryRun, OfAVeryLongMoveTellsAllButTheFrames) {
  Lab lab(hall(1, 1, "fine_ticks"));
  lab.connect();
  const reply_t planned = lab.wait(lab.send(dry({"m01"}, {1'000'000'000})));
  ASSERT_EQ(planned.result, "done");
  EXPECT_EQ(planned.plan.at(0).frames, -1);
  EXPECT_NEAR(static_cast<double>(planned.plan.at(0).duration_us), 4e11, 1e9);
}

}  // namespace
}  // namespace bushd::test
