// Frames on their way to the line, and when the line will have carried them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bus/address.h"
#include "bus/bus_times.h"
#include "engine/frame.h"
#include "engine/message.h"

namespace bushd::link {

using fieldbus::McuAddress;

inline constexpr McuAddress kBroadcast{BUSHD_ADDRESS_BROADCAST};

class FrameWriter {
 public:
  explicit FrameWriter(std::uint32_t baud) : baud_(baud) {}

  // A port has been opened: nothing is on its way.
  void reset(std::int64_t now_us) { free_us_ = now_us; }

  // Returns the frame's sequence number.
  std::uint8_t send(std::int64_t now_us, McuAddress address, std::uint8_t type,
                    std::span<const std::uint8_t> payload);

  // It is one of the last 256: an adapter that echoes has returned it.
  bool has_sent(const bushd_frame& frame) const;

  // What was sent since the last clear(); valid until the next send().
  std::span<const std::uint8_t> bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

  // How long the line takes for this many bytes.
  std::int64_t line_us(std::size_t bytes) const;
  // From the end of the longest answer of a window to the next window.
  std::int64_t window_guard_us() const { return fieldbus::window_guard_us(baud_); }
  // When all that was sent has left.
  std::int64_t free_us() const { return free_us_; }
  // Little enough waits for the line that the next frame may be chosen now.
  bool has_room(std::int64_t now_us) const { return free_us_ - now_us < kMaxBacklogUs; }
  std::int64_t room_from_us() const { return free_us_ - kMaxBacklogUs + 1; }

 private:
  // Bytes handed to the port but not yet on the bus. What is due next is decided as late as that.
  static constexpr std::int64_t kMaxBacklogUs = 5'000;

  std::uint32_t baud_;
  std::vector<std::uint8_t> bytes_;
  std::int64_t free_us_ = 0;
  std::uint8_t sequence_ = 0;
  std::array<std::uint32_t, 256> sent_{};  // fingerprints, by sequence number
};

}  // namespace bushd::link
