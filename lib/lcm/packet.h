// What the codecs share: a message as a packet of its channel.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "lcm/codec.h"
#include "lcm/wire.h"

namespace bushd::lcm {

std::int32_t count(const auto& elements) {
  return static_cast<std::int32_t>(elements.size());
}

template <class Message>
bushd::Result<Packet> packet(std::string_view channel, const Message& message) {
  auto payload = encode(message);
  if (!payload) return fail(payload.error());
  return Packet{.channel = std::string(channel), .payload = std::move(*payload)};
}

}  // namespace bushd::lcm
