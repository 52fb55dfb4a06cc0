#include "engine/frame.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/properties.h"

namespace bushd::test::frame_test {
namespace {

using Bytes = std::vector<uint8_t>;

constexpr uint8_t kFills[] = {0x00, 0x01, 0xA5, 0xFF};

struct Frame {
  uint8_t address = 0;
  uint8_t type = 0;
  uint8_t sequence = 0;
  Bytes payload;

  bool operator==(const Frame&) const = default;
};

Bytes encode(const Frame& frame) {
  Bytes wire(BUSHD_FRAME_MAX_WIRE);
  wire.resize(bushd_frame_encode(frame.address, frame.type, frame.sequence, frame.payload.data(),
                                 frame.payload.size(), wire.data()));
  return wire;
}

// What a receiver makes of a stream of bytes.
struct Heard {
  std::vector<Frame> frames;
  int bad_crc = 0;
  int bad_length = 0;
};

Heard receive(const Bytes& bytes, bushd_receiver* receiver) {
  Heard heard;
  for (const uint8_t byte : bytes) {
    bushd_frame frame;
    switch (bushd_receive_byte(receiver, byte, &frame)) {
      case BUSHD_RECEIVE_MORE:
        break;
      case BUSHD_RECEIVE_FRAME:
        heard.frames.push_back({frame.address, frame.type, frame.sequence,
                                Bytes(frame.payload, frame.payload + frame.payload_size)});
        break;
      case BUSHD_RECEIVE_BAD_CRC:
        ++heard.bad_crc;
        break;
      case BUSHD_RECEIVE_BAD_LENGTH:
        ++heard.bad_length;
        break;
    }
  }
  return heard;
}

Heard receive(const Bytes& bytes) {
  bushd_receiver receiver{};
  return receive(bytes, &receiver);
}

// COBS by its definition (Cheshire and Baker): blocks of non-zero bytes, each led by its length +
// 1, a zero after every block but the last and those of length 254.
Bytes cobs_decode(const Bytes& wire) {
  Bytes raw;
  size_t at = 0;
  while (at < wire.size()) {
    const uint8_t code = wire[at++];
    for (int i = 1; i < code; ++i) raw.push_back(wire.at(at++));
    if (code != 255 && at < wire.size()) raw.push_back(0);
  }
  return raw;
}

// Bytes with many zeros, with none, or with everything.
Bytes any_bytes(size_t size) {
  const auto low = *rc::gen::element(0, 0, 1);
  const auto high = *rc::gen::element(1, 2, 255);
  Bytes bytes(size);
  for (auto& byte : bytes)
    byte = between<uint8_t>(static_cast<uint8_t>(low), static_cast<uint8_t>(high));
  return bytes;
}

Frame any_frame() {
  return {*rc::gen::arbitrary<uint8_t>(), *rc::gen::arbitrary<uint8_t>(),
          *rc::gen::arbitrary<uint8_t>(), any_bytes(between<size_t>(0, BUSHD_FRAME_MAX_PAYLOAD))};
}

TEST(Frame, OfEverySizeComesBackWhole) {
  for (size_t size = 0; size <= BUSHD_FRAME_MAX_PAYLOAD; ++size) {
    for (const uint8_t fill : kFills) {
      const Frame frame{fill, 0x0B, fill, Bytes(size, fill)};
      const Bytes wire = encode(frame);
      ASSERT_EQ(wire.size(), size + BUSHD_FRAME_OVERHEAD);
      const Heard heard = receive(wire);
      ASSERT_EQ(heard.frames, std::vector<Frame>{frame}) << size << " bytes of " << int{fill};
    }
  }
}

TEST(Frame, IsStandardCobsWithTheCrcBehindTheRawBytes) {
  holds("wire == COBS(raw) 00", [] {
    const Frame frame = any_frame();
    Bytes wire = encode(frame);
    RC_ASSERT(wire.back() == 0);
    wire.pop_back();
    for (const uint8_t byte : wire) RC_ASSERT(byte != 0);
    Bytes raw = frame.payload;
    raw.insert(raw.begin(), {frame.address, frame.type, frame.sequence});
    const uint32_t crc = ~bushd_crc32(BUSHD_CRC32_START, raw.data(), raw.size());
    for (int shift = 0; shift < 32; shift += 8) raw.push_back(static_cast<uint8_t>(crc >> shift));
    RC_ASSERT(cobs_decode(wire) == raw);
  });
}

TEST(Frame, ComesBackWholeWhateverItHolds) {
  holds("decode(encode(frame)) == frame, one after the other", [] {
    const std::vector<Frame> frames{any_frame(), any_frame(), any_frame()};
    Bytes line;
    for (const Frame& frame : frames) {
      for (const uint8_t byte : encode(frame)) line.push_back(byte);
    }
    RC_ASSERT(receive(line).frames == frames);
  });
}

// Flips bits of data bytes only: the raw frame then has exactly these bits wrong. (A COBS distance
// that is hit moves zeros about, that is many raw bits; against those stands the length and a
// chance of 2^-16.)
void flip_data_bits(Bytes* wire, int count) {
  std::vector<bool> is_data(wire->size(), true);
  for (size_t at = 0; at < wire->size(); at += std::max<size_t>((*wire)[at], 1))
    is_data[at] = false;
  for (int tries = 0; count > 0 && tries < 10000; ++tries) {
    const auto bit = between<size_t>(0, wire->size() * 8 - 1);
    const auto flipped = static_cast<uint8_t>((*wire)[bit / 8] ^ (1u << bit % 8));
    if (!is_data[bit / 8] || flipped == 0) continue;
    (*wire)[bit / 8] = flipped;
    --count;
  }
}

TEST(Frame, WithUpToThreeDataBitsWrongIsNeverTaken) {
  holds("hamming distance of 4 over the longest frame", [] {
    const Bytes good = encode(any_frame());
    for (int i = 0; i < 100; ++i) {
      Bytes wire = good;
      flip_data_bits(&wire, between(1, 4));
      RC_ASSERT(wire == good || receive(wire).bad_crc == 1);
    }
  });
}

TEST(Frame, WithAnySingleBitWrongIsNeverTaken) {
  for (const size_t size : {0u, 1u, 5u, 10u, 57u, 129u, 247u}) {
    for (const uint8_t fill : kFills) {
      Bytes payload(size, fill);
      for (size_t i = 0; i < size; i += 7) payload[i] = static_cast<uint8_t>(i);
      const Bytes good = encode({1, 11, 42, payload});
      for (size_t bit = 0; bit < good.size() * 8; ++bit) {
        Bytes wire = good;
        wire[bit / 8] = static_cast<uint8_t>(wire[bit / 8] ^ (1u << bit % 8));
        wire.push_back(0);  // where the delimiter itself was hit
        const Heard heard = receive(wire);
        ASSERT_TRUE(heard.frames.empty()) << size << " bytes, bit " << bit;
        ASSERT_GE(heard.bad_crc + heard.bad_length, 1);
      }
    }
  }
}

TEST(Receiver, IgnoresEmptyFrames) {
  const Heard heard = receive(Bytes(10, 0));
  EXPECT_TRUE(heard.frames.empty());
  EXPECT_EQ(heard.bad_crc + heard.bad_length, 0);
}

TEST(Receiver, RefusesTruncatedFrames) {
  for (const size_t size : {0u, 1u, 10u, 129u, 247u}) {
    for (const uint8_t fill : kFills) {
      const Bytes wire = encode({1, 11, 42, Bytes(size, fill)});
      const auto at = [&](size_t i) { return wire.begin() + static_cast<std::ptrdiff_t>(i); };
      for (size_t cut = 1; cut + 1 < wire.size(); ++cut) {
        Bytes head(wire.begin(), at(cut));
        head.push_back(0);
        ASSERT_TRUE(receive(head).frames.empty()) << size << " bytes cut at " << cut;
        ASSERT_TRUE(receive(Bytes(at(cut), wire.end())).frames.empty());
      }
    }
  }
}

TEST(Receiver, RefusesFramesTooShortForHeaderAndCrc) {
  for (size_t size = 1; size <= BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC; ++size) {
    Bytes line(size, static_cast<uint8_t>(size));
    line.push_back(0);
    EXPECT_EQ(receive(line).bad_length, 1) << size;
  }
}

TEST(Receiver, RefusesADistanceThatPointsBeyondTheEnd) {
  Bytes wire = encode({1, 2, 3, {4, 5, 6}});
  wire[0] = 200;
  EXPECT_EQ(receive(wire).bad_length, 1);
}

TEST(Receiver, CountsAnOverlongFrameOnceAndGoesOn) {
  const Frame good{7, 9, 1, {1, 2, 3}};
  for (const size_t size : {256u, 257u, 300u, 70000u}) {
    Bytes line(size, 0x11);
    line.push_back(0);
    for (const uint8_t byte : encode(good)) line.push_back(byte);
    const Heard heard = receive(line);
    EXPECT_EQ(heard.bad_length, 1) << size;
    EXPECT_EQ(heard.frames, std::vector<Frame>{good}) << size;
  }
}

TEST(Receiver, ChecksRepliesThatItDoesNotKeep) {
  holds("other frames come as they are", [] {
    const Frame frame = any_frame();
    const bool reply = (frame.type & BUSHD_TYPE_REPLY) != 0;
    Bytes wire = encode(frame);
    const bool damaged = *rc::gen::arbitrary<bool>();
    if (damaged) {
      uint8_t& byte = wire[between<size_t>(0, wire.size() - 2)];
      byte ^= static_cast<uint8_t>(byte == 1 ? 2 : 1);  // not into a delimiter
    }
    const auto piece = between<size_t>(1, 40);
    bushd_receiver receiver{};
    Heard heard;
    bool passed = false;
    for (size_t at = 0; at < wire.size(); at += piece) {
      const auto end = std::min(at + piece, wire.size());
      const Heard more = receive(Bytes(wire.begin() + static_cast<std::ptrdiff_t>(at),
                                       wire.begin() + static_cast<std::ptrdiff_t>(end)),
                                 &receiver);
      heard.frames.insert(heard.frames.end(), more.frames.begin(), more.frames.end());
      heard.bad_crc += more.bad_crc;
      heard.bad_length += more.bad_length;
      const auto size = receiver.size;
      bushd_receiver_pass_reply(&receiver);
      passed = passed || receiver.size < size;
      if (reply && !damaged) RC_ASSERT(receiver.size <= 1 + BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC);
    }
    if (damaged) {
      RC_ASSERT(heard.frames.empty());
      RC_ASSERT(heard.bad_crc + heard.bad_length == 1);
      return;
    }
    RC_ASSERT(heard.frames.size() == 1u);
    RC_ASSERT(!passed || reply);
    if (passed) heard.frames[0].payload = frame.payload;
    RC_ASSERT(heard.frames[0] == frame);
  });
}

TEST(Receiver, FindsTheNextFrameAfterAnyGarbage) {
  holds("garbage, delimiter, frame -> frame", [] {
    bushd_receiver receiver{};
    Bytes garbage = any_bytes(between<size_t>(0, 600));
    garbage.push_back(0);
    receive(garbage, &receiver);
    const Frame frame = any_frame();
    RC_ASSERT(receive(encode(frame), &receiver).frames == std::vector<Frame>{frame});
  });
}

TEST(Receiver, SurvivesAnyBytes) {
  holds("frames heard in noise carry a good checksum", [] {
    bushd_receiver receiver{};
    for (const Frame& frame : receive(any_bytes(2000), &receiver).frames) {
      RC_ASSERT(frame.payload.size() <= BUSHD_FRAME_MAX_PAYLOAD);
    }
  });
}

}  // namespace
}  // namespace bushd::test::frame_test
