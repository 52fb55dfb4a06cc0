// Bytes that are pulses. A byte at 8N1 takes ten bits on TXD: start bit (low), eight data bits, the
// lowest first, stop bit (high). Each fall of the line is a step of the motor, so that the next
// byte, which begins with a fall, follows ten bits after this one began:
//
//     byte   falls at bit     steps   between them, bits   to the next byte's first, bits
//     0x55   0 2 4 6 8        5       2                    2
//     0xDB   0 3 6            3       3                    4
//     0xEF   0 5              2       5                    5
//     0xF0   0                1       -                    10
//
// and as the last byte of a run, for the steps that are left over
//
//     0xD5   0 2 4 6          4       2                    -
//     0xF5   0 2 4            3       2                    -
//     0xFB   0 3              2       3                    -
//     0xFF   0                1       -                    -
//
// 0x55, 0xF0 and the last bytes are those of the source (docs/heritage.md). 0xDB and 0xEF make two
// more speeds at the same baud rate: a change of rate costs a pause, a change of byte nothing.
#pragma once

#include <array>
#include <cstdint>

namespace bushd::serial_pulse {

constexpr unsigned kBitsPerByte = 10;

struct Pattern {
  std::uint8_t byte;
  std::uint8_t steps;
  std::uint8_t between_bits;  // the shortest, from one of its steps to the next
  std::uint8_t after_bits;    // from its last step to the end of the byte
};

// With many steps first. The last byte of a run has one of kLast with as many as are left, or of
// kAny with fewer.
constexpr std::array<Pattern, 4> kAny = {
    {{0x55, 5, 2, 2}, {0xDB, 3, 3, 4}, {0xEF, 2, 5, 5}, {0xF0, 1, 10, 10}}};
constexpr std::array<Pattern, 4> kLast = {
    {{0xFF, 1, 10, 10}, {0xFB, 2, 3, 7}, {0xF5, 3, 2, 6}, {0xD5, 4, 2, 4}}};  // [steps - 1]
constexpr unsigned kMostSteps = 5;

}  // namespace bushd::serial_pulse
