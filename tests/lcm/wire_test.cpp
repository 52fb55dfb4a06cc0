// What is decoded and what is not, for all that can be done to a payload.
#include "lcm/wire.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <climits>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <new>
#include <string>

#include "lcm/messages.h"
#include "lcm/payloads.h"

namespace {

std::atomic<std::size_t> g_largest_allocation{0};

}  // namespace

// Watches that no length from the network becomes an allocation of its own size.
// Not inlined: gcc would see malloc here and operator delete there, and warn of a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  g_largest_allocation = std::max(g_largest_allocation.load(), size);
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace bushd::lcm {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t kSeed = 20040518;

template <class T>
class Wire : public testing::Test {
 protected:
  Wire() { std::cout << "seed " << kSeed << "\n"; }

  Bytes bytes() { return test::PayloadMaker(random_).make<T>(); }

  // The decoder takes a payload only if it is what the encoder makes of the message.
  static void expect_rejected_or_exact(const Bytes& payload) {
    if (const auto decoded = decode<T>(payload)) {
      const auto again = encode(*decoded);
      ASSERT_TRUE(again) << again.error().text();
      EXPECT_EQ(*again, payload);
    }
  }

  test::Random random_{kSeed};
};

// Of those of the same layout, one.
using Types =
    testing::Types<answer_t, arm_t, emergency_stop_t, get_table_t, health_t, hello_t,
                   mcu_description_t, mcu_state_t, move_line_t, move_t, position_compare_t,
                   set_position_t, set_table_t, stop_t, subscribe_t, table_answer_t, use_table_t,
                   welcome_t, get_history_t, history_answer_t, configure_t, configuration_answer_t,
                   home_t, jog_t, camac_request_t, camac_reply_t, camac_lam_t, move_path_t,
                   follow_t, arm_line_t>;

class TypeNames {
 public:
  template <class T>
  static std::string GetName(int) {
    return T::getTypeName();
  }
};
TYPED_TEST_SUITE(Wire, Types, TypeNames);

TYPED_TEST(Wire, EveryMessageComesBackAsItWas) {
  for (int i = 0; i < 500; ++i) {
    const Bytes sent = this->bytes();
    const auto decoded = decode<TypeParam>(sent);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(encode(*decoded).value(), sent);
  }
}

TYPED_TEST(Wire, NothingShorterOrLongerIsTaken) {
  for (int i = 0; i < 20; ++i) {
    Bytes sent = this->bytes();
    for (std::size_t length = 0; length < sent.size(); ++length) {
      EXPECT_FALSE(decode<TypeParam>({sent.data(), length}));
    }
    sent.push_back(0);
    EXPECT_FALSE(decode<TypeParam>(sent));
  }
}

TYPED_TEST(Wire, NoOtherFingerprintIsTaken) {
  Bytes sent = this->bytes();
  for (std::size_t bit = 0; bit < 64; ++bit) {
    sent[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_FALSE(decode<TypeParam>(sent));
    sent[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
  }
}

TYPED_TEST(Wire, FlippedBitsAreRejectedOrAnotherValidMessage) {
  for (int i = 0; i < 10; ++i) {
    Bytes sent = this->bytes();
    for (std::size_t bit = 0; bit < sent.size() * 8; ++bit) {
      sent[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      this->expect_rejected_or_exact(sent);
      sent[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    }
  }
}

// At every place, so at those of all string and array lengths too.
TYPED_TEST(Wire, HostileLengthsAreRejectedWithoutAllocatingForThem) {
  constexpr std::array<std::int32_t, 9> kLengths{-1,      -5,      0,       1 << 16,    1 << 24,
                                                 INT_MIN, INT_MAX, 1 << 28, INT_MIN + 1};
  for (int i = 0; i < 20; ++i) {
    const Bytes sent = this->bytes();
    g_largest_allocation = 0;
    for (std::size_t at = 8; at + 4 <= sent.size(); ++at) {
      for (const std::int32_t length : kLengths) {
        Bytes hostile = sent;
        for (std::size_t k = 0; k < 4; ++k) {
          hostile[at + k] =
              static_cast<std::uint8_t>(static_cast<std::uint32_t>(length) >> (24 - 8 * k));
        }
        this->expect_rejected_or_exact(hostile);
      }
    }
    EXPECT_LT(g_largest_allocation, kMaxMessageBytes);
  }
}

TYPED_TEST(Wire, NoiseBehindTheFingerprintIsRejectedOrAnotherValidMessage) {
  const Bytes valid = this->bytes();
  for (int i = 0; i < 20000; ++i) {
    Bytes noise(valid.begin(), valid.begin() + 8);
    for (std::size_t n = test::below(this->random_, 300); n > 0; --n) {
      // Mostly small numbers: lengths that fit now and then.
      noise.push_back(
          static_cast<std::uint8_t>(this->random_() >> (test::below(this->random_, 4) * 18)));
      if (test::below(this->random_, 2) == 0)
        noise.back() = static_cast<std::uint8_t>(noise.back() & 3);
    }
    this->expect_rejected_or_exact(noise);
  }
}

TEST(Encode, RefusesCountsThatAreNotThoseOfTheArrays) {
  test::Random random(kSeed);
  auto move = test::random_message<move_t>(random);
  ++move.motor_count;
  EXPECT_FALSE(encode(move));
  move.motor_count = -1;
  EXPECT_FALSE(encode(move));
  auto answer = test::random_message<answer_t>(random);
  answer.outcomes.emplace_back();
  EXPECT_FALSE(encode(answer));
  auto health = test::random_message<health_t>(random);
  health.latency_below_us.emplace_back();
  EXPECT_FALSE(encode(health));
}

TEST(Encode, RefusesCountsWithin) {
  table_answer_t tables{};
  tables.tables.push_back(table_t{});
  tables.table_count = 1;
  EXPECT_TRUE(encode(tables));
  tables.tables[0].accel_count = 1;
  EXPECT_FALSE(encode(tables));
  answer_t answer{};
  answer.plan.push_back(move_plan_t{});
  answer.plan_count = 1;
  EXPECT_TRUE(encode(answer));
  answer.plan[0].motor_count = 1;
  EXPECT_FALSE(encode(answer));
}

TEST(Encode, RefusesTextsWithANul) {
  move_t move{};
  move.request.client_id = std::string("a\0b", 3);
  const auto bytes = encode(move);
  ASSERT_FALSE(bytes);
  EXPECT_NE(bytes.error().text().find("NUL"), std::string::npos);
}

TEST(Encode, RefusesWhatDoesNotFitOneDatagram) {
  const auto bytes = encode(test::state_part(1, 0, 1, 600, 63));
  ASSERT_FALSE(bytes);
  EXPECT_NE(bytes.error().text().find("datagram"), std::string::npos);
}

TEST(Size, StateOfOneMcuWithTheLongestNamesIsBelow4KiB) {
  EXPECT_LT(encode(test::state_part(1, 0, 1, 16, 63)).value().size(), 4096u);
}

TEST(Size, HealthOfABusWithEveryAddressFitsOneDatagram) {
  EXPECT_TRUE(encode(test::health_part(1, 0, 1, 255, std::string(63, 'x'))));
}

TEST(Size, MoveOf512MotorsFitsOneDatagram) {  // answers come in parts
  move_t move{};
  for (int i = 0; i < 512; ++i) {
    motor_amount_t amount{};
    amount.motor = std::string(63, 'x');
    move.motors.push_back(amount);
  }
  move.motor_count = 512;
  EXPECT_TRUE(encode(move));
}

}  // namespace
}  // namespace bushd::lcm
