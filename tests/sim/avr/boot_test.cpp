// How the image for ATmega2560 begins: what it tests before it lets a motor move, and what begins
// it again when it hangs.
#include "sim/avr/avr_fixture.h"

namespace bushd::sim::boot_test {
namespace {

class AvrBoot : public AvrAlone {};
// Its power is on when the test says so: the chip has its fault by then.
class AvrPowerOn : public AvrAlone {
 protected:
  void SetUp() override {}
};

TEST_F(AvrBoot, FindsNoFaultInAGoodChip) {
  EXPECT_EQ(master_.poll(kAddress).faults, 0);
}

TEST_F(AvrBoot, ABitOfTheProgramThatHasFlippedKeepsMotorsOff) {
  // Vectors of interrupts that it does not use: it works all the same.
  for (const std::uint32_t address : {0x06u, 0xE2u}) {
    avr_->flip_flash_bit(address, 5);
    reboot();
    const bushd_report report = master_.poll(kAddress);
    EXPECT_EQ(report.faults, BUSHD_FAULT_SELF_TEST) << address;
    EXPECT_EQ(report.failed_tests, BUSHD_TEST_FLASH);
    EXPECT_EQ(master_.acknowledged(kAddress, bushd_control{BUSHD_CONTROL_ENABLE, 0}),
              BUSHD_E_STATE);
    avr_->flip_flash_bit(address, 5);
  }
  reboot();
  EXPECT_EQ(master_.poll(kAddress).faults, 0);
}

// In the queue, where the MCU works all the same.
TEST_F(AvrPowerOn, ABitOfRamThatIsStuckKeepsMotorsOff) {
  avr_->stick_ram_bit(0x900, 3);
  pass(kBootNs);
  EXPECT_EQ(master_.poll(kAddress).failed_tests, BUSHD_TEST_RAM);
}

TEST_F(AvrPowerOn, AnInputThatIsShortedToTheSupplyKeepsMotorsOff) {
  avr_->short_motor_input(5);
  pass(kBootNs);
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.faults, BUSHD_FAULT_SELF_TEST);
  EXPECT_EQ(report.failed_tests, BUSHD_TEST_INPUTS);
}

// A motor may stand on its switch.
TEST_F(AvrPowerOn, AnInputThatIsActiveIsNoFault) {
  avr_->set_inputs({0xFFFF, BUSHD_SYSTEM_INPUTS});
  pass(kBootNs);
  EXPECT_EQ(master_.poll(kAddress).faults, 0);
}

TEST_F(AvrBoot, TellsWhyItBooted) {
  EXPECT_EQ(master_.poll(kAddress).reset_cause, BUSHD_RESET_POWER_ON);
  reboot();
  EXPECT_EQ(master_.poll(kAddress).reset_cause, BUSHD_RESET_EXTERNAL);
}

struct Hang {
  const char* name;
  void (AvrMcu::*begin)();
};

class AvrWatchdog : public AvrAlone, public testing::WithParamInterface<Hang> {};
INSTANTIATE_TEST_SUITE_P(Hangs, AvrWatchdog,
                         testing::Values(Hang{"MainLoop", &AvrMcu::hang},
                                         Hang{"TickTimer", &AvrMcu::stop_ticks}),
                         [](auto& hang) { return hang.param.name; });

TEST_P(AvrWatchdog, BootsAnMcuThatHangsInMotionAnew) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  run(3, 10'000);
  pass(100 * TimeNs{kTickNs});
  const bushd_report before = master_.poll(kAddress);
  ASSERT_EQ(before.state, BUSHD_STATE_RUN);
  ASSERT_EQ(recorder_.times(0, Signal::kEnable, 0, false).size(), 0u);

  (avr_->*GetParam().begin)();
  const TimeNs hung_ns = bus_.now_ns();
  pass(300'000'000 + kBootNs);
  const auto disabled = recorder_.times(0, Signal::kEnable, 0, false);
  ASSERT_EQ(disabled.size(), 1u);
  EXPECT_LT(disabled[0] - hung_ns, 150'000'000);
  const std::size_t made = steps_made(3);
  pass(100 * TimeNs{kTickNs});
  EXPECT_EQ(steps_made(3), made);

  const bushd_report after = master_.poll(kAddress);
  EXPECT_EQ(after.boot_number, before.boot_number + 1);
  EXPECT_EQ(after.reset_cause, BUSHD_RESET_WATCHDOG);
  EXPECT_EQ(after.state, BUSHD_STATE_BUSY);
  EXPECT_EQ(after.faults, 0);
  ASSERT_NO_FATAL_FAILURE(make_ready());
  run(3, 50);
  pass(200 * TimeNs{kTickNs});
  EXPECT_EQ(steps_made(3), made + 50);
  EXPECT_EQ(master_.poll(kAddress).motor[3].position_steps, 50);
}

// The work of a stop must not grow with what is left of the run.
TEST_F(AvrBoot, TheWatchdogLeavesAnEmergencyStopOfALongRunAlone) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  run(3, 1'000'000);
  pass(100 * TimeNs{kTickNs});
  const bushd_report before = master_.poll(kAddress);
  ASSERT_EQ(before.running, 1 << 3);
  master_.send(kAddress, BUSHD_MSG_EMERGENCY, Bytes{BUSHD_STOP_IMMEDIATE});
  pass(10 * TimeNs{kTickNs});
  const bushd_report after = master_.poll(kAddress);
  EXPECT_EQ(after.boot_number, before.boot_number);
  EXPECT_EQ(after.moving, 0);
  EXPECT_EQ(after.motor[3].position_steps, static_cast<std::int32_t>(steps_made(3)));
}

// No request comes, for longer than the watchdog waits; nothing moves.
TEST_F(AvrBoot, TheWatchdogLeavesAnIdleMcuAlone) {
  const std::uint16_t boot_number = master_.poll(kAddress).boot_number;
  pass(2'000'000'000);
  EXPECT_EQ(master_.poll(kAddress).boot_number, boot_number);
}

}  // namespace
}  // namespace bushd::sim::boot_test
