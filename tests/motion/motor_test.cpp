// What a motor does and may do, from requests and reports alone.
#include "motion/motor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/tables.h"
#include "motion/ramp.h"

namespace bushd::motion {
namespace {

using test::kTickNs;
using testing::HasSubstr;

constexpr Tick kStart = 100;
constexpr std::int64_t kSteps = 400;

class MotorTest : public testing::Test {
 protected:
  static MotorSetup setup() {
    return {.name = "theta",
            .mcu = "hall:1",
            .output = Output{3},
            .has_home = true,
            .limit_immediate = true,
            .emergency_stop_immediate = true};
  }
  MotorTest() {
    mcu.motor_count = 16;
    motor.goes_online(mcu, true, false);
    motor.trust().is_known();
  }

  // What the MCU says when its motors have done their plans up to `tick`.
  std::vector<Event> report(Tick tick, std::optional<std::int64_t> position = {}) {
    mcu.tick = static_cast<std::uint32_t>(tick);
    if (motor.is<Moving>()) {
      Axis ahead = motor.axis();
      ahead.executed(tick);
      if (!position) position = ahead.executed_steps();
      set(mcu.moving, tick >= ahead.start_tick() && tick < ahead.end_tick());
    }
    if (position) mcu.motor[3].position_steps = static_cast<std::int32_t>(*position);
    return as_it_is(tick);
  }
  // What it says as it is.
  std::vector<Event> as_it_is(Tick tick, bool emergency_stop_open = false) {
    return motor.report({.of_mcu = mcu,
                         .tick = tick,
                         .requests_open = requests_open,
                         .emergency_stop_open = emergency_stop_open});
  }
  static void set(std::uint16_t& mask, bool on) {
    mask = static_cast<std::uint16_t>(on ? mask | 1u << 3 : mask & ~(1u << 3));
  }
  template <class E>
  static const E* find(const std::vector<Event>& events) {
    for (const Event& event : events) {
      if (const E* found = std::get_if<E>(&event)) return found;
    }
    return nullptr;
  }
  std::string refusal(std::int64_t target) const {
    if (const auto used = motor.reach().may_be_used(); !used) return used.error().text();
    const auto may = motor.reach().may_move_to(target);
    return may ? "" : may.error().text();
  }

  test::TestTable table{test::ramp(), true};
  Motor motor{setup(), Axis(*table.view(), kTickNs, BUSHD_FORMAT_FINE)};
  bushd_report mcu{};
  bool requests_open = false;
};

TEST_F(MotorTest, MovesAndEndsWhereItWasSent) {
  EXPECT_TRUE(motor.is<Resting>());
  motor.start(kSteps, kStart);
  EXPECT_TRUE(motor.has_plan());
  EXPECT_EQ(motor.target_steps(), kSteps);
  EXPECT_TRUE(report(kStart + 5).empty());
  EXPECT_GT(motor.position_steps(), 0);
  const auto events = report(motor.axis().end_tick());
  const auto* ended = find<event::Ended>(events);
  ASSERT_NE(ended, nullptr);
  EXPECT_EQ(ended->outcome, Outcome::kReached);
  EXPECT_TRUE(motor.is<Resting>());
  EXPECT_EQ(motor.position_steps(), kSteps);
  EXPECT_FALSE(motor.end(Outcome::kLink, "it has ended already"));
}

TEST_F(MotorTest, AStopIsPlannedAtOnceAndToldWhenExecuted) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  motor.stop();
  EXPECT_TRUE(motor.axis().needs_change());
  EXPECT_TRUE(motor.axis().change(kStart + 30));
  EXPECT_FALSE(motor.axis().needs_change());
  const auto events = report(motor.axis().end_tick());
  ASSERT_NE(find<event::Executed>(events), nullptr);
  EXPECT_EQ(find<event::Executed>(events)->change.at, kStart + 30);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kStopped);
}

// That is the MCU's own doing too, whoever has cleared the fault by then: the count is right.
TEST_F(MotorTest, AStopThatTookTheStartBackIsNobodysStop) {
  motor.is_stopped_by_others();
  EXPECT_FALSE(motor.moves());
  EXPECT_EQ(refusal(kSteps), "");
}

TEST_F(MotorTest, RunDownByAFaultThatAnotherMasterHasClearedIsNoMismatch) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  mcu.faults = BUSHD_FAULT_LINK;
  EXPECT_TRUE(report(kStart + 30).empty()) << "it moves on, down its table";
  mcu.faults = 0;
  mcu.moving = 0;
  mcu.tick = kStart + 60;
  mcu.motor[3].position_steps -= 1;
  const auto events = as_it_is(kStart + 60);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kLink);
  EXPECT_EQ(motor.trust().uncertain_reason(), std::nullopt);
}

TEST_F(MotorTest, WhatAnotherMasterMovesIsNotAtRest) {
  set(mcu.moving, true);
  report(kStart, 17);
  EXPECT_TRUE(motor.is<Local>());
  EXPECT_EQ(motor.position_steps(), 17);
  EXPECT_THAT(refusal(20), HasSubstr("another master"));
  set(mcu.moving, false);
  report(kStart + 1, 18);
  EXPECT_TRUE(motor.is<Resting>());
  EXPECT_EQ(refusal(20), "");
}

TEST_F(MotorTest, ATargetBehindTakesASecondRun) {
  motor.start(kSteps, kStart);
  report(kStart + 40);
  motor.aim(-5);
  EXPECT_TRUE(motor.axis().change(kStart + 50));
  EXPECT_EQ(motor.target_steps(), -5);
  const auto events = report(motor.axis().end_tick());
  EXPECT_NE(find<event::Turn>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events), nullptr);
  motor.start(motor.axis().target_steps(), motor.axis().end_tick() + 20);
  EXPECT_EQ(motor.target_steps(), -5);
}

TEST_F(MotorTest, ACountThatDiffersStopsItAndMakesItsPositionUncertain) {
  motor.start(kSteps, kStart);
  const auto events = report(kStart + 20, 1);
  EXPECT_NE(find<event::Mismatch>(events), nullptr);
  EXPECT_NE(find<event::Replan>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events), nullptr) << "it moves";
  mcu.moving = 0;
  const auto last = report(motor.axis().end_tick(), 7);
  ASSERT_NE(find<event::Ended>(last), nullptr);
  EXPECT_EQ(find<event::Ended>(last)->outcome, Outcome::kFault);
  EXPECT_THAT(find<event::Ended>(last)->reason, HasSubstr("counted position 1"));
  EXPECT_THAT(refusal(10), HasSubstr("position is uncertain"));
  motor.trust().is_known();
  EXPECT_EQ(refusal(10), "");
}

TEST_F(MotorTest, AStartThatNeverCameIsNoMismatch) {
  motor.start(kSteps, kStart);
  mcu.motor[3].position_steps = 0;
  const auto events = as_it_is(kStart + 30);
  EXPECT_NE(find<event::MissedStart>(events), nullptr);
  EXPECT_EQ(motor.trust().uncertain_reason(), std::nullopt);
  EXPECT_TRUE(motor.start_of_run().awaits_new());
  EXPECT_TRUE(motor.stands());
  EXPECT_EQ(motor.target_steps(), kSteps);
  EXPECT_TRUE(as_it_is(kStart + 60).empty());
  const Leg leg = motor.take_leg();
  EXPECT_EQ(leg.target, kSteps);
  motor.start(leg.target, kStart + 100);
  EXPECT_FALSE(is_late(motor));
}

TEST_F(MotorTest, OneThatHasMovedHasNotMissedItsStart) {
  motor.start(kSteps, kStart);
  mcu.motor[3].position_steps = 0;
  EXPECT_TRUE(motor.start_of_run().is_missed(mcu));
  mcu.motor[3].position_steps = 46;
  EXPECT_FALSE(motor.start_of_run().is_missed(mcu)) << "says the next report";
}

TEST_F(MotorTest, WaitsForTheTriggerAndStopsIfThatCameFirst) {
  motor.arm(9, kSteps);
  EXPECT_TRUE(motor.is<Armed>());
  EXPECT_THAT(refusal(10), HasSubstr("waits for the trigger"));
  requests_open = true;
  EXPECT_TRUE(report(kStart).empty()) << "it may not have been armed yet";
  requests_open = false;
  motor.stop();
  mcu.trigger_number = 9;
  mcu.trigger_state = BUSHD_TRIGGER_STARTED;
  mcu.start_tick = kStart + 2;
  mcu.start_ns = 1000;
  const auto events = report(kStart + 3, 0);
  ASSERT_FALSE(events.empty());
  const auto* started = std::get_if<event::Started>(&events.front());
  ASSERT_NE(started, nullptr);
  EXPECT_EQ(started->start, kStart + 2);
  EXPECT_EQ(started->late_ns, 1000u);
  EXPECT_NE(find<event::Replan>(events), nullptr);
  EXPECT_TRUE(motor.is<Moving>());
}

TEST_F(MotorTest, IsArmedOnceItsMcuSaysSo) {
  motor.arm(9, kSteps);
  EXPECT_FALSE(motor.as<Armed>()->confirmed);
  requests_open = true;
  mcu.trigger_number = 8;
  mcu.trigger_state = BUSHD_TRIGGER_ARMED;
  EXPECT_TRUE(report(kStart).empty()) << "that was another one";
  EXPECT_FALSE(motor.as<Armed>()->confirmed);
  mcu.trigger_number = 9;
  EXPECT_NE(find<event::Waits>(report(kStart + 1)), nullptr);
  EXPECT_TRUE(motor.as<Armed>()->confirmed);
  EXPECT_TRUE(report(kStart + 2).empty()) << "told once";
}

TEST_F(MotorTest, WhatDisarmsItEndsIt) {
  motor.arm(9, kSteps);
  motor.stop("phi, armed with it, has ended");
  mcu.trigger_number = 9;
  mcu.trigger_state = BUSHD_TRIGGER_DISARMED;
  const auto events = report(kStart);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_TRUE(find<event::Ended>(events)->was_armed);
  EXPECT_THAT(find<event::Ended>(events)->reason,
              HasSubstr("disarmed, because phi, armed with it, has ended"));
  EXPECT_TRUE(motor.is<Resting>());
}

TEST_F(MotorTest, ItsLimitSwitchKeepsItFromOneDirection) {
  set(mcu.forbidden_positive, true);
  report(kStart);
  EXPECT_THAT(refusal(10), HasSubstr("limit switch at the positive end"));
  EXPECT_EQ(refusal(-10), "");
}

TEST_F(MotorTest, ALimitSwitchInFlightEndsTheMoveWhereItStands) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  set(mcu.forbidden_positive, true);
  const auto met = report(kStart + 34, motor.position_steps());
  EXPECT_NE(find<event::Drop>(met), nullptr);
  EXPECT_THAT(refusal(kSteps), HasSubstr("is stopping it"));
  set(mcu.moving, false);
  const auto events = as_it_is(kStart + 40);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kLimit);
  EXPECT_THAT(refusal(-10), HasSubstr("stopped immediately at its limit switch"));
}

// A stop would be a ramp-down from where the plan is, and the motor may go the other way.
TEST_F(MotorTest, OneThatAnotherMasterMayMoveIsLeftToIt) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  mcu.motor[3].position_steps -= 500;
  const auto told = motor.report({.of_mcu = mcu,
                                  .tick = kStart + 30,
                                  .requests_open = false,
                                  .emergency_stop_open = false,
                                  .other_master = true});
  EXPECT_NE(find<event::Drop>(told), nullptr);
  ASSERT_NE(find<event::Mismatch>(told), nullptr);
  EXPECT_FALSE(find<event::Mismatch>(told)->stopped);
  EXPECT_FALSE(motor.axis().stopping());
  EXPECT_TRUE(report(kStart + 31, 0).empty()) << "it moves";
  set(mcu.moving, false);
  const auto events = as_it_is(kStart + 40);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kFault);
  EXPECT_THAT(*motor.trust().uncertain_reason(), HasSubstr("where the table leads to"));
}

TEST_F(MotorTest, AnEmergencyStopThatCutsMakesItsPositionUncertainIfItMoved) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  mcu.faults = BUSHD_FAULT_EMERGENCY;
  EXPECT_TRUE(report(kStart + 21).empty()) << "it may still move";
  set(mcu.moving, false);
  const auto events = as_it_is(kStart + 22, true);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kStopped);
  EXPECT_THAT(*motor.trust().uncertain_reason(),
              HasSubstr("stopped immediately by an emergency stop"));
}

TEST_F(MotorTest, OneThatIsStoppedTwiceInAPauseStood) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  motor.pause();
  motor.axis().change(kStart + 30);
  const Tick end = motor.axis().end_tick();
  EXPECT_NE(find<event::Paused>(report(end)), nullptr);
  motor.stop();
  motor.stop();
  const auto events = report(end + 10);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_TRUE(find<event::Ended>(events)->was_paused) << "its end has been told";
}

// It stood: no step can be lost.
TEST_F(MotorTest, AnEmergencyStopLeavesAPausedMotorKnown) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  motor.pause();
  motor.axis().change(kStart + 30);
  EXPECT_NE(find<event::Paused>(report(motor.axis().end_tick())), nullptr);
  mcu.faults = BUSHD_FAULT_EMERGENCY;
  const auto events = report(motor.axis().end_tick() + 10);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kStopped);
  EXPECT_FALSE(motor.trust().uncertain_reason());
}

TEST_F(MotorTest, ALimitSwitchThatEndsAPauseIsNoStopOnRequest) {
  motor.start(kSteps, kStart);
  report(kStart + 20);
  motor.pause();
  motor.axis().change(kStart + 30);
  set(mcu.forbidden_positive, true);
  set(mcu.moving, true);
  // By a ramp of its MCU's own, which is a step longer and ends in the same place.
  const Tick end = motor.axis().end_tick();
  mcu.motor[3].position_steps = static_cast<std::int32_t>(motor.axis().planned_end_steps());
  EXPECT_NE(find<event::Drop>(as_it_is(end)), nullptr);
  set(mcu.moving, false);
  const auto events = as_it_is(end + 1);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kLimit);
}

TEST_F(MotorTest, HomingKeepsOthersAway) {
  motor.goes_online(mcu, false, true);
  EXPECT_THAT(refusal(1), HasSubstr("MCU hall:1 restarted"));
  motor.give_to_mcu(Homing{});
  EXPECT_THAT(refusal(1), HasSubstr("being homed"));
  motor.trust().is_known();
  motor.take_from_mcu(Homing{});
  EXPECT_TRUE(motor.is<Resting>());
  EXPECT_EQ(refusal(1), "");
}

TEST_F(MotorTest, LocalInputsHaveItAsLongAsTheyMoveIt) {
  set(mcu.autonomous, true);
  report(kStart, 5);
  EXPECT_TRUE(motor.is<Local>());
  EXPECT_THAT(refusal(1), HasSubstr("local inputs of MCU hall:1"));
  set(mcu.autonomous, false);
  report(kStart + 10, 9);
  EXPECT_TRUE(motor.is<Resting>());
  EXPECT_EQ(motor.position_steps(), 9);
  EXPECT_EQ(motor.trust().uncertain_reason(), std::nullopt);
}

// Told in the tick in which it was cut, when the program still has it.
TEST_F(MotorTest, AnEmergencyStopInAProgramIsDoubtedAtOnce) {
  motor.give_to_mcu(InProgram{});
  set(mcu.autonomous, true);
  report(kStart, 5);
  mcu.faults = BUSHD_FAULT_EMERGENCY;
  report(kStart + 10, 9);
  EXPECT_NE(motor.trust().uncertain_reason(), std::nullopt);
}

TEST_F(MotorTest, AProgramThatIsCutBeforeItsMotorWasSeenToMoveIsDoubted) {
  motor.give_to_mcu(InProgram{});
  mcu.faults = BUSHD_FAULT_EMERGENCY;
  report(kStart, 0);
  EXPECT_EQ(motor.trust().uncertain_reason(), std::nullopt) << "it has not begun";
  report(kStart + 10, 2);
  EXPECT_NE(motor.trust().uncertain_reason(), std::nullopt);
}

TEST_F(MotorTest, LocalInputsThatCameFirstEndAMove) {
  motor.start(kSteps, kStart);
  set(mcu.autonomous, true);
  const auto events = report(kStart - 5, 0);
  ASSERT_NE(find<event::Ended>(events), nullptr);
  EXPECT_EQ(find<event::Ended>(events)->outcome, Outcome::kStopped);
  EXPECT_TRUE(motor.is<Local>());
  motor.goes_offline(0, false);
  EXPECT_TRUE(motor.is<Resting>()) << "nobody knows of it any more";
}

TEST_F(MotorTest, HasNoPositionBeforeItsMcuHasReported) {
  const Motor unheard(setup(), Axis(*table.view(), kTickNs, BUSHD_FORMAT_FINE));
  EXPECT_EQ(position_trust(unheard, {}).trust, words::Trust::kUnknown);
  EXPECT_THAT(position_trust(unheard, {}).reason, HasSubstr("MCU hall:1 has not reported"));
  EXPECT_EQ(position_trust(motor, 0).trust, words::Trust::kKnown);
  EXPECT_EQ(position_trust(motor, 0).reason, "");
  report(kStart, 42);
  EXPECT_EQ(position_trust(motor, 1).trust, words::Trust::kUnknown) << "its MCU is in another boot";
  EXPECT_THAT(position_trust(motor, 1).reason, HasSubstr("heard at 42"));
  motor.scale().set_coordinates(units::Coordinates::make({"mm", {4, 1}, false, 0.5, 2}).value());
  EXPECT_THAT(position_trust(motor, 1).reason, HasSubstr("heard at 42 (11.00 mm)"));
}

TEST_F(MotorTest, SaysHowItStandsToItsSoftLimits) {
  EXPECT_TRUE(motor.reach().stands_within_soft_limits());
  report(kStart, 42);
  motor.scale().set_soft_limits(units::SoftLimits{0, 42});
  EXPECT_TRUE(motor.reach().stands_within_soft_limits());
  motor.scale().set_soft_limits(units::SoftLimits{43, 50});
  EXPECT_THAT(motor.reach().stands_within_soft_limits().error().message,
              HasSubstr("it stands at 42 steps, beyond its soft limits of 43 steps to 50 steps"));
  EXPECT_FALSE(motor.reach().may_move_to(41));
  EXPECT_TRUE(motor.reach().may_move_to(45));
}

TEST_F(MotorTest, IsUncertainUntilSomebodySaysWhereItStandsButMayMove) {
  Motor found(setup(), Axis(*table.view(), kTickNs, BUSHD_FORMAT_FINE));
  found.goes_online(mcu, true, false);
  EXPECT_EQ(position_trust(found, 0).trust, words::Trust::kUncertain);
  EXPECT_THAT(position_trust(found, 0).reason, HasSubstr("neither set nor homed"));
  EXPECT_TRUE(found.reach().may_move_to(5));
  found.give_to_mcu(Homing{});
  found.trust().is_known();
  found.take_from_mcu(Homing{});
  EXPECT_EQ(position_trust(found, 0).trust, words::Trust::kKnown);
}

TEST_F(MotorTest, IsStaleWhileItsMcuIsOffline) {
  motor.goes_offline(4711, false);
  EXPECT_EQ(position_trust(motor, 0).trust, words::Trust::kStale);
  EXPECT_EQ(position_trust(motor, 0).heard_utime_us, 4711);
  EXPECT_THAT(position_trust(motor, 0).reason, HasSubstr("it rested"));
  motor.goes_online(mcu, false, false);
  motor.start(kSteps, kStart);
  report(kStart + 20);
  motor.goes_offline(4712, false);
  motor.end(Outcome::kLink, "lost");
  EXPECT_EQ(position_trust(motor, 0).trust, words::Trust::kStale);
  EXPECT_EQ(position_trust(motor, 0).heard_utime_us, 4712);
  EXPECT_THAT(position_trust(motor, 0).reason, HasSubstr("may have run on"));
  motor.goes_online(mcu, false, false);
  EXPECT_EQ(position_trust(motor, 0).trust, words::Trust::kKnown);
}

TEST_F(MotorTest, WhatPeopleMayMoveUnheardMayHaveRunOnFromRest) {
  Motor other(setup(), Axis(*table.view(), kTickNs, BUSHD_FORMAT_FINE));
  other.goes_online(mcu, true, false);
  other.trust().is_known();
  other.goes_offline(4711, true);
  EXPECT_THAT(position_trust(other, 0).reason, HasSubstr("may have run on"));
}

}  // namespace
}  // namespace bushd::motion
