// A packet of the control socket (AF_UNIX, SOCK_SEQPACKET): the channel's name, a NUL, the message.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "lcm/codec.h"
#include "lcm/wire.h"

namespace bushd::control {

inline constexpr std::size_t kMaxChannel = 63;
inline constexpr std::size_t kMaxPacketBytes = kMaxChannel + 1 + lcm::kMaxMessageBytes;

std::vector<std::uint8_t> packet_of(const lcm::Packet& packet);

struct View {
  std::string_view channel;
  std::span<const std::uint8_t> payload;
};
// Nothing for what has no name at its beginning.
std::optional<View> view_of(std::span<const std::uint8_t> packet);

}  // namespace bushd::control
