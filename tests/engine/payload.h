// Messages as the payloads of their frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/frame.h"
#include "engine/message_motion.h"

namespace bushd::test {

// `encode` writes to where it is told and returns how much that is.
template <class Encode>
std::vector<std::uint8_t> payload_of(Encode&& encode) {
  std::vector<std::uint8_t> payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(encode(payload.data()));
  return payload;
}

template <class Message>
std::vector<std::uint8_t> payload_of(const Message& message,
                                     std::size_t (*encode)(const Message*, std::uint8_t*)) {
  return payload_of([&](std::uint8_t* payload) { return encode(&message, payload); });
}

// TABLE_RUN of one motor.
inline std::vector<std::uint8_t> table_run_payload(std::uint8_t epoch, std::uint32_t first_tick,
                                                   const bushd_table_run_entry& entry) {
  return payload_of([&](std::uint8_t* payload) {
    return bushd_encode_table_run(epoch, first_tick, &entry, 1, payload);
  });
}

}  // namespace bushd::test
