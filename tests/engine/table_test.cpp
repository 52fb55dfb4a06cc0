#include "engine/table.h"

#include <cstdint>
#include <vector>

#include "engine/tables.h"

namespace bushd::test::table_test {
namespace {

struct Checked {
  bushd_status status;
  uint32_t index;
  bool decel;

  bool operator==(const Checked&) const = default;
};

Checked check(const Law& law) {
  const TestTable table(law, false);
  Checked checked{BUSHD_OK, 999, false};
  checked.status = bushd_table_check(table.view(), &checked.index, &checked.decel);
  EXPECT_EQ(bushd_table_check(table.view(), nullptr, nullptr), checked.status);
  return checked;
}

const std::vector<uint16_t> kGood{9, 7, 7, 2};

TEST(TableCheck, TakesEverySortedTable) {
  EXPECT_EQ(check({kGood, kGood, 2, 1}).status, BUSHD_OK);
  EXPECT_EQ(check({{1}, {65535}, 65535, 1}).status, BUSHD_OK);
  holds("any_law() is good", [] { RC_ASSERT(check(any_law()).status == BUSHD_OK); });
}

TEST(TableCheck, NamesSideAndIndexOfTheFault) {
  const auto bad_accel = [](bushd_status s, uint32_t i) { return Checked{s, i, false}; };
  const auto bad_decel = [](bushd_status s, uint32_t i) { return Checked{s, i, true}; };
  EXPECT_EQ(check({{}, kGood, 2, 1}), bad_accel(BUSHD_E_TABLE_EMPTY, 0));
  EXPECT_EQ(check({kGood, {}, 2, 1}), bad_decel(BUSHD_E_TABLE_EMPTY, 0));
  EXPECT_EQ(check({{9, 7, 0}, kGood, 2, 1}), bad_accel(BUSHD_E_TABLE_ZERO, 2));
  EXPECT_EQ(check({kGood, {0}, 2, 1}), bad_decel(BUSHD_E_TABLE_ZERO, 0));
  EXPECT_EQ(check({{9, 10, 2}, kGood, 2, 1}), bad_accel(BUSHD_E_TABLE_UNSORTED, 1));
  EXPECT_EQ(check({kGood, {9, 7, 8}, 2, 1}), bad_decel(BUSHD_E_TABLE_UNSORTED, 2));
}

TEST(TableCheck, RefusesZeroCruiseAndZeroUnit) {
  EXPECT_EQ(check({kGood, kGood, 0, 1}).status, BUSHD_E_TABLE_ZERO);
  EXPECT_EQ(check({kGood, kGood, 2, 0}).status, BUSHD_E_TABLE_ZERO);
}

TEST(TableCheck, RefusesASideThatLastsLongerThanHalfOf32Bits) {
  const size_t most = INT32_MAX / 65535;
  EXPECT_EQ(check({std::vector<uint16_t>(most, 65535), kGood, 2, 1}).status, BUSHD_OK);
  EXPECT_EQ(check({kGood, std::vector<uint16_t>(most + 1, 65535), 2, 1}),
            (Checked{BUSHD_E_TABLE_TOO_LONG, static_cast<uint32_t>(most), true}));
}

TEST(TableDelay, IsTheGreatestOfAccelDecelAndCruise) {
  // The example of the rule: five steps of 5 4 3 | 3 | 2 3 6.
  const TestTable table({{5, 4, 3}, {6, 3, 2}, 3, 1}, false);
  std::vector<uint16_t> delays;
  for (uint32_t j = 1; j <= 5; ++j) delays.push_back(bushd_table_delay(table.view(), j, 5));
  EXPECT_EQ(delays, (std::vector<uint16_t>{5, 4, 3, 3, 6}));
  EXPECT_EQ(bushd_table_delay(table.view(), 1, 1), 6);  // the slower side rules a move of one step
}

TEST(TableDelay, AgreesWithTheDefinition) {
  holds("delay rule", [] {
    const TestTable table(any_law(), false);
    const auto n = between<uint32_t>(1, 200);
    const Reference reference = Reference::move(table.law(), n);
    for (uint32_t j = 1; j <= n; ++j) {
      RC_ASSERT(Wide{bushd_table_delay(table.view(), j, n)} * table.law().unit_ns * 256 ==
                reference.step(j - 1).delay);
    }
  });
}

TEST(TableStepsToStop, AgreesWithALinearSearch) {
  holds("fewest k with D(k) <= delay", [] {
    const TestTable table(any_law(), false);
    const Law& law = table.law();
    const auto delay = between<uint16_t>(1, 65535);
    uint32_t k = 0;
    while (k < law.decel.size() && law.decel[k] > delay) ++k;
    RC_ASSERT(bushd_table_steps_to_stop(table.view(), delay) == k);
  });
}

TEST(TableMaxSteps, BoundsEveryStretchOfAMove) {
  holds("no stretch of a tick's length holds more steps", [] {
    const TestTable table(any_law(), false);
    const uint32_t tick_ns = any_tick_ns(table.law());
    const uint32_t bound = bushd_table_max_steps_per_tick(table.view(), tick_ns);
    RC_ASSERT(bound <= 127);
    const Reference reference = Reference::move(table.law(), 100);
    size_t first = 0;
    for (size_t last = 0; last < reference.steps(); ++last) {
      while (reference.step(last).end - reference.step(first).end > Wide{tick_ns} * 256) ++first;
      RC_ASSERT(last - first + 1 <= bound);
    }
  });
}

TEST(TableMaxSteps, SaturatesNever) {
  const TestTable table({{1}, {1}, 1, 1}, false);
  EXPECT_EQ(bushd_table_max_steps_per_tick(table.view(), UINT32_MAX), UINT32_MAX);
  EXPECT_EQ(bushd_table_max_steps_per_tick(table.view(), 20'000'000), 20'000'001u);
}

// Bit by bit, as the definition has it.
uint32_t crc32_of(const std::vector<uint8_t>& bytes) {
  uint32_t crc = UINT32_MAX;
  for (const uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

void append16(std::vector<uint8_t>* bytes, size_t value) {
  bytes->push_back(static_cast<uint8_t>(value));
  bytes->push_back(static_cast<uint8_t>(value >> 8));
}

TEST(TableCrc32, IsThatOfAllThatTheTableHolds) {
  EXPECT_EQ(crc32_of({'1', '2', '3', '4', '5', '6', '7', '8', '9'}), 0xCBF43926u);
  holds("crc32 == definition", [] {
    const TestTable table(any_law(), *rc::gen::arbitrary<bool>());
    bushd_table view = *table.view();
    const bool symmetric = *rc::gen::arbitrary<bool>();
    if (symmetric) view.decel = view.accel;
    const Law& law = table.law();
    std::vector<uint8_t> bytes;
    append16(&bytes, law.accel.size());
    append16(&bytes, symmetric ? 0 : law.decel.size());
    append16(&bytes, law.cruise);
    append16(&bytes, law.unit_ns & 0xFFFF);
    append16(&bytes, law.unit_ns >> 16);
    for (const uint16_t code : law.accel) append16(&bytes, code);
    if (!symmetric) {
      for (const uint16_t code : law.decel) append16(&bytes, code);
    }
    RC_ASSERT(bushd_table_crc32(&view) == crc32_of(bytes));
  });
}

TEST(RampIndex, HoldsThePrefixSumsAndTheGreatestIndexOfEachBucket) {
  holds("sum and bucket by definition", [] {
    const TestTable table(any_law(), true);
    const bushd_ramp& ramp = table.view()->accel;
    uint32_t total = 0;
    for (uint32_t i = 0; i <= ramp.count; ++i) {
      RC_ASSERT(ramp.sum[i] == total);
      if (i < ramp.count) total += ramp.code[i];
    }
    const uint32_t buckets = bushd_ramp_bucket_entries(&ramp);
    RC_ASSERT(buckets == (total >> ramp.bucket_shift) + 1);
    RC_ASSERT(buckets <= 8 * (ramp.count + 8) + 9);
    uint32_t i = 0;
    for (uint32_t b = 0; b < buckets; ++b) {
      while (i < ramp.count && ramp.sum[i + 1] <= b << ramp.bucket_shift) ++i;
      RC_ASSERT(ramp.bucket[b] == i);
    }
  });
}

}  // namespace
}  // namespace bushd::test::table_test
