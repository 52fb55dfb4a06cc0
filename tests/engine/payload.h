// Messages as the payloads of their frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/frame.h"

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

}  // namespace bushd::test
