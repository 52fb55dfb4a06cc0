// What becomes of what the image for ATmega2560 keeps in its EEPROM when the power goes;
// tests/conformance has the rest.
#include "sim/avr/avr_fixture.h"
#include "sim/random.h"

namespace bushd::sim::nvm_test {
namespace {

class AvrNvm : public AvrAlone {};

TEST_F(AvrNvm, APowerCutLeavesAllOrAFault) {
  constexpr std::uint32_t kShortTickNs = 1'250'000;
  Random random(4, 0);
  int whole = 0;
  int broken = 0;
  std::uint32_t kept_crc = 0;
  for (std::uint16_t cut = 0; cut < 8; ++cut) {
    SCOPED_TRACE("cut " + std::to_string(cut));
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kShortTickNs, BUSHD_FORMAT_FINE));
    const auto first = static_cast<std::uint16_t>(1000 + cut);
    ASSERT_NO_FATAL_FAILURE(
        master_.upload_table(kAddress, 0, 10'000, falling_codes(first, 100), 800));
    const std::uint32_t sent_crc = master_.tables(kAddress).bank[0].crc;
    // Before, while or after its 200 bytes and the settings are written.
    pass(500'000'000 + static_cast<TimeNs>(random.below(1800)) * 1'000'000);
    reboot();
    const bushd_report report = master_.poll(kAddress);
    const bushd_tables found = master_.tables(kAddress);
    if (report.faults == 0 && found.bank[0].valid) {
      ++whole;
      EXPECT_TRUE(found.bank[0].crc == sent_crc || found.bank[0].crc == kept_crc);
      kept_crc = found.bank[0].crc;
    } else if (report.faults != 0) {
      ++broken;
      EXPECT_EQ(report.faults, BUSHD_FAULT_EEPROM);
      EXPECT_EQ(report.failed_tests, BUSHD_TEST_EEPROM);
      EXPECT_EQ(master_.valid_tables(kAddress), 0u);
      EXPECT_EQ(master_.acknowledged(kAddress, bushd_control{BUSHD_CONTROL_CLEAR_FAULTS, 0}),
                BUSHD_OK);
    } else {
      EXPECT_EQ(kept_crc, 0u) << "what was kept is gone";
    }
  }
  EXPECT_GE(whole, 2);
  EXPECT_GE(broken, 2);
}

// The byte that is being written holds anything then.
TEST_F(AvrNvm, APowerCutLosesNoIdAndLeavesTheOldAddressOrTheNewOne) {
  std::uint8_t address = kAddress;
  std::array<int, 2> found{};  // old, new
  for (std::uint64_t bytes = 0; bytes <= 12; ++bytes) {
    for (const bool torn : {false, true}) {
      SCOPED_TRACE("cut after " + std::to_string(bytes) + (torn ? " bytes and a half" : " bytes"));
      const auto other = static_cast<std::uint8_t>(address ^ 0x5A);
      const std::uint64_t before = avr_->eeprom_writes();
      master_.broadcast(bushd_set_address{{1}, other});
      for (int ms = 0; ms < 50 && avr_->eeprom_writes() < before + bytes; ++ms) pass(1'000'000);
      if (torn) avr_->tear_eeprom_byte();
      reboot();
      const bool is_new = avr_->address() == other;
      ++found[is_new];
      if (is_new) address = other;
      const auto identity = master_.identify(address);
      ASSERT_TRUE(identity);
      EXPECT_EQ(identity->unique_id[0], 1);
      EXPECT_EQ(master_.poll(address).faults, 0);
    }
  }
  EXPECT_GE(found[0], 5);
  EXPECT_GE(found[1], 5);
}

// What is kept becomes shorter behind the byte that is being compared or written.
TEST_F(AvrNvm, TablesThatAreForgottenMeanwhileLeaveTheRestAlone) {
  constexpr std::uint16_t kCodes = 100;
  constexpr std::uint64_t kBytesOfOthers = 300;  // more than all but the codes
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
  Random random(5, 0);
  for (int round = 0; round < 12; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const auto first = static_cast<std::uint16_t>(1000 + round);
    ASSERT_NO_FATAL_FAILURE(
        master_.upload_table(kAddress, 0, 10'000, falling_codes(first, kCodes), 800));
    if (round % 2 == 0) {
      // Compared: a walk takes some 300 ms, and is made for a second before anything is written.
      pass(static_cast<TimeNs>(random.below(1000)) * 1'000'000);
    } else {
      // Written: the codes come after all else but the motors' tables.
      const std::uint64_t before = avr_->eeprom_writes();
      const std::uint64_t written = kBytesOfOthers + random.below(kCodes);
      for (int ms = 0; ms < 3000 && avr_->eeprom_writes() < before + written; ++ms) pass(1'000'000);
    }
    ASSERT_EQ(master_.acknowledged(kAddress, bushd_control{BUSHD_CONTROL_FORGET_TABLES, 0}),
              BUSHD_OK);
    pass(1'000'000'000);
  }
  reboot();
  ASSERT_TRUE(master_.identify(kAddress));
  EXPECT_EQ(master_.poll(kAddress).faults, 0);
  EXPECT_EQ(avr_->boot_number(), 8);
}

// A cell of the EEPROM is good for 100000 writes (data sheet): drivers that are disabled at rest
// would wear one out within weeks.
TEST_F(AvrNvm, DriversThatSleepAndWakeWriteNothing) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  bushd_set_inputs inputs{};
  inputs.enable_after_watchdog = true;
  ASSERT_EQ(master_.acknowledged(kAddress, inputs), BUSHD_OK);
  pass(4'000'000'000);
  const std::uint64_t before = avr_->eeprom_writes();
  for (int i = 0; i < 20; ++i) {
    for (const std::uint8_t action : {BUSHD_CONTROL_DISABLE, BUSHD_CONTROL_ENABLE}) {
      ASSERT_EQ(master_.acknowledged(kAddress, bushd_control{action, 0}), BUSHD_OK);
      pass(50'000'000);
    }
  }
  EXPECT_EQ(avr_->eeprom_writes(), before);
}

// With the number of the boot before, counts of before it would be taken for known.
TEST_F(AvrNvm, ABootNumberThatIsNotWrittenIsStillAnotherOne) {
  avr_->wear_eeprom_byte(16, 3);
  std::uint16_t before = master_.poll(kAddress).boot_number;
  for (int boot = 0; boot < 4; ++boot) {
    reboot();
    const bushd_report report = master_.poll(kAddress);
    EXPECT_NE(report.boot_number, before);
    EXPECT_EQ(report.failed_tests, 0);
    before = report.boot_number;
  }
  avr_->wear_eeprom_byte(14, 7);
  reboot();
  EXPECT_EQ(master_.poll(kAddress).faults, BUSHD_FAULT_EEPROM) << "nothing counts any more";
}

TEST_F(AvrNvm, NothingIsWrittenWhileAMotorMoves) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  const std::uint64_t before = avr_->eeprom_writes();
  while (avr_->eeprom_writes() < before + 10) pass(20'000'000);
  run(3, 400);
  pass(40 * TimeNs{kTickNs});
  ASSERT_EQ(master_.poll(kAddress).state, BUSHD_STATE_RUN);
  const std::uint64_t written = avr_->eeprom_writes();
  while (master_.poll(kAddress).state == BUSHD_STATE_RUN) {
    EXPECT_LE(avr_->eeprom_writes(), written + 1);
    pass(20 * TimeNs{kTickNs});
  }
  EXPECT_EQ(steps_made(3), 400u);
  pass(3'000'000'000);
  reboot();
  EXPECT_EQ(master_.valid_tables(kAddress), 1u);
}

}  // namespace
}  // namespace bushd::sim::nvm_test
