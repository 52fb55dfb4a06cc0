#include "sim/wire.h"

#include <gtest/gtest.h>

#include <array>
#include <numeric>

namespace bushd::sim::wire_test {
namespace {

constexpr std::uint32_t kBaud = 500'000;
constexpr TimeNs kByteNs = 20'000;
using Bytes = std::vector<std::uint8_t>;

class TwoTalkers : public testing::Test {
 protected:
  Wire wire{kBaud};
  std::size_t a = wire.add_talker();
  std::size_t b = wire.add_talker();
};

TEST_F(TwoTalkers, ByteTakesTenBitTimes) {
  EXPECT_EQ(wire.next_end_ns(), kNever);
  EXPECT_EQ(wire.send(a, Bytes{0x11, 0x22}, 1000), 1000 + 2 * kByteNs);
  const WireByte first = wire.take();
  EXPECT_EQ(first.start_ns, 1000);
  EXPECT_EQ(first.end_ns, 1000 + kByteNs);
  EXPECT_EQ(first.value, 0x11);
  EXPECT_FALSE(first.corrupted);
  const WireByte second = wire.take();
  EXPECT_EQ(second.start_ns, first.end_ns);
  EXPECT_EQ(wire.next_end_ns(), kNever);
}

TEST_F(TwoTalkers, BytesOfOneTalkerQueueBehindEachOther) {
  wire.send(a, Bytes{1}, 0);
  EXPECT_EQ(wire.send(a, Bytes{2}, kByteNs / 2), 2 * kByteNs);
  EXPECT_EQ(wire.send(a, Bytes{3}, 5 * kByteNs), 6 * kByteNs);
  EXPECT_EQ(wire.busy_until_ns(), 6 * kByteNs);
}

TEST(Wire, ByteTimesDoNotDriftAtAnOddBaudRate) {
  Wire wire(115'200);  // 86805.5... ns a byte
  const std::size_t talker = wire.add_talker();
  const Bytes block(115'200 / 8, 0x55);
  TimeNs end_ns = 0;
  for (int i = 0; i < 8 * 3; ++i) {
    end_ns = wire.send(talker, block, 0);
    while (wire.next_end_ns() != kNever) wire.take();
  }
  EXPECT_EQ(end_ns, 30'000'000'000);
}

TEST_F(TwoTalkers, TalkersInTurnDoNotCollide) {
  wire.send(a, Bytes{1}, 0);
  wire.send(b, Bytes{2}, kByteNs);
  EXPECT_FALSE(wire.take().corrupted);
  EXPECT_FALSE(wire.take().corrupted);
}

TEST_F(TwoTalkers, OverlapCorruptsTheBytesOfBothAndNoOthers) {
  wire.send(a, Bytes(10, 0x0F), 0);
  wire.send(b, Bytes(2, 0xF0), 4 * kByteNs + kByteNs / 2);  // over bytes 4, 5, 6 of a
  int corrupted_a = 0, corrupted_b = 0, collisions = 0;
  while (wire.next_end_ns() != kNever) {
    const WireByte byte = wire.take();
    const std::uint8_t sent = byte.talker == a ? 0x0F : 0xF0;
    EXPECT_EQ(byte.corrupted, byte.value != sent);
    if (byte.corrupted) (byte.talker == a ? corrupted_a : corrupted_b) += 1;
    if (byte.collision) {
      ++collisions;
      EXPECT_EQ(byte.collision->time_ns, 4 * kByteNs + kByteNs / 2);
      EXPECT_EQ(byte.collision->talker[0], a);
      EXPECT_EQ(byte.collision->talker[1], b);
    }
  }
  EXPECT_EQ(corrupted_a, 3);
  EXPECT_EQ(corrupted_b, 2);
  EXPECT_EQ(collisions, 1);
}

TEST_F(TwoTalkers, EachNewOverlapIsACollisionOfItsOwn) {
  for (int i = 0; i < 3; ++i) {
    wire.send(a, Bytes(2, 1), i * 10 * kByteNs);
    wire.send(b, Bytes(2, 2), i * 10 * kByteNs + 1);
  }
  int collisions = 0;
  while (wire.next_end_ns() != kNever) collisions += wire.take().collision.has_value();
  EXPECT_EQ(collisions, 3);
}

TEST_F(TwoTalkers, SilencedTalkerBreaksItsByteOffAndDropsTheRest) {
  wire.send(a, Bytes{1, 2, 3}, 0);
  wire.take();
  wire.silence(a, kByteNs + 1);
  const WireByte broken = wire.take();
  EXPECT_TRUE(broken.corrupted);
  EXPECT_FALSE(broken.collision);
  EXPECT_EQ(wire.next_end_ns(), kNever);
  EXPECT_EQ(wire.send(a, Bytes{4}, 10 * kByteNs), 11 * kByteNs);
}

}  // namespace
}  // namespace bushd::sim::wire_test
