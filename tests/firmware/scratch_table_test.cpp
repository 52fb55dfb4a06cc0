// The table bank that is not kept over resets: lines go by it, and nothing else knows of it.
#include <vector>

#include "firmware/line_runs.h"

namespace bushd::test {
namespace {

using ScratchTable = OfLines;
INSTANTIATE_TEST_SUITE_P(Formats, ScratchTable,
                         testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE), format_name);

constexpr std::uint8_t kScratch = BUSHD_SCRATCH_BANK;
const std::vector<LineMotor> kLineMotors = {{0, 333}, {1, -118}, {3, 332}};

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
    const Frame line{
        .first = rig.first_open() + 3, .motors = kLineMotors, .longest = 333, .bank = kScratch};
    ASSERT_EQ(start(rig, line), BUSHD_OK);
    expect_slots(rig, Reference::move(slower, 333), line);
  }
  const Frame line{.first = rig.first_open() + 3, .motors = kLineMotors, .longest = 333};
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  expect_slots(rig, Reference::move(law, 333), line);
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
  const auto refused = [&] {
    return start(
        rig,
        {.first = rig.first_open() + 3, .motors = kLineMotors, .longest = 333, .bank = kScratch});
  };
  EXPECT_EQ(refused(), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.data(kScratch, 0, slower.accel), BUSHD_E_STATE);
  ASSERT_EQ(rig.begin(kScratch, slower), BUSHD_OK);
  ASSERT_EQ(rig.data(kScratch, 0, codes_of(slower)), BUSHD_OK);
  EXPECT_EQ(refused(), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.end(kScratch, slower.accel), BUSHD_E_CRC);
  EXPECT_EQ(refused(), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.end(kScratch, codes_of(slower)), BUSHD_OK);
  EXPECT_EQ(refused(), BUSHD_OK);
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
  Frame line{
      .first = rig.first_open() + 3, .motors = kLineMotors, .longest = 333, .bank = kScratch};
  EXPECT_EQ(start(rig, line), BUSHD_E_NO_TABLE) << "discarded";
  ASSERT_EQ(rig.upload(kScratch, slower), BUSHD_OK);
  line.first = rig.first_open() + 3;
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  expect_slots(rig, Reference::move(slower, 333), line);
  // And both others are what they were.
  line = {.first = rig.first_open() + 3, .motors = kLineMotors, .longest = 333, .bank = 1};
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  expect_slots(rig, Reference::move(kept, 333), line);
  line = {.first = rig.first_open() + 3, .motors = kLineMotors, .longest = 333};
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  expect_slots(rig, Reference::move(law, 333), line);
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
  const Frame line{
      .first = rig.first_open() + 3, .motors = kLineMotors, .longest = 333, .bank = kScratch};
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  for (const std::uint8_t bank : {kScratch, std::uint8_t{0}, std::uint8_t{5}}) {
    EXPECT_EQ(rig.begin(bank, slower), BUSHD_E_STATE) << int{bank};
  }
  EXPECT_EQ(rig.end(kScratch, codes_of(slower)), BUSHD_OK) << "the acknowledgement was lost";
  expect_slots(rig, Reference::move(slower, 333), line);
  // A motor that begins to move between its parts.
  ASSERT_EQ(rig.begin(kScratch, slower), BUSHD_OK);
  const Plan plan = this->plan(5);
  ASSERT_EQ(rig.take(rig.part(plan, rig.first_open(), 0, 100)), BUSHD_OK);
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
  Rig none({.disabled_capabilities = BUSHD_CAN_SCRATCH});
  none.make_ready(law, format);
  EXPECT_EQ(none.identify().capabilities & BUSHD_CAN_SCRATCH, 0u);
  EXPECT_EQ(none.begin(kScratch, law), BUSHD_E_FORMAT);
  EXPECT_EQ(none.data(kScratch, 0, law.accel), BUSHD_E_FORMAT);
  EXPECT_EQ(none.end(kScratch, codes_of(law)), BUSHD_E_FORMAT);
  EXPECT_EQ(start(none, {.first = none.first_open() + 3,
                         .motors = kLineMotors,
                         .longest = 333,
                         .bank = kScratch}),
            BUSHD_E_NO_TABLE);
  EXPECT_NE(rig.identify().capabilities & BUSHD_CAN_SCRATCH, 0u);
}

}  // namespace
}  // namespace bushd::test
