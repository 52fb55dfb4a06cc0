// What is decoded and what is not, for all that can be done to a payload; and that the bytes are
// those of lcm-gen's types.
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

#include "lcm/all_messages.h"
#include "lcm/random_message.h"

namespace {

std::atomic<std::size_t> g_largest_allocation{0};
std::atomic<std::size_t> g_allocated{0};

}  // namespace

// Watches that no length from the network becomes an allocation of its own size.
// Not inlined: gcc would see malloc here and operator delete there, and warn of a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  g_largest_allocation = std::max(g_largest_allocation.load(), size);
  g_allocated += size;
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
Bytes bytes_of_good(const T& message) {
  return encode("TEST", message).value();
}

template <class Pair>
class Wire : public testing::Test {
 protected:
  using Message = typename Pair::Message;
  using Oracle = typename Pair::Oracle;

  Wire() { std::cout << "seed " << kSeed << "\n"; }

  // As it comes out of a decoder: what a type may hold and no message can say is gone.
  Bytes bytes() {
    const Bytes told = bytes_of_good(test::random_message<Message>(random_));
    return bytes_of_good(decode<Message>(told).value());
  }

  // What is taken means the same as what the encoder makes of it: true may be any byte but 0, and a
  // speed of 0 is none in whatever unit.
  static void expect_rejected_or_stable(const Bytes& payload) {
    const auto decoded = decode<Message>(payload);
    if (!decoded) return;
    const auto again = encode("TEST", *decoded);
    ASSERT_TRUE(again) << again.error().text();
    const auto once_more = decode<Message>(*again);
    ASSERT_TRUE(once_more);
    EXPECT_EQ(bytes_of_good(*once_more), *again);
  }

  test::Random random_{kSeed};
};

template <class>
struct TypesOf;
template <class... Pair>
struct TypesOf<std::tuple<Pair...>> {
  using Types = testing::Types<Pair...>;
};

class TypeNames {
 public:
  template <class Pair>
  static std::string GetName(int) {
    return Pair::Oracle::getTypeName();
  }
};
TYPED_TEST_SUITE(Wire, TypesOf<test::AllMessages>::Types, TypeNames);

// Names, their order and types are part of the fingerprint; so this compares all of them.
TYPED_TEST(Wire, TheFingerprintIsThatOfLcmGen) {
  EXPECT_EQ(fingerprint<typename TestFixture::Message>(),
            static_cast<std::uint64_t>(TestFixture::Oracle::getHash()));
}

TYPED_TEST(Wire, LcmGenReadsAndWritesTheSameBytes) {
  for (int i = 0; i < 500; ++i) {
    const Bytes sent = this->bytes();
    typename TestFixture::Oracle oracle{};
    const int size = static_cast<int>(sent.size());
    ASSERT_EQ(oracle.decode(sent.data(), 0, size), size);
    ASSERT_EQ(oracle.getEncodedSize(), size);
    Bytes again(sent.size());
    ASSERT_EQ(oracle.encode(again.data(), 0, size), size);
    EXPECT_EQ(again, sent);
    const auto heard = decode<typename TestFixture::Message>(again);
    ASSERT_TRUE(heard);
    EXPECT_EQ(bytes_of_good(*heard), sent);
  }
}

TYPED_TEST(Wire, NothingShorterOrLongerIsTaken) {
  for (int i = 0; i < 20; ++i) {
    Bytes sent = this->bytes();
    for (std::size_t length = 0; length < sent.size(); ++length) {
      EXPECT_FALSE(decode<typename TestFixture::Message>({sent.data(), length}));
    }
    sent.push_back(0);
    EXPECT_FALSE(decode<typename TestFixture::Message>(sent));
  }
}

TYPED_TEST(Wire, NoOtherFingerprintIsTaken) {
  Bytes sent = this->bytes();
  for (std::size_t bit = 0; bit < 64; ++bit) {
    sent[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_FALSE(decode<typename TestFixture::Message>(sent));
    sent[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
  }
}

TYPED_TEST(Wire, FlippedBitsAreRejectedOrAnotherValidMessage) {
  for (int i = 0; i < 10; ++i) {
    Bytes sent = this->bytes();
    for (std::size_t bit = 0; bit < sent.size() * 8; ++bit) {
      sent[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      this->expect_rejected_or_stable(sent);
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
        this->expect_rejected_or_stable(hostile);
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
    this->expect_rejected_or_stable(noise);
  }
}

// A motor of a result is told by some 70 bytes at least, and takes less than 400.
TEST(Decode, MemoryIsASmallMultipleOfThePayload) {
  Answer answer;
  answer.motors.resize(400);  // without texts
  const auto bytes = bytes_of_good(answer);
  g_allocated = 0;
  EXPECT_TRUE(decode<Answer>(bytes));
  EXPECT_LT(g_allocated, 400 * 400 + 4 * bytes.size());
}

TEST(Encode, RefusesTextsWithANul) {
  RequestMessage<api::Move> move{};
  move.request.id.client_id = std::string("a\0b", 3);
  const auto bytes = encode("MOVE", move);
  ASSERT_FALSE(bytes);
  EXPECT_NE(bytes.error().text().find("MOVE: one of its texts contains a NUL"), std::string::npos);
}

api::StateSnapshot state_of(int motors, std::size_t name_length) {
  api::StateSnapshot state{.bus = "hall", .mcu = "hall:1", .state = api::McuState::kReady};
  for (int i = 0; i < motors; ++i) state.motors.push_back({.name = std::string(name_length, 'x')});
  return state;
}

TEST(Encode, RefusesWhatDoesNotFitOneDatagram) {
  const auto bytes = encode(Part{}, 0, state_of(600, 63));
  ASSERT_FALSE(bytes);
  EXPECT_NE(bytes.error().text().find("datagram"), std::string::npos);
}

TEST(Size, StateOfOneMcuWithTheLongestNamesIsBelow4KiB) {
  EXPECT_LT(encode(Part{}, 0, state_of(16, 63)).value().payload.size(), 4096u);
}

TEST(Size, HealthOfABusWithEveryAddressFitsOneDatagram) {
  api::HealthSnapshot health{.bus = std::string(63, 'x'), .port_state = "open"};
  for (int i = 1; i <= 255; ++i) {
    health.mcus.push_back({.mcu = health.bus + ":" + std::to_string(i),
                           .address = i,
                           .unique_id = "0123456789abcdef"});
  }
  EXPECT_TRUE(encode(Part{}, health));
}

TEST(Size, MoveOf512MotorsFitsOneDatagram) {  // answers come in parts
  api::Move move;
  for (int i = 0; i < 512; ++i) move.motors.push_back({std::string(63, 'x'), 7});
  EXPECT_TRUE(encode(0, {}, api::Request(move)));
}

}  // namespace
}  // namespace bushd::lcm
