// Table memory: whatever order a master sends things in, an MCU never ramps down by anything but a
// table that was checked whole.
#include <array>
#include <string>
#include <utility>

#include "firmware/rig.h"

namespace bushd::test {
namespace {

Law flat_law(std::uint16_t first, std::size_t accel, std::size_t decel) {
  Law law;
  for (std::size_t i = 0; i < accel; ++i) {
    law.accel.push_back(static_cast<std::uint16_t>(first - 3 * i));
  }
  for (std::size_t i = 0; i < decel; ++i) {
    law.decel.push_back(static_cast<std::uint16_t>(first - 20 - 5 * i));
  }
  law.cruise = 25;
  law.unit_ns = 40'000;
  return law;
}

// Lets the motor run into the end of its queue at cruise and compares every tick of the ramp-down
// with what the law says: the MCU's own table decides it.
void expect_runs_down_by(Rig& rig, std::uint8_t motor, const Law& law) {
  rig.pass(3);
  const Plan plan = plan_move(law, 500, Rig::kTickNs, BUSHD_FORMAT_FINE);
  const std::size_t cut = 120;
  const std::uint32_t start = rig.first_open();
  ASSERT_NO_FATAL_FAILURE(rig.take_plan(plan, start, cut, 40, motor));
  rig.forget_history();
  rig.pass_until_rest();
  const auto rest = steps_by_tick(
      Reference::ramp_down(law, plan.delay[cut - 1], plan.fraction[cut - 1]), Rig::kTickNs);
  std::vector<int> seen = rig.history(motor);
  seen.resize(cut + 2 + rest.size());
  EXPECT_EQ(std::vector<int>(seen.begin() + cut + 2, seen.end()), rest);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
}

class TableUpload : public testing::Test {
 protected:
  TableUpload() {
    EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE), BUSHD_OK);
    rig.sync_to(1000);
    EXPECT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  }
  // To motor 0.
  void give(const Law& law) {
    ASSERT_EQ(rig.upload(0, law), BUSHD_OK);
    ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
  }
  // Whole and checked, the same on both sides.
  void upload_symmetric(std::uint8_t bank, const Law& law, std::uint32_t revision = 0) {
    ASSERT_EQ(rig.begin(bank, law, true, revision), BUSHD_OK);
    ASSERT_EQ(rig.data(bank, 0, law.accel), BUSHD_OK);
    EXPECT_FALSE(rig.tables().bank[bank].valid) << "not yet checked";
    ASSERT_EQ(rig.end(bank, law.accel), BUSHD_OK);
  }
  Rig rig{RigOptions{.code_count = 150}};
};

TEST_F(TableUpload, PiecesOfNoTableAreRefused) {
  EXPECT_EQ(rig.data(0, 0, {5, 4}), BUSHD_E_STATE) << "no begin";
  EXPECT_EQ(rig.end(0, {}), BUSHD_E_STATE);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_E_STATE);
  const Law law = flat_law(200, 6, 4);
  ASSERT_EQ(rig.begin(3, law), BUSHD_OK);
  EXPECT_EQ(rig.assign(0, 3), BUSHD_E_STATE) << "not yet checked";
  EXPECT_EQ(rig.end(3, {}), BUSHD_E_STATE) << "nothing received";
  EXPECT_EQ(rig.data(3, 1, {197}), BUSHD_E_STATE) << "a hole";
  EXPECT_EQ(rig.data(3, 0, std::vector<std::uint16_t>(11, 200)), BUSHD_E_STATE)
      << "more than announced";
  EXPECT_EQ(rig.data(4, 0, {200}), BUSHD_E_STATE) << "another bank";
  EXPECT_EQ(rig.data(3, 0, {200, 197, 194}), BUSHD_OK);
  EXPECT_EQ(rig.end(3, {200, 197, 194}), BUSHD_E_STATE) << "incomplete";
  EXPECT_EQ(rig.data(3, 4, {1}), BUSHD_E_STATE) << "a hole";
  EXPECT_EQ(rig.data(3, 8, {1, 1, 1}), BUSHD_E_STATE) << "beyond the end";
  EXPECT_EQ(rig.data(3, 1, {197, 194, 191, 188, 185}), BUSHD_OK) << "overlap repeats";
  EXPECT_EQ(rig.data(3, 6, {180, 175, 170, 165}), BUSHD_OK);
  EXPECT_EQ(rig.end(3, codes_of(law)), BUSHD_OK);
  EXPECT_EQ(rig.end(3, codes_of(law)), BUSHD_OK) << "the acknowledgement was lost";
  EXPECT_EQ(rig.data(3, 0, {1}), BUSHD_E_STATE) << "a checked table is not written to";
  EXPECT_EQ(rig.assign(0, 3), BUSHD_OK);
  expect_runs_down_by(rig, 0, law);
}

TEST_F(TableUpload, WrongChecksumIsFoundAndCanBeRepaired) {
  const Law law = flat_law(200, 6, 4);
  ASSERT_EQ(rig.begin(0, law), BUSHD_OK);
  std::vector<std::uint16_t> wrong = codes_of(law);
  wrong[5] ^= 1;
  ASSERT_EQ(rig.data(0, 0, wrong), BUSHD_OK);
  EXPECT_EQ(rig.end(0, codes_of(law)), BUSHD_E_CRC);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_E_STATE);
  ASSERT_EQ(rig.data(0, 0, codes_of(law)), BUSHD_OK);
  EXPECT_EQ(rig.end(0, codes_of(law)), BUSHD_OK);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_OK);
}

TEST_F(TableUpload, BadTablesAreNamedAndUseless) {
  const auto status_of = [this](std::vector<std::uint16_t> accel,
                                std::vector<std::uint16_t> decel) {
    Law law = flat_law(200, 1, 1);
    law.accel = std::move(accel);
    law.decel = std::move(decel);
    const bushd_status status = rig.upload(1, law);
    EXPECT_EQ(rig.assign(0, 1), BUSHD_E_STATE);
    return status;
  };
  EXPECT_EQ(status_of({9, 8, 0}, {7}), BUSHD_E_TABLE_ZERO);
  EXPECT_EQ(status_of({9, 8, 7}, {0}), BUSHD_E_TABLE_ZERO);
  EXPECT_EQ(status_of({9, 8, 9}, {7}), BUSHD_E_TABLE_UNSORTED);
  EXPECT_EQ(status_of({9, 8}, {7, 8}), BUSHD_E_TABLE_UNSORTED);
  Law empty = flat_law(200, 1, 1);
  empty.accel.clear();
  EXPECT_EQ(rig.begin(1, empty), BUSHD_E_FORMAT);
  Law no_cruise = flat_law(200, 1, 1);
  no_cruise.cruise = 0;
  EXPECT_EQ(rig.begin(1, no_cruise), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.begin(9, flat_law(200, 1, 1)), BUSHD_E_FORMAT) << "banks 0..8";
}

TEST_F(TableUpload, AssignNeedsAConfiguredMcuAndATableSlowEnough) {
  Rig fresh;
  ASSERT_EQ(fresh.upload(0, ramp_law()), BUSHD_OK) << "tables may come before the configuration";
  EXPECT_EQ(fresh.assign(0, 0), BUSHD_E_STATE);
  Law fast = ramp_law();
  fast.cruise = 1;
  fast.unit_ns = Rig::kTickNs / 127;  // 127 of them fit into a tick, so 128 steps might
  ASSERT_EQ(fresh.upload(1, fast), BUSHD_OK);
  fast.unit_ns = Rig::kTickNs / 126 - 1;
  ASSERT_EQ(fresh.upload(2, fast), BUSHD_OK);
  fast.unit_ns = Rig::kTickNs / 126 + 1;
  ASSERT_EQ(fresh.upload(3, fast), BUSHD_OK);
  ASSERT_EQ(fresh.configure(BUSHD_FORMAT_FINE), BUSHD_OK);
  EXPECT_EQ(fresh.assign(0, 0), BUSHD_OK);
  EXPECT_EQ(fresh.assign(0, 1), BUSHD_E_CAPACITY);
  EXPECT_EQ(fresh.assign(0, 2), BUSHD_OK) << "at most 127";
  EXPECT_EQ(fresh.assign(0, 3), BUSHD_OK);
  EXPECT_EQ(fresh.assign(4, 0), BUSHD_E_FORMAT) << "four motors: 0..3";
}

TEST_F(TableUpload, MemoryIsFilledToTheLastCodeAndNoFurther) {
  ASSERT_EQ(rig.upload(0, flat_law(250, 60, 39)), BUSHD_OK);
  EXPECT_EQ(rig.upload(1, flat_law(250, 40, 12)), BUSHD_E_CAPACITY) << "52 into 51";
  EXPECT_EQ(rig.data(1, 0, {5}), BUSHD_E_STATE);
  ASSERT_EQ(rig.upload(1, flat_law(250, 40, 11)), BUSHD_OK);
  Law one = flat_law(250, 1, 0);
  EXPECT_EQ(rig.begin(2, one, true), BUSHD_E_CAPACITY);
  ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
  ASSERT_EQ(rig.assign(1, 1), BUSHD_OK);
  expect_runs_down_by(rig, 0, flat_law(250, 60, 39));
  expect_runs_down_by(rig, 1, flat_law(250, 40, 11));
  // What the bank held before is given up even if the new table does not fit.
  EXPECT_EQ(rig.begin(0, flat_law(250, 70, 30)), BUSHD_E_CAPACITY);
  EXPECT_EQ(rig.start(flat_law(250, 60, 39), 5), BUSHD_E_NO_TABLE);
  expect_runs_down_by(rig, 1, flat_law(250, 40, 11));
  EXPECT_EQ(rig.upload(2, flat_law(250, 59, 40)), BUSHD_OK) << "its place is free";
}

TEST_F(TableUpload, LargestAnnouncementIsRefusedNotWrapped) {
  Law law = flat_law(250, 10, 10);
  law.accel.resize(65535, 1);
  law.decel.resize(2, 1);
  EXPECT_EQ(rig.begin(0, law), BUSHD_E_CAPACITY);
}

TEST_F(TableUpload, SymmetricTableIsKeptOnce) {
  Law law = flat_law(250, 70, 0);
  ASSERT_NO_FATAL_FAILURE(upload_symmetric(0, law));
  ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
  EXPECT_EQ(rig.upload(1, flat_law(250, 40, 40)), BUSHD_OK) << "80 codes are left";
  law.decel = law.accel;
  expect_runs_down_by(rig, 0, law);
}

// Tables lie one behind the other; one that is sent anew with another size moves those behind it.
TEST_F(TableUpload, TablesSentAgainLeaveTheOthersUnharmed) {
  std::array<Law, 4> law = {flat_law(250, 12, 7), flat_law(240, 20, 9), flat_law(230, 9, 13),
                            flat_law(220, 15, 0)};
  law[3].decel = law[3].accel;
  for (std::uint8_t i = 0; i < 3; ++i) ASSERT_EQ(rig.upload(i, law[i]), BUSHD_OK);
  ASSERT_NO_FATAL_FAILURE(upload_symmetric(3, law[3]));
  for (std::uint8_t i = 0; i < 4; ++i) ASSERT_EQ(rig.assign(i, i), BUSHD_OK);
  const std::size_t sizes[][2] = {{3, 2}, {30, 11}, {12, 7}, {1, 1}, {40, 20}};
  for (const std::uint8_t again : std::initializer_list<std::uint8_t>{0, 1, 2, 1, 0}) {
    for (const auto& size : sizes) {
      law[again] = flat_law(250, size[0], size[1]);
      ASSERT_EQ(rig.upload(again, law[again]), BUSHD_OK);
      EXPECT_EQ(rig.start(law[again], 5, again), BUSHD_E_NO_TABLE)
          << "its motors must be assigned anew";
      ASSERT_EQ(rig.assign(again, again), BUSHD_OK);
      for (std::uint8_t i = 0; i < 4; ++i) {
        SCOPED_TRACE("table " + std::to_string(again) + " sent, motor " + std::to_string(i));
        expect_runs_down_by(rig, i, law[i]);
      }
    }
    law[again] = flat_law(245, 10, 8);
    ASSERT_EQ(rig.upload(again, law[again]), BUSHD_OK);
    ASSERT_EQ(rig.assign(again, again), BUSHD_OK);
  }
}

// An upload that was broken off holds memory too, and must move with the rest.
TEST_F(TableUpload, HalfSentTableMovesWithTheOthers) {
  const Law first = flat_law(250, 20, 10);
  const Law half = flat_law(240, 8, 4);
  ASSERT_EQ(rig.upload(0, first), BUSHD_OK);
  ASSERT_EQ(rig.begin(1, half), BUSHD_OK);
  ASSERT_EQ(rig.data(1, 0, half.accel), BUSHD_OK);
  ASSERT_EQ(rig.upload(0, flat_law(250, 3, 3)), BUSHD_OK);
  ASSERT_EQ(rig.data(1, 8, half.decel), BUSHD_OK);
  EXPECT_EQ(rig.end(1, codes_of(half)), BUSHD_OK);
  ASSERT_EQ(rig.assign(2, 1), BUSHD_OK);
  expect_runs_down_by(rig, 2, half);
}

TEST_F(TableUpload, RefusedWhileAMotorMoves) {
  const Law law = flat_law(250, 20, 10);
  ASSERT_NO_FATAL_FAILURE(give(law));
  ASSERT_EQ(rig.assign(1, 0), BUSHD_OK);
  const Plan plan = plan_move(law, 4, Rig::kTickNs, BUSHD_FORMAT_FINE);
  ASSERT_EQ(rig.take(rig.part(plan, rig.first_open() + 5, 0, 100)), BUSHD_OK);
  int moving_ticks = 0;
  while (rig.poll().moving != 0) {
    EXPECT_EQ(rig.begin(0, law), BUSHD_E_STATE) << "its own table";
    EXPECT_EQ(rig.begin(5, law), BUSHD_E_STATE) << "another one would move it in memory";
    EXPECT_EQ(rig.assign(0, 0), BUSHD_E_STATE);
    EXPECT_EQ(rig.assign(1, 0), BUSHD_OK) << "a motor at rest may be given a table";
    rig.pass();
    ++moving_ticks;
  }
  EXPECT_GE(moving_ticks, static_cast<int>(plan.ticks()) + 5);
  EXPECT_EQ(rig.pulses(0), 4);
  EXPECT_EQ(rig.upload(0, law), BUSHD_OK);
}

TEST_F(TableUpload, WhatIsHeldIsTold) {
  const Law law = flat_law(250, 20, 10);
  ASSERT_EQ(rig.upload(2, law), BUSHD_OK);
  const Law flat = flat_law(240, 8, 0);
  ASSERT_NO_FATAL_FAILURE(upload_symmetric(5, flat, 0xCAFE1234));
  const bushd_tables tables = rig.tables();
  for (std::uint8_t i = 0; i < BUSHD_TABLE_BANKS; ++i) {
    EXPECT_EQ(tables.bank[i].valid, i == 2 || i == 5) << int{i};
  }
  EXPECT_EQ(tables.bank[5].revision, 0xCAFE1234);
  Bytes whole = {8, 0, 0, 0, 25, 0, 0x40, 0x9C, 0, 0};
  append(whole, flat.accel);
  EXPECT_EQ(tables.bank[5].crc, crc32(whole));
}

// The checksum covers all that a table holds, not its codes alone.
TEST_F(TableUpload, AnotherCruiseThanTheMastersIsFound) {
  const Law law = flat_law(200, 6, 4);
  ASSERT_EQ(rig.begin(0, law), BUSHD_OK);
  ASSERT_EQ(rig.data(0, 0, codes_of(law)), BUSHD_OK);
  Bytes whole = {6, 0, 4, 0, 26, 0, 0x40, 0x9C, 0, 0};
  append(whole, codes_of(law));
  Bytes end(5);
  bushd_put_u32(&end[1], crc32(whole));
  EXPECT_EQ(rig.request(BUSHD_MSG_TABLE_END, end), BUSHD_E_CRC);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_E_STATE);
}

TEST_F(TableUpload, AllAreForgottenAtOnceAndTheirMemoryIsFree) {
  const Law law = flat_law(250, 80, 40);
  ASSERT_NO_FATAL_FAILURE(give(law));
  EXPECT_EQ(rig.begin(1, law), BUSHD_E_CAPACITY);
  ASSERT_EQ(rig.start(law, 4), BUSHD_OK);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_E_STATE) << "a motor moves";
  rig.pass_until_rest();
  EXPECT_EQ(rig.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_OK);
  EXPECT_FALSE(rig.tables().bank[0].valid);
  EXPECT_EQ(rig.start(law, 4), BUSHD_E_NO_TABLE);
  EXPECT_EQ(rig.upload(1, law), BUSHD_OK);
  ASSERT_EQ(rig.assign(0, 1), BUSHD_OK);
  expect_runs_down_by(rig, 0, law);
}

// Its checks may take longer than a tick, and local motion begins when people want it.
TEST_F(TableUpload, IsNotEndedWhileAMotorMoves) {
  const Law law = flat_law(250, 20, 10);
  ASSERT_NO_FATAL_FAILURE(give(law));
  ASSERT_EQ(rig.begin(1, law), BUSHD_OK);
  ASSERT_EQ(rig.data(1, 0, codes_of(law)), BUSHD_OK);
  ASSERT_EQ(rig.start(law, 4), BUSHD_OK);
  EXPECT_EQ(rig.end(1, codes_of(law)), BUSHD_E_STATE);
  EXPECT_FALSE(rig.tables().bank[1].valid);
  rig.pass_until_rest();
  EXPECT_EQ(rig.end(1, codes_of(law)), BUSHD_OK);
}

TEST_F(TableUpload, RefusedDuringARampDown) {
  const Law law = flat_law(250, 20, 10);
  ASSERT_NO_FATAL_FAILURE(give(law));
  const Plan plan = plan_move(law, 200, Rig::kTickNs, BUSHD_FORMAT_FINE);
  ASSERT_EQ(rig.take(rig.part(plan, rig.first_open(), 0, 50)), BUSHD_OK);
  rig.pass(55);
  ASSERT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  ASSERT_NE(rig.poll().moving, 0);
  EXPECT_EQ(rig.begin(0, law), BUSHD_E_STATE);
  EXPECT_EQ(rig.begin(1, law), BUSHD_E_STATE);
  rig.pass_until_rest();
  EXPECT_EQ(rig.begin(0, law), BUSHD_OK);
}

}  // namespace
}  // namespace bushd::test
