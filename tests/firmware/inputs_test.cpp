// Limit switches, the emergency input, the supply current and EN after a watchdog reset. What a
// stop by an input must look like is seen from a twin that is stopped by EMERGENCY in the same
// tick.
#include <memory>
#include <random>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr bushd_inputs kNothing{0, 0};
constexpr bushd_inputs kSwitch{1, 0};  // of motor 0

Bytes table_run(std::uint32_t first, std::uint32_t steps, std::int8_t direction) {
  const bushd_table_run_entry entry = {0, 0, direction, steps, 0};
  return table_run_payload(0, first, entry);
}

class Inputs : public Streams {
 protected:
  // A fresh MCU whose motors have these limits.
  std::unique_ptr<Rig> with(const InputSettings& settings) const {
    auto made = std::make_unique<ReadyRig>(law, format, RigOptions{.queue_ticks = 256});
    EXPECT_EQ(made->set_inputs(settings), BUSHD_OK);
    return made;
  }
  bushd_status start(Rig& on, int steps, std::uint32_t ahead = 0) const {
    return on.take(on.part(plan(steps), on.first_open() + ahead, 0, 100));
  }
  bushd_status start_run(Rig& on, int steps) const {
    return on.take(BUSHD_MSG_TABLE_RUN,
                   table_run(on.first_open(), static_cast<std::uint32_t>(std::abs(steps)),
                             static_cast<std::int8_t>(steps < 0 ? -1 : 1)));
  }
  static void rest(Rig& on) {
    on.pass_until_rest();
    on.pass(3);
    EXPECT_EQ(on.poll().motor[0].position_steps, on.pulses(0));
  }
  // The motor comes to rest on its positive limit after some steps.
  void hit_positive(Rig& on) const {
    ASSERT_EQ(start(on, 50), BUSHD_OK);
    on.pass(20);
    on.pins(kSwitch);
    rest(on);
    ASSERT_GT(on.pulses(0), 0);
    ASSERT_LT(on.pulses(0), 50);
  }
};
BUSHD_IN_BOTH_FORMATS(Inputs);

TEST_P(Inputs, ALimitRampsAMotorDownByItsTableOrCutsItAtAnyTick) {
  for (const bushd_stop_mode mode : {BUSHD_STOP_RAMP, BUSHD_STOP_IMMEDIATE}) {
    for (const int steps : {50, -50}) {
      for (int ticks = 0; ticks < 90; ticks += 3) {
        for (const bool whole : {false, true}) {
          SCOPED_TRACE(testing::Message() << mode << " " << steps << " " << ticks << " " << whole);
          const std::uint16_t cuts = mode == BUSHD_STOP_IMMEDIATE ? 1 : 0;
          const auto limited = with({.limit_positive = static_cast<std::uint16_t>(steps > 0),
                                     .limit_negative = static_cast<std::uint16_t>(steps < 0),
                                     .limit_immediate = cuts});
          const auto twin = with({});
          for (Rig* on : {limited.get(), twin.get()}) {
            ASSERT_EQ(whole ? start_run(*on, steps) : start(*on, steps), BUSHD_OK);
            on->pass(ticks);
          }
          limited->pins(kSwitch);
          twin->emergency(mode);
          rest(*limited);
          rest(*twin);
          twin->pass(static_cast<int>(limited->history(0).size()) -
                     static_cast<int>(twin->history(0).size()));
          ASSERT_EQ(limited->history(0), twin->history(0));
          ASSERT_EQ(limited->poll().faults, 0);
          ASSERT_EQ(limited->poll().state, BUSHD_STATE_READY);
          ASSERT_EQ(limited->poll().forbidden_positive, steps > 0);
          ASSERT_EQ(limited->poll().forbidden_negative, steps < 0);
        }
      }
    }
  }
}

TEST_P(Inputs, TheWayIntoALimitIsRefusedAndTheWayOutIsNot) {
  const auto on = with({.limit_positive = 1});
  hit_positive(*on);
  EXPECT_EQ(start(*on, 5), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(start_run(*on, 5), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(on->poll().moving, 0);
  const auto stood = on->pulses(0);
  EXPECT_EQ(start(*on, -5), BUSHD_OK);
  rest(*on);
  EXPECT_EQ(on->pulses(0), stood - 5) << "still on the switch: it may go on";
  EXPECT_EQ(start_run(*on, -5), BUSHD_OK);
  on->pins(kNothing);
  rest(*on);
  EXPECT_EQ(on->pulses(0), stood - 10);
  EXPECT_EQ(on->poll().forbidden_positive, 0);
  EXPECT_EQ(start(*on, 3), BUSHD_OK);
  rest(*on);
  EXPECT_EQ(on->pulses(0), stood - 7);
}

TEST_P(Inputs, NothingStartsBeforeALimitsRampDownIsOver) {
  for (const bool whole : {false, true}) {
    const auto on = with({.limit_positive = 1});
    ASSERT_EQ(start_run(*on, 50), BUSHD_OK);
    on->pass(40);
    on->pins(kSwitch);
    on->pass(3);
    ASSERT_EQ(on->poll().forbidden_positive, 1);
    ASSERT_EQ(on->poll().moving, 1);
    EXPECT_EQ(whole ? start_run(*on, -5) : start(*on, -5), BUSHD_E_STATE);
    rest(*on);
    const auto stood = on->pulses(0);
    EXPECT_EQ(whole ? start_run(*on, -5) : start(*on, -5), BUSHD_OK);
    rest(*on);
    EXPECT_EQ(on->pulses(0), stood - 5);
  }
}

TEST_P(Inputs, StartsByTableTicksIntoALimitAreRefused) {
  const auto on = with({.limit_negative = 1});
  on->pins(kSwitch);
  on->pass();
  bushd_table_ticks_entry entry{0, {}};
  entry.state.direction = -1;
  entry.state.accel_end = 1;
  const Bytes payload = payload_of([&](std::uint8_t* to) {
    return bushd_encode_table_ticks(0, BUSHD_TICKS_START, on->first_open(), 30, &entry, 1, to);
  });
  EXPECT_EQ(on->take(BUSHD_MSG_TABLE_TICKS, payload), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(on->poll().forbidden_negative, 1);
}

TEST_P(Inputs, AMotorWhoseWayIsBarredDoesNotHoldUpThoseThatStartWithIt) {
  for (const bool whole : {false, true}) {
    const auto on = with({.limit_positive = 1});
    on->pins(kSwitch);
    on->pass();
    if (whole) {
      const bushd_table_run_entry both[] = {{0, 0, 1, 20, 0}, {1, 0, 1, 20, 0}};
      const Bytes payload = payload_of([&](std::uint8_t* to) {
        return bushd_encode_table_run(0, on->first_open(), both, 2, to);
      });
      ASSERT_EQ(on->take(BUSHD_MSG_TABLE_RUN, payload), BUSHD_OK);
    } else {
      Ticks ticks = ones(kStart, on->first_open(), 4);
      ticks.mask = 3;
      ticks.displacements.assign(8, one());
      ticks.delays = {64, 64};
      ASSERT_EQ(on->take(ticks), BUSHD_OK);
    }
    on->pass(3);
    EXPECT_EQ(on->poll().moving, 2);
    rest(*on);
    EXPECT_EQ(on->pulses(0), 0);
    EXPECT_GE(on->pulses(1), 4);
  }
}

TEST_P(Inputs, OneThatHasOverrunItsSwitchStillMayNotGoOn) {
  const auto on = with({.limit_positive = 1});
  ASSERT_EQ(start(*on, 50), BUSHD_OK);
  on->pass(20);
  on->pins(kSwitch);
  on->pass(2);
  on->pins(kNothing);
  rest(*on);
  EXPECT_EQ(on->poll().forbidden_positive, 1);
  EXPECT_EQ(start(*on, 5), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(start(*on, -2), BUSHD_OK);
  rest(*on);
  EXPECT_EQ(on->poll().forbidden_positive, 0);
}

TEST_P(Inputs, AStartThatWaitsIsGivenUpWhenItsWayIsBarred) {
  for (const bool whole : {false, true}) {
    const auto on = with({.limit_positive = 1});
    if (whole) {
      ASSERT_EQ(on->take(BUSHD_MSG_TABLE_RUN, table_run(on->first_open() + 10, 5, 1)), BUSHD_OK);
    } else {
      ASSERT_EQ(start(*on, 5, 10), BUSHD_OK);
    }
    on->pass(3);
    on->pins(kSwitch);
    rest(*on);
    EXPECT_EQ(on->pulses(0), 0);
    EXPECT_EQ(on->poll().faults, 0);
  }
}

// A stream that turns, as a new target's does: the switch closes while it moves away.
TEST_P(Inputs, AStreamThatTurnsTowardsAClosedSwitchStopsWhereItTurns) {
  const auto on = with({.limit_positive = 1});
  Ticks ticks = ones(kStart, on->first_open(), 8);
  ticks.displacements = {two_back(), two_back(), two_back(), two_back(),
                         one(),      one(),      one(),      one()};
  ASSERT_EQ(on->take(ticks), BUSHD_OK);
  on->pass(3);
  on->pins(kSwitch);
  rest(*on);
  EXPECT_EQ(on->pulses(0), -8);
  EXPECT_EQ(on->poll().forbidden_positive, 1);
}

TEST_P(Inputs, OneSwitchForBothEndsForbidsTheDirectionInWhichItWasMet) {
  for (const int sign : {1, -1}) {
    const auto on = with({.limit_positive = 1, .limit_negative = 1});
    ASSERT_EQ(start(*on, 50 * sign), BUSHD_OK);
    on->pass(20);
    on->pins(kSwitch);
    rest(*on);
    EXPECT_EQ(on->poll().forbidden_positive, sign > 0);
    EXPECT_EQ(on->poll().forbidden_negative, sign < 0);
    EXPECT_EQ(start(*on, 5 * sign), BUSHD_E_FORBIDDEN);
    ASSERT_EQ(start(*on, -20 * sign), BUSHD_OK);
    on->pass(5);
    on->pins(kNothing);
    rest(*on);
    EXPECT_EQ(on->poll().forbidden_positive | on->poll().forbidden_negative, 0);
  }
}

TEST_P(Inputs, OtherMotorsAndOtherInputsGoTheirWay) {
  const auto on = with({.limit_positive = 1});
  ASSERT_EQ(on->start(law, 40, 1), BUSHD_OK);
  ASSERT_EQ(start(*on, 40), BUSHD_OK);
  on->pins({0xFFFE, 0xFF});
  on->pass(20);
  on->pins({0xFFFF, 0xFF});
  rest(*on);
  EXPECT_LT(on->pulses(0), 40);
  EXPECT_EQ(on->pulses(1), 40);
}

TEST_P(Inputs, AnInvertedSwitchIsActiveWhenItsPinIsNot) {
  const auto on = with({.limit_positive = 1, .inverted = 1});
  EXPECT_EQ(on->poll().inputs, 1);
  EXPECT_EQ(on->poll().forbidden_positive, 1) << "from the first tick on";
  EXPECT_EQ(start(*on, 5), BUSHD_E_FORBIDDEN);
  on->pins(kSwitch);
  on->pass(2);
  EXPECT_EQ(on->poll().inputs, 0);
  EXPECT_EQ(start(*on, 5), BUSHD_OK);
  rest(*on);
  EXPECT_EQ(on->pulses(0), 5);
}

TEST_P(Inputs, ASwitchCountsOnceItHasStayedForTheDebounceTicks) {
  for (const int ticks : {0, 1, 2, 7, 15}) {
    SCOPED_TRACE(ticks);
    const auto on = with({.limit_positive = 3, .debounce_ticks = static_cast<std::uint8_t>(ticks)});
    for (int bounce = 0; bounce < 3; ++bounce) {
      on->pins(kSwitch);
      on->pass(ticks);
      EXPECT_EQ(on->poll().forbidden_positive, 0) << "not long enough";
      on->pins(kNothing);
      on->pass();
    }
    on->pins(kSwitch);
    on->pass(ticks);
    on->pins({3, 0});  // another motor's counts by itself
    on->pass();
    EXPECT_EQ(on->poll().forbidden_positive, ticks == 0 ? 3 : 1);
    on->pins({2, 0});
    on->pass(ticks);
    EXPECT_EQ(on->poll().forbidden_positive, 3);
    on->pass();
    EXPECT_EQ(on->poll().forbidden_positive, 2);
  }
}

TEST_P(Inputs, SettingsAreForMotorsAtRest) {
  ASSERT_EQ(start(rig, 5), BUSHD_OK);
  EXPECT_EQ(rig.set_inputs({}), BUSHD_E_STATE);
  rest(rig);
  EXPECT_EQ(rig.set_inputs({}), BUSHD_OK);
}

// Whatever switches do, steps are counted, and none is begun from rest into an active limit.
TEST_P(Inputs, NoStepIsLostHoweverSwitchesBounce) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto below = [&random](unsigned n) { return static_cast<int>(random() % n); };
    const auto on = with({.limit_positive = static_cast<std::uint16_t>(1 + below(3)),
                          .limit_negative = static_cast<std::uint16_t>(below(4)),
                          .limit_immediate = static_cast<std::uint16_t>(below(4)),
                          .debounce_ticks = static_cast<std::uint8_t>(below(3))});
    for (int move = 0; move < 12; ++move) {
      const int steps = below(80) - 40;
      if (steps != 0) below(2) != 0 ? start(*on, steps) : start_run(*on, steps);
      for (int i = below(60); i > 0; --i) {
        if (below(4) == 0) on->pins({static_cast<std::uint16_t>(below(4)), 0});
        const bushd_report before = on->poll();
        on->pass();
        const bushd_report after = on->poll();
        ASSERT_EQ(after.motor[0].position_steps, on->pulses(0));
        const int made = after.motor[0].position_steps - before.motor[0].position_steps;
        ASSERT_FALSE((before.moving & 1) == 0 && made != 0);
      }
      if (below(3) == 0) rest(*on);
    }
    rest(*on);
    EXPECT_EQ(on->poll().faults, 0);
  }
}

class SystemInputs : public Inputs {};
BUSHD_IN_BOTH_FORMATS(SystemInputs);

TEST_P(SystemInputs, TheEmergencyInputStopsAllMotorsAsEmergencyDoes) {
  for (const bushd_stop_mode mode : {BUSHD_STOP_RAMP, BUSHD_STOP_IMMEDIATE, BUSHD_STOP_DISABLE}) {
    for (const std::uint8_t rests_at : {std::uint8_t{0}, std::uint8_t{1}}) {
      const auto stopped =
          with({.system_inverted = rests_at, .emergency = static_cast<std::uint8_t>(mode + 1)});
      const auto twin = with({});
      stopped->pins({0, rests_at});
      stopped->control(BUSHD_CONTROL_CLEAR_FAULTS);
      stopped->control(BUSHD_CONTROL_ENABLE);
      for (Rig* on : {stopped.get(), twin.get()}) {
        ASSERT_EQ(start(*on, 50), BUSHD_OK);
        ASSERT_EQ(on->start(law, -50, 2), BUSHD_OK);
        on->pass(25);
      }
      stopped->pins({0, static_cast<std::uint8_t>(1 - rests_at)});
      twin->emergency(mode);
      for (Rig* on : {stopped.get(), twin.get()}) on->pass(60);
      EXPECT_EQ(stopped->history(0), twin->history(0));
      EXPECT_EQ(stopped->history(2), twin->history(2));
      const bushd_report report = stopped->poll();
      const int disabled = mode == BUSHD_STOP_DISABLE ? int{BUSHD_FAULT_DISABLED} : 0;
      EXPECT_EQ(report.faults, BUSHD_FAULT_EMERGENCY_INPUT | disabled);
      EXPECT_EQ(report.state, BUSHD_STATE_FAULT);
      EXPECT_EQ(report.motor[2].position_steps, stopped->pulses(2));
      EXPECT_EQ(start(*stopped, 5), BUSHD_E_STATE);
    }
  }
}

TEST_P(SystemInputs, TheEmergencyInputIsLatchedAndClearedWhenItIsReleased) {
  const auto on = with({.emergency = BUSHD_EMERGENCY_INPUT_RAMP});
  on->pins({0, BUSHD_INPUT_EMERGENCY});
  on->pass();
  EXPECT_EQ(on->poll().system_inputs, BUSHD_INPUT_EMERGENCY);
  EXPECT_EQ(on->control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT) << "it is still pressed";
  on->pins(kNothing);
  on->pass(3);
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT);
  EXPECT_EQ(on->control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(on->poll().faults, 0);
  EXPECT_EQ(start(*on, 5), BUSHD_OK);
  rest(*on);
  EXPECT_EQ(on->pulses(0), 5);
}

TEST_P(SystemInputs, TheEmergencyInputIsClearedOnlyByItsName) {
  const auto on = with({.emergency = BUSHD_EMERGENCY_INPUT_RAMP});
  on->emergency(BUSHD_STOP_RAMP);
  on->pins({0, BUSHD_INPUT_EMERGENCY});
  on->pass();
  on->pins(kNothing);
  on->pass();
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT);
  EXPECT_EQ(on->clear(BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_LINK), BUSHD_OK);
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT);
  EXPECT_EQ(start(*on, 5), BUSHD_E_STATE);
  EXPECT_EQ(on->clear(BUSHD_FAULT_EMERGENCY_INPUT), BUSHD_OK);
  EXPECT_EQ(on->poll().faults, 0);
}

TEST_P(SystemInputs, TheEmergencyInputDoesNothingUnlessItIsToldTo) {
  const auto on = with({});
  ASSERT_EQ(start(*on, 50), BUSHD_OK);
  on->pass(20);
  on->pins({0, BUSHD_INPUT_EMERGENCY});
  rest(*on);
  EXPECT_EQ(on->pulses(0), 50);
}

TEST_P(SystemInputs, OvercurrentTakesEnAwayUntilItIsClearedAndGone) {
  const auto on = with({.overcurrent = 600});
  on->current(600);
  ASSERT_EQ(start(*on, 50), BUSHD_OK);
  on->pass(25);
  EXPECT_TRUE(on->enabled());
  on->current(601);
  on->pass();
  EXPECT_FALSE(on->enabled());
  const std::size_t prepared = on->history(0).size() + 1;
  rest(*on);
  for (std::size_t i = prepared; i < on->history(0).size(); ++i) EXPECT_EQ(on->history(0)[i], 0);
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_OVERCURRENT);
  EXPECT_EQ(on->poll().current, 601);
  EXPECT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_E_STATE);
  EXPECT_EQ(on->control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_OVERCURRENT) << "it still flows";
  on->current(20);
  EXPECT_EQ(on->control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(on->poll().state, BUSHD_STATE_BUSY) << "drivers stay off until they are wanted";
  EXPECT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(on->poll().state, BUSHD_STATE_READY);
}

TEST(EnableAfterWatchdog, IsKeptWhileDriversAreOnAndAskedFor) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  EXPECT_FALSE(rig.enable_kept());
  EXPECT_EQ(rig.set_inputs({.enable_after_watchdog = true}), BUSHD_OK);
  EXPECT_TRUE(rig.enable_kept());
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_FALSE(rig.enable_kept());
  EXPECT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_TRUE(rig.enable_kept());
}

TEST(EnableAfterWatchdog, RaisesEnAtBootUnlessTheSelfTestFailed) {
  Rig good({.reset_cause = BUSHD_RESET_WATCHDOG, .enable_at_boot = true});
  EXPECT_TRUE(good.enabled());
  EXPECT_EQ(good.poll().flags, BUSHD_FLAG_ENABLED);
  EXPECT_EQ(good.poll().state, BUSHD_STATE_BUSY) << "it takes no moves yet";
  EXPECT_TRUE(good.enable_kept()) << "there may be another reset before a master comes";
  Rig bad({.failing_tests = BUSHD_TEST_RAM, .enable_at_boot = true});
  EXPECT_FALSE(bad.enabled());
}

}  // namespace
}  // namespace bushd::test
