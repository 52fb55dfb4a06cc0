#include "control/packet.h"

#include <algorithm>

namespace bushd::control {

std::vector<std::uint8_t> packet_of(const lcm::Packet& packet) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(packet.channel.size() + 1 + packet.payload.size());
  bytes.insert(bytes.end(), packet.channel.begin(), packet.channel.end());
  bytes.push_back(0);
  bytes.insert(bytes.end(), packet.payload.begin(), packet.payload.end());
  return bytes;
}

std::optional<View> view_of(std::span<const std::uint8_t> packet) {
  const auto name = packet.first(std::min(packet.size(), kMaxChannel + 1));
  const auto nul = std::find(name.begin(), name.end(), std::uint8_t{0});
  if (nul == name.begin() || nul == name.end()) return std::nullopt;
  const auto length = static_cast<std::size_t>(nul - name.begin());
  return View{.channel = {reinterpret_cast<const char*>(packet.data()), length},
              .payload = packet.subspan(length + 1)};
}

}  // namespace bushd::control
