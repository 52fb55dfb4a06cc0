// Which ticks can still be changed, and how far ahead of the present that is.
#include "bus/rs485/horizon.h"

#include <gtest/gtest.h>

namespace bushd::link {
namespace {

TEST(Horizon, NextTickButOneCanBeChanged) {
  EXPECT_EQ(first_changeable(100), 102);
  EXPECT_FALSE(too_late(102, 100));
  EXPECT_TRUE(too_late(101, 100));
}

class AtTick1000 : public testing::Test {
 protected:
  AtTick1000() { clock.sample(1000, 0, kNowUs); }
  static constexpr std::int64_t kNowUs = 5'000'000;
  BusClock clock{1'000'000};
  Latency latency;
  Horizon horizon{clock, latency};
};

TEST_F(AtTick1000, StartsLeaveTimeForTwoPolls) {
  EXPECT_EQ(horizon.earliest_start(kNowUs), 1100);
}

TEST_F(AtTick1000, ReplacementIsStillChangeableWhenItArrives) {
  const Tick at = horizon.earliest_replace(kNowUs, kNowUs);
  EXPECT_EQ(at, 1013) << "10 ms, the two ticks of the MCU, one by which this clock may lag";
  EXPECT_FALSE(too_late(at, clock.tick_at(kNowUs + 10'000) + 1));
  EXPECT_EQ(horizon.earliest_replace(kNowUs, kNowUs + 30'000), 1043) << "the line takes so long";
}

TEST_F(AtTick1000, WhatAnAdapterHoldsBackComesOnTop) {
  latency.recent_us = 5'000;
  EXPECT_EQ(horizon.earliest_start(kNowUs), 1120);
  EXPECT_EQ(horizon.earliest_replace(kNowUs, kNowUs), 1023);
  EXPECT_EQ(horizon.queue_target_us(), 320'000);
  EXPECT_EQ(horizon.queue_urgent_us(50'000), 140'000);
}

TEST_F(AtTick1000, LatencyOfAStoppedProgramIsNotTheAdapters) {
  latency.recent_us = 3'000'000;
  EXPECT_EQ(horizon.earliest_start(kNowUs), 1260);
  EXPECT_EQ(horizon.earliest_replace(kNowUs, kNowUs), 1093);
}

}  // namespace
}  // namespace bushd::link
