// CRC-32/ISO-HDLC, reflected: polynomial 0x04C11DB7. Three ways to the same value, chosen by
// BUSHD_CRC_SLICES:
//   0   a nibble at a time through 64 bytes of table; for small MCUs
//   1   a byte at a time through 1 KiB, which an AVR keeps in its flash
//   16  slicing: sixteen bytes a round through sixteen tables of 256 entries (16 KiB); for the host
// Slice k maps a byte to its CRC followed by k zero bytes. A CRC is linear over XOR, so a slice is
// spanned by its values at 1, 2, 4, .. 128: the rows below (tests/engine/crc_test.cpp checks them
// bit by bit).
#include "engine/frame.h"

#ifndef BUSHD_CRC_SLICES
#define BUSHD_CRC_SLICES 0
#endif

// With BUSHD_OWN_CRC32 a small MCU brings its own loop, and only the table is here.
#ifdef BUSHD_OWN_CRC32
#define CONST_TABLE const
#define kSlice bushd_crc32_table
#else
#define CONST_TABLE static const
#endif
#ifdef __AVR__
#define IN_FLASH __flash
#else
#define IN_FLASH
#endif

#if BUSHD_CRC_SLICES == 0

static inline uint32_t crc_nibbles(uint32_t crc, uint8_t byte) {
  static const uint32_t kNibble[16] = {0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC,
                                       0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
                                       0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C,
                                       0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C};
  crc ^= byte;
  crc = crc >> 4 ^ kNibble[crc & 15u];
  return crc >> 4 ^ kNibble[crc & 15u];
}

#endif

#if BUSHD_CRC_SLICES != 0

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
#define ROW(...)                                                                       \
  {SIXTYFOUR(0, __VA_ARGS__), SIXTYFOUR(64, __VA_ARGS__), SIXTYFOUR(128, __VA_ARGS__), \
   SIXTYFOUR(192, __VA_ARGS__)}

CONST_TABLE IN_FLASH uint32_t kSlice[BUSHD_CRC_SLICES][256] = {
    ROW(0x77073096, 0xEE0E612C, 0x076DC419, 0x0EDB8832, 0x1DB71064, 0x3B6E20C8, 0x76DC4190,
        0xEDB88320),
#if BUSHD_CRC_SLICES == 16
    ROW(0x191B3141, 0x32366282, 0x646CC504, 0xC8D98A08, 0x4AC21251, 0x958424A2, 0xF0794F05,
        0x3B83984B),
    ROW(0x01C26A37, 0x0384D46E, 0x0709A8DC, 0x0E1351B8, 0x1C26A370, 0x384D46E0, 0x709A8DC0,
        0xE1351B80),
    ROW(0xB8BC6765, 0xAA09C88B, 0x8F629757, 0xC5B428EF, 0x5019579F, 0xA032AF3E, 0x9B14583D,
        0xED59B63B),
    ROW(0x3D6029B0, 0x7AC05360, 0xF580A6C0, 0x30704BC1, 0x60E09782, 0xC1C12F04, 0x58F35849,
        0xB1E6B092),
    ROW(0xCB5CD3A5, 0x4DC8A10B, 0x9B914216, 0xEC53826D, 0x03D6029B, 0x07AC0536, 0x0F580A6C,
        0x1EB014D8),
    ROW(0xA6770BB4, 0x979F1129, 0xF44F2413, 0x33EF4E67, 0x67DE9CCE, 0xCFBD399C, 0x440B7579,
        0x8816EAF2),
    ROW(0xCCAA009E, 0x4225077D, 0x844A0EFA, 0xD3E51BB5, 0x7CBB312B, 0xF9766256, 0x299DC2ED,
        0x533B85DA),
    ROW(0x177B1443, 0x2EF62886, 0x5DEC510C, 0xBBD8A218, 0xACC04271, 0x82F182A3, 0xDE920307,
        0x6655004F),
    ROW(0xEFC26B3E, 0x04F5D03D, 0x09EBA07A, 0x13D740F4, 0x27AE81E8, 0x4F5D03D0, 0x9EBA07A0,
        0xE6050901),
    ROW(0xC18EDFC0, 0x586CB9C1, 0xB0D97382, 0xBAC3E145, 0xAEF6C4CB, 0x869C8FD7, 0xD64819EF,
        0x77E1359F),
    ROW(0x9BA54C6F, 0xEC3B9E9F, 0x03063B7F, 0x060C76FE, 0x0C18EDFC, 0x1831DBF8, 0x3063B7F0,
        0x60C76FE0),
    ROW(0xDD96D985, 0x605CB54B, 0xC0B96A96, 0x5A03D36D, 0xB407A6DA, 0xB37E4BF5, 0xBD8D91AB,
        0xA06A2517),
    ROW(0x9D0FE176, 0xE16EC4AD, 0x19AC8F1B, 0x33591E36, 0x66B23C6C, 0xCD6478D8, 0x41B9F7F1,
        0x8373EFE2),
    ROW(0xB9FBDBE8, 0xA886B191, 0x8A7C6563, 0xCF89CC87, 0x44629F4F, 0x88C53E9E, 0xCAFB7B7D,
        0x4E87F0BB),
    ROW(0xAE689191, 0x87A02563, 0xD4314C87, 0x73139F4F, 0xE6273E9E, 0x173F7B7D, 0x2E7EF6FA,
        0x5CFDEDF4),
#endif
};

#endif

#ifdef BUSHD_OWN_CRC32

#elif BUSHD_CRC_SLICES == 16

// Four bytes, `behind` of the sixteen after them. Written out: -O2 does not unroll a loop of them.
static inline uint32_t crc_four(uint32_t first, const uint8_t* data, int behind) {
  return kSlice[behind + 3][(first ^ data[0]) & 0xFF] ^
         kSlice[behind + 2][(first >> 8 ^ data[1]) & 0xFF] ^
         kSlice[behind + 1][(first >> 16 ^ data[2]) & 0xFF] ^ kSlice[behind][first >> 24 ^ data[3]];
}

uint32_t bushd_crc32(uint32_t crc, const uint8_t* data, size_t size) {
  for (; size >= 16; size -= 16, data += 16) {
    crc = crc_four(crc, data, 12) ^ crc_four(0, data + 4, 8) ^ crc_four(0, data + 8, 4) ^
          crc_four(0, data + 12, 0);
  }
  for (; size >= 4; size -= 4, data += 4) crc = crc_four(crc, data, 0);
  for (; size > 0; --size, ++data) crc = crc >> 8 ^ kSlice[0][(uint8_t)crc ^ *data];
  return crc;
}

#elif BUSHD_CRC_SLICES == 1

uint32_t bushd_crc32(uint32_t crc, const uint8_t* data, size_t size) {
  for (; size > 0; --size, ++data) crc = crc >> 8 ^ kSlice[0][(uint8_t)crc ^ *data];
  return crc;
}

#else

uint32_t bushd_crc32(uint32_t crc, const uint8_t* data, size_t size) {
  for (; size > 0; --size, ++data) crc = crc_nibbles(crc, *data);
  return crc;
}

#endif
