#include <functional>

#include "firmware/rig.h"

namespace bushd::test {
namespace {

bushd_emission burst(std::uint16_t step_us) {
  bushd_emission settings{};
  settings.mode = BUSHD_EMISSION_BURST;
  settings.step_us = step_us;
  return settings;
}

bushd_emission of_mode(bushd_emission_mode mode) {
  bushd_emission settings = burst(100);
  settings.mode = mode;
  settings.sequence = BUSHD_PHASES_HALF;
  settings.settle_us = 30;
  return settings;
}

constexpr bushd_emission_mode kModes[] = {
    BUSHD_EMISSION_EVEN,      BUSHD_EMISSION_BURST,  BUSHD_EMISSION_COMMON_DIR,
    BUSHD_EMISSION_STAGGERED, BUSHD_EMISSION_PHASES, BUSHD_EMISSION_COMMON_STAGGERED};

// READY, with this emission.
void make_ready(Rig& rig, const bushd_emission& settings, bushd_format format) {
  rig.make_ready(ramp_law(), format);
  ASSERT_EQ(rig.emission(settings), BUSHD_OK);
  ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
}

TEST(Emission, IsRefusedBeforeConfigure) {
  Rig rig;
  EXPECT_EQ(rig.emission(burst(100)), BUSHD_E_STATE);
}

TEST(Emission, IsRefusedWhileAMotorMovesUnlessItIsTheSame) {
  Rig rig;
  make_ready(rig, burst(100), BUSHD_FORMAT_COARSE);
  EXPECT_EQ(rig.take({.flags = BUSHD_TICKS_START,
                      .first = rig.first_open(),
                      .count = 2,
                      .displacements = {0x81, 0x82},
                      .delays = {0}}),
            BUSHD_OK);
  EXPECT_EQ(rig.emission(burst(101)), BUSHD_E_STATE);
  EXPECT_EQ(rig.emission(burst(100)), BUSHD_OK);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 3);
  EXPECT_EQ(rig.emission(burst(101)), BUSHD_OK);
}

TEST(Emission, MotorsHaveNoTableAfterAnotherOne) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE);
  const Ticks ticks{.flags = BUSHD_TICKS_START,
                    .first = rig.first_open() + 5,
                    .displacements = {0x81},
                    .delays = {0}};
  EXPECT_EQ(rig.emission(of_mode(BUSHD_EMISSION_EVEN)), BUSHD_OK);
  EXPECT_EQ(rig.take(ticks), BUSHD_E_NO_TABLE);
}

TEST(Emission, AnotherTickMakesItEvenAgain) {
  Rig rig;
  make_ready(rig, burst(640), BUSHD_FORMAT_COARSE);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_COARSE, 2'000'000), BUSHD_OK);
  rig.sync_to(5000);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_OK);
  EXPECT_EQ(rig.take({.flags = BUSHD_TICKS_START,
                      .first = rig.first_open(),
                      .displacements = {0x85},
                      .delays = {0}}),
            BUSHD_OK)
      << "five steps would not find room at 640 us each";
}

TEST(Emission, TableThatIsTooFastForTheStepPeriodIsNotAssigned) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE);
  // Up to four steps in 2.56 ms at 0.8 ms a step.
  EXPECT_EQ(rig.emission(burst(640)), BUSHD_OK);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_OK);
  EXPECT_EQ(rig.emission(burst(641)), BUSHD_OK);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_E_CAPACITY);
}

TEST(Emission, TicksWithMoreStepsThanFindRoomAreRefused) {
  for (const bushd_format format : {BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE}) {
    Rig rig;
    make_ready(rig, burst(640), format);
    const bool fine = format == BUSHD_FORMAT_FINE;
    const auto with_steps = [&](int steps) {
      return Ticks{.flags = BUSHD_TICKS_START,
                   .first = rig.first_open(),
                   .displacements = {static_cast<std::int16_t>(fine ? -256 * steps : steps)},
                   .delays = {0}};
    };
    EXPECT_EQ(rig.take(with_steps(5)), BUSHD_E_FORMAT);
    EXPECT_EQ(rig.take(with_steps(4)), BUSHD_OK);
    rig.pass_until_rest();
    EXPECT_EQ(rig.pulses(0), -4);
    EXPECT_EQ(rig.poll().motor[0].position_steps, -4);
  }
}

TEST(Emission, SettingsThatSlotsCannotKeepAreRefusedWithTheirStatus) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE);
  bushd_emission settings{};
  settings.pulse_us = 5;  // half a slot is 5 us, of a shortened tick 4.9
  EXPECT_EQ(rig.emission(settings), BUSHD_E_PULSE_WIDTH);
  settings = {};
  settings.dir_setup_us = 2600;
  EXPECT_EQ(rig.emission(settings), BUSHD_E_DIR_SETUP);
  EXPECT_EQ(rig.emission(burst(2561)), BUSHD_E_STEP_PERIOD);
  EXPECT_EQ(rig.take({.flags = BUSHD_TICKS_START,
                      .first = rig.first_open(),
                      .displacements = {0x81},
                      .delays = {0}}),
            BUSHD_OK)
      << "what is refused changes nothing";
}

TEST(Emission, ModeThatThePortDoesNotSupportIsRefused) {
  Rig rig({.disabled_capabilities = BUSHD_CAN_PHASES});
  EXPECT_EQ(rig.identify().capabilities & BUSHD_CAN_PHASES, 0);
  rig.make_ready(ramp_law(), BUSHD_FORMAT_COARSE);
  EXPECT_EQ(rig.emission(of_mode(BUSHD_EMISSION_PHASES)), BUSHD_E_FORMAT);
}

TEST(Emission, StaggeredStepsWithACommonDirNeedBothCapabilities) {
  for (const std::uint32_t denied : {BUSHD_CAN_COMMON_DIR, BUSHD_CAN_STAGGERED}) {
    ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE, {.disabled_capabilities = denied});
    EXPECT_EQ(rig.emission(of_mode(BUSHD_EMISSION_COMMON_STAGGERED)), BUSHD_E_FORMAT) << denied;
  }
}

TEST(Emission, PulsesAreRefusedThatThePortDoesNotMake) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE, {.pulse_ns = 3'500});
  bushd_emission settings{};
  settings.pulse_us = 3;
  EXPECT_EQ(rig.emission(settings), BUSHD_OK);
  settings.pulse_us = 4;
  EXPECT_EQ(rig.emission(settings), BUSHD_E_PULSE_WIDTH);
}

TEST(Emission, PulsesAreRefusedThatThePortMayMakeTooShort) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE, {.slots = 128, .pulse_ns = -3'000});
  // A tick may be shortened to follow the bus.
  const std::uint32_t half_slot_ns = (Rig::kTickNs - Rig::kTickNs / 64) / 256;
  bushd_emission settings{};
  settings.pulse_us = static_cast<std::uint8_t>((half_slot_ns - 3'000) / 1000);
  ASSERT_GT(settings.pulse_us, 0);
  EXPECT_EQ(rig.emission(settings), BUSHD_OK);
  ++settings.pulse_us;
  EXPECT_EQ(rig.emission(settings), BUSHD_E_PULSE_WIDTH);
  settings.pulse_us = 0;
  EXPECT_EQ(rig.emission(settings), BUSHD_OK) << "no matter how long";
}

TEST(Emission, NoLengthOfPulsesIsKeptWhereTheyMayBeginAsLateAsTheyEnd) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE, {.slots = 128, .pulse_ns = -1'000'000});
  bushd_emission settings{};
  settings.pulse_us = 1;
  EXPECT_EQ(rig.emission(settings), BUSHD_E_PULSE_WIDTH);
}

TEST(Emission, PhasesTakeFourOutputsAMotor) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE, {.motors = 11});
  EXPECT_EQ(rig.emission(of_mode(BUSHD_EMISSION_PHASES)), BUSHD_OK);
  EXPECT_EQ(rig.assign(1, 0), BUSHD_OK);
  EXPECT_EQ(rig.assign(2, 0), BUSHD_E_FORMAT);
}

// A rotor stands where the levels of its phase hold it: others would turn it, and no counter would
// tell.
TEST(Emission, WindingsKeepTheirLevelsThroughOtherSettings) {
  Rig rig;
  bushd_emission phases = of_mode(BUSHD_EMISSION_PHASES);
  phases.hold_current = true;
  make_ready(rig, phases, BUSHD_FORMAT_FINE);
  rig.run_plan(plan_move(ramp_law(), 3, Rig::kTickNs, BUSHD_FORMAT_FINE), 0);
  rig.pass(3);
  constexpr std::uint16_t kFourthOfHalf = 0x6;
  ASSERT_EQ(rig.slot_buffer().step[0], kFourthOfHalf);
  const auto expect_levels = [&](std::uint16_t levels) {
    ASSERT_EQ(rig.emission(phases), BUSHD_OK);
    rig.pass(60);  // windings that do not hold stay on for 0.1 s
    EXPECT_EQ(rig.slot_buffer().step[0], levels);
  };
  phases.hold_current = false;
  expect_levels(0);
  phases.hold_current = true;
  expect_levels(kFourthOfHalf);
  ASSERT_EQ(rig.configure(BUSHD_FORMAT_FINE, 2'000'000), BUSHD_OK);
  rig.pass(3);
  expect_levels(kFourthOfHalf);
  // Its steps are others: it begins with its first one.
  phases.sequence = BUSHD_PHASES_FULL;
  expect_levels(0x3);
}

// Ticks of a move, whoever makes them: as many steps in each as in even emission.
void expect_same_steps(bushd_format format, const std::function<void(Rig&)>& move) {
  std::vector<int> even;
  for (const bushd_emission_mode mode : kModes) {
    Rig rig;
    make_ready(rig, of_mode(mode), format);
    rig.forget_history();
    move(rig);
    if (mode == BUSHD_EMISSION_EVEN) even = rig.history(0);
    EXPECT_EQ(rig.history(0), even) << "mode " << mode;
    EXPECT_EQ(rig.poll().motor[0].position_steps, rig.pulses(0)) << "mode " << mode;
    EXPECT_NE(rig.pulses(0), 0);
  }
}

TEST(Emission, StreamsMakeTheSameStepsInEachTickInEveryMode) {
  for (const bushd_format format : {BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE}) {
    expect_same_steps(format, [&](Rig& rig) {
      rig.run_plan(plan_move(ramp_law(), 70, Rig::kTickNs, format), 0);
      rig.run_plan(plan_move(ramp_law(), -33, Rig::kTickNs, format), 0);
    });
  }
}

TEST(Emission, TableRunsMakeTheSameStepsInEachTickInEveryMode) {
  for (const bushd_format format : {BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE}) {
    expect_same_steps(format, [&](Rig& rig) {
      const bushd_table_run_entry entry = {
          .motor = 0, .bank = 0, .direction = -1, .steps = 90, .shortest_delay = 0};
      ASSERT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, table_run_payload(0, rig.first_open(), entry)),
                BUSHD_OK);
      rig.pass_until_rest();
    });
  }
}

TEST(Emission, RampDownsMakeTheSameStepsInEachTickInEveryMode) {
  for (const bushd_format format : {BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE}) {
    expect_same_steps(format, [&](Rig& rig) {
      const Plan plan = plan_move(ramp_law(), 200, Rig::kTickNs, format);
      ASSERT_EQ(rig.take(rig.part(plan, rig.first_open(), 0, 40)), BUSHD_OK);
      rig.pass_until_rest();
      EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
    });
  }
}

}  // namespace
}  // namespace bushd::test
