// Lines that wait for a trigger, from the request to the pins of two MCUs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/on_line.h"
#include "daemon/traced.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

const std::vector<std::int64_t> kShort{600, -600, 34, 600};

class TriggeredLine : public Traced<const char*> {
 protected:
  static api::ArmLine armed_to(const std::vector<std::int64_t>& steps,
                               std::int64_t delay_us = 1000) {
    return {.edge = api::Edge::kRising,
            .delay_us = delay_us,
            .kind = api::Move::Kind::kAbsolute,
            .motors = motor_steps(kMotors, steps)};
  }
  static bool all_wait(Lab& lab) {
    return std::ranges::all_of(kMotors, [&](const std::string& motor) {
      return lab.motor(motor).activity == api::Activity::kArmed;
    });
  }
  // Returns the number of the request, when all wait.
  static std::int64_t arm(Lab& lab, const api::ArmLine& request) {
    const auto number = lab.send(request);
    EXPECT_TRUE(lab.run_until([&] { return all_wait(lab); }, 2));
    lab.run_for(0.1);
    return number;
  }
  static void fire(Lab& lab, std::size_t mcu) {
    lab.bus(0).mcu(mcu).set_inputs({});
    lab.bus(0).mcu(mcu).set_inputs({0, BUSHD_INPUT_TRIGGER});
  }
  // Edges at both MCUs, so long after each other.
  static void fire_both(Lab& lab, double apart_s = 0) {
    fire(lab, 0);
    if (apart_s > 0) lab.run_for(apart_s);
    fire(lab, 1);
  }
  void expect_explained(Lab& lab) {
    close_trace(lab);
    EXPECT_EQ(check(lab, ""), 0) << said();
  }
  // Also: each run begins where it says. Some of them, since the clocks of trace and log are not
  // the same, and what all have in common is not seen.
  void expect_explained_exactly(Lab& lab) {
    expect_explained(lab);
    EXPECT_EQ(check(lab, "",
                    [](auto& event) {
                      if (event["event"] == "move" && event["steps"] > 0) {
                        event["late_ns"] = (event.value("late_ns", 0) + 300'000) % 2'560'000;
                      }
                      return true;
                    }),
              1);
  }
};
INSTANTIATE_TEST_SUITE_P(Manners, TriggeredLine,
                         testing::Values("fine", "coarse", "fine_table", "coarse_ticks"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(TriggeredLine, IsMadeByBothMcusFromTheEdgeOn) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const auto move = arm(lab, armed_to(kShort, 12'345));
  for (const std::string& motor : kMotors) EXPECT_FALSE(lab.motor(motor).moving);
  EXPECT_EQ(lab.motor("m03").target_steps, 34);
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_FALSE(lab.has_result(move));
  fire_both(lab);
  double most = 0;
  while (!lab.has_result(move)) {
    lab.run_for(0.0007);
    most = std::max(most, off_line(lab, kMotors, kShort));
  }
  EXPECT_LE(most, kOffByMcus) << "the edges are at the same time";
  const Answer result = lab.last_reply(move);
  EXPECT_EQ(result.result, "reached");
  EXPECT_EQ(result.reason, "m01: stands at its target; the line was limited by m01");
  EXPECT_EQ(result.position_steps, kShort);
  for (std::size_t i = 0; i < kMotors.size(); ++i) {
    EXPECT_EQ(lab.shaft_steps(kMotors[i]), kShort[i]);
    EXPECT_EQ(lab.motor(kMotors[i]).trust, api::Trust::kKnown);
  }
  // A speed, and the way back.
  api::ArmLine back = armed_to({0, 0, 0, 0});
  back.speed = api::Speed{.per_s = 900, .in_steps = true};
  const auto second = arm(lab, back);
  fire_both(lab, 20e-6);
  EXPECT_EQ(lab.wait(second).result, "reached");
  expect_clean(lab);
  expect_explained_exactly(lab);
}

// Edges that are apart, so that the runs are in other steps: all stop on one point of the line.
TEST_P(TriggeredLine, StopsOnOnePointHoweverFarTheEdgesWereApart) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  std::vector<std::int64_t> at{0, 0, 0, 0};
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(i);
    std::vector<std::int64_t> to;
    for (std::size_t m = 0; m < at.size(); ++m) to.push_back(at[m] + kInMcus[m]);
    const auto move = arm(lab, armed_to(to));
    fire_both(lab, 350e-6 * i);
    lab.run_for(0.31 + 0.12 * i);
    lab.send(Ask::kStop, {kMotors[static_cast<std::size_t>(i) % 4]});
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "stopped");
    const std::int64_t made = lab.shaft_steps("m01") - at[0];
    EXPECT_GT(made, 10);
    EXPECT_LT(made, 2900);
    // The law of a line: floor( N (s - 1/2) / L + 1/2 ).
    const std::vector<std::int64_t> way{made, -made, (171 * (2 * made - 1) + 3000) / 6000, made};
    for (std::size_t m = 0; m < at.size(); ++m) {
      EXPECT_EQ(lab.shaft_steps(kMotors[m]) - at[m], way[m]) << kMotors[m];
      at[m] = lab.shaft_steps(kMotors[m]);
    }
    EXPECT_THAT(result.reason, testing::Not(HasSubstr("off it"))) << result.reason;
  }
  expect_clean(lab);
  expect_explained(lab);
}

TEST_P(TriggeredLine, IsPausedAndResumedAndGivenANearerEnd) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const auto move = arm(lab, armed_to(kInMcus));
  fire_both(lab, 200e-6);
  lab.run_for(0.5);
  EXPECT_EQ(lab.ask(api::Pause{{"m03"}}).reason, "paused: 4 motors");
  lab.run_for(0.3);
  lab.send(api::Resume{});
  lab.run_for(0.4);
  const auto nearer = lab.send(line_to(kMotors, {2500, -2500, 142, 2500}));
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_EQ(lab.wait(nearer).result, "reached") << lab.last_reply(nearer).reason;
  EXPECT_EQ(lab.shaft_steps("m03"), 142);
  expect_clean(lab);
  expect_explained(lab);
}

TEST_P(TriggeredLine, WaitsUntilItIsDisarmed) {
  ReadyLab lab(hall(2, 2, GetParam()));
  auto move = arm(lab, armed_to(kInMcus));
  EXPECT_EQ(lab.ask(api::Disarm{{"m03"}}).result, "done");
  Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("stopped", "disarmed, because m03, armed with it"));
  fire_both(lab);
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.ask(line_to(kMotors, kInMcus)).result, "reached");
  move = arm(lab, armed_to({0, 0, 0, 0}));
  lab.send(Ask::kStop, {"m01"});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  move = arm(lab, armed_to({0, 0, 0, 0}));
  EXPECT_EQ(lab.ask(api::EmergencyStop{}).result, "done");
  EXPECT_NE(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m04"), 3000);
}

// One of them has not had it: the others do not go on alone.
TEST_P(TriggeredLine, EndsIfTheTriggerComesToOneMcuOnly) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const auto move = arm(lab, armed_to(kInMcus));
  fire(lab, 0);
  const Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("stopped", "the trigger has come to MCU hall:1, and not to MCU hall:2"));
  EXPECT_LT(lab.shaft_steps("m01"), 1000);
  EXPECT_EQ(lab.shaft_steps("m02"), -lab.shaft_steps("m01"));
  EXPECT_EQ(lab.shaft_steps("m04"), 0);
  EXPECT_EQ(lab.motor("m04").activity, api::Activity::kResting);
  fire(lab, 1);
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m04"), 0);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, kMotors, {0, 0, 0, 0}).result, "reached");
  expect_explained(lab);
}

TEST_P(TriggeredLine, EndsIfTheTriggersAreTooFarApart) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const auto move = arm(lab, armed_to(kInMcus, 50'000));
  fire_both(lab, 0.004);
  const Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("stopped", "the trigger came to MCU hall:2 "));
  EXPECT_THAT(result.reason, HasSubstr(" us later than to MCU hall:1"));
  EXPECT_LT(lab.shaft_steps("m01"), 1000);
  expect_explained(lab);
}

TEST_P(TriggeredLine, EndsForAllIfAnMcuGivesUp) {
  ReadyLab lab(hall(2, 2, GetParam()));
  auto move = arm(lab, armed_to(kInMcus));
  lab.bus(0).reboot(1, 50'000'000);
  EXPECT_NE(lab.wait(move).result, "reached");
  lab.mcu_comes_to("hall:2", api::McuState::kReady, 20);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
  fire_both(lab);
  lab.run_for(0.3);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

// The report that tells of its beginning tells of its end, too: of all MCUs, or of one while
// another one waits on.
TEST_P(TriggeredLine, MayBeOverWhenItsBeginningIsTold) {
  for (const std::size_t deaf : {std::size_t{2}, std::size_t{1}, std::size_t{0}}) {
    SCOPED_TRACE(deaf);
    ReadyLab lab(hall(2, 2, GetParam()));
    const auto move = arm(lab, armed_to({3, -3, 3, 3}));
    lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
    if (deaf == 2) {
      fire_both(lab);
    } else {
      fire(lab, 1 - deaf);
    }
    lab.run_for(0.2);
    lab.on_send = nullptr;
    const Answer result = lab.wait(move, 5);
    if (deaf == 2) {
      EXPECT_EQ(result.result, "reached") << result.reason;
      EXPECT_EQ(lab.shaft_steps("m04"), 3);
    } else {
      EXPECT_THAT(result, Ends("stopped", "the trigger has come to MCU"));
      EXPECT_EQ(lab.motor(deaf == 1 ? "m04" : "m01").activity, api::Activity::kResting);
    }
  }
}

TEST_P(TriggeredLine, IsMadeOfLegsWithBacklash) {
  ReadyLab lab(with_keys(hall(2, 2, GetParam()), "m02", "backlash = 20\n"));
  const auto move = arm(lab, armed_to(kInMcus));
  fire_both(lab);
  EXPECT_EQ(lab.wait(move).result, "reached");
  for (std::size_t i = 0; i < kMotors.size(); ++i) {
    EXPECT_EQ(lab.shaft_steps(kMotors[i]), kInMcus[i]);
  }
  expect_clean(lab);
}

class ArmedLine : public testing::Test {
 protected:
  static std::string refusal(Lab& lab, const std::vector<std::string>& motors,
                             const std::vector<std::int64_t>& steps, std::int64_t delay_us = 100) {
    const auto number =
        lab.send(api::ArmLine{.delay_us = delay_us, .motors = motor_steps(motors, steps)});
    lab.run_for(0.05);
    EXPECT_TRUE(lab.has_result(number));
    const Answer answer = lab.last_reply(number);
    EXPECT_EQ(answer.result, "refused");
    return answer.reason;
  }
};

TEST_F(ArmedLine, IsRefusedWhereItCannotWait) {
  ReadyLab lab(hall(2, 2, "fine"), {}, nullptr, BUSHD_CAN_SCRATCH);
  EXPECT_THAT(refusal(lab, kMotors, kInMcus, 49), HasSubstr("allowed: 50 to 1650000"));
  EXPECT_THAT(refusal(lab, kMotors, kSteps), HasSubstr("m04: a move of no steps"));
  EXPECT_THAT(refusal(lab, kMotors, {3000, -1201, 17, 3}),
              HasSubstr("a table of its own, which MCU hall:1 does not have, and has no room for"));
  EXPECT_THAT(refusal(lab, {"m09"}, {1}), HasSubstr("no motor \"m09\""));
  const auto waits =
      lab.send(api::ArmLine{.delay_us = 100, .motors = motor_steps({"m01", "m03"}, {500, 500})});
  lab.run_for(0.2);
  EXPECT_THAT(refusal(lab, {"m01", "m02"}, {5, 5}), HasSubstr("m01 waits for the trigger"));
  EXPECT_THAT(refusal(lab, {"m02"}, {5}),
              HasSubstr("m01 waits for the trigger of MCU hall:1 already"));
  EXPECT_THAT(lab.ask(line_to({"m01", "m03"}, {5, 5})).reason,
              HasSubstr("m01 waits for the trigger; run 'bushctl disarm m01' first"));
  EXPECT_FALSE(lab.has_result(waits));
  lab.send(Ask::kMoveTo, {"m04"}, {900});
  lab.run_for(0.2);
  EXPECT_THAT(refusal(lab, {"m04"}, {5}), HasSubstr("m04 moves; run 'bushctl stop m04' first"));
}

TEST_F(ArmedLine, EndsWithItsClientIfThatIsAskedFor) {
  ReadyLab lab(hall(2, 2, "fine"), {}, nullptr, BUSHD_CAN_SCRATCH);
  const auto waits =
      lab.send_as("panel", api::ArmLine{.delay_us = 100,
                                        .motors = motor_steps({"m01", "m03"}, {9, 9}),
                                        .while_connected = true});
  lab.run_for(0.2);
  EXPECT_THAT(lab.motor("m03").armed_by, HasSubstr("of panel"));
  lab.leave("panel");
  EXPECT_THAT(lab.wait(waits), Ends("stopped", "because its client has gone"));
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST_F(ArmedLine, IsRefusedForAnMcuWithoutLines) {
  ReadyLab lab(hall(2, 2, "fine"), {}, nullptr, BUSHD_CAN_LINE_RUN);
  EXPECT_THAT(refusal(lab, kMotors, kInMcus),
              HasSubstr("MCU hall:1 makes no lines that a trigger begins"));
}

}  // namespace
}  // namespace bushd::test
