// Bits of motors, and numbers that wrap.
#ifndef BUSHD_FIRMWARE_CORE_BITS_H
#define BUSHD_FIRMWARE_CORE_BITS_H

#include <stdint.h>

#include "engine/message.h"

// Tick numbers wrap (at 2.56 ms after 127 days); differences do not, as long as they are below
// 2^31.
static inline int32_t ticks_after(uint32_t tick, uint32_t reference) {
  return (int32_t)(tick - reference);
}

// The tick of which these are the low bits, less than 2^15 before or after the other one.
static inline uint32_t near_tick(uint16_t low, uint32_t other) {
  const int32_t after = (int16_t)(low - (uint16_t)other);
  return other + (uint32_t)after;
}

// An 8-bit CPU shifts bit by bit: it looks the bit up.
extern const uint16_t bushd_mcu_motor_bit[BUSHD_MOTORS_PER_MCU];
static inline uint16_t motor_bit(uint8_t motor) {
  return bushd_mcu_motor_bit[motor];
}

static inline uint16_t saturating_increment(uint16_t value) {
  return value < UINT16_MAX ? (uint16_t)(value + 1u) : value;
}

#endif
