// Homing by the MCUs, and motions by their local inputs, as clients see them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "daemon/lab.h"
#include "sim/plant.h"
#include "sim/shipped_motors.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// hall() with something more for motor m01.
std::string with(const std::string& keys, int mcus = 1, int motors = 2,
                 const std::string& manner = "fine") {
  return with_keys(hall(mcus, motors, manner), "m01", keys + "\n");
}

std::string homes(const std::string& more = {}) {
  return "home = { direction = \"negative\", position_steps = -50, most_steps = 6000" + more + " }";
}

class Homing : public testing::Test {
 protected:
  static void put_switch(Lab& lab, std::int64_t at_steps, std::size_t mcu = 0) {
    lab.bus(0).mcu(mcu).attach_switch(0, {.at_steps = at_steps, .hysteresis_steps = 4});
  }
  static void hold(Lab& lab, std::uint8_t buttons) { lab.bus(0).mcu(0).set_inputs({0, buttons}); }
};

TEST_F(Homing, SetsThePositionAndEndsReached) {
  for (const char* manner : {"fine", "coarse", "fine_table"}) {
    Lab lab(with(homes(), 1, 2, manner));
    put_switch(lab, -700);
    lab.connect();
    const auto home = lab.send(Ask::kHome, {"m01"});
    lab.run_for(0.3);
    EXPECT_EQ(lab.motor("m01").activity, api::Activity::kHoming);
    EXPECT_NE(lab.motor("m01").moving, 0);
    EXPECT_EQ(lab.motor("m02").activity, api::Activity::kResting);
    const Answer result = lab.wait(home);
    EXPECT_EQ(result.result, "reached") << result.reason;
    ASSERT_EQ(result.position_steps.size(), 1u);
    EXPECT_EQ(result.position_steps[0], lab.shaft_steps("m01") + 650);
    EXPECT_LE(std::abs(result.position_steps[0] + 50), 1);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
    EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {100}).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), -550);
  }
}

TEST_F(Homing, MakesAPositionKnownAgain) {
  Lab lab(with(homes()));
  put_switch(lab, -300);
  lab.connect();
  lab.bus(0).reboot(0, 50'000'000);
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").trust == api::Trust::kUncertain; }));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {5})).reason,
              HasSubstr("bushctl home"));
  EXPECT_EQ(lab.ask(Ask::kHome, {"m01"}).result, "reached");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {5}).result, "reached");
}

TEST_F(Homing, MeanwhileNothingElseIsDoneWithTheMotor) {
  Lab lab(with(homes()));
  put_switch(lab, -2000);
  lab.connect();
  const auto home = lab.send(Ask::kHome, {"m01"});
  for (const double seconds : {0.0, 0.5}) {
    lab.run_for(seconds);
    const auto refused = [&](Ask kind) {
      return lab.last_reply(lab.send(kind, {"m01"}, {5})).reason;
    };
    EXPECT_THAT(refused(Ask::kMoveBy), HasSubstr("m01: it is being homed"));
    EXPECT_THAT(refused(Ask::kHome), HasSubstr("m01: it is being homed"));
    EXPECT_THAT(refused(Ask::kSetPosition), HasSubstr("m01 moves"));
    EXPECT_THAT(refused(Ask::kDisable), HasSubstr("m01 moves"));
  }
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {50}).result, "reached");
  EXPECT_EQ(lab.wait(home).result, "reached");
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kHome, {"m02"})).reason,
              HasSubstr("no home switch configured"));
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kHome, {})).result, "refused");
}

TEST_F(Homing, StopAndEmergencyStopEndIt) {
  for (const Ask kind : {Ask::kStop, Ask::kEmergencyStop}) {
    ReadyLab lab(with(homes()));
    const auto home = lab.send(Ask::kHome, {"m01"});
    lab.run_for(0.7);
    const auto stop = lab.send(kind, {});
    const Answer result = lab.wait(home);
    EXPECT_EQ(result.result, "stopped") << result.reason;
    EXPECT_EQ(lab.wait(stop).result, "done");
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
    EXPECT_LT(result.position_steps.at(0), -100);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown) << "its steps were counted all the time";
  }
}

TEST_F(Homing, LeavesAPositionUncertainIfTheSwitchIsNotFound) {
  ReadyLab lab(with(homes()));
  lab.bus(0).reboot(0, 50'000'000);
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").trust == api::Trust::kUncertain; }));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  EXPECT_THAT(lab.ask(Ask::kHome, {"m01"}), Ends("fault", "m01: its switch was not found"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

TEST_F(Homing, ASwitchThatIsNotThereIsAFault) {
  ReadyLab lab(with(homes(", slow_most_steps = 60")));
  const Answer missing = lab.ask(Ask::kHome, {"m01"});
  EXPECT_THAT(missing, Ends("fault", "m01: its switch was not found"));
  EXPECT_EQ(missing.position_steps.at(0), -6000);
  lab.bus(0).mcu(0).set_inputs({1, 0});
  const Answer stuck = lab.ask(Ask::kHome, {"m01"});
  EXPECT_THAT(stuck, Ends("fault", "stuck"));
  EXPECT_EQ(stuck.position_steps.at(0), -6000 + 60);
  EXPECT_EQ(lab.shaft_steps("m01"), -6000 + 60);
}

TEST_F(Homing, MotorsOfOneMcuTakeTurns) {
  Lab lab(with_keys(with(homes()), "m02", homes() + "\n"));
  put_switch(lab, -300);
  lab.bus(0).mcu(0).attach_switch(1, {.at_steps = -500, .hysteresis_steps = 4});
  lab.connect();
  const auto home = lab.send(Ask::kHome, {"m02", "m01"});
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_LT(lab.shaft_steps("m02"), 0);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kHoming) << "it waits for its turn";
  const Answer result = lab.wait(home);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_LE(std::abs(lab.shaft_steps("m01") + 300), 1);
  EXPECT_LE(std::abs(lab.shaft_steps("m02") + 500), 1);

  // One that waits is stopped at once.
  const auto again = lab.send(Ask::kHome, {"m01", "m02"});
  lab.run_for(0.1);
  lab.send(Ask::kStop, {"m02"});
  const Answer part = lab.wait(again);
  EXPECT_EQ(part.motor_results.at(0), "reached");
  EXPECT_EQ(part.motor_results.at(1), "stopped");
}

TEST_F(Homing, AtTheStartOfItsMcu) {
  Lab lab(with(homes(", at_start = true")));
  put_switch(lab, -300);
  lab.connect();
  const auto homed = [&] { return lab.motor("m01").activity == api::Activity::kResting; };
  lab.run_for(0.1);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kHoming);
  ASSERT_TRUE(lab.run_until(homed, 60));
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01") + 250);
  // A new daemon finds it homed.
  lab.restart_daemon();
  lab.connect();
  lab.run_for(0.1);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
  lab.bus(0).reboot(0, 50'000'000);
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").trust == api::Trust::kUncertain; }));
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").trust == api::Trust::kKnown; }, 60));
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01") + 250);
}

// From boot on the MCU is ready only when all its motors with a home have been homed.
TEST_F(Homing, AnMcuIsReadyAfterIt) {
  Lab lab(with_mcu_keys(with(homes()), "ready = \"after-homing\"\n"));
  put_switch(lab, -300);
  ASSERT_TRUE(lab.run_until([&] {
    return lab.has_state("hall:1") && lab.state_of("hall:1").detail == "not homed yet: m01";
  }));
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kBusy);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kHoming) << "nobody has asked for it";
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m02"}, {5})).reason,
              HasSubstr("is not ready before m01 has been homed"));
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
  lab.run_for(2);
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kBusy) << "it was stopped";
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m02"}, {5})).reason,
              HasSubstr("'bushctl home m01'"));
  EXPECT_EQ(lab.ask(Ask::kHome, {"m01"}).result, "reached");
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kReady);
  lab.connect();
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {5}).result, "reached");
  // A new daemon finds it homed; after a reset it homes them anew.
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  lab.bus(0).reboot(0, 50'000'000);
  ASSERT_TRUE(lab.mcu_comes_to("hall:1", api::McuState::kBusy));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 60));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01") + 250);
}

TEST_F(Homing, IsLostWithItsMcuAndCountedAllTheSame) {
  ReadyLab lab(with(homes()));
  const auto home = lab.send(Ask::kHome, {"m01"});
  lab.run_for(0.7);
  lab.unplug(0);
  EXPECT_EQ(lab.wait(home).result, "link");
  lab.run_for(3);
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_LT(lab.shaft_steps("m01"), -100);
  EXPECT_GT(lab.shaft_steps("m01"), -6000) << "it ramped down when it heard nobody";
}

// Wherever it comes from, with a contact that bounces for as long as a slow step lasts: the place
// is the same to one step, and no step is out of the table.
TEST_F(Homing, WhereverItComesFromItIsTheSameToOneStep) {
  sim::Plant plant(1);
  const auto table = tables::load(kShippedTables / "bushd2-constant.toml").value();
  const sim::PaceRules rules(table->view(), 2'560'000, BUSHD_MAX_SLOTS, BUSHD_FORMAT_FINE);
  plant.attach(0, 0, rules);
  Lab lab(with(homes(), 1, 1), {}, &plant);
  plant.on_violation = [](sim::TimeNs, std::size_t, std::size_t, const std::string& what) {
    ADD_FAILURE() << what;
  };
  lab.bus(0).mcu(0).attach_switch(
      0, {.at_steps = -400, .hysteresis_steps = 6, .bounce_ns = 7'000'000, .seed = 5});
  lab.connect();
  sim::Random random(21, 0);
  for (int i = 0; i < 100; ++i) {
    const Answer result = lab.ask(Ask::kHome, {"m01"});
    ASSERT_EQ(result.result, "reached") << result.reason;
    const std::int64_t off = result.position_steps.at(0) + 50 - (lab.shaft_steps("m01") + 400);
    ASSERT_GE(off, 0);
    ASSERT_LE(off, 1);
    const auto away = random.between(-40, 900);
    ASSERT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {away - 50}).result, "reached");
  }
}

TEST_F(Homing, LocalInputsMoveAMotorAndTheDaemonFollows) {
  ReadyLab lab(with("local = true"));
  hold(lab, BUSHD_INPUT_FORWARD);
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").activity == api::Activity::kLocal; }, 1));
  EXPECT_EQ(lab.motor("m02").activity, api::Activity::kResting);
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {5})).reason,
              HasSubstr("local inputs of MCU hall:1"));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {50}).result, "reached");
  hold(lab, 0);
  ASSERT_TRUE(
      lab.run_until([&] { return lab.motor("m01").activity == api::Activity::kResting; }, 5));
  EXPECT_GT(lab.shaft_steps("m01"), 50);
  EXPECT_EQ(lab.shaft_steps("m02"), 50);
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

// It ramps down, stands although the button is held, and goes on with the next press.
TEST_F(Homing, AStopEndsLocalMotionUntilTheInputIsReleased) {
  ReadyLab lab(with("local = true"));
  for (int again = 0; again < 2; ++again) {
    hold(lab, BUSHD_INPUT_FORWARD);
    ASSERT_TRUE(
        lab.run_until([&] { return lab.motor("m01").activity == api::Activity::kLocal; }, 1));
    lab.run_for(0.3);
    EXPECT_THAT(lab.ask(Ask::kStop, {}), Ends("done", "m01: its local inputs must be released"));
    const std::int64_t at = lab.shaft_steps("m01");
    EXPECT_GT(at, 30 * (again + 1));
    lab.run_for(2);
    EXPECT_EQ(lab.shaft_steps("m01"), at) << "answered when it stood";
    hold(lab, 0);
    lab.run_for(0.1);
  }
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).reason, "done");
}

TEST_F(Homing, AHeldMotorIsNotMovedByLocalInputs) {
  ReadyLab lab(with("local = true"));
  EXPECT_EQ(lab.ask(api::Hold{.motors = {"m01"}}).reason, "held: 1 motor");
  hold(lab, BUSHD_INPUT_FORWARD);
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  // Also by an MCU that was configured meanwhile.
  lab.unplug(0, 0.5);
  lab.connect();
  hold(lab, 0);
  lab.run_for(0.1);
  hold(lab, BUSHD_INPUT_FORWARD);
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.ask(api::Release{.motors = {"m01"}}).result, "done");
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), 0) << "held all the time";
  hold(lab, 0);
  lab.run_for(0.1);
  hold(lab, BUSHD_INPUT_FORWARD);
  lab.run_for(0.5);
  EXPECT_GT(lab.shaft_steps("m01"), 30);
  // While it moves: it ramps down.
  EXPECT_EQ(lab.ask(api::Hold{.motors = {"m01"}}).reason, "held: 1 motor");
  lab.run_for(1);
  const std::int64_t at = lab.shaft_steps("m01");
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), at);
}

// Whoever comes first has the motor.
TEST_F(Homing, AMoveAndAPressAtTheSameTimeNeverMix) {
  for (int ms = 0; ms < 160; ms += 8) {
    SCOPED_TRACE(ms);
    ReadyLab lab(with("local = true"));
    const auto move = lab.send(Ask::kMoveBy, {"m01"}, {100});
    lab.run_for(ms * 1e-3);
    hold(lab, BUSHD_INPUT_REVERSE);
    lab.run_for(0.5);
    hold(lab, 0);
    const Answer result = lab.wait(move);
    EXPECT_THAT(result.result, testing::AnyOf("reached", "stopped")) << result.reason;
    ASSERT_TRUE(
        lab.run_until([&] { return lab.motor("m01").activity == api::Activity::kResting; }, 5));
    EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    if (result.result == "reached") {
      EXPECT_EQ(lab.shaft_steps("m01"), 100);
    } else {
      EXPECT_LT(lab.shaft_steps("m01"), 0);
    }
    EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
  }
}

TEST_F(Homing, ADaemonThatComesWaitsForLocalMotionToEnd) {
  ReadyLab lab(with("local = true"));
  hold(lab, BUSHD_INPUT_FORWARD);
  lab.run_for(0.5);
  lab.restart_daemon();
  lab.run_for(1.5);
  EXPECT_FALSE(lab.all_ready());
  const std::int64_t at = lab.shaft_steps("m01");
  EXPECT_GT(at, 100) << "it goes on";
  hold(lab, 0);
  lab.connect();
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
}

}  // namespace
}  // namespace bushd::test
