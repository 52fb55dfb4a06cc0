// Speeds below the slowest code of a table, whose time units are nanoseconds as 'bushtab new' makes
// them: on every way, judged by tools/check-trace edge by edge.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "daemon/traced.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// 800 to 3000 steps/s. 65535 units are 763 steps/s.
const std::string kNanoseconds =
    "name = \"glacier\"\ntime_unit_ns = 20\naccel = [62500, 40000, 25000, 18000, 16667]\n";

api::Move moved(const std::vector<std::string>& motors, const std::vector<std::int64_t>& steps,
                double per_s, api::Move::Kind kind = api::Move::Kind::kRelative) {
  return {.kind = kind,
          .motors = motor_steps(motors, steps),
          .speed = api::Speed{.per_s = per_s, .in_steps = true}};
}

class SlowSpeeds : public Traced<const char*> {
 protected:
  int judge(Lab& lab, const std::string& options = "") {
    close_trace(lab);
    return Traced::check(lab, options);
  }
  static void expect(Lab& lab, std::int64_t request, const std::string& result = "reached") {
    const Answer answer = lab.wait(request);
    EXPECT_EQ(answer.result, result) << answer.reason;
  }
};
INSTANTIATE_TEST_SUITE_P(Manners, SlowSpeeds,
                         testing::Values("fine", "coarse", "fine_table", "coarse_table",
                                         "fine_ticks"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(SlowSpeeds, MovesAndTheirChangesAreOnTheEdge) {
  ReadyLab lab(hall(2, 2, GetParam(), "glacier"), kNanoseconds, vcd_.get());
  const std::int64_t begin_us = lab.now_us();
  expect(lab, lab.send(moved({"m01", "m03"}, {3, -2}, 2)));
  EXPECT_GT(lab.now_us() - begin_us, 1'500'000);
  EXPECT_LT(lab.now_us() - begin_us, 2'000'000);
  // From full speed down to a slow one, and up again.
  const auto to = [&](double per_s) {
    return lab.send(moved({"m02"}, {2000}, per_s, api::Move::Kind::kAbsolute));
  };
  to(9999);
  lab.run_for(0.4);
  to(20);
  lab.run_for(1);
  EXPECT_DOUBLE_EQ(lab.motor("m02").velocity_steps_per_s, 20);
  expect(lab, to(1500));
  const auto jog = [&](double per_s) {
    return lab.send(
        api::Jog{.motor = "m04", .per_s = per_s, .in_steps = true, .keepalive_ms = 5000});
  };
  const auto jogged = jog(5);
  lab.run_for(0.9);
  jog(400);
  lab.run_for(0.2);
  jog(-2.5);
  lab.run_for(0.9);
  jog(0);
  expect(lab, jogged, "done");
  EXPECT_EQ(judge(lab), 0) << said();
}

TEST_P(SlowSpeeds, LinesAreOnTheEdge) {
  ReadyLab lab(hall(2, 2, GetParam(), "glacier"), kNanoseconds, vcd_.get());
  const std::vector<std::string> motors{"m01", "m02", "m03"};
  api::MoveLine line{.motors = motor_steps(motors, {9, -4, 6})};
  line.speed = api::Speed{.per_s = 5, .in_steps = true};
  const std::int64_t begin_us = lab.now_us();
  expect(lab, lab.send(line));
  EXPECT_GT(lab.now_us() - begin_us, 1'800'000);
  line = {.motors = motor_steps(motors, {4, 2, 0})};
  line.duration_s = 3;
  const std::int64_t again_us = lab.now_us();
  expect(lab, lab.send(line));
  EXPECT_NEAR(static_cast<double>(lab.now_us() - again_us) * 1e-6, 3.25, 0.75)
      << "and up to half a second for its table";
  EXPECT_EQ(judge(lab), 0) << said();
}

TEST_P(SlowSpeeds, PathsAreOnTheEdge) {
  ReadyLab lab(hall(2, 2, GetParam(), "glacier"), kNanoseconds, vcd_.get());
  api::MovePath path{.motors = {"m01", "m03"}, .rows = 3, .positions = {5, 2, 8, 8, 3, 0}};
  path.speed = api::Speed{.per_s = 6, .in_steps = true};
  expect(lab, lab.send(path));
  std::ofstream(this->path("path.csv")) << "m01,m03\n5,2\n8,8\n3,0\n";
  EXPECT_EQ(judge(lab, "--path " + this->path("path.csv")), 0) << said();
}

// A ramp-down makes no step that is more than half a second away.
TEST_P(SlowSpeeds, AStopWaitsForHalfASecondAtMost) {
  ReadyLab lab(hall(2, 2, GetParam(), "glacier"), kNanoseconds, vcd_.get());
  for (const bool waits : {true, false}) {
    const std::int64_t from = lab.shaft_steps("m01");
    const auto move = lab.send(moved({"m01"}, {50}, 0.5));
    EXPECT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") == from + 1; }));
    lab.run_for(waits ? 1.6 : 1.1);
    const std::int64_t stop_us = lab.now_us();
    lab.send(Ask::kStop, {"m01"});
    expect(lab, move, "stopped");
    EXPECT_LT(lab.now_us() - stop_us, 700'000);
    EXPECT_EQ(lab.shaft_steps("m01"), from + (waits ? 2 : 1));
    EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  }
  EXPECT_EQ(judge(lab), 0) << said();
}

// What the MCU does by itself in an emergency, and when nothing more comes.
TEST_P(SlowSpeeds, AnEmergencyAndSilenceMakeNoStepThatIsFarAway) {
  // Bytes of a coarse stream tell no parts of a step: the MCU may make the one that it is in.
  const int unseen = std::string(GetParam()) == "coarse" ? 1 : 0;
  for (const bool silence : {false, true}) {
    ReadyLab lab(hall(1, 1, GetParam(), "glacier"), kNanoseconds);
    lab.send(moved({"m01"}, {50}, 0.1));
    EXPECT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") == 1; }));
    lab.run_for(4);
    if (silence) {
      lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
    } else {
      lab.send(Ask::kEmergencyStop, {});
    }
    lab.run_for(20);
    EXPECT_GE(lab.shaft_steps("m01"), 1) << (silence ? "silence" : "emergency");
    EXPECT_LE(lab.shaft_steps("m01"), 1 + unseen) << (silence ? "silence" : "emergency");
  }
}

TEST(SlowRuns, HomingIsAsSlowAsAsked) {
  const std::string home =
      "home = { direction = \"negative\", position_steps = 0, most_steps = 60 }\n";
  Lab lab(with_keys(hall(1, 1, "fine", "glacier"), "m01", home), kNanoseconds);
  lab.bus(0).mcu(0).attach_switch(0, {.at_steps = -4, .hysteresis_steps = 1});
  lab.connect();
  const std::int64_t begin_us = lab.now_us();
  const auto homed = lab.send(api::Home{{"m01"}, api::Speed{.per_s = 0.8, .in_steps = true}});
  lab.run_for(5.5);
  EXPECT_EQ(lab.shaft_steps("m01"), -4) << "1.25 s a step";
  const Answer result = lab.wait(homed);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_GT(lab.now_us() - begin_us, 8'000'000) << "slow stages are not faster";
}

TEST(SlowRuns, AnEdgeStartsThemExactToASlot) {
  ReadyLab lab(hall(1, 2, "fine_table", "glacier"), kNanoseconds);
  const auto armed = lab.send(api::Arm{.edge = api::Edge::kRising,
                                       .delay_us = 1000,
                                       .motors = motor_steps({"m01", "m02"}, {3, -2}),
                                       .speed = api::Speed{.per_s = 2, .in_steps = true}});
  lab.run_for(0.2);
  lab.bus(0).mcu(0).set_inputs({0, BUSHD_INPUT_TRIGGER});
  const std::int64_t begin_us = lab.now_us();
  EXPECT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") == 1; }));
  // Three ticks, a millisecond and half a second behind the edge.
  EXPECT_NEAR(static_cast<double>(lab.now_us() - begin_us), 3 * 2560 + 1000 + 500'000, 2560);
  const Answer result = lab.wait(armed);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 3);
  EXPECT_EQ(lab.shaft_steps("m02"), -2);
}

// An image whose MCU has no room for them gets streams, and what it makes alone is refused.
TEST(SlowRuns, AnMcuWithoutThemStreams) {
  const std::string home =
      "home = { direction = \"negative\", position_steps = 0, most_steps = 60 }\n";
  ReadyLab lab(with_keys(hall(1, 1, "fine_table", "glacier"), "m01", home), kNanoseconds, nullptr,
               BUSHD_CAN_SLOW_RUNS);
  EXPECT_EQ(lab.ask(moved({"m01"}, {3}, 2)).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 3);
  const api::Speed slow{.per_s = 2, .in_steps = true};
  EXPECT_THAT(lab.ask(api::Home{{"m01"}, slow}).reason,
              HasSubstr("m01: MCU hall:1 cannot home it so slowly; ask for 762.951 "
                        "steps/s or more"));
  const Answer armed = lab.wait(
      lab.send(api::Arm{.delay_us = 1000, .motors = motor_steps({"m01"}, {3}), .speed = slow}));
  EXPECT_THAT(armed.reason, HasSubstr("m01: MCU hall:1 makes no steps that are so slow by itself"));
  EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0);
}

TEST(SlowRuns, AStepAnHourIsMadeWhenTheHourIsOver) {
  for (const char* manner : {"fine", "fine_table"}) {
    Lab lab(hall(1, 1, manner, "glacier"), kNanoseconds);
    lab.read_period_us = 20'000;
    lab.connect();
    const auto move = lab.send(moved({"m01"}, {1}, 1.0 / 3600));
    lab.run_for(3599);
    EXPECT_EQ(lab.shaft_steps("m01"), 0) << manner;
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "reached") << result.reason;
    EXPECT_EQ(lab.shaft_steps("m01"), 1) << manner;
    EXPECT_THAT(lab.ask(moved({"m01"}, {1}, 1.0 / 3601)).reason,
                HasSubstr("allowed: up to an hour a step"));
  }
}

}  // namespace
}  // namespace bushd::test
