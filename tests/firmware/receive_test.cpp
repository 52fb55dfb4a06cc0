// What an MCU hears on a line that others use too: whom it answers, what it drops and counts.
#include <array>

#include "firmware/rig.h"

namespace bushd::test {
namespace {

Bytes wire_of(std::uint8_t address, std::uint8_t type, const Bytes& payload = {},
              std::uint8_t sequence = 100) {
  Bytes wire(BUSHD_FRAME_MAX_WIRE);
  wire.resize(
      bushd_frame_encode(address, type, sequence, payload.data(), payload.size(), wire.data()));
  return wire;
}

// To all, so that nobody answers.
Bytes set_position_wire(std::int32_t steps, std::uint8_t sequence) {
  const bushd_set_position message = {0, steps};
  const Bytes payload = payload_of(message, bushd_encode_set_position);
  return wire_of(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SET_POSITION, payload, sequence);
}

// A line or an adapter may keep a frame back, or make it twice. What it asked for is then no longer
// wanted.
TEST(Receive, RequestsThatWereOvertakenChangeNothing) {
  Rig rig({.address = 7});
  rig.feed(set_position_wire(11, 250));
  rig.feed(set_position_wire(22, 251));
  rig.feed(set_position_wire(11, 250));
  rig.feed(set_position_wire(22, 251));
  const auto control = [](std::uint8_t action, std::uint8_t sequence) {
    return wire_of(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_CONTROL, {action}, sequence);
  };
  rig.feed(control(BUSHD_CONTROL_DISABLE, 3));
  rig.feed(control(BUSHD_CONTROL_ENABLE, 2));
  EXPECT_FALSE(rig.enabled());
  // Frames for others are counted along.
  rig.feed(wire_of(9, BUSHD_MSG_CONTROL, {BUSHD_CONTROL_DISABLE}, 10));
  rig.feed(set_position_wire(33, 9));
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.motor[0].position_steps, 22);
  EXPECT_EQ(report.last_rejection, BUSHD_E_LATE);
  EXPECT_EQ(report.rejected_frames, 4);
}

// A new master counts from anywhere.
TEST(Receive, AfterSilenceAnySequenceNumberIsNew) {
  Rig rig({.address = 7});
  rig.feed(set_position_wire(11, 200));
  rig.pass(41);  // 105 ms
  rig.feed(set_position_wire(22, 199));
  EXPECT_EQ(rig.poll().motor[0].position_steps, 22);
}

TEST(Receive, AnswersOnlyItsOwnAddress) {
  Rig rig({.address = 7});
  for (int address = 0; address <= 255; ++address) {
    for (const std::uint8_t type : {BUSHD_MSG_TABLES, BUSHD_MSG_CONTROL}) {
      rig.frame(static_cast<std::uint8_t>(address), type,
                type == BUSHD_MSG_CONTROL ? Bytes{0} : Bytes{});
      EXPECT_EQ(rig.answer().has_value(), address == 7) << address;
    }
  }
  EXPECT_EQ(rig.poll().bad_frames, 0);
  EXPECT_EQ(rig.poll().rejected_frames, 0) << "frames for others are no errors";
}

TEST(Receive, FramesForOthersHaveNoEffect) {
  Rig rig({.address = 7});
  rig.frame(8, BUSHD_MSG_CONTROL, {BUSHD_CONTROL_ENABLE});
  EXPECT_FALSE(rig.enabled());
  rig.frame(8, BUSHD_MSG_CONTROL, {0x55});
  EXPECT_EQ(rig.poll().rejected_frames, 0);
}

TEST(Receive, BroadcastActsWithoutAnswer) {
  Rig rig;
  rig.frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_CONTROL, {BUSHD_CONTROL_ENABLE});
  EXPECT_FALSE(rig.answer());
  EXPECT_TRUE(rig.enabled());
  rig.frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_CONTROL, {3});
  rig.frame(BUSHD_ADDRESS_BROADCAST, 0x33, {});
  EXPECT_FALSE(rig.answer());
  EXPECT_EQ(rig.poll().rejected_frames, 2);
}

TEST(Receive, RepliesOfOthersAndEchoesOfItsOwnAreIgnored) {
  Rig rig({.address = 7});
  for (const std::uint8_t address : std::initializer_list<std::uint8_t>{0, 7, 8}) {
    rig.frame(address, BUSHD_MSG_CONTROL | BUSHD_TYPE_REPLY, {BUSHD_CONTROL_ENABLE});
    rig.frame(address, BUSHD_MSG_POLL | BUSHD_TYPE_REPLY, {});
    rig.frame(address, 0xFF, {});
    EXPECT_FALSE(rig.answer());
  }
  EXPECT_FALSE(rig.enabled());
  EXPECT_EQ(rig.poll().rejected_frames, 0);
}

TEST(Receive, EveryFlippedBitIsFoundAndCounted) {
  Rig rig({.address = 7});
  const Bytes good = wire_of(7, BUSHD_MSG_CONTROL, {BUSHD_CONTROL_ENABLE});
  int bad = 0;
  for (std::size_t byte = 0; byte + 1 < good.size(); ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      Bytes wire = good;
      wire[byte] = static_cast<std::uint8_t>(wire[byte] ^ 1 << bit);
      rig.feed(wire);
      EXPECT_FALSE(rig.answer()) << byte << '.' << bit;
      EXPECT_FALSE(rig.enabled());
      // A bit that makes a delimiter cuts the frame in two pieces, both bad; an empty one is none.
      const bool cut = wire[byte] == 0;
      bad += cut && byte > 0 ? 2 : 1;
      ASSERT_EQ(rig.poll().bad_frames, bad) << byte << '.' << bit;
    }
  }
}

TEST(Receive, TooShortAndTooLongAreCountedOnceAndTheNextFrameIsHeard) {
  Rig rig({.address = 7});
  rig.feed(Bytes{0, 0, 0, 0});
  EXPECT_EQ(rig.poll().bad_frames, 0) << "nothing between delimiters is no error";
  rig.feed(Bytes{5, 1, 2, 3, 4, 0});
  EXPECT_EQ(rig.poll().bad_frames, 1);
  Bytes noise(5000, 0x41);
  noise.push_back(0);
  rig.feed(noise);
  EXPECT_EQ(rig.poll().bad_frames, 2);
  rig.feed(Bytes(100, 0xFF));
  rig.feed(wire_of(7, BUSHD_MSG_CONTROL, {BUSHD_CONTROL_ENABLE}));
  EXPECT_FALSE(rig.enabled()) << "noise ran into the frame";
  EXPECT_EQ(rig.poll().bad_frames, 3);
  rig.feed(Bytes(100, 0xFF));
  rig.feed(Bytes{0});
  rig.feed(wire_of(7, BUSHD_MSG_CONTROL, {BUSHD_CONTROL_ENABLE}, 101));
  EXPECT_TRUE(rig.enabled()) << "a delimiter first ends the noise";
}

TEST(Receive, CountersStopAtTheirEnd) {
  Rig rig({.address = 7});
  for (int i = 0; i < 65534; ++i) rig.feed(Bytes{1, 1, 0});
  EXPECT_EQ(rig.poll().bad_frames, 65534);
  for (int i = 0; i < 5; ++i) rig.feed(Bytes{1, 1, 0});
  EXPECT_EQ(rig.poll().bad_frames, 65535);
  const Bytes unknown = wire_of(BUSHD_ADDRESS_BROADCAST, 0x40);
  for (int i = 0; i < 65540; ++i) rig.feed(unknown);
  EXPECT_EQ(rig.poll().rejected_frames, 65535);
  EXPECT_EQ(rig.poll().last_rejection, BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(rig.poll().bad_frames, 65535);
}

TEST(Receive, AnswersBeginWithADelimiter) {
  Rig rig;
  rig.frame(BUSHD_MSG_TABLES, {});
  const auto answer = rig.answer();  // decodes from the first byte on, and accepts a single frame
  ASSERT_TRUE(answer);
  EXPECT_EQ(rig.last_sent().front(), 0);
  EXPECT_EQ(rig.last_sent().back(), 0);
}

TEST(Receive, AnswersInPiecesAreTheSame) {
  const auto report_of = [](bool in_pieces) {
    Rig rig({.motors = 16, .in_pieces = in_pieces});
    rig.frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, {1, 7, 5, 0, 0, 255});
    if (in_pieces) {
      EXPECT_FALSE(rig.answer()) << "it waits until there is time for it";
      rig.work();
    }
    const auto answer = rig.answer();
    EXPECT_TRUE(answer);
    return answer ? std::pair(answer->payload, answer->delay_ns) : std::pair(Bytes{}, 0u);
  };
  EXPECT_EQ(report_of(true), report_of(false));
}

}  // namespace
}  // namespace bushd::test
