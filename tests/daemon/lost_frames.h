// Frames that get lost on their way to MCUs.
#pragma once

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

}  // namespace bushd::test
