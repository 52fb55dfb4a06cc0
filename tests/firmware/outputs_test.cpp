// Levels at which drivers do what they are to do: what the port is told of them, and when they may
// change.
#include "firmware/rig.h"

namespace bushd::test {
namespace {

constexpr bushd_set_outputs kLow = {
    .step_low = 0x0001, .direction_low = 0x0001, .enabled = BUSHD_ENABLED_LOW};

void step_forward(Rig& rig) {
  ASSERT_EQ(rig.take({.flags = BUSHD_TICKS_START,
                      .first = rig.first_open(),
                      .displacements = {0x81},
                      .delays = {0}}),
            BUSHD_OK);
}

// DIR in the tick in which motor 0 makes its step.
bool direction_of_step(Rig& rig) {
  while (rig.slot_buffer().active == 0) rig.pass(1);
  return (rig.slot_buffer().direction & 1) != 0;
}

TEST(Outputs, AreNotDrivenBeforeSomebodyHasToldTheirLevels) {
  Rig rig;
  EXPECT_EQ(rig.levels().enabled, 0);
  EXPECT_EQ(rig.outputs(kLow), BUSHD_E_STATE) << "before CONFIGURE";
  ASSERT_EQ(rig.configure(BUSHD_FORMAT_COARSE), BUSHD_OK);
  EXPECT_EQ(rig.levels().enabled, 0);
  ASSERT_EQ(rig.outputs(kLow), BUSHD_OK);
  EXPECT_EQ(rig.levels().enabled, BUSHD_ENABLED_LOW);
  EXPECT_EQ(rig.levels().step_low, 1);
  EXPECT_FALSE(rig.enabled());
}

TEST(Outputs, OfAMasterThatTellsNoneAreActiveHigh) {
  Rig rig;
  ASSERT_EQ(rig.configure(BUSHD_FORMAT_COARSE), BUSHD_OK);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(rig.levels().enabled, BUSHD_ENABLED_HIGH);
  EXPECT_EQ(rig.levels().step_low, 0);
}

TEST(Outputs, ChangeDisablesTheDriversFirst) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE);
  ASSERT_TRUE(rig.enabled());
  ASSERT_EQ(rig.outputs(kLow), BUSHD_OK);
  EXPECT_FALSE(rig.enabled());
  ASSERT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  ASSERT_EQ(rig.outputs(kLow), BUSHD_OK);
  EXPECT_TRUE(rig.enabled()) << "the same levels change nothing";
}

TEST(Outputs, DoNotChangeWhileAMotorMoves) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE);
  step_forward(rig);
  EXPECT_EQ(rig.outputs(kLow), BUSHD_E_STATE);
  EXPECT_EQ(rig.levels().enabled, BUSHD_ENABLED_HIGH);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 1);
  EXPECT_EQ(rig.outputs(kLow), BUSHD_OK);
}

TEST(Outputs, DirIsLowInThePositiveDirectionIfTheySaySo) {
  for (const bool low : {false, true}) {
    ReadyRig rig(ramp_law(), BUSHD_FORMAT_COARSE);
    if (low) {
      ASSERT_EQ(rig.outputs(kLow), BUSHD_OK);
      ASSERT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
    }
    step_forward(rig);
    EXPECT_EQ(direction_of_step(rig), !low);
    rig.pass_until_rest();
    EXPECT_EQ(rig.mcu().motor[0].position_steps, 1);
  }
}

TEST(Outputs, WindingsAreNotTurnedRound) {
  bushd_emission phases{};
  phases.mode = BUSHD_EMISSION_PHASES;
  Rig rig;
  ASSERT_EQ(rig.configure(BUSHD_FORMAT_COARSE), BUSHD_OK);
  ASSERT_EQ(rig.emission(phases), BUSHD_OK);
  EXPECT_EQ(rig.outputs(kLow), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.outputs({.step_low = 0, .direction_low = 0, .enabled = BUSHD_ENABLED_LOW}),
            BUSHD_OK);
  Rig other;
  ASSERT_EQ(other.configure(BUSHD_FORMAT_COARSE), BUSHD_OK);
  ASSERT_EQ(other.outputs(kLow), BUSHD_OK);
  EXPECT_EQ(other.emission(phases), BUSHD_E_FORMAT);
}

TEST(Outputs, AreKeptOverResets) {
  Rig rig;
  ASSERT_EQ(rig.configure(BUSHD_FORMAT_COARSE), BUSHD_OK);
  ASSERT_EQ(rig.outputs(kLow), BUSHD_OK);
  rig.restart_with_nvm();
  EXPECT_EQ(rig.levels().enabled, BUSHD_ENABLED_LOW);
  EXPECT_EQ(rig.levels().direction_low, 1);
  EXPECT_FALSE(rig.enabled());
}

}  // namespace
}  // namespace bushd::test
