// Requests by their messages: so that no test puts the type of one beside the fields of another.
#pragma once

#include "bus/rs485/request.h"
#include "engine/message.h"
#include "engine/payload.h"

namespace bushd::test {

using link::Request;
using link::request_of;

// Those that are not acknowledged by the one MCU that is asked.
#define BUSHD_REQUEST_OF(type, kind)                                     \
  inline Request request_of(const bushd_##kind& message) {               \
    return {BUSHD_MSG_##type, payload_of(message, bushd_encode_##kind)}; \
  }
BUSHD_REQUEST_OF(SYNC, sync)
BUSHD_REQUEST_OF(EMERGENCY, emergency)
BUSHD_REQUEST_OF(IDENTIFY, identify)
BUSHD_REQUEST_OF(SET_ADDRESS, set_address)
#undef BUSHD_REQUEST_OF

// TICKS; BUSHD_TICKS_FINE among the flags says what displacements are.
struct Ticks {
  std::uint8_t flags = 0;
  std::uint32_t first = 0;
  std::uint8_t count = 1;
  std::uint16_t mask = 1;
  std::vector<std::int16_t> displacements{};  // count x motors of the mask; as they are sent
  std::vector<std::uint16_t> delays{};        // one a motor
  std::uint8_t epoch = 0;
};

inline std::vector<std::uint8_t> ticks_payload(const Ticks& ticks) {
  return payload_of([&](std::uint8_t* to) {
    std::size_t size = bushd_encode_ticks_head(ticks.epoch, ticks.flags, ticks.first, ticks.count,
                                               ticks.mask, ticks.delays.data(), to);
    for (const std::int16_t displacement : ticks.displacements) {
      if ((ticks.flags & BUSHD_TICKS_FINE) != 0) {
        bushd_put_i16(to + size, displacement);
        size += 2;
      } else {
        to[size++] = static_cast<std::uint8_t>(displacement);
      }
    }
    return size;
  });
}

// Whole steps as one of these.
inline std::int16_t displacement_of(int steps, bool fine) {
  const int coarse = steps > 0 ? steps | BUSHD_COARSE_DIRECTION : -steps;
  return static_cast<std::int16_t>(fine ? 256 * steps : coarse);
}

}  // namespace bushd::test
