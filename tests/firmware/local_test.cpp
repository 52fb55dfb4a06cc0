// LOCAL: two buttons at the MCU move motors, with a host or without.
#include <algorithm>
#include <functional>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr std::uint16_t kLocal = 0b0101;

class Local : public Streams {
 protected:
  void SetUp() override { ASSERT_EQ(rig.local(kLocal), BUSHD_OK); }
  void hold(std::uint8_t buttons, int ticks) {
    rig.pins({0, buttons});
    rig.pass(ticks);
  }
  void release() { hold(0, 1); }
};
BUSHD_IN_BOTH_FORMATS(Local);

TEST_P(Local, WhileHeldMotorsFollowTheirTableAndThenRampDown) {
  for (const auto& [button, direction] :
       {std::pair{BUSHD_INPUT_FORWARD, 1}, std::pair{BUSHD_INPUT_REVERSE, -1}}) {
    rig.forget_history();
    hold(static_cast<std::uint8_t>(button), 130);
    EXPECT_EQ(rig.poll().autonomous, kLocal);
    EXPECT_EQ(rig.poll().moving, kLocal);
    EXPECT_EQ(rig.poll().running, 0) << "not for a master to end";
    EXPECT_EQ(rig.poll().state, BUSHD_STATE_RUN);
    release();
    rig.pass_until_rest();
    // The third reading begins it, in the tick that is prepared then; the release is read in the
    // tick after the 130th.
    auto reference = Reference::move(law, 100000);
    reference.ramp_down_at(128 * std::uint64_t{Rig::kTickNs});
    ASSERT_NO_FATAL_FAILURE(expect_steps({rig.history(2).begin() + 4, rig.history(2).end()},
                                         steps_by_tick(reference, Rig::kTickNs), direction));
    EXPECT_EQ(rig.history(0), rig.history(2));
    EXPECT_EQ(rig.pulses(1), 0) << "not one of these";
    expect_rest_as_counted();
    EXPECT_EQ(rig.poll().faults, 0);
  }
}

TEST_P(Local, BothButtonsRampDownAndABounceIsNoPress) {
  hold(BUSHD_INPUT_FORWARD, 2);
  release();
  hold(BUSHD_INPUT_FORWARD, 2);
  release();
  EXPECT_EQ(rig.poll().moving, 0);
  hold(BUSHD_INPUT_FORWARD, 60);
  hold(BUSHD_INPUT_FORWARD | BUSHD_INPUT_REVERSE, 100);
  EXPECT_EQ(rig.poll().moving, 0);
  const std::int64_t at = rig.pulses(0);
  EXPECT_GT(at, 20);
  hold(BUSHD_INPUT_REVERSE, 60);
  release();
  rig.pass_until_rest();
  EXPECT_LT(rig.pulses(0), at);
  expect_rest_as_counted();
}

// A tap on the other button: it turns only after its ramp, and only where it is still asked to.
TEST_P(Local, PressedAgainOnTheRampItMovesOnceItRests) {
  hold(BUSHD_INPUT_FORWARD, 100);
  hold(BUSHD_INPUT_REVERSE, 300);
  release();
  EXPECT_LT(rig.pulses(0), 100);
  rig.pass_until_rest();
  const auto& ticks = rig.history(0);
  const auto turned = std::find_if(ticks.begin(), ticks.end(), [](int n) { return n < 0; });
  ASSERT_NE(turned, ticks.end());
  EXPECT_TRUE(std::none_of(turned, ticks.end(), [](int n) { return n > 0; }));
  expect_rest_as_counted();
}

TEST_P(Local, AStreamOnSuchAMotorIsRefusedMeanwhileAndWhatStreamsIsLeftAlone) {
  hold(BUSHD_INPUT_FORWARD, 10);
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 4, 0)), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_E_STATE);
  release();
  rig.pass_until_rest();
  const std::int64_t at = rig.pulses(0);
  const std::int64_t other = rig.pulses(2);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 30, 0)), BUSHD_OK);
  hold(BUSHD_INPUT_REVERSE, 60);
  EXPECT_EQ(rig.pulses(0), at + 30) << "not after it either, until the next press";
  EXPECT_LT(rig.pulses(2), other);
  release();
  rig.pass_until_rest();
  hold(BUSHD_INPUT_REVERSE, 30);
  release();
  rig.pass_until_rest();
  EXPECT_LT(rig.pulses(0), at + 30);
  expect_rest_as_counted();
}

TEST_P(Local, EmergencyStopsItUntilItIsClearedAndPressedAgain) {
  hold(BUSHD_INPUT_FORWARD, 60);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass(200);
  EXPECT_EQ(rig.poll().moving, 0);
  const std::int64_t at = rig.pulses(0);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  rig.pass(50);
  EXPECT_EQ(rig.pulses(0), at) << "held all the time: nobody at the motor expects it to start";
  release();
  hold(BUSHD_INPUT_FORWARD, 50);
  EXPECT_GT(rig.pulses(0), at);
  release();
  expect_rest_as_counted();
}

TEST_P(Local, ACutIsNoRampWhoeverAsksForIt) {
  ASSERT_EQ(rig.set_inputs({.limit_positive = 0b0101,
                            .limit_immediate = 0b0101,
                            .emergency = BUSHD_EMERGENCY_INPUT_IMMEDIATE,
                            .overcurrent = 500}),
            BUSHD_OK);
  ASSERT_EQ(rig.local(kLocal), BUSHD_OK);
  const std::vector<std::function<void()>> cuts = {
      [&] { rig.emergency(BUSHD_STOP_IMMEDIATE); },
      [&] { rig.pins({0, BUSHD_INPUT_FORWARD | BUSHD_INPUT_EMERGENCY}); },
      [&] { rig.current(600); },
      [&] {
        rig.pins({0b0101, BUSHD_INPUT_FORWARD});
        rig.pass(1);
        rig.pins({0b0101, 0});
      },
  };
  for (const auto& cut : cuts) {
    hold(BUSHD_INPUT_FORWARD, 60);
    ASSERT_EQ(rig.poll().autonomous, kLocal);
    cut();
    rig.pass(2);
    const std::int64_t at = rig.pulses(0);
    rig.pass(50);
    EXPECT_EQ(rig.pulses(0), at);
    rig.current(0);
    release();
    EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_ENABLE), BUSHD_OK);
  }
}

TEST_P(Local, WorksWithoutAHostButNotWithoutDriversOrTables) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 5), BUSHD_OK);
  rig.pass(500);
  hold(BUSHD_INPUT_FORWARD, 60);
  release();
  rig.pass_until_rest();
  EXPECT_GT(rig.pulses(0), 20);
  EXPECT_EQ(rig.poll().faults, 0) << "nobody's silence is a fault here";
  expect_rest_as_counted();
  const std::int64_t at = rig.pulses(0);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 60);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  rig.pass(60);
  release();
  ASSERT_EQ(rig.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 60);
  release();
  EXPECT_EQ(rig.pulses(0), at);
}

TEST_P(Local, StopsAtALimitAndComesBackFromIt) {
  ASSERT_EQ(rig.set_inputs({.limit_positive = 0b0001}), BUSHD_OK);
  ASSERT_EQ(rig.local(kLocal), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 100);
  rig.pins({0b0001, BUSHD_INPUT_FORWARD});
  rig.pass(200);
  const std::int64_t at = rig.pulses(0);
  rig.pass(100);
  EXPECT_EQ(rig.pulses(0), at);
  EXPECT_EQ(rig.poll().autonomous, 0b0100) << "the other one moves on";
  rig.pins({0b0001, 0});
  rig.pass(100);
  rig.pins({0b0001, BUSHD_INPUT_FORWARD});
  rig.pass(50);
  EXPECT_EQ(rig.pulses(0), at) << "barred";
  rig.pins({0b0001, 0});
  rig.pass_until_rest();
  rig.pins({0b0001, BUSHD_INPUT_REVERSE});
  rig.pass(50);
  release();
  EXPECT_LT(rig.pulses(0), at);
  expect_rest_as_counted();
}

TEST_P(Local, MotorsThatTheMcuDoesNotHaveAreRefused) {
  EXPECT_EQ(rig.local(0b1'0001), BUSHD_E_FORMAT);
  hold(BUSHD_INPUT_FORWARD, 60);
  EXPECT_EQ(rig.poll().autonomous, kLocal) << "as it was told before";
  release();
  expect_rest_as_counted();
}

// What a master takes away from them ramps down, and waits for the next press when it is given
// back.
TEST_P(Local, AMasterEndsItAndTheButtonMustBeReleasedFirst) {
  hold(BUSHD_INPUT_FORWARD, 130);
  ASSERT_EQ(rig.poll().autonomous, kLocal);
  ASSERT_EQ(rig.local(0b0100), BUSHD_OK);
  rig.pass(100);
  EXPECT_EQ(rig.poll().autonomous, 0b0100) << "the other one goes on";
  const std::int64_t at = rig.pulses(0);
  auto reference = Reference::move(law, 100000);
  reference.ramp_down_at(128 * std::uint64_t{Rig::kTickNs});
  EXPECT_EQ(at, static_cast<std::int64_t>(reference.steps()));
  ASSERT_EQ(rig.local(kLocal), BUSHD_OK);
  rig.pass(100);
  EXPECT_EQ(rig.pulses(0), at) << "held all the time";
  EXPECT_EQ(rig.poll().autonomous, 0b0100);
  release();
  rig.pass_until_rest();
  hold(BUSHD_INPUT_FORWARD, 60);
  EXPECT_EQ(rig.poll().autonomous, kLocal);
  EXPECT_GT(rig.pulses(0), at);
  ASSERT_EQ(rig.local(0), BUSHD_OK);
  rig.pass_until_rest();
  ASSERT_EQ(rig.local(kLocal), BUSHD_OK);
  rig.pass(100);
  EXPECT_EQ(rig.poll().moving, 0) << "held all the time";
  release();
  hold(BUSHD_INPUT_REVERSE, 60);
  EXPECT_EQ(rig.poll().autonomous, kLocal);
  release();
  expect_rest_as_counted();
}

// People expect nothing of a button that was held, or is shorted, before anybody could press it.
TEST_P(Local, AButtonMustHaveBeenSeenReleasedSinceItWasTold) {
  ASSERT_EQ(rig.local(0), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 5);
  ASSERT_EQ(rig.local(kLocal), BUSHD_OK);
  rig.pass(60);
  EXPECT_EQ(rig.pulses(0), 0) << "held when it was given motors";
  release();
  rig.pass_until_rest();
  // Another wiring: what rests is a press now.
  ASSERT_EQ(rig.set_inputs({.system_inverted = BUSHD_INPUT_FORWARD}), BUSHD_OK);
  ASSERT_EQ(rig.local(kLocal), BUSHD_OK);
  rig.pass(60);
  EXPECT_EQ(rig.pulses(0), 0) << "active at rest";
  rig.pins({0, BUSHD_INPUT_FORWARD});
  rig.pass(1);
  rig.pins({});
  rig.pass(3);
  EXPECT_EQ(rig.poll().autonomous, kLocal);
}

TEST_P(Local, AButtonHeldAtPowerUpMovesNothingUntilItIsPressedAnew) {
  rig.pins({0, BUSHD_INPUT_FORWARD});
  rig.restart_with_nvm();
  rig.pass(60);
  EXPECT_EQ(rig.poll().moving, 0);
  EXPECT_FALSE(rig.enabled());
  release();
  hold(BUSHD_INPUT_FORWARD, 60);
  EXPECT_EQ(rig.poll().autonomous, kLocal);
}

// Nor of one that is held when its motor gets a table.
TEST_P(Local, AMotorThatGetsItsTableWhileTheButtonIsHeldWaitsForThePress) {
  ASSERT_EQ(rig.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 60);
  ASSERT_EQ(rig.upload(0, law), BUSHD_OK);
  ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
  rig.pass(60);
  EXPECT_EQ(rig.pulses(0), 0);
  release();
  hold(BUSHD_INPUT_FORWARD, 60);
  EXPECT_GT(rig.pulses(0), 0);
}

TEST_P(Local, LeavesAMotorThatHomesAlone) {
  ASSERT_EQ(rig.home({0, -1, 5000, 0, 400, 1000, 0}), BUSHD_OK);
  rig.pass(20);
  hold(BUSHD_INPUT_FORWARD, 60);
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_FAST);
  EXPECT_GT(rig.pulses(2), 0);
  release();
  rig.pass(20);
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_FAST);
  EXPECT_LT(rig.pulses(0), -20);
}

// It comes to rest where its position is the last one that is counted, and goes back from there.
TEST_P(Local, EndsWhereItsCountEnds) {
  for (const int direction : {1, -1}) {
    const auto button =
        static_cast<std::uint8_t>(direction > 0 ? BUSHD_INPUT_FORWARD : BUSHD_INPUT_REVERSE);
    const auto other =
        static_cast<std::uint8_t>(direction > 0 ? BUSHD_INPUT_REVERSE : BUSHD_INPUT_FORWARD);
    ASSERT_EQ(rig.set_position(0, direction * (INT32_MAX - 200)), BUSHD_OK);
    ASSERT_EQ(rig.set_position(2, direction * INT32_MAX), BUSHD_OK);
    const std::int64_t before = rig.pulses(2);
    const std::int64_t from = rig.pulses(0);
    hold(button, 500);
    EXPECT_EQ(rig.poll().motor[0].position_steps, direction * INT32_MAX);
    EXPECT_EQ(rig.pulses(0) - from, direction * 200);
    EXPECT_EQ(rig.pulses(2), before) << "there already";
    // Pressed again, and on the other side.
    release();
    rig.pass_until_rest();
    hold(button, 50);
    EXPECT_EQ(rig.poll().motor[0].position_steps, direction * INT32_MAX);
    hold(other, 100);
    release();
    rig.pass_until_rest();
    EXPECT_LT(direction * (rig.pulses(0) - from), 200);
    EXPECT_EQ(rig.poll().motor[0].position_steps,
              direction * (INT32_MAX - 200) + (rig.pulses(0) - from));
    EXPECT_LT(direction * rig.pulses(2), direction * before);
  }
}

}  // namespace
}  // namespace bushd::test
