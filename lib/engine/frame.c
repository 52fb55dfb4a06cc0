// COBS (Cheshire and Baker, 1999) for frames of at most 254 bytes: every zero is replaced by the
// distance to the next one (or to the end), and one such distance stands in front. The code byte
// 255 of the general scheme can then only mean "no zero at all", so no case is special.
#include "engine/frame.h"

#include <string.h>

// Marks a frame that is being skipped because it is longer than any can be.
#define OVERLONG (BUSHD_FRAME_MAX_RAW + 2u)

size_t bushd_frame_encode(uint8_t address, uint8_t type, uint8_t tag, const uint8_t* payload,
                          size_t payload_size, uint8_t* wire) {
  uint8_t* const raw = wire + 1;
  raw[0] = address;
  raw[1] = type;
  raw[2] = tag;
  uint8_t* const body = raw + BUSHD_FRAME_HEADER;
  if (payload_size != 0 && payload != body) memcpy(body, payload, payload_size);
  size_t size = BUSHD_FRAME_HEADER + payload_size;
  const uint32_t crc = ~bushd_crc32(BUSHD_CRC32_START, raw, size);
  for (uint8_t shift = 0; shift < 32; shift = (uint8_t)(shift + 8)) {
    raw[size++] = (uint8_t)(crc >> shift);
  }
  // Backwards, so that the distance to the next zero is known at each.
  size_t next = size;
  for (size_t i = size; i-- > 0;) {
    const bool zero = raw[i] == 0;
    raw[i] = zero ? (uint8_t)(next - i) : raw[i];
    next = zero ? i : next;
  }
  wire[0] = (uint8_t)(next + 1);
  raw[size] = 0;
  return size + 2;
}

// In place: data[0] is the leading distance and the raw frame stays where it is, behind it. Bytes
// collected between delimiters are never 0, so every distance moves on.
static bool cobs_decode(uint8_t* data, uint16_t size) {
  uint16_t at = data[0];
  while (at < size) {
    const uint8_t distance = data[at];
    data[at] = 0;
    at = (uint16_t)(at + distance);
  }
  return at == size;
}

bushd_receive bushd_receive_byte(bushd_receiver* receiver, uint8_t byte, bushd_frame* frame) {
  if (byte != 0) {
    if (receiver->size < sizeof receiver->buffer) {
      receiver->buffer[receiver->size++] = byte;
    } else {
      receiver->size = OVERLONG;
    }
    return BUSHD_RECEIVE_MORE;
  }
  const uint16_t size = receiver->size;
  receiver->size = 0;
  if (size == 0) return BUSHD_RECEIVE_MORE;
  if (size == OVERLONG || size < 1 + BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC) {
    return BUSHD_RECEIVE_BAD_LENGTH;
  }
  if (!cobs_decode(receiver->buffer, size)) return BUSHD_RECEIVE_BAD_LENGTH;
  const uint8_t* const raw = receiver->buffer + 1;
  const uint16_t body = (uint16_t)(size - 1 - BUSHD_FRAME_CRC);
  // A frame and its own CRC leave the same register behind, whatever the frame.
  const uint32_t kResidue = 0xDEBB20E3;
  if (bushd_crc32(BUSHD_CRC32_START, raw, body + BUSHD_FRAME_CRC) != kResidue) {
    return BUSHD_RECEIVE_BAD_CRC;
  }
  frame->address = raw[0];
  frame->type = raw[1];
  frame->tag = raw[2];
  frame->payload = raw + BUSHD_FRAME_HEADER;
  frame->payload_size = (uint8_t)(body - BUSHD_FRAME_HEADER);
  return BUSHD_RECEIVE_FRAME;
}
