#include "lcm/transport.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <iostream>
#include <stdexcept>
#include <string>

#include "lcm/messages.h"
#include "lcm/random_message.h"

namespace bushd::lcm {
namespace {

std::unique_ptr<Transport> in_process() {
  return std::move(Transport::open("memq://").value());
}

bool readable(const Transport& transport) {
  pollfd polled{.fd = transport.fd(), .events = POLLIN, .revents = 0};
  return poll(&polled, 1, 0) == 1;
}

using Bytes = std::vector<std::uint8_t>;

Bytes numbered(std::int64_t number) {
  return encode(0, {.number = number}, api::Request(api::Stop{})).value().payload;
}
std::int64_t number_of(std::span<const std::uint8_t> payload) {
  return decode_client_message("STOP", payload).value().id.number;
}

TEST(Transport, DeliversWhatWasPublishedInItsOrder) {
  const auto transport = in_process();
  std::vector<std::int64_t> heard;
  ASSERT_TRUE(transport->subscribe("BUSHD_STOP",
                                   [&](auto payload) { heard.push_back(number_of(payload)); }));
  for (int i = 1; i <= 100; ++i) ASSERT_TRUE(transport->publish("BUSHD_STOP", numbered(i)));
  EXPECT_TRUE(readable(*transport));
  transport->handle();
  EXPECT_FALSE(readable(*transport));
  ASSERT_EQ(heard.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(heard[static_cast<std::size_t>(i)], i + 1);
}

TEST(Transport, HandleReturnsWhenNothingWaits) {
  in_process()->handle();
}

TEST(Transport, AFloodDoesNotKeepTheCaller) {
  const auto transport = in_process();
  int heard = 0;
  // Every message makes another one.
  ASSERT_TRUE(transport->subscribe("C", [&](auto payload) {
    ++heard;
    EXPECT_TRUE(transport->publish("C", payload));
  }));
  ASSERT_TRUE(transport->publish("C", numbered(1)));
  transport->handle();
  EXPECT_EQ(heard, Transport::kQueueCapacity);
  EXPECT_TRUE(readable(*transport));
}

TEST(Transport, ChannelsAreNamesAndNotPatterns) {
  const auto transport = in_process();
  int heard = 0;
  ASSERT_TRUE(transport->subscribe("LAB.2+(x)_STOP", [&](auto /*payload*/) { ++heard; }));
  ASSERT_TRUE(transport->publish("LABx2+(x)_STOP", numbered(1)));
  ASSERT_TRUE(transport->publish("LAB.2+(x)_STOP", numbered(1)));
  transport->handle();
  EXPECT_EQ(heard, 1);
}

TEST(Transport, RefusesChannelNamesThatLcmCannotSend) {
  const auto transport = in_process();
  const std::string longest(63, 'x');
  EXPECT_TRUE(transport->publish(longest, numbered(1)));
  EXPECT_FALSE(transport->publish(longest + "x", numbered(1)));
  EXPECT_FALSE(transport->subscribe("", [](auto /*payload*/) {}));
}

TEST(Transport, AnExceptionOfAHandlerComesOutAndTheNextMessagesStillArrive) {
  const auto transport = in_process();
  std::int64_t last = 0;
  ASSERT_TRUE(transport->subscribe("C", [&](auto payload) {
    last = number_of(payload);
    if (last == 1) throw std::runtime_error("handler");
  }));
  ASSERT_TRUE(transport->publish("C", numbered(1)));
  ASSERT_TRUE(transport->publish("C", numbered(2)));
  EXPECT_THROW(transport->handle(), std::runtime_error);
  transport->handle();
  EXPECT_EQ(last, 2);
}

template <class T>
void expect_survives_hostile_payloads() {
  constexpr std::uint64_t kSeed = 19850101;
  std::cout << "seed " << kSeed << "\n";
  test::Random random(kSeed);
  const auto transport = in_process();
  std::uint64_t heard = 0;
  std::uint64_t rejected = 0;
  ASSERT_TRUE(
      transport->subscribe("C", [&](auto payload) { ++(decode<T>(payload) ? heard : rejected); }));
  std::uint64_t valid = 0;
  std::uint64_t hostile = 0;
  for (int round = 0; round < 2000; ++round) {
    auto bytes = encode("TEST", test::random_message<T>(random)).value();
    ASSERT_TRUE(transport->publish("C", bytes));
    ++valid;
    switch (test::below(random, 4)) {
      case 0:
        bytes.resize(test::below(random, bytes.size()));
        break;
      case 1:
        bytes.push_back(static_cast<std::uint8_t>(random()));
        break;
      case 2:
        bytes[test::below(random, 8)] ^= 0x10;
        break;
      default:  // the length of the first string, or the fields around it
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(8 + test::below(random, 60) % 9),
                    16, std::uint8_t{0xFF});
    }
    if (!decode<T>(bytes)) {
      ASSERT_TRUE(transport->publish("C", bytes));
      ++hostile;
    }
    transport->handle();
  }
  const std::vector<std::uint8_t> oversized(kMaxMessageBytes + 1);
  ASSERT_TRUE(transport->publish("C", oversized));
  transport->handle();
  EXPECT_EQ(heard, valid);
  EXPECT_EQ(rejected, hostile + 1);
  EXPECT_GT(hostile, 1000u);
}

TEST(Transport, HostileMovesAreCountedAndValidOnesArrive) {
  expect_survives_hostile_payloads<RequestMessage<api::Move>>();
}
TEST(Transport, HostileAnswersAreCountedAndValidOnesArrive) {
  expect_survives_hostile_payloads<Answer>();
}
TEST(Transport, HostileStatesAreCountedAndValidOnesArrive) {
  expect_survives_hostile_payloads<StateMessage>();
}

TEST(Transport, AnUnusableUrlIsNamedTogetherWithTheRemedy) {
  testing::internal::CaptureStderr();
  const auto nonsense = Transport::open("nonsense");
  ASSERT_FALSE(nonsense);
  EXPECT_NE(nonsense.error().text().find("nonsense"), std::string::npos);
  const auto no_address = Transport::open("udpm://239.255.76.999:7667?ttl=0");
  ASSERT_FALSE(no_address);
  EXPECT_NE(no_address.error().text().find("ip route replace"), std::string::npos);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "of the library";
}

}  // namespace
}  // namespace bushd::lcm
