// Codes K of a converter, by fractions, and the exchange with a board that has one.
#include "base/converter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "engine/properties.h"
#include "heritage/commutator/exchange.h"
#include "sim/commutator_board.h"

namespace bushd::test {
namespace {

using commutator::Exchange;
using commutator::Status;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr Converter kPlain{.max_hz = 2500, .max_code = 250};
constexpr Exchange::Setup kWithConverter{.start_hz = 0, .baud = 1'000'000, .converter = kPlain};

Converter random_converter() {
  const auto max_code = between(1u, kMaxConverterCode);
  return {.max_hz = between(kLeastHzPerCode * max_code, kMaxConverterHz), .max_code = max_code};
}

__extension__ typedef unsigned __int128 Wide;
// A frequency as numerator / denominator, compared by products of 128 bits.
struct Fraction {
  Wide above;
  Wide below;
  friend bool operator<=(const Fraction& a, const Fraction& b) {
    return a.above * b.below <= b.above * a.below;
  }
};
Fraction hz_of(const Converter& converter, std::uint32_t code) {
  return {static_cast<Wide>(converter.max_hz) * code, converter.max_code};
}

TEST(ConverterCodes, AreTheLargestWhoseFrequencyIsNotAboveTheOneAskedFor) {
  holds("f(K) <= 1 / delay < f(K + 1), or K is at its end", [] {
    const Converter converter = random_converter();
    const auto delay_ns = between<int>(0, 3) == 0 ? *rc::gen::arbitrary<std::uint64_t>()
                                                  : between<std::uint64_t>(1, 600'000'000);
    const std::uint32_t code = converter_code(converter, delay_ns);
    RC_ASSERT(code <= converter.max_code);
    const Fraction asked{1'000'000'000, delay_ns};
    RC_ASSERT(hz_of(converter, code) <= asked);
    if (code < converter.max_code) RC_ASSERT(!(hz_of(converter, code + 1) <= asked));
    // So none is sooner than its delay, and a slower step has no higher code.
    if (code > 0 && code < converter.max_code) {
      RC_ASSERT(converter_period_ns(converter, code) >= delay_ns);
    }
    if (delay_ns < UINT64_MAX) RC_ASSERT(converter_code(converter, delay_ns + 1) <= code);
  });
}

TEST(ConverterCodes, AreTheirOwnPeriods) {
  for (std::uint32_t code = 1; code <= 250; ++code) {
    const std::uint64_t period_ns = converter_period_ns(kPlain, code);
    // The period is rounded up, by less than a nanosecond.
    EXPECT_EQ(converter_code(kPlain, period_ns - 1 + (100'000'000 % code == 0)), code);
    EXPECT_EQ(period_ns, (100'000'000 + code - 1) / code);
  }
  EXPECT_EQ(converter_code(kPlain, 0), 250u);
  EXPECT_EQ(converter_code(kPlain, 100'000'001), 0u);
}

TEST(ExchangeWithConverter, SendsTheCodeOfTheSpeed) {
  Exchange exchange(kWithConverter);
  exchange.step(0, 3, true, 400'000);  // 2500 steps/s
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(0, 0x8B, 250));
  EXPECT_TRUE(exchange.receive(500, 0x10).answer);
  exchange.step(500, 3, true, 10'000'001);  // a little less than 100 steps/s
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(9));
}

TEST(ExchangeWithConverter, HoldsBackWhatIsSlowerThanItsLowestCode) {
  Exchange exchange(kWithConverter);
  exchange.step(0, 0, false, 130'000'000);  // K = 1: 100 ms
  EXPECT_THAT(exchange.take_bytes(), IsEmpty());
  EXPECT_EQ(exchange.next_wake_us(), 30'000);
  exchange.advance(30'000);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(0, 0x80, 1));
}

// A converter may be slower or faster than it is to be: what it gives within the second of the
// board's watch is a step.
TEST(ExchangeWithConverter, WaitsForTheBoardsWatch) {
  Exchange exchange(kWithConverter);
  exchange.step(0, 0, false, 400'000);
  // Four bytes, 40 us; 1.04 s; 100 ms.
  EXPECT_EQ(exchange.next_wake_us(), 41 + 1'040'000 + 100'000);
  EXPECT_TRUE(exchange.receive(49, 0x10).stray);
  const auto answered = exchange.receive(1'000'000, 0x10);
  ASSERT_TRUE(answered.answer);
  exchange.step(2'000'000, 0, false, 400'000);
  const auto silent = exchange.receive(3'010'000, 0x21);
  ASSERT_TRUE(silent.answer);
  EXPECT_EQ(silent.answer->status, (Status{.right_limit = true, .no_pulse = true}));
  EXPECT_EQ(exchange.longest_us(), 1'040'000);
  EXPECT_EQ(exchange.most_steps_per_s(), 2500u);
}

TEST(ExchangeWithConverter, OnlyItsBoardSaysThatNoPulseCame) {
  EXPECT_FALSE(commutator::status_of(0x20));
  EXPECT_EQ(commutator::status_of(0x20, true), (Status{.no_pulse = true}));
  for (unsigned byte = 0x40; byte <= 0xFF; ++byte) {
    EXPECT_FALSE(commutator::status_of(static_cast<std::uint8_t>(byte), true)) << byte;
  }
}

}  // namespace
}  // namespace bushd::test
