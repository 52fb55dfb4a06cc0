// Frames that get lost on their way to MCUs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "engine/frame.h"

namespace bushd::test {

// These bytes without the frames that are lost.
inline std::vector<std::uint8_t> without(const std::vector<std::uint8_t>& bytes,
                                         const std::function<bool(const bushd_frame&)>& lost) {
  std::vector<std::uint8_t> through;
  std::vector<std::uint8_t> pending;  // until its frame is complete
  bushd_receiver receiver{};
  bushd_frame frame;
  for (const std::uint8_t byte : bytes) {
    pending.push_back(byte);
    if (bushd_receive_byte(&receiver, byte, &frame) != BUSHD_RECEIVE_FRAME) continue;
    if (!lost(frame)) through.insert(through.end(), pending.begin(), pending.end());
    pending.clear();
  }
  through.insert(through.end(), pending.begin(), pending.end());
  return through;
}

// What Lab::on_send is to be: whatever the daemon sends at once gets through as a whole, or, with
// a frame of this type (BUSHD_MSG_*) to this address in it, not at all.
inline auto loses(std::uint8_t address, std::uint8_t type) {
  return [address, type](std::size_t, std::vector<std::uint8_t>& bytes) {
    const auto lost = [&](const bushd_frame& frame) {
      return frame.address == address && frame.type == type;
    };
    return without(bytes, lost).size() == bytes.size();
  };
}

}  // namespace bushd::test
