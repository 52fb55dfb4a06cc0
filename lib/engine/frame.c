// COBS (Cheshire and Baker, 1999) for frames of at most 254 bytes: every zero is replaced by the
// distance to the next one (or to the end), and one such distance stands in front. The code byte
// 255 of the general scheme can then only mean "no zero at all", so no case is special.
#include "engine/frame.h"

#include <string.h>

size_t bushd_frame_encode(uint8_t address, uint8_t type, uint8_t sequence, const uint8_t* payload,
                          size_t payload_size, uint8_t* wire) {
  uint8_t* const raw = wire + 1;
  raw[0] = address;
  raw[1] = type;
  raw[2] = sequence;
  uint8_t* const body = raw + BUSHD_FRAME_HEADER;
  if (payload_size != 0 && payload != body) memcpy(body, payload, payload_size);
  const size_t size = BUSHD_FRAME_HEADER + payload_size;
  return bushd_frame_close(wire, size, bushd_crc32(BUSHD_CRC32_START, raw, size));
}

size_t bushd_frame_close(uint8_t* wire, size_t size, uint32_t crc) {
  uint8_t* const raw = wire + 1;
  for (uint8_t shift = 0; shift < 32; shift = (uint8_t)(shift + 8)) {
    raw[size++] = (uint8_t)(~crc >> shift);
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

void bushd_receiver_check(bushd_receiver* receiver) {
  if (receiver->size == 0 || receiver->size == BUSHD_FRAME_OVERLONG) return;
  const uint16_t raw_size = (uint16_t)(receiver->size - 1u);
  const uint8_t* const raw = receiver->buffer + 1;
  receiver->inverted = ~bushd_crc32(~receiver->inverted, raw + receiver->checked,
                                    (size_t)(raw_size - receiver->checked));
  receiver->checked = raw_size;
}

void bushd_receiver_pass_reply(bushd_receiver* receiver) {
  enum { EMPTY = 1 + BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC };
  if (receiver->size <= EMPTY || receiver->size == BUSHD_FRAME_OVERLONG) return;
  const uint8_t type = receiver->buffer[2];
  if ((type & BUSHD_TYPE_REPLY) == 0) return;
  bushd_receiver_check(receiver);
  receiver->size = EMPTY;
  receiver->checked = EMPTY - 1;
}

static void begin_frame(bushd_receiver* receiver) {
  receiver->size = 0;
  receiver->run = 0;
  receiver->checked = 0;
  receiver->inverted = 0;
}

bushd_receive bushd_receive_byte(bushd_receiver* receiver, uint8_t byte, bushd_frame* frame) {
  if (bushd_receiver_collect(receiver, byte)) return BUSHD_RECEIVE_MORE;
  bushd_receiver_check(receiver);
  const uint16_t size = receiver->size;
  // The delimiter must be where the last distance leads.
  const bool whole = receiver->run == 0;
  const uint32_t crc = ~receiver->inverted;
  begin_frame(receiver);
  if (size == 0) return BUSHD_RECEIVE_MORE;
  if (size == BUSHD_FRAME_OVERLONG || size < 1 + BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC || !whole) {
    return BUSHD_RECEIVE_BAD_LENGTH;
  }
  // A frame and its own CRC leave the same register behind, whatever the frame.
  const uint32_t kResidue = 0xDEBB20E3;
  if (crc != kResidue) return BUSHD_RECEIVE_BAD_CRC;
  const uint8_t* const raw = receiver->buffer + 1;
  const uint16_t body = (uint16_t)(size - 1 - BUSHD_FRAME_CRC);
  frame->address = raw[0];
  frame->type = raw[1];
  frame->sequence = raw[2];
  frame->payload = raw + BUSHD_FRAME_HEADER;
  frame->payload_size = (uint8_t)(body - BUSHD_FRAME_HEADER);
  return BUSHD_RECEIVE_FRAME;
}
