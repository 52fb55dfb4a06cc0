// Lines whose run the MCUs make themselves: what goes over the bus, where the motors are, and where
// a lost link leaves them.
#include "daemon/motion_frames.h"
#include "daemon/on_line.h"

namespace bushd::test {
namespace {

TEST(LinesByMcus, AllMotorsAreOnThemToAStep) {
  for (const char* manner : {"fine", "coarse", "coarse_table"}) {
    expect_on_line_all_the_way(manner, kInMcus, kOffByMcus);
  }
}

// The table of a line of motors with one table is that one, unless their ways are nearly as long.
// Then they get it first, if they take any.
TEST(LinesByMcus, OneFrameTellsAnMcuAllOfIt) {
  struct Case {
    const char* manner;
    std::int64_t steps;
    std::uint32_t disabled_capabilities;
    int most;
  };
  for (const auto& [manner, steps, disabled_capabilities, most] :
       std::vector<Case>{{"fine", 2000, 0, 2},
                         {"coarse", -1, 0, 2},
                         {"fine", 1999, 0, 2},
                         {"fine", 1999, BUSHD_CAN_SCRATCH, 1000},
                         {"fine_ticks", 2000, 0, 1000}}) {
    SCOPED_TRACE(std::string(manner) + " " + std::to_string(steps));
    ReadyLab lab(hall(2, 2, manner), {}, nullptr, disabled_capabilities);
    auto line = line_to({"m01", "m02", "m03"}, {2000, -2000, steps});
    line.dry_run = true;
    const auto plan = lab.ask(line).plan;
    line.dry_run = false;
    MotionFrames sent;
    lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
      sent.add(bytes);
      return true;
    };
    EXPECT_EQ(lab.ask(line).result, "reached");
    lab.run_for(0.3);
    if (most == 2) {
      EXPECT_EQ(sent.frames, 2);
    } else {
      EXPECT_GT(sent.frames, 8);
    }
    ASSERT_TRUE(plan && plan->traffic);
    EXPECT_EQ(plan->traffic->frames, sent.frames);
    EXPECT_EQ(lab.shaft_steps("m03"), steps);
  }
}

// All MCUs go by the time that the last SYNC has told, so they ramp down from the same tick.
TEST(LinesByMcus, ALostLinkLeavesAllOnTheLine) {
  const std::vector<std::int64_t> steps{20000, -20000, 3, 1201};
  for (const char* manner : {"fine", "coarse"}) {
    for (const double after_s : {0.3, 1.0, 1.61}) {
      SCOPED_TRACE(std::string(manner) + " " + std::to_string(after_s));
      ReadyLab lab(hall(2, 2, manner));
      const auto move = lab.send(line_to(kMotors, steps));
      lab.run_for(after_s);
      const std::int64_t before = lab.shaft_steps("m01");
      lab.unplug(0);
      double most = 0;
      for (int i = 0; i < 300; ++i) {
        lab.run_for(0.01);
        most = std::max(most, off_line(lab, kMotors, steps));
      }
      EXPECT_LE(most, kOffByMcus);
      EXPECT_LE(off_line(lab, kMotors, steps), kOffAtRest);
      const std::int64_t stands = lab.shaft_steps("m01");
      EXPECT_GT(stands, before + 500) << "for a second they go on";
      EXPECT_LT(stands, 20000);
      lab.run_for(1);
      EXPECT_EQ(lab.shaft_steps("m01"), stands);
      EXPECT_EQ(lab.last_reply(move).result, "link");
      lab.plug(0);
      lab.run_for(3);
      for (const std::string& motor : kMotors) {
        EXPECT_EQ(lab.motor(motor).position_steps, lab.shaft_steps(motor));
      }
      lab.ask(Ask::kClearFaults, {});
      EXPECT_EQ(lab.ask(line_to(kMotors, {0, 0, 0, 0})).result, "reached");
    }
  }
}

TEST(LinesByMcus, TakeANearerEndAndAnotherSpeed) {
  for (const char* manner : {"fine", "coarse"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(hall(2, 2, manner));
    const std::vector<std::int64_t> steps{6000, -6000, 401, 6000};
    const auto move = lab.send(line_to(kMotors, steps));
    lab.run_until([&] { return lab.shaft_steps("m01") >= 1000; });
    auto slower = line_to(kMotors, steps);
    slower.speed = api::Speed{.per_s = 300, .in_steps = true};
    const auto second = lab.send(slower);
    lab.run_for(0.4);
    EXPECT_LE(off_line(lab, kMotors, steps), kOffByMcus);
    const auto third = lab.send(line_to(kMotors, {3000, -3000, 200, 3000}));
    EXPECT_EQ(lab.wait(third).result, "reached") << lab.last_reply(third).reason;
    EXPECT_EQ(lab.last_reply(move).result, "stopped");
    EXPECT_EQ(lab.last_reply(second).result, "stopped");
    EXPECT_EQ(lab.shaft_steps("m01"), 3000);
    EXPECT_EQ(lab.shaft_steps("m02"), -3000);
    EXPECT_EQ(lab.shaft_steps("m03"), 200);
    EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0u);
  }
}

// An MCU that is too slow for TABLE_TICKS makes a run of 270 us a step itself, or of 400 us where
// it has other motors; a faster one is streamed to it.
TEST(LinesByMcus, AreStreamedIfTooFastForThem) {
  const std::string table =
      "name = \"glacier\"\ntime_unit_ns = 1000\naccel = [2000, 1000, 700, 500, 400, 300, 250]\n";
  struct Case {
    std::uint32_t disabled_capabilities;
    double speed;
    std::size_t motors;  // of four, on two MCUs
    bool streamed;
  };
  for (const auto& [disabled_capabilities, speed, motors, streamed] :
       std::vector<Case>{{0, 3750, 4, false},
                         {BUSHD_CAN_TABLE_TICKS, 3700, 4, false},
                         {BUSHD_CAN_TABLE_TICKS, 3750, 4, true},
                         {BUSHD_CAN_TABLE_TICKS, 2500, 3, false},
                         {BUSHD_CAN_TABLE_TICKS, 2520, 3, true}}) {
    SCOPED_TRACE(std::to_string(disabled_capabilities) + " " + std::to_string(speed));
    ReadyLab lab(hall(2, 2, "fine", "glacier"), table, nullptr, disabled_capabilities);
    const std::vector<std::int64_t> steps{3000, -3000, 3000, 3000};
    auto line = line_to({kMotors.begin(), kMotors.begin() + static_cast<std::ptrdiff_t>(motors)},
                        {steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(motors)});
    line.speed = api::Speed{.per_s = speed, .in_steps = true};
    MotionFrames sent;
    lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
      sent.add(bytes);
      return true;
    };
    EXPECT_EQ(lab.ask(line).result, "reached");
    lab.run_for(0.3);
    if (streamed) {
      EXPECT_GT(sent.frames, 8);
    } else {
      EXPECT_EQ(sent.frames, 2);
    }
    EXPECT_EQ(lab.shaft_steps("m02"), -3000);
    EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0u);
  }
}

}  // namespace
}  // namespace bushd::test
