// Speeds that are not to be exceeded, from the request to the shaft. Edges are judged by
// trace_test.cpp, which has moves with speeds too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// Two motors on one MCU by a table of 40 us: 100 to 2500 steps/s. `keys` are of m01.
std::string lab_with(const std::string& keys, const char* manner = "fine") {
  return with_keys(hall(1, 2, manner), "m01", keys);
}

api::Move by(std::int64_t steps, double per_s, bool in_steps = true) {
  return api::Move{.motors = {{"m01", steps}},
                   .speed = api::Speed{.per_s = per_s, .in_steps = in_steps}};
}

double seconds(const Lab& lab) {
  return static_cast<double>(lab.now_us()) * 1e-6;
}

// The fastest that the motor is seen while it moves.
double fastest(Lab& lab, std::int64_t request) {
  double most = 0;
  lab.run_for(0.01);  // what was published of the move before is over
  lab.run_until([&] {
    most = std::max(most, std::abs(lab.motor("m01").velocity_steps_per_s));
    return lab.has_result(request);
  });
  return most;
}

TEST(Speeds, AMoveIsNotFasterThanAskedInAnyManner) {
  for (const char* manner :
       {"fine", "coarse", "fine_table", "coarse_table", "fine_ticks", "coarse_ticks"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(lab_with("", manner));
    const auto move = lab.send(by(1500, 700));
    // 35.7 units of 40 us, rounded up to 36.
    EXPECT_DOUBLE_EQ(fastest(lab, move), 1e9 / (36 * 40'000.0));
    EXPECT_EQ(lab.last_reply(move).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), 1500);
    EXPECT_DOUBLE_EQ(fastest(lab, lab.send(by(-1500, 9999))), 2500) << "the table is slower";
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
  }
}

TEST(Speeds, ADryRunTellsThePeakAndTheTimeOfTheMove) {
  ReadyLab lab(lab_with(""));
  api::Move move = by(1500, 500);
  move.dry_run = true;
  const Answer planned = lab.ask(move);
  ASSERT_TRUE(planned.plan);
  EXPECT_DOUBLE_EQ(planned.plan->motors[0].peak_steps_per_s, 500);
  EXPECT_GT(planned.plan->duration_us, 3'000'000);
}

TEST(Speeds, MaxSpeedHoldsForEveryMoveInTheMotorsUnit) {
  ReadyLab lab(lab_with("unit = \"mm\"\nsteps_per_unit = 400\nmax_speed = 1.25\n"));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {800});
  EXPECT_DOUBLE_EQ(fastest(lab, move), 500);
  EXPECT_DOUBLE_EQ(fastest(lab, lab.send(by(800, 2, false))), 500) << "max_speed is slower";
  EXPECT_DOUBLE_EQ(fastest(lab, lab.send(by(800, 0.625, false))), 250);
}

TEST(Speeds, ASpeedThatNoStepCanHaveIsRefusedWithItsFigure) {
  ReadyLab lab(lab_with("unit = \"mm\"\nsteps_per_unit = 400\n"));
  const Answer slow = lab.ask(by(5, 6e-7, false));
  EXPECT_THAT(slow, Ends("refused", "m01: 6e-07 mm/s would take 4166.67 s a step"));
  EXPECT_THAT(slow.reason, HasSubstr("6.94445e-07 mm/s"));
  for (const double speed : {-1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(lab.ask(by(5, speed)).result, "refused") << speed;
  }
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(Speeds, AMotorThatMovesTakesAnotherSpeedWithItsTarget) {
  for (const char* manner : {"fine", "coarse_table"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(lab_with("", manner));
    const auto to = [](std::int64_t position, double speed) {
      return api::Move{.kind = api::Move::Kind::kAbsolute,
                       .motors = {{"m01", position}},
                       .speed = api::Speed{.per_s = speed, .in_steps = true}};
    };
    const auto speed_is = [&lab](double steps_per_s) {
      return lab.run_until([&] { return lab.motor("m01").velocity_steps_per_s == steps_per_s; }, 3);
    };
    lab.send(to(9000, 1000));
    EXPECT_TRUE(speed_is(1000));
    lab.send(to(9000, 250));
    EXPECT_TRUE(speed_is(250)) << "slower, to the same target";
    lab.send(to(9001, 2000));
    EXPECT_TRUE(speed_is(1e9 / (13 * 40'000.0)));
    EXPECT_THAT(lab.ask(to(-100, 500)), Ends("reached"));
    EXPECT_EQ(lab.shaft_steps("m01"), -100);
    EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0);
  }
}

TEST(Speeds, HomingKeepsToThem) {
  Lab lab(
      lab_with("home = { direction = \"negative\", position_steps = 0, most_steps = 6000 }\n"
               "max_speed = 500\n"));
  lab.bus(0).mcu(0).attach_switch(0, {.at_steps = -700, .hysteresis_steps = 4});
  lab.connect();
  const double begin_s = seconds(lab);
  EXPECT_EQ(lab.ask(Ask::kHome, {"m01"}).result, "reached");
  EXPECT_GT(seconds(lab) - begin_s, 1.4) << "700 steps at 500 steps/s";
  const double slow_s = seconds(lab);
  EXPECT_EQ(lab.ask(api::Home{{"m01"}, api::Speed{100, true}}).result, "reached");
  EXPECT_GT(seconds(lab), slow_s);
}

}  // namespace
}  // namespace bushd::test
