// Moves that wait for the trigger, and the position compare output, from the command to the pins.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "daemon/lab.h"
#include "daemon/step_times.h"
#include "sim/shipped_motors.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kBusTickNs = 2'560'000;

class Triggered : public testing::TestWithParam<const char*> {
 protected:
  StepTimes pins;
  ReadyLab lab{hall(2, 3, GetParam()), {}, &pins};

  static api::Request armed(const std::vector<std::string>& motors,
                            const std::vector<std::int64_t>& steps, std::int32_t delay_us = 1000) {
    return api::Arm{
        .edge = api::Edge::kRising, .delay_us = delay_us, .motors = motor_steps(motors, steps)};
  }
  std::int64_t arm(const std::vector<std::string>& motors, const std::vector<std::int64_t>& steps,
                   std::int32_t delay_us = 1000) {
    const auto number = lab.send(armed(motors, steps, delay_us));
    EXPECT_TRUE(lab.run_until([&] { return lab.bus(0).mcu(0).core().trigger.armed != 0; }, 1));
    lab.run_for(0.1);
    return number;
  }
  // An edge now; returns when.
  std::int64_t fire(std::size_t mcu = 0) {
    const std::int64_t now_ns = lab.bus(0).now_ns();
    lab.bus(0).mcu(mcu).set_inputs({});
    lab.bus(0).mcu(mcu).set_inputs({0, BUSHD_INPUT_TRIGGER});
    return now_ns;
  }
  // Does the n-th step lie in the slot where the table puts it?
  void expect_table(const std::vector<sim::TimeNs>& steps, std::size_t count,
                    std::int64_t begin_ns) {
    ASSERT_EQ(steps.size(), count);
    const bushd_table& table = lab_table().view();
    std::int64_t at_ns = begin_ns;
    for (std::uint32_t j = 0; j < count; ++j) {
      const std::int64_t delay = std::max(
          {bushd_table_accel(&table, j),
           bushd_table_decel(&table, static_cast<std::uint32_t>(count) - 1 - j), table.cruise});
      at_ns += delay * table.time_unit_ns;
      // Its MCU keeps in step with the bus by a few us.
      ASSERT_LE(steps[j], at_ns + 5'000) << j;
      ASSERT_GE(steps[j], at_ns - kBusTickNs / 256 - 5'000) << j;
    }
  }
  static const tables::Table& lab_table() {
    static const auto table = tables::load(kShippedTables / "bushd2-constant.toml").value();
    return *table;
  }
};
INSTANTIATE_TEST_SUITE_P(Manners, Triggered,
                         testing::Values("fine", "coarse", "fine_table", "coarse_ticks"));

TEST_P(Triggered, MovesBeginThreeTicksAndTheirDelayAfterTheEdge) {
  for (const std::int64_t steps : {1, 40, -700}) {
    const auto before = pins.of(0, 0).size();
    const auto from = lab.motor("m01").position_steps;
    const auto move = arm({"m01", "m03"}, {steps, steps}, 12'345);
    EXPECT_EQ(lab.motor("m01").activity, api::Activity::kArmed);
    EXPECT_FALSE(lab.motor("m01").moving);
    EXPECT_NE(lab.motor("m02").activity, api::Activity::kArmed);
    EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kReady);
    EXPECT_EQ(lab.motor("m01").position_steps, from);
    EXPECT_FALSE(lab.has_result(move));
    const std::int64_t edge_ns = fire();
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "reached") << result.reason;
    EXPECT_EQ(lab.replies(move).size(), 2u);
    EXPECT_EQ(lab.shaft_steps("m01"), from + steps);
    EXPECT_EQ(lab.shaft_steps("m03"), from + steps);
    EXPECT_NE(lab.motor("m01").activity, api::Activity::kArmed);
    const auto& all = pins.of(0, 0);
    expect_table({all.begin() + static_cast<std::ptrdiff_t>(before), all.end()},
                 static_cast<std::size_t>(std::abs(steps)), edge_ns + 3 * kBusTickNs + 12'345'000);
    EXPECT_EQ(pins.of(0, 0), pins.of(0, 2)) << "in the same slots";
    const auto line = nlohmann::json::parse(*std::find_if(
        lab.move_lines().rbegin(), lab.move_lines().rend(),
        [](const std::string& text) { return text.find("\"event\":\"move\"") != text.npos; }));
    EXPECT_EQ(line["moves"], "table");
    EXPECT_EQ(line["from_steps"], from);
    EXPECT_EQ((line["start_tick"].get<std::int64_t>() * kBusTickNs + line.value("late_ns", 0)) %
                  kBusTickNs,
              line.value("late_ns", 0));
  }
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_TRUE(lab.errors().empty());
}

TEST_P(Triggered, EachMcuHasItsOwnTriggerAndTheMoveEndsWithTheLast) {
  const auto move = arm({"m01", "m04"}, {50, -60});
  fire(0);
  lab.run_for(2);
  EXPECT_EQ(lab.shaft_steps("m01"), 50);
  EXPECT_EQ(lab.shaft_steps("m04"), 0);
  EXPECT_FALSE(lab.has_result(move));
  EXPECT_EQ(lab.motor("m04").activity, api::Activity::kArmed);
  fire(1);
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m04"), -60);
}

TEST_P(Triggered, AreSaidToBeArmedWhenAnEdgeStartsThem) {
  const auto move = lab.send(armed({"m01", "m04"}, {50, 60}));
  EXPECT_TRUE(
      lab.run_until([&] { return lab.motor("m01").activity == api::Activity::kArming; }, 1));
  EXPECT_FALSE(lab.motor("m01").moving);
  const auto both_armed = [&] {
    return lab.motor("m01").activity == api::Activity::kArmed &&
           lab.motor("m04").activity == api::Activity::kArmed;
  };
  ASSERT_TRUE(lab.run_until(both_armed, 0.2)) << "told at once";
  for (const std::size_t mcu : {0u, 1u}) EXPECT_NE(lab.bus(0).mcu(mcu).core().trigger.armed, 0);
  fire(0);
  fire(1);
  EXPECT_EQ(lab.wait(move).result, "reached");
}

TEST_P(Triggered, DisarmedTheyEndAsStopped) {
  for (const Ask kind : {Ask::kDisarm, Ask::kStop}) {
    const auto move = arm({"m01", "m02"}, {50, 60});
    const auto disarm = lab.send(kind, {"m02"});
    EXPECT_EQ(lab.wait(disarm).result, "done");
    EXPECT_EQ(lab.last_reply(disarm).reason, "done");
    EXPECT_THAT(lab.last_reply(move), Ends("stopped", "disarmed before the trigger came"));
    fire();
    lab.run_for(1);
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
    EXPECT_NE(lab.motor("m01").activity, api::Activity::kArmed);
  }
  EXPECT_EQ(lab.ask(Ask::kDisarm, {}).result, "done") << "nothing is armed";
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {30}).result, "reached");
}

// All of them wait, or none.
TEST_P(Triggered, WhereOneMcuCannotBeArmedTheOthersDoNotWait) {
  ReadyLab limited(with_keys(hall(2, 3, GetParam()), "m05", "limit = \"positive\"\n"), {}, &pins);
  limited.bus(0).mcu(1).set_inputs({0b010, 0});
  limited.run_for(0.003);  // a tick later the MCU knows, and the daemon does not
  const auto move = limited.send(armed({"m01", "m04", "m05"}, {50, 60, 70}));
  const Answer result = limited.wait(move, 2);
  EXPECT_EQ(result.result, "limit") << result.reason;
  EXPECT_EQ(result.motor_results, (std::vector<std::string>{"stopped", "limit", "limit"}));
  EXPECT_EQ(limited.bus(0).mcu(0).core().trigger.armed, 0);
  for (const std::size_t mcu : {0u, 1u}) {
    limited.bus(0).mcu(mcu).set_inputs({0, BUSHD_INPUT_TRIGGER});
  }
  limited.run_for(1);
  for (const char* motor : {"m01", "m04", "m05"}) EXPECT_EQ(limited.shaft_steps(motor), 0);
}

TEST_P(Triggered, WhereOneMcuIsDisarmedOrLostTheOthersAreToo) {
  auto move = arm({"m01", "m04"}, {50, 60});
  EXPECT_EQ(lab.ask(Ask::kDisarm, {"m04"}).result, "done");
  EXPECT_EQ(lab.wait(move, 2).result, "stopped");
  move = arm({"m01", "m04"}, {50, 60});
  lab.bus(0).reboot(1, 100'000'000);
  const Answer result = lab.wait(move, 5);
  EXPECT_EQ(result.result, "link");
  EXPECT_EQ(result.motor_results, (std::vector<std::string>{"stopped", "link"}));
  fire(0);
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST_P(Triggered, TooLateToDisarmStopRampsThemDown) {
  auto move = arm({"m01"}, {3000});
  fire();
  EXPECT_THAT(lab.ask(Ask::kDisarm, {"m01"}), Ends("done", "the trigger came before"));
  EXPECT_TRUE(lab.motor("m01").moving);
  EXPECT_EQ(lab.wait(move).result, "reached");
  // A long delay: stopped before it has begun.
  move = arm({"m01"}, {-3000}, 1'400'000);
  fire();
  EXPECT_EQ(lab.ask(Ask::kStop, {}).result, "done");
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), 3000);
  lab.run_for(1.6);
  EXPECT_EQ(lab.shaft_steps("m01"), 3000);
  // In flight.
  move = arm({"m01"}, {-3000});
  fire();
  lab.run_for(0.8);
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
  const Answer result = lab.last_reply(move);
  EXPECT_EQ(result.result, "stopped");
  EXPECT_LT(result.position_steps.at(0), 3000);
  EXPECT_GT(result.position_steps.at(0), 0);
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
}

TEST_P(Triggered, AfterTheStartTheyTakeNewTargets) {
  for (const double later_s : {0.05, 0.3, 0.6}) {
    const auto from = lab.shaft_steps("m01");
    const auto move = arm({"m01"}, {2000}, 100'000);
    fire();
    lab.run_for(later_s);
    const auto next = lab.send(Ask::kMoveTo, {"m01"}, {from + 3333});
    EXPECT_EQ(lab.wait(next).result, "reached") << lab.last_reply(next).reason;
    EXPECT_EQ(lab.last_reply(move).result, "stopped");
    EXPECT_EQ(lab.shaft_steps("m01"), from + 3333);
  }
  EXPECT_TRUE(lab.errors().empty());
}

TEST_P(Triggered, WhatWaitsIsRefusedOtherCommands) {
  const auto move = arm({"m01"}, {50});
  std::vector<api::Request> requests = {armed({"m01"}, {10})};
  for (const Ask ask :
       {Ask::kMoveBy, Ask::kMoveTo, Ask::kSetPosition, Ask::kDisable, Ask::kClearFaults}) {
    requests.push_back(request_of(ask, {"m01"}, {10}));
  }
  for (const api::Request& request : requests) {
    const Answer reply = lab.last_reply(lab.send(request));
    EXPECT_EQ(reply.result, "refused") << name_of(request);
    EXPECT_THAT(reply.reason, HasSubstr("waits for the trigger")) << name_of(request);
  }
  EXPECT_THAT(lab.last_reply(lab.send(armed({"m02"}, {10}))).reason,
              HasSubstr("m01 waits for the trigger of MCU hall:1 already"));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {30}).result, "reached") << "others move";
  fire();
  EXPECT_EQ(lab.wait(move).result, "reached");
}

// By default they wait though nobody is there any more: a script arms them and ends.
TEST_P(Triggered, OutliveWhoHasArmedThemUnlessThatIsAskedFor) {
  const auto ask = [](const char* motor, bool while_connected) {
    api::Arm arm = std::get<api::Arm>(armed({motor}, {40}));
    arm.while_connected = while_connected;
    return api::Request(arm);
  };
  EXPECT_THAT(lab.last_reply(lab.send(ask("m01", true))).reason,
              HasSubstr("LCM does not tell when it has gone"));
  const auto stays = lab.send_as("script", ask("m01", false));
  const auto ends = lab.send_as("panel", ask("m04", true));
  ASSERT_TRUE(lab.run_until([&] { return lab.bus(0).mcu(1).core().trigger.armed != 0; }, 1));
  lab.run_for(0.2);
  EXPECT_THAT(lab.motor("m01").armed_by, HasSubstr("of script"));
  EXPECT_THAT(lab.motor("m04").armed_by, HasSubstr("of panel"));
  EXPECT_EQ(lab.motor("m02").armed_by, "");
  EXPECT_THAT(lab.last_reply(lab.send(armed({"m05"}, {10}))).reason,
              HasSubstr("m04 waits for the trigger of MCU hall:2 already, asked for by command " +
                        std::to_string(ends) + " of panel"));
  lab.leave("script");
  lab.leave("panel");
  lab.run_for(0.5);
  EXPECT_THAT(lab.last_reply(ends), Ends("stopped", "disarmed, because its client has gone"));
  EXPECT_EQ(lab.motor("m04").armed_by, "");
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kArmed);
  EXPECT_THAT(lab.motor("m01").armed_by, HasSubstr("of script"));
  fire(0);
  fire(1);
  EXPECT_EQ(lab.wait(stays).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m04"), 0);
  EXPECT_EQ(lab.motor("m01").armed_by, "");
}

// The edge is faster than the daemon: they ramp down.
TEST_P(Triggered, AnEdgeBeforeTheyAreDisarmedForAClientThatHasGoneIsFollowedByARampDown) {
  api::Arm arm = std::get<api::Arm>(armed({"m01"}, {3000}));
  arm.while_connected = true;
  const auto number = lab.send_as("panel", arm);
  ASSERT_TRUE(lab.run_until([&] { return lab.bus(0).mcu(0).core().trigger.armed != 0; }, 1));
  lab.run_for(0.2);
  fire();
  lab.leave("panel");
  EXPECT_THAT(lab.wait(number), Ends("stopped", "because its client has gone"));
  EXPECT_LT(lab.shaft_steps("m01"), 3000);
}

TEST_P(Triggered, ArmingIsRefusedWithAReason) {
  const auto refusal = [this](const api::Request& request) {
    const Answer reply = lab.last_reply(lab.send(request));
    EXPECT_EQ(reply.phase, Answer::kRefused);
    return reply.reason;
  };
  EXPECT_THAT(refusal(armed({}, {})), HasSubstr("no motor"));
  EXPECT_THAT(refusal(armed({"m01"}, {0})), HasSubstr("no steps"));
  EXPECT_THAT(refusal(armed({"m01"}, {5}, 49)), HasSubstr("50 to 1650000"));
  EXPECT_THAT(refusal(armed({"m01"}, {5}, 1'650'001)), HasSubstr("50 to 1650000"));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {500});
  lab.run_for(0.3);
  EXPECT_THAT(refusal(armed({"m01"}, {5})), HasSubstr("m01 moves"));
  EXPECT_EQ(lab.wait(move).result, "reached");
}

// Whenever the stop comes, also when the MCU has ticks of before.
TEST_P(Triggered, MayBeArmedAsSoonAsAStopIsDone) {
  for (int wait_ms = 0; wait_ms <= 120; wait_ms += 4) {
    lab.send(Ask::kMoveBy, {"m01"}, {4000});
    lab.run_for(0.5);
    ASSERT_EQ(lab.ask(api::Pause{{"m01"}}).result, "done");
    ASSERT_EQ(lab.ask(api::Resume{{"m01"}}).result, "done");
    lab.run_for(wait_ms * 1e-3);
    ASSERT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
    const auto move = lab.send(armed({"m01", "m02"}, {4, 4}));
    lab.run_for(0.5);
    EXPECT_FALSE(lab.has_result(move))
        << wait_ms << " ms after resume: " << lab.last_reply(move).reason;
    lab.ask(Ask::kStop, {});
  }
}

TEST_P(Triggered, AnEmergencyStopEndsThem) {
  const auto move = arm({"m01"}, {50});
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  fire();
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  const auto again = arm({"m01"}, {50});
  fire();
  EXPECT_EQ(lab.wait(again).result, "reached");
}

TEST_P(Triggered, LostFramesLeaveOneMoveAndOneResult) {
  int frames = 0;
  for (int drop = 0; drop < 6; ++drop) {
    const auto from = lab.shaft_steps("m01");
    frames = 0;
    lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) { return frames++ != drop; };
    const auto move = arm({"m01"}, {50});
    fire();
    EXPECT_EQ(lab.wait(move).result, "reached") << "frame " << drop;
    EXPECT_EQ(lab.shaft_steps("m01"), from + 50) << "frame " << drop;
    lab.on_send = nullptr;
  }
}

// It may be hours until it comes; what was armed before is nobody's any more.
TEST_P(Triggered, ANewDaemonDisarms) {
  arm({"m01"}, {50});
  lab.restart_daemon();
  lab.connect();
  fire();
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  const auto move = arm({"m01"}, {50});
  fire();
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 50);
}

TEST_P(Triggered, WithoutADaemonNothingStarts) {
  const auto move = arm({"m01"}, {50});
  lab.unplug(0);
  EXPECT_EQ(lab.last_reply(move).result, "link");
  lab.run_for(2);
  fire();
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  lab.plug(0);
  lab.connect();
  const auto again = arm({"m01"}, {50});
  fire();
  EXPECT_EQ(lab.wait(again).result, "reached");
}

TEST_P(Triggered, ShutDownDisarms) {
  const auto move = arm({"m01"}, {50});
  lab.core().shut_down(lab.now_us());
  EXPECT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }, 2));
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
}

TEST_P(Triggered, PulseWhenTheMotorArrives) {
  api::PositionCompare compare{.motor = "m02",
                               .position = 300,
                               .arrivals = {.positive = true},
                               .delay_us = 20'000,
                               .width_us = 500};
  EXPECT_EQ(lab.ask(compare).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {1000}).result, "reached");
  lab.run_for(0.1);
  ASSERT_EQ(pins.pulses.size(), 2u);
  const std::int64_t arrived_ns = pins.of(0, 1).at(299);
  EXPECT_NEAR(static_cast<double>(pins.pulses[0].time_ns - arrived_ns), 20e6, 10'000);
  EXPECT_NEAR(static_cast<double>(pins.pulses[1].time_ns - pins.pulses[0].time_ns), 500e3, 10'000);
  EXPECT_TRUE(pins.pulses[0].level);
  EXPECT_FALSE(pins.pulses[1].level);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {-1000}).result, "reached");
  EXPECT_EQ(pins.pulses.size(), 2u) << "the other direction";
  compare.arrivals = {};
  EXPECT_EQ(lab.ask(compare).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {1000}).result, "reached");
  EXPECT_EQ(pins.pulses.size(), 2u) << "switched off";
}

TEST_P(Triggered, PositionCompareIsRefusedWithAReason) {
  using Compare = api::PositionCompare;
  const Compare good{.motor = "m02",
                     .position = 300,
                     .arrivals = {.positive = true, .negative = true},
                     .width_us = 10};
  const auto refusal = [this](Compare compare, const auto& bend) {
    bend(compare);
    const Answer reply = lab.last_reply(lab.send(compare));
    EXPECT_EQ(reply.phase, Answer::kRefused);
    return reply.reason;
  };
  EXPECT_THAT(refusal(good, [](Compare& c) { c.width_us = 0; }), HasSubstr("1 to 1000000"));
  EXPECT_THAT(refusal(good, [](Compare& c) { c.delay_us = -1; }), HasSubstr("0 to 1500000"));
  EXPECT_THAT(refusal(good, [](Compare& c) { c.position = std::int64_t{1} << 40; }),
              HasSubstr("lie within"));
  EXPECT_EQ(lab.ask(good).result, "done");
}

}  // namespace
}  // namespace bushd::test
