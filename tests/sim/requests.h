// Requests by their messages: so that no test puts the type of one beside the fields of another.
#pragma once

#include <tuple>

#include "engine/message.h"
#include "engine/payload.h"

namespace bushd::test {

template <class Message>
struct RequestKind {
  bushd_type type;
  std::size_t (*encode)(const Message*, std::uint8_t*);
};

inline constexpr std::tuple kRequestKinds{
    RequestKind{BUSHD_MSG_ASSIGN, bushd_encode_assign},
    RequestKind{BUSHD_MSG_CONFIGURE, bushd_encode_configure},
    RequestKind{BUSHD_MSG_CONTROL, bushd_encode_control},
    RequestKind{BUSHD_MSG_CURRENTS, bushd_encode_currents},
    RequestKind{BUSHD_MSG_EMERGENCY, bushd_encode_emergency},
    RequestKind{BUSHD_MSG_EMISSION, bushd_encode_emission},
    RequestKind{BUSHD_MSG_HOME, bushd_encode_home},
    RequestKind{BUSHD_MSG_IDENTIFY, bushd_encode_identify},
    RequestKind{BUSHD_MSG_LOCAL, bushd_encode_local},
    RequestKind{BUSHD_MSG_MOTOR_INPUTS, bushd_encode_motor_inputs},
    RequestKind{BUSHD_MSG_POSITION_COMPARE, bushd_encode_position_compare},
    RequestKind{BUSHD_MSG_PROGRAM, bushd_encode_program_control},
    RequestKind{BUSHD_MSG_SET_ADDRESS, bushd_encode_set_address},
    RequestKind{BUSHD_MSG_INPUTS, bushd_encode_set_inputs},
    RequestKind{BUSHD_MSG_OUTPUTS, bushd_encode_set_outputs},
    RequestKind{BUSHD_MSG_SET_POSITION, bushd_encode_set_position},
    RequestKind{BUSHD_MSG_VELOCITY, bushd_encode_set_velocity},
    RequestKind{BUSHD_MSG_SYNC, bushd_encode_sync},
    RequestKind{BUSHD_MSG_TABLE_BEGIN, bushd_encode_table_begin},
    RequestKind{BUSHD_MSG_TABLE_END, bushd_encode_table_end},
    RequestKind{BUSHD_MSG_TRAVEL, bushd_encode_travel}};

struct Request {
  bushd_type type;
  std::vector<std::uint8_t> payload;
};

template <class Message>
Request request_of(const Message& message) {
  const auto& kind = std::get<RequestKind<Message>>(kRequestKinds);
  return {kind.type, payload_of(message, kind.encode)};
}

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
