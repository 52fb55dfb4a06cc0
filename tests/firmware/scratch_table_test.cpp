// The table bank that is not kept over resets: lines go by it, and nothing else knows of it.
#include <vector>

#include "firmware/line_runs.h"

namespace bushd::test {
namespace {

constexpr std::uint8_t kScratch = BUSHD_SCRATCH_BANK;

class ScratchTable : public OfLines {
 protected:
  static Frame line_of(const Rig& on, std::uint8_t bank) {
    return {.first = on.first_open() + 3,
            .motors = {{0, 333}, {1, -118}, {3, 332}},
            .longest = 333,
            .bank = bank};
  }
  bushd_status start_line(std::uint8_t bank) { return start(rig, line_of(rig, bank)); }
  // Its motors go by the law that this bank has.
  void expect_line_by(std::uint8_t bank, const Law& of_bank) {
    const Frame line = line_of(rig, bank);
    ASSERT_EQ(start(rig, line), BUSHD_OK);
    expect_slots(rig, Reference::move(of_bank, 333), line);
  }
};
BUSHD_IN_BOTH_FORMATS(ScratchTable);

// Slower than the motors' own, and with unequal sides.
Law envelope_law() {
  Law law = ramp_law();
  for (std::uint16_t& code : law.accel) code = static_cast<std::uint16_t>(code * 5 / 4);
  for (std::uint16_t& code : law.decel) code = static_cast<std::uint16_t>(code * 9 / 8);
  law.cruise = static_cast<std::uint16_t>(law.cruise + 7);
  return law;
}

TEST_P(ScratchTable, LinesGoByItExactToASlot) {
  for (int i = 0; i < 2; ++i) {
    Law slower = envelope_law();
    slower.cruise = static_cast<std::uint16_t>(slower.cruise + i);
    ASSERT_EQ(rig.upload(kScratch, slower), BUSHD_OK);
    ASSERT_NO_FATAL_FAILURE(expect_line_by(kScratch, slower));
  }
  ASSERT_NO_FATAL_FAILURE(expect_line_by(0, law));
}

// A motor that leaves the line goes by its own.
TEST_P(ScratchTable, IsNoMotorsTable) {
  ASSERT_EQ(rig.upload(kScratch, envelope_law()), BUSHD_OK);
  EXPECT_EQ(rig.assign(0, kScratch), BUSHD_E_FORMAT);
  for (std::uint8_t m = 0; m < 4; ++m) EXPECT_EQ(rig.mcu().motor[m].table, 0);
  const bushd_tables held = rig.tables();
  for (std::uint8_t bank = 1; bank < BUSHD_TABLE_BANKS; ++bank) {
    EXPECT_FALSE(held.bank[bank].valid);
  }
}

TEST_P(ScratchTable, NoLineGoesByOneThatHasNotComeWhole) {
  const Law slower = envelope_law();
  EXPECT_EQ(start_line(kScratch), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.data(kScratch, 0, slower.accel), BUSHD_E_STATE);
  ASSERT_EQ(rig.begin(kScratch, slower), BUSHD_OK);
  ASSERT_EQ(rig.data(kScratch, 0, codes_of(slower)), BUSHD_OK);
  EXPECT_EQ(start_line(kScratch), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.end(kScratch, slower.accel), BUSHD_E_CRC);
  EXPECT_EQ(start_line(kScratch), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.end(kScratch, codes_of(slower)), BUSHD_OK);
  EXPECT_EQ(start_line(kScratch), BUSHD_OK);
}

// Its codes lie behind all others.
TEST_P(ScratchTable, MakesRoomForTablesThatAreKept) {
  const Law slower = envelope_law();
  ASSERT_EQ(rig.upload(kScratch, slower), BUSHD_OK);
  const std::uint16_t used = rig.mcu().tables.codes_used;
  Law kept = law;
  kept.cruise = static_cast<std::uint16_t>(kept.cruise + 1);
  ASSERT_EQ(rig.upload(1, kept), BUSHD_OK);
  EXPECT_GT(rig.mcu().tables.codes_used, used);
  ASSERT_EQ(rig.assign(0, 1), BUSHD_OK);
  EXPECT_EQ(start_line(kScratch), BUSHD_E_NO_TABLE) << "discarded";
  ASSERT_EQ(rig.upload(kScratch, slower), BUSHD_OK);
  ASSERT_NO_FATAL_FAILURE(expect_line_by(kScratch, slower));
  // And both others are what they were.
  ASSERT_NO_FATAL_FAILURE(expect_line_by(1, kept));
  ASSERT_NO_FATAL_FAILURE(expect_line_by(0, law));
}

TEST_P(ScratchTable, HasTheRoomThatOthersLeave) {
  Law large = law;
  const std::size_t left = rig.options().code_count - rig.mcu().tables.codes_used;
  large.accel.assign(left - 1, 200);
  large.decel = {200};
  EXPECT_EQ(rig.upload(kScratch, large), BUSHD_OK);
  large.accel.push_back(200);
  EXPECT_EQ(rig.begin(kScratch, large), BUSHD_E_CAPACITY);
  EXPECT_EQ(rig.end(kScratch, codes_of(large)), BUSHD_E_STATE);
}

TEST_P(ScratchTable, IsTakenAtRestOnly) {
  const Law slower = envelope_law();
  ASSERT_EQ(rig.upload(kScratch, slower), BUSHD_OK);
  const Frame line = line_of(rig, kScratch);
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  for (const std::uint8_t bank : {kScratch, std::uint8_t{0}, std::uint8_t{5}}) {
    EXPECT_EQ(rig.begin(bank, slower), BUSHD_E_STATE) << int{bank};
  }
  EXPECT_EQ(rig.end(kScratch, codes_of(slower)), BUSHD_OK) << "the acknowledgement was lost";
  expect_slots(rig, Reference::move(slower, 333), line);
  // A motor that begins to move between its parts.
  ASSERT_EQ(rig.begin(kScratch, slower), BUSHD_OK);
  ASSERT_EQ(rig.start(law, 5), BUSHD_OK);
  EXPECT_EQ(rig.data(kScratch, 0, codes_of(slower)), BUSHD_OK);
  EXPECT_EQ(rig.end(kScratch, codes_of(slower)), BUSHD_E_STATE) << "checks take a while";
  rig.pass_until_rest();
  EXPECT_EQ(rig.end(kScratch, codes_of(slower)), BUSHD_OK);
}

TEST_P(ScratchTable, IsForgottenWithTheOthersAndAtAReset) {
  const Law slower = envelope_law();
  ASSERT_EQ(rig.upload(kScratch, slower), BUSHD_OK);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_OK);
  EXPECT_EQ(rig.data(kScratch, 0, slower.accel), BUSHD_E_STATE);
  ASSERT_EQ(rig.upload(0, law), BUSHD_OK);
  ASSERT_EQ(rig.upload(kScratch, slower), BUSHD_OK);
  ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
  const std::uint16_t used = rig.mcu().tables.codes_used;
  rig.restart_with_nvm();
  EXPECT_EQ(rig.mcu().tables.codes_used, used);
  EXPECT_TRUE(rig.tables().bank[0].valid);
  EXPECT_EQ(bushd_mcu_checked_table(&rig.mcu(), kScratch), nullptr);
}

// To no byte: it is written to EEPROM or flash for no line.
TEST_P(ScratchTable, IsNoPartOfWhatAPortKeeps) {
  const auto kept = [this] {
    Bytes all;
    for (std::uint8_t i = 0;; ++i) {
      const bushd_mcu_nvm_region piece = bushd_mcu_nvm_region_at(rig.mutable_mcu(), i);
      if (piece.at == nullptr) return all;
      const auto* const bytes = static_cast<const std::uint8_t*>(piece.at);
      all.insert(all.end(), bytes, bytes + piece.size);
    }
  };
  const Bytes before = kept();
  ASSERT_EQ(rig.upload(kScratch, envelope_law()), BUSHD_OK);
  EXPECT_EQ(kept(), before);
  ASSERT_EQ(rig.begin(kScratch, envelope_law()), BUSHD_OK);
  EXPECT_EQ(kept(), before);
}

TEST_P(ScratchTable, IsNoBankOfAnMcuWithoutIt) {
  ReadyRig none(law, format, {.disabled_capabilities = BUSHD_CAN_SCRATCH});
  EXPECT_EQ(none.identify().capabilities & BUSHD_CAN_SCRATCH, 0u);
  EXPECT_EQ(none.begin(kScratch, law), BUSHD_E_FORMAT);
  EXPECT_EQ(none.data(kScratch, 0, law.accel), BUSHD_E_FORMAT);
  EXPECT_EQ(none.end(kScratch, codes_of(law)), BUSHD_E_FORMAT);
  EXPECT_EQ(start(none, line_of(none, kScratch)), BUSHD_E_NO_TABLE);
  EXPECT_NE(rig.identify().capabilities & BUSHD_CAN_SCRATCH, 0u);
}

}  // namespace
}  // namespace bushd::test
