// From reset to READY: what an MCU does before it was told anything, and in which states it moves.
#include <algorithm>

#include "firmware/rig.h"

namespace bushd::test {
namespace {

TEST(Boot, BusyWithDriversOffUntilConfiguredSyncedAndEnabled) {
  Rig rig;
  rig.pins({0x1234, BUSHD_INPUT_TRIGGER});
  rig.current(700);
  EXPECT_FALSE(rig.enabled());
  EXPECT_GE(rig.enable_calls(), 1) << "the port is told, not left as reset had it";
  EXPECT_EQ(rig.port_tick_ns(), BUSHD_BOOT_TICK_NS);
  bushd_report report = rig.poll();
  EXPECT_EQ(report.state, BUSHD_STATE_BUSY);
  EXPECT_EQ(report.flags, 0);
  EXPECT_EQ(report.faults, 0);
  EXPECT_EQ(report.epoch, 0);
  EXPECT_EQ(report.moving, 0);
  EXPECT_EQ(report.inputs, 0x1234);
  EXPECT_EQ(report.system_inputs, BUSHD_INPUT_TRIGGER);
  EXPECT_EQ(report.forbidden_positive | report.forbidden_negative, 0);
  EXPECT_EQ(report.current, 700);
  EXPECT_EQ(report.reset_cause, BUSHD_RESET_POWER_ON);
  EXPECT_EQ(report.failed_tests, 0);
  EXPECT_EQ(report.boot_number, 77);
  EXPECT_EQ(report.motor_count, rig.options().motors);
  for (unsigned m = 0; m < report.motor_count; ++m) EXPECT_EQ(report.motor[m].position_steps, 0);

  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE, 1'000'000), BUSHD_OK);
  EXPECT_EQ(rig.port_tick_ns(), 1'000'000u);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_BUSY);
  rig.sync_to(5000);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_BUSY);
  EXPECT_FALSE(rig.enabled());
  EXPECT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_TRUE(rig.enabled());
  report = rig.poll();
  EXPECT_EQ(report.state, BUSHD_STATE_READY);
  EXPECT_EQ(report.flags & 7, BUSHD_FLAG_ENABLED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_CONFIGURED);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_FALSE(rig.enabled());
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_BUSY);
}

TEST(Boot, IdentitySaysWhatThePortGave) {
  Rig rig({.motors = 16, .slots = 200, .queue_ticks = 32, .code_count = 900});
  const bushd_identity identity = rig.identify();
  EXPECT_EQ(identity.protocol_version, BUSHD_PROTOCOL_VERSION);
  EXPECT_EQ(identity.motors, 16);
  EXPECT_EQ(identity.slots, 200);
  EXPECT_EQ(identity.queue_ticks, 32);
  EXPECT_EQ(identity.table_codes, 900);
  EXPECT_EQ(identity.boot_number, 77);
  EXPECT_EQ(identity.capabilities,
            BUSHD_CAN_COARSE | BUSHD_CAN_FINE | BUSHD_CAN_TABLE_TICKS | BUSHD_CAN_TABLE_RUN |
                BUSHD_CAN_LINE_RUN | BUSHD_CAN_HOME | BUSHD_CAN_LOCAL | BUSHD_CAN_TRIGGER |
                BUSHD_CAN_POSITION_COMPARE | BUSHD_CAN_BURST | BUSHD_CAN_COMMON_DIR |
                BUSHD_CAN_STAGGERED | BUSHD_CAN_PHASES | BUSHD_CAN_MOTOR_INPUTS | BUSHD_CAN_TRAVEL |
                BUSHD_CAN_CURRENTS | BUSHD_CAN_VELOCITY | BUSHD_CAN_KEYPAD | BUSHD_CAN_SCRATCH |
                BUSHD_CAN_CLEAR_NAMED | BUSHD_CAN_OUTPUTS | BUSHD_CAN_SLOW_RUNS |
                BUSHD_CAN_PROGRAM | BUSHD_CAN_ELEMENTARY | BUSHD_CAN_DISABLE);
  EXPECT_TRUE(std::ranges::equal(identity.unique_id, Rig::unique_id()));
}

TEST(Boot, FailedSelfTestNeverRaisesEn) {
  Rig rig({.failing_tests = BUSHD_TEST_RAM});
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_FAULT);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_SELF_TEST);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE), BUSHD_OK);
  rig.sync_to(100);
  EXPECT_EQ(rig.upload(0, ramp_law()), BUSHD_OK);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_OK);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_ENABLE), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_SELF_TEST) << "only a reboot clears it";
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_FAULT);
  EXPECT_FALSE(rig.enabled());
  EXPECT_EQ(rig.start(ramp_law(), 3), BUSHD_E_STATE);
}

TEST(Boot, WithoutWhatItKeepsAnMcuMovesOnceThatIsKnown) {
  Rig rig({.failing_tests = BUSHD_TEST_EEPROM});
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_EEPROM);
  EXPECT_EQ(rig.poll().failed_tests, BUSHD_TEST_EEPROM);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE), BUSHD_OK);
  rig.sync_to(100);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_FAULT);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
}

TEST(Boot, TellsWhyItBooted) {
  Rig rig({.reset_cause = BUSHD_RESET_BROWN_OUT});
  EXPECT_EQ(rig.poll().reset_cause, BUSHD_RESET_BROWN_OUT);
}

TEST(Boot, ConfigureAgainKeepsAllAndAnotherTickBeginsAnew) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE), BUSHD_OK);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY) << "the same again changes nothing";
  EXPECT_EQ(rig.start(ramp_law(), 3), BUSHD_OK);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_COARSE), BUSHD_E_STATE) << "a motor moves";
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE, 3'000'000), BUSHD_E_STATE);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 3);

  EXPECT_EQ(rig.configure(BUSHD_FORMAT_COARSE), BUSHD_OK);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_BUSY) << "out of step with the bus";
  rig.sync_to(40);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
  const Plan coarse = plan_move(ramp_law(), 3, Rig::kTickNs, BUSHD_FORMAT_COARSE);
  EXPECT_EQ(rig.take(rig.part(coarse, rig.first_open(), 0, 100)), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_OK) << "the tables themselves stay";
  rig.run_plan(coarse, 0);
  EXPECT_EQ(rig.pulses(0), 6);
  EXPECT_EQ(rig.poll().motor[0].position_steps, 6);
}

TEST(Boot, DisableAndClearAreRefusedInMotion) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  const Plan plan = plan_move(ramp_law(), 5, Rig::kTickNs, BUSHD_FORMAT_FINE);
  ASSERT_EQ(rig.take(rig.part(plan, rig.first_open() + 20, 0, 100, 2)), BUSHD_OK);
  EXPECT_EQ(rig.poll().moving, 1 << 2) << "a queued motor moves, though not yet";
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_RUN);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(rig.set_position(2, 9), BUSHD_E_STATE);
  EXPECT_EQ(rig.set_position(1, 9), BUSHD_OK) << "that one rests";
  rig.pass_until_rest();
  EXPECT_EQ(rig.set_position(2, -100), BUSHD_OK);
  EXPECT_EQ(rig.poll().motor[2].position_steps, -100);
  EXPECT_EQ(rig.poll().motor[1].position_steps, 9);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
}

// Between two reports and two ticks: the state that counts is that of now.
TEST(Boot, TicksRightAfterDisableAreRefused) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  const Plan plan = plan_move(ramp_law(), 5, Rig::kTickNs, BUSHD_FORMAT_FINE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  rig.frame(BUSHD_MSG_TICKS, rig.encode(rig.part(plan, rig.first_open(), 0, 100)));
  rig.pass(60);
  EXPECT_EQ(rig.pulses(0), 0);
  EXPECT_EQ(rig.poll().motor[0].position_steps, 0) << "no steps without power";
  EXPECT_EQ(rig.poll().last_rejection, BUSHD_E_STATE);
}

TEST(Boot, TicksRightAfterEnableAreTaken) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_BUSY);
  const Plan plan = plan_move(ramp_law(), 5, Rig::kTickNs, BUSHD_FORMAT_FINE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  rig.frame(BUSHD_MSG_TICKS, rig.encode(rig.part(plan, rig.first_open(), 0, 100)));
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 5);
}

TEST(Boot, ValuesOutOfRangeAreRefused) {
  Rig rig;
  EXPECT_EQ(rig.request(BUSHD_MSG_CONFIGURE, {0, 0, 0, 0, 1, 9, 0}), BUSHD_E_FORMAT)
      << "tick of 0 ns";
  EXPECT_EQ(rig.request(BUSHD_MSG_CONFIGURE, {0, 0, 0x27, 0, 2, 9, 0}), BUSHD_E_FORMAT)
      << "format 2";
  EXPECT_EQ(rig.request(BUSHD_MSG_CONFIGURE, {0, 0, 0x27, 0}), BUSHD_E_LENGTH);
  EXPECT_EQ(rig.request(BUSHD_MSG_CONTROL, {3}), BUSHD_E_FORMAT) << "enable and disable";
  EXPECT_EQ(rig.request(BUSHD_MSG_CONTROL, {16}), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.request(BUSHD_MSG_CONTROL, {}), BUSHD_E_LENGTH);
  EXPECT_EQ(rig.request(BUSHD_MSG_CONTROL, {BUSHD_CONTROL_CLEAR_FAULTS, 0}), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.set_position(4, 0), BUSHD_E_FORMAT) << "four motors: 0..3";
  EXPECT_EQ(rig.request(0x11, {}), BUSHD_E_LENGTH);
  EXPECT_EQ(rig.request(0x7F, {1, 2, 3}), BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(rig.poll().rejected_frames, 10);
  EXPECT_EQ(rig.poll().flags, 0) << "nothing of it had an effect";
}

}  // namespace
}  // namespace bushd::test
