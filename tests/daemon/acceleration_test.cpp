// Motors that take a share of their table's acceleration: host and MCU go by the same codes, on
// every way, judged by tools/check-trace edge by edge.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "daemon/traced.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// Two moves of the same time are told to have ended so far apart at most: their ends lie anywhere
// between two polls, which are 50 ms apart, and their beginnings anywhere in a tick of 2.56 ms.
constexpr double kToldWithinS = 0.05 + 0.00256;

class Acceleration : public Traced<const char*> {
 protected:
  int judge(Lab& lab) {
    close_trace(lab);
    return Traced::check(lab, "");
  }
  static Answer change(Lab& lab, const std::string& motor, const std::string& value) {
    return lab.ask(api::Configure{.kind = api::Configure::Kind::kChange,
                                  .changes = {{motor, "acceleration", value}}});
  }
  // A move of so many steps, in seconds.
  static double seconds(Lab& lab, const std::string& motor, std::int64_t steps) {
    const std::int64_t before_us = lab.now_us();
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {motor}, {steps}).result, "reached");
    return static_cast<double>(lab.now_us() - before_us) * 1e-6;
  }
};
INSTANTIATE_TEST_SUITE_P(Manners, Acceleration,
                         testing::Values("fine", "coarse", "fine_table", "coarse_table",
                                         "fine_ticks"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(Acceleration, IsThatOfHostAndMcuFromTheChangeOn) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const std::string hash = lab.description("m01").table.hash;
  const double whole_s = seconds(lab, "m01", 400);
  EXPECT_EQ(change(lab, "m01", "0.25").result, "done");
  EXPECT_NE(lab.description("m01").table.hash, hash);
  EXPECT_EQ(lab.description("m02").table.hash, hash);
  // 400 steps are ramps alone: by bushd2-constant 2 x 200 delays, 0.36048 s. With a quarter of the
  // acceleration a speed is reached after four times the steps, so the 200 steps of a side take 4
  // times its first 50 delays (89.88 ms) at most, and 4 times the 50 delays from the second one on
  // (80.76 ms) at least, as a delay is that at one of the ends of its four steps.
  const double quarter_s = seconds(lab, "m01", -400);
  EXPECT_LT(quarter_s - whole_s, 8 * 0.08988 - 0.36048 + kToldWithinS);
  EXPECT_GT(quarter_s - whole_s, 8 * 0.08076 - 0.36048 - kToldWithinS);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01", "m02"}, {300, 300}).result, "reached");
  api::MoveLine line{.motors = motor_steps({"m01", "m02", "m03"}, {700, -400, 150})};
  EXPECT_EQ(lab.ask(line).result, "reached");
  // A stop ramps down as gently.
  const auto stopped = lab.send(Ask::kMoveBy, {"m01"}, {3000});
  lab.run_for(0.6);
  lab.send(Ask::kStop, {"m01"});
  EXPECT_EQ(lab.wait(stopped).result, "stopped");
  EXPECT_EQ(change(lab, "m01", "1").result, "done");
  EXPECT_EQ(lab.description("m01").table.hash, hash);
  EXPECT_NEAR(seconds(lab, "m01", 400), whole_s, kToldWithinS);
  for (const char* motor : {"m01", "m02", "m03"}) {
    EXPECT_EQ(lab.motor(motor).position_steps, lab.shaft_steps(motor)) << motor;
  }
  EXPECT_EQ(judge(lab), 0) << said();
}

TEST(AccelerationSetting, IsKeptAndCountsWithAnotherTable) {
  Lab lab(hall(1, 2));
  lab.keep_positions();
  lab.connect();
  const auto change = [&lab](const std::string& motor, const std::string& value) {
    return lab.ask(api::Configure{.kind = api::Configure::Kind::kChange,
                                  .changes = {{motor, "acceleration", value}}});
  };
  const std::string whole = lab.description("m01").table.hash;
  EXPECT_THAT(change("m01", "0.001"),
              Ends("refused", "m01: acceleration: with 0.001 of its acceleration"));
  const auto move = lab.send(Ask::kMoveBy, {"m02"}, {1000});
  lab.run_for(0.3);
  EXPECT_THAT(change("m01", "0.5").reason, HasSubstr("a motor of MCU hall:1 moves"));
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(change("m01", "0.5").result, "done");
  const std::string half = lab.description("m01").table.hash;
  EXPECT_NE(half, whole);
  lab.cut_pc_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 20));
  EXPECT_EQ(lab.description("m01").table.hash, half) << "the state store has kept it";
  EXPECT_EQ(lab.wait(lab.use("axes", "bushd2-scurve")).result, "done");
  EXPECT_NE(lab.description("m01").table.hash, lab.description("m02").table.hash);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01", "m02"}, {500, -500}).result, "reached");
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
}

}  // namespace
}  // namespace bushd::test
