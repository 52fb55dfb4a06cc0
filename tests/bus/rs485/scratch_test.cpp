// What is uploaded into the volatile bank, request by request.
#include "bus/rs485/scratch.h"

#include <gtest/gtest.h>

#include <vector>

namespace bushd::link {
namespace {

struct Codes {
  Codes(std::vector<std::uint16_t> a, std::vector<std::uint16_t> d)
      : accel(std::move(a)), decel(std::move(d)) {
    table.accel.code = accel.data();
    table.accel.count = static_cast<std::uint16_t>(accel.size());
    table.decel.code = decel.data();
    table.decel.count = static_cast<std::uint16_t>(decel.size());
    table.cruise = 7;
    table.time_unit_ns = 40'000;
  }
  std::vector<std::uint16_t> accel;
  std::vector<std::uint16_t> decel;
  bushd_table table{};
};

bushd_table_begin begin_of(const Scratch& scratch) {
  bushd_table_begin begin{};
  EXPECT_EQ(scratch.front().type, BUSHD_MSG_TABLE_BEGIN);
  EXPECT_EQ(bushd_decode_table_begin(scratch.front().payload.data(), scratch.front().payload.size(),
                                     &begin),
            BUSHD_OK);
  return begin;
}

int acknowledge_all(Scratch& scratch) {
  int requests = 0;
  for (; scratch.under_way(); ++requests) {
    EXPECT_EQ(scratch.table(), nullptr);
    scratch.acknowledged(scratch.ask().type, BUSHD_OK);
  }
  return requests;
}

TEST(Scratch, HasItsTableWhenAllPartsAreAcknowledged) {
  Scratch scratch;
  EXPECT_FALSE(scratch.under_way());
  {
    const Codes codes(std::vector<std::uint16_t>(200, 50), {40, 30});
    scratch.upload(codes.table);
  }  // it has a copy
  const bushd_table_begin begin = begin_of(scratch);
  EXPECT_EQ(begin.bank, BUSHD_SCRATCH_BANK);
  EXPECT_EQ(begin.accel_count, 200);
  EXPECT_EQ(begin.decel_count, 2);
  EXPECT_EQ(acknowledge_all(scratch), 4) << "begin, 202 codes, end";
  ASSERT_NE(scratch.table(), nullptr);
  EXPECT_EQ(scratch.table()->cruise, 7);
  EXPECT_EQ(scratch.table()->accel.code[199], 50);
  EXPECT_EQ(scratch.table()->decel.code[1], 30);
}

TEST(Scratch, SendsOneSideIfBothAreTheSame) {
  Scratch scratch;
  const Codes codes({50, 40}, {50, 40});
  scratch.upload(codes.table);
  EXPECT_EQ(begin_of(scratch).decel_count, 0);
  EXPECT_EQ(acknowledge_all(scratch), 3);
  EXPECT_EQ(scratch.table()->decel.code, scratch.table()->accel.code);
}

TEST(Scratch, ARefusalEndsIt) {
  for (int refused = 0; refused < 3; ++refused) {
    Scratch scratch;
    const Codes codes({50, 40}, {50, 40});
    scratch.upload(codes.table);
    for (int i = 0; i < refused; ++i) scratch.acknowledged(scratch.ask().type, BUSHD_OK);
    scratch.acknowledged(scratch.ask().type, BUSHD_E_STATE);
    EXPECT_FALSE(scratch.under_way());
    EXPECT_EQ(scratch.table(), nullptr);
  }
}

TEST(Scratch, AnswersToOthersAreNotItsOwn) {
  Scratch scratch;
  const Codes codes({50, 40}, {30});
  scratch.upload(codes.table);
  scratch.acknowledged(BUSHD_MSG_TABLE_END, BUSHD_E_STATE);
  EXPECT_EQ(begin_of(scratch).accel_count, 2);
  acknowledge_all(scratch);
  ASSERT_NE(scratch.table(), nullptr);
  scratch.acknowledged(BUSHD_MSG_TABLE_END, BUSHD_E_STATE);
  EXPECT_NE(scratch.table(), nullptr);
}

TEST(Scratch, AnotherTableReplacesWhatWasThere) {
  Scratch scratch;
  const Codes codes({50, 40}, {30});
  scratch.upload(codes.table);
  acknowledge_all(scratch);
  const Codes other({9}, {8});
  scratch.upload(other.table);
  EXPECT_EQ(scratch.table(), nullptr) << "the MCU discards it with the first part";
  EXPECT_EQ(begin_of(scratch).accel_count, 1);
  scratch.clear();
  EXPECT_FALSE(scratch.under_way());
}

}  // namespace
}  // namespace bushd::link
