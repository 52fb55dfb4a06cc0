// CRC-16/IBM-3740. Two ways to the same value, chosen by BUSHD_CRC_SLICES:
//   0   no table: the shift form of the polynomial x^16 + x^12 + x^5 + 1; for small MCUs
//   16  slicing: sixteen bytes a round through sixteen tables of 256 entries (8 KiB); for the host
// Slice k maps a byte to its CRC followed by k zero bytes. A CRC is linear over XOR, so a slice is
// spanned by its values at 1, 2, 4, .. 128: the rows below (tests/engine/crc_test.cpp checks them
// bit by bit).
#include "engine/frame.h"

#ifndef BUSHD_CRC_SLICES
#define BUSHD_CRC_SLICES 0
#endif

static inline uint16_t crc_shift(uint16_t crc, uint8_t byte) {
  uint8_t x = (uint8_t)((crc >> 8) ^ byte);
  x = (uint8_t)(x ^ (x >> 4));
  return (uint16_t)((uint32_t)crc << 8 ^ (uint32_t)x << 12 ^ (uint32_t)x << 5 ^ x);
}

#if BUSHD_CRC_SLICES == 16

#define BIT(b, n, v) (((b) >> (n)) & 1 ? (v) : 0)
#define ENTRY(b, v0, v1, v2, v3, v4, v5, v6, v7)                                                   \
  (BIT(b, 0, v0) ^ BIT(b, 1, v1) ^ BIT(b, 2, v2) ^ BIT(b, 3, v3) ^ BIT(b, 4, v4) ^ BIT(b, 5, v5) ^ \
   BIT(b, 6, v6) ^ BIT(b, 7, v7))
#define FOUR(b, ...)                                                           \
  ENTRY(b, __VA_ARGS__), ENTRY(b + 1, __VA_ARGS__), ENTRY(b + 2, __VA_ARGS__), \
      ENTRY(b + 3, __VA_ARGS__)
#define SIXTEEN(b, ...)                                                     \
  FOUR(b, __VA_ARGS__), FOUR(b + 4, __VA_ARGS__), FOUR(b + 8, __VA_ARGS__), \
      FOUR(b + 12, __VA_ARGS__)
#define SIXTYFOUR(b, ...)                                                              \
  SIXTEEN(b, __VA_ARGS__), SIXTEEN(b + 16, __VA_ARGS__), SIXTEEN(b + 32, __VA_ARGS__), \
      SIXTEEN(b + 48, __VA_ARGS__)
#define ROW(...)                                                                        \
  {                                                                                     \
    SIXTYFOUR(0, __VA_ARGS__), SIXTYFOUR(64, __VA_ARGS__), SIXTYFOUR(128, __VA_ARGS__), \
        SIXTYFOUR(192, __VA_ARGS__)                                                     \
  }

static const uint16_t kSlice[16][256] = {
    ROW(0x1021, 0x2042, 0x4084, 0x8108, 0x1231, 0x2462, 0x48C4, 0x9188),
    ROW(0x3331, 0x6662, 0xCCC4, 0x89A9, 0x0373, 0x06E6, 0x0DCC, 0x1B98),
    ROW(0x3730, 0x6E60, 0xDCC0, 0xA9A1, 0x4363, 0x86C6, 0x1DAD, 0x3B5A),
    ROW(0x76B4, 0xED68, 0xCAF1, 0x85C3, 0x1BA7, 0x374E, 0x6E9C, 0xDD38),
    ROW(0xAA51, 0x4483, 0x8906, 0x022D, 0x045A, 0x08B4, 0x1168, 0x22D0),
    ROW(0x45A0, 0x8B40, 0x06A1, 0x0D42, 0x1A84, 0x3508, 0x6A10, 0xD420),
    ROW(0xB861, 0x60E3, 0xC1C6, 0x93AD, 0x377B, 0x6EF6, 0xDDEC, 0xABF9),
    ROW(0x47D3, 0x8FA6, 0x0F6D, 0x1EDA, 0x3DB4, 0x7B68, 0xF6D0, 0xFD81),
    ROW(0xEB23, 0xC667, 0x9CEF, 0x29FF, 0x53FE, 0xA7FC, 0x5FD9, 0xBFB2),
    ROW(0x6F45, 0xDE8A, 0xAD35, 0x4A4B, 0x9496, 0x390D, 0x721A, 0xE434),
    ROW(0xD849, 0xA0B3, 0x5147, 0xA28E, 0x553D, 0xAA7A, 0x44D5, 0x89AA),
    ROW(0x0375, 0x06EA, 0x0DD4, 0x1BA8, 0x3750, 0x6EA0, 0xDD40, 0xAAA1),
    ROW(0x4563, 0x8AC6, 0x05AD, 0x0B5A, 0x16B4, 0x2D68, 0x5AD0, 0xB5A0),
    ROW(0x7B61, 0xF6C2, 0xFDA5, 0xEB6B, 0xC6F7, 0x9DCF, 0x2BBF, 0x577E),
    ROW(0xAEFC, 0x4DD9, 0x9BB2, 0x2745, 0x4E8A, 0x9D14, 0x2A09, 0x5412),
    ROW(0xA824, 0x4069, 0x80D2, 0x1185, 0x230A, 0x4614, 0x8C28, 0x0871),
};

uint16_t bushd_crc16(uint16_t crc, const uint8_t* data, size_t size) {
  for (; size >= 16; size -= 16, data += 16) {
    uint16_t next = kSlice[15][(crc >> 8) ^ data[0]] ^ kSlice[14][(crc & 0xFF) ^ data[1]];
    for (int i = 2; i < 16; ++i) next ^= kSlice[15 - i][data[i]];
    crc = next;
  }
  for (; size > 0; --size, ++data) crc = crc_shift(crc, *data);
  return crc;
}

#else

uint16_t bushd_crc16(uint16_t crc, const uint8_t* data, size_t size) {
  for (; size > 0; --size, ++data) crc = crc_shift(crc, *data);
  return crc;
}

#endif
