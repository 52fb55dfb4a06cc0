// A line on which one MCU does not hear one kind of message: for Lab::on_send.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/frame.h"

namespace bushd::test {

// What Lab::on_send is to be: whatever the daemon sends at once gets through as a whole, or, with
// a frame of this type (BUSHD_MSG_*) to this address in it, not at all.
inline auto loses(std::uint8_t address, std::uint8_t type) {
  return [address, type](std::size_t, std::vector<std::uint8_t>& bytes) {
    bushd_receiver receiver{};
    bushd_frame frame;
    for (const std::uint8_t byte : bytes) {
      if (bushd_receive_byte(&receiver, byte, &frame) != BUSHD_RECEIVE_FRAME) continue;
      if (frame.address == address && frame.type == type) return false;
    }
    return true;
  };
}

}  // namespace bushd::test
