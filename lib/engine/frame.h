// Framing: raw frame = address, type, sequence, payload, CRC-32 (low byte first); on the bus it is
// COBS encoded and ended by a zero byte. A raw frame has at most 254 bytes, so COBS costs exactly
// one byte. CRC-32/ISO-HDLC: polynomial 0x04C11DB7, reflected, start 0xFFFFFFFF, inverted at the
// end; check value 0xCBF43926.
#ifndef BUSHD_ENGINE_FRAME_H
#define BUSHD_ENGINE_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_FRAME_HEADER 3u
#define BUSHD_FRAME_CRC 4u
#define BUSHD_FRAME_MAX_RAW 254u
#define BUSHD_FRAME_MAX_PAYLOAD (BUSHD_FRAME_MAX_RAW - BUSHD_FRAME_HEADER - BUSHD_FRAME_CRC)
#define BUSHD_FRAME_MAX_WIRE (BUSHD_FRAME_MAX_RAW + 2u)  // + COBS code byte + delimiter
#define BUSHD_FRAME_OVERHEAD (BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC + 2u)  // wire bytes - payload

#define BUSHD_ADDRESS_BROADCAST 0u
#define BUSHD_TYPE_REPLY 0x80u  // set in `type` of everything that an MCU sends

// The register after `data`, which may come in pieces; a CRC is its complement. O(size).
#define BUSHD_CRC32_START UINT32_MAX
uint32_t bushd_crc32(uint32_t crc, const uint8_t* data, size_t size);

// Encodes one frame into `wire` (BUSHD_FRAME_MAX_WIRE bytes suffice for any); returns the number of
// bytes including the delimiter. The payload may stand in its place already, at wire + 1 +
// BUSHD_FRAME_HEADER. Precondition: payload_size <= BUSHD_FRAME_MAX_PAYLOAD. O(size).
size_t bushd_frame_encode(uint8_t address, uint8_t type, uint8_t sequence, const uint8_t* payload,
                          size_t payload_size, uint8_t* wire);

// The end of it, for who makes a frame in steps: `size` bytes of the raw frame stand at wire + 1,
// `crc` is the register after them.
size_t bushd_frame_close(uint8_t* wire, size_t size, uint32_t crc);

// A decoded frame; `payload` points into the receiver's buffer and lives until the next byte.
typedef struct bushd_frame {
  uint8_t address;
  uint8_t type;
  uint8_t sequence;
  uint8_t payload_size;
  const uint8_t* payload;
} bushd_frame;

#define BUSHD_FRAME_OVERLONG (BUSHD_FRAME_MAX_RAW + 2u)

// Collects bytes of a line into frames, decoding as they come. Zero-initialise it; resynchronises
// at every delimiter.
typedef struct bushd_receiver {
  uint8_t buffer[BUSHD_FRAME_MAX_RAW + 1u];  // a zero for the leading distance, then the raw frame
  uint16_t size;      // bytes collected; BUSHD_FRAME_OVERLONG: more than any frame has
  uint8_t run;        // bytes to come before the next distance
  uint16_t checked;   // raw bytes that the CRC has gone over
  uint32_t inverted;  // of its register
} bushd_receiver;

typedef enum bushd_receive {
  BUSHD_RECEIVE_MORE = 0,   // no frame yet
  BUSHD_RECEIVE_FRAME = 1,  // *frame holds a frame with a good checksum
  BUSHD_RECEIVE_BAD_CRC = 2,
  BUSHD_RECEIVE_BAD_LENGTH = 3  // too long, too short, or broken COBS
} bushd_receive;

// For a small MCU's loop, which must not be held up at a frame's end.
// The short way of a byte that ends no frame; false if it does, and must go through
// bushd_receive_byte.
static inline bool bushd_receiver_collect(bushd_receiver* receiver, uint8_t byte) {
  if (byte == 0) return false;
  if (receiver->size >= sizeof receiver->buffer) {
    receiver->size = BUSHD_FRAME_OVERLONG;
    return true;
  }
  const bool distance = receiver->run == 0;
  receiver->run = (uint8_t)((distance ? byte : receiver->run) - 1u);
  receiver->buffer[receiver->size++] = distance ? 0 : byte;
  return true;
}
// The CRC over what has come. O(bytes since the last call).
void bushd_receiver_check(bushd_receiver* receiver);
// Keeps nothing of a reply but that it is one; its payload will mean nothing. For MCUs, which do
// not read what others answer: however long it is, it needs no more of the buffer than came since
// the last call, and as much as an empty frame.
void bushd_receiver_pass_reply(bushd_receiver* receiver);

// Feeds one byte. Empty frames (two delimiters in a row) are nothing. O(1), O(frame) at a
// delimiter.
bushd_receive bushd_receive_byte(bushd_receiver* receiver, uint8_t byte, bushd_frame* frame);

#ifdef __cplusplus
}
#endif
#endif
