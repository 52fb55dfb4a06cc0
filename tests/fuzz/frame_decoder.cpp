// The frame decoder against a slow one, written from docs/protocol.md. Whatever came before, a good
// frame after a delimiter is heard.
//
// Input: a mode, then bytes as they are on the line; with an odd mode these are address, type,
// sequence and payload of a frame that is sent right, or with one byte spoilt where the mode is
// not 1.
#include <array>
#include <cstring>
#include <vector>

#include "engine/frame.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;

// What lies between two delimiters, decoded by the book.
struct Decoded {
  bushd_receive result = BUSHD_RECEIVE_BAD_LENGTH;
  std::array<std::uint8_t, BUSHD_FRAME_MAX_RAW> raw;
  std::size_t size = 0;
};

// CRC-32/ISO-HDLC without a table, a bit at a time.
std::uint32_t other_crc(Bytes bytes) {
  std::uint32_t crc = UINT32_MAX;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xEDB88320 & (0 - (crc & 1)));
  }
  return ~crc;
}

Decoded decode(Bytes stuffed) {
  Decoded out;
  if (stuffed.empty()) out.result = BUSHD_RECEIVE_MORE;
  if (stuffed.size() < 8 || stuffed.size() > 255) return out;
  for (std::size_t at = 0; at < stuffed.size();) {
    const std::size_t distance = stuffed[at];
    if (at + distance > stuffed.size()) return out;
    for (std::size_t i = 1; i < distance; ++i) out.raw[out.size++] = stuffed[at + i];
    at += distance;
    if (at < stuffed.size()) out.raw[out.size++] = 0;
  }
  const std::size_t body = out.size - 4;
  std::uint32_t sent = 0;
  for (std::size_t i = 4; i-- > 0;) sent = sent << 8 | out.raw[body + i];
  const bool good = other_crc(Bytes(out.raw).first(body)) == sent;
  out.result = good ? BUSHD_RECEIVE_FRAME : BUSHD_RECEIVE_BAD_CRC;
  return out;
}

class Line {
 public:
  void feed(Bytes bytes) {
    for (const std::uint8_t byte : bytes) feed(byte);
  }
  bushd_receive feed(std::uint8_t byte) {
    bushd_frame frame{};
    const bushd_receive result = bushd_receive_byte(&receiver_, byte, &frame);
    if (byte != 0) {
      BUSHD_REQUIRE(result == BUSHD_RECEIVE_MORE);
      // More than can be told from "too long" need not be kept.
      if (size_ < since_delimiter_.size()) since_delimiter_[size_++] = byte;
      return result;
    }
    const Bytes stuffed = Bytes(since_delimiter_).first(size_);
    size_ = 0;
    const Decoded expected = decode(stuffed);
    BUSHD_REQUIRE(result == expected.result);
    if (result != BUSHD_RECEIVE_FRAME) return result;
    BUSHD_REQUIRE(frame.address == expected.raw[0]);
    BUSHD_REQUIRE(frame.type == expected.raw[1]);
    BUSHD_REQUIRE(frame.sequence == expected.raw[2]);
    BUSHD_REQUIRE(frame.payload_size == expected.size - BUSHD_FRAME_HEADER - BUSHD_FRAME_CRC);
    BUSHD_REQUIRE(std::memcmp(frame.payload, &expected.raw[3], frame.payload_size) == 0);
    // There is one way only to put a frame on the bus.
    std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire;
    const std::size_t wire_size = bushd_frame_encode(
        frame.address, frame.type, frame.sequence, frame.payload, frame.payload_size, wire.data());
    BUSHD_REQUIRE(wire_size == stuffed.size() + 1 && wire[wire_size - 1] == 0);
    BUSHD_REQUIRE(std::memcmp(wire.data(), stuffed.data(), stuffed.size()) == 0);
    return result;
  }

 private:
  bushd_receiver receiver_{};
  std::array<std::uint8_t, 300> since_delimiter_;
  std::size_t size_ = 0;
};

void run(Input input) {
  Line line;
  const std::uint8_t mode = input.u8();
  if ((mode & 1) == 0) {
    line.feed(input.bytes(SIZE_MAX));
  } else {
    const std::uint8_t address = input.u8();
    const std::uint8_t type = input.u8();
    const std::uint8_t sequence = input.u8();
    const Bytes payload = input.bytes(BUSHD_FRAME_MAX_PAYLOAD);
    std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire;
    const std::size_t size =
        bushd_frame_encode(address, type, sequence, payload.data(), payload.size(), wire.data());
    if (mode != 1) wire[(mode >> 1) % size] ^= static_cast<std::uint8_t>(sequence | 1);
    for (std::size_t i = 0; i + 1 < size; ++i) line.feed(wire[i]);
    const bushd_receive result = line.feed(wire[size - 1]);
    if (mode == 1) BUSHD_REQUIRE(result == BUSHD_RECEIVE_FRAME);
  }
  line.feed(0);
  constexpr std::array<std::uint8_t, 8> kIdentify = {0x08, 0x01, 0x01, 0x01,
                                                     0xF2, 0xB2, 0x9F, 0x90};
  line.feed(kIdentify);
  BUSHD_REQUIRE(line.feed(0) == BUSHD_RECEIVE_FRAME);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({data, size});
  return 0;
}
