#include "tools/bushsim/adapter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

namespace bushsim {
namespace {

using bushd::sim::kNever;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::int64_t kMs = 1'000'000;

TEST(Adapter, WithoutALatencyBytesGoOnAtOnce) {
  Adapter adapter({});
  adapter.take_from_line(1, 5 * kMs);
  adapter.take_from_line(2, 6 * kMs);
  EXPECT_EQ(adapter.next_packet_ns(), kNever);
  EXPECT_THAT(adapter.take_packets(6 * kMs), ElementsAre(1, 2));
  EXPECT_THAT(adapter.take_packets(7 * kMs), IsEmpty());
}

TEST(Adapter, HoldsBytesUntilTheTimerHasRun) {
  Adapter adapter({.latency_ns = 16 * kMs});
  adapter.take_from_line(1, 33 * kMs);  // the timer has run at 16 and 32 ms, with nothing to send
  adapter.take_from_line(2, 47 * kMs);
  EXPECT_EQ(adapter.next_packet_ns(), 48 * kMs);
  EXPECT_THAT(adapter.take_packets(48 * kMs - 1), IsEmpty());
  EXPECT_THAT(adapter.take_packets(48 * kMs), ElementsAre(1, 2));
  EXPECT_EQ(adapter.next_packet_ns(), kNever);
}

TEST(Adapter, AByteThatComesWithTheTimerIsOfTheNextPacket) {
  Adapter adapter({.latency_ns = 4 * kMs});
  adapter.take_from_line(1, 4 * kMs);
  EXPECT_EQ(adapter.next_packet_ns(), 8 * kMs);
}

TEST(Adapter, AFullPacketGoesAtOnceAndStartsTheTimerAnew) {
  Adapter adapter({.latency_ns = 16 * kMs});
  for (std::size_t i = 0; i < Adapter::kPacketBytes; ++i) adapter.take_from_line(7, 3 * kMs);
  EXPECT_THAT(adapter.take_packets(3 * kMs), SizeIs(Adapter::kPacketBytes));
  adapter.take_from_line(8, 4 * kMs);
  EXPECT_EQ(adapter.next_packet_ns(), 19 * kMs);
}

TEST(Adapter, WhatItHoldsIsLostWithItsPower) {
  Adapter adapter({.latency_ns = 16 * kMs});
  adapter.take_from_line(1, kMs);
  adapter.drop();
  EXPECT_EQ(adapter.next_packet_ns(), kNever);
  EXPECT_THAT(adapter.take_packets(99 * kMs), IsEmpty());
}

// Zeros, of which so many bits become ones.
std::vector<std::uint8_t> garbled(Adapter& adapter, std::size_t bytes) {
  std::vector<std::uint8_t> passed(bytes);
  adapter.pass_to_line(passed);
  return passed;
}

std::uint64_t ones(const std::vector<std::uint8_t>& bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), std::uint64_t{0},
                         [](std::uint64_t sum, std::uint8_t byte) {
                           return sum + static_cast<std::uint64_t>(std::popcount(byte));
                         });
}

TEST(Adapter, WithoutBitErrorsBytesPassAsTheyAre) {
  Adapter adapter({.seed = 5});
  EXPECT_EQ(ones(garbled(adapter, 100'000)), 0u);
  EXPECT_EQ(adapter.flipped_bits(), 0u);
}

TEST(Adapter, BitsAreFlippedAtTheRateThatWasGiven) {
  constexpr std::size_t kBytes = 1'000'000;
  for (const double rate : {1e-4, 0.01, 0.5}) {
    Adapter adapter({.bit_error_rate = rate, .seed = 11});
    const auto flipped = ones(garbled(adapter, kBytes));
    const double expected = 8 * kBytes * rate;
    // Five standard deviations of a binomial distribution.
    EXPECT_NEAR(static_cast<double>(flipped), expected, 5 * std::sqrt(expected * (1 - rate)));
    EXPECT_EQ(adapter.flipped_bits(), flipped);
  }
}

TEST(Adapter, TheSeedTellsWhichInEachDirection) {
  const AdapterOptions options{.bit_error_rate = 0.05, .seed = 3};
  Adapter one(options);
  Adapter other(options);
  // However the bytes are divided, and whatever passes the other way meanwhile.
  const auto whole = garbled(one, 300);
  auto divided = garbled(other, 100);
  for (int i = 0; i < 50; ++i) other.take_from_line(0, i);
  const auto rest = garbled(other, 200);
  divided.insert(divided.end(), rest.begin(), rest.end());
  EXPECT_EQ(divided, whole);

  const auto back = other.take_packets(50);
  EXPECT_GT(ones(back), 0u);
  EXPECT_NE(back, std::vector(whole.begin(), whole.begin() + 50));
  Adapter third({.bit_error_rate = 0.05, .seed = 4});
  EXPECT_NE(garbled(third, 300), whole);
}

}  // namespace
}  // namespace bushsim
