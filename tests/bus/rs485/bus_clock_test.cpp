#include "bus/rs485/bus_clock.h"

#include <gtest/gtest.h>

namespace bushd::link {
namespace {

constexpr std::int64_t kTickNs = 2'560'000;

TEST(BusClock, FirstReportIsTakenAsItIs) {
  BusClock clock(kTickNs);
  EXPECT_FALSE(clock.valid());
  EXPECT_EQ(clock.unwrap(0xFFFFFFF0u, 5), 0xFFFFFFF0);
  clock.sample(1000, 0, 1'000'000);
  EXPECT_TRUE(clock.valid());
  EXPECT_EQ(clock.tick_at(1'000'000), 1000);
  EXPECT_EQ(clock.tick_at(1'002'559), 1000);
  EXPECT_EQ(clock.tick_at(1'002'560), 1001);
  EXPECT_EQ(clock.tick_at(999'999), 999);
  EXPECT_EQ(clock.tick_at(-1'560'000), 0);
  EXPECT_EQ(clock.tick_at(-1'560'001), -1) << "before tick 0, rounded down";
}

TEST(BusClock, ATickBeginsWhenItIsFirstTold) {
  for (const std::int64_t tick_ns : {kTickNs, std::int64_t{1'000'001}}) {
    BusClock clock(tick_ns);
    clock.sample(1000, 123'457, 1'000'000);
    for (const Tick tick : {-1, 0, 1, 999, 1000, 1001, 123456}) {
      const std::int64_t begin_us = clock.begin_us(tick);
      EXPECT_EQ(clock.tick_at(begin_us), tick);
      EXPECT_EQ(clock.tick_at(begin_us - 1), tick - 1);
    }
  }
}

TEST(BusClock, SmallestLatencyCounts) {
  BusClock clock(kTickNs);
  // True bus time is host time; reports come 20, 3 and 9 ms late.
  for (const std::int64_t late_us : {20'000, 3'000, 9'000}) {
    clock.sample(500, 100'000, 1'280'100 + late_us);
  }
  // Its idea lags by those 3 ms and never leads.
  EXPECT_EQ(clock.tick_at(500 * 2560 + 3'000), 500);
  EXPECT_EQ(clock.tick_at(501 * 2560 + 2'999), 500);
  EXPECT_EQ(clock.tick_at(501 * 2560 + 3'000), 501);
}

TEST(BusClock, OldLatenciesAreForgotten) {
  BusClock clock(kTickNs);
  const auto report = [&](std::int64_t tick, std::int64_t late_us) {
    clock.sample(tick, 0, tick * 2560 + late_us);
  };
  report(0, 1'000);
  // A drifting crystal: 32 reports later the first is no measure any more.
  for (int i = 1; i <= 31; ++i) report(20 * i, 5'000);
  EXPECT_EQ(clock.tick_at(700 * 2560 + 1'000), 700) << "the best of the window still counts";
  report(640, 5'000);
  EXPECT_EQ(clock.tick_at(700 * 2560 + 1'000), 698);
  EXPECT_EQ(clock.tick_at(700 * 2560 + 5'000), 700);
}

TEST(BusClock, TicksUnwrapOverTwoToThe32) {
  BusClock clock(kTickNs);
  const std::int64_t top = (std::int64_t{1} << 32) - 10;
  clock.sample(top, 0, 1'000'000);
  EXPECT_EQ(clock.unwrap(0xFFFFFFF7u, 1'002'560), top + 1);
  EXPECT_EQ(clock.unwrap(5, 1'000'000 + 15 * 2560), top + 15);
  EXPECT_EQ(clock.unwrap(0xFFFFFFF0u, 1'000'000 + 15 * 2560), top - 6) << "an old one stays old";
  clock.sample(top + 15, 0, 1'000'000 + 15 * 2560);
  EXPECT_EQ(clock.tick_at(1'000'000 + 20 * 2560), top + 20);
}

TEST(BusClock, ResetForgetsAll) {
  BusClock clock(kTickNs);
  clock.sample(77, 0, 1'000'000);
  clock.reset();
  EXPECT_FALSE(clock.valid());
  clock.sample(5, 0, 9'000'000);
  EXPECT_EQ(clock.tick_at(9'000'000), 5);
}

}  // namespace
}  // namespace bushd::link
