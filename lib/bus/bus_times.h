// Times of the protocol that the budget of a bus and its master share (docs/protocol.md, Wire).
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/message.h"

namespace bushd::fieldbus {

inline constexpr std::int64_t kPollPeriodUs = 50'000;  // each MCU is asked this often, or oftener
inline constexpr std::int64_t kSyncPeriodUs = 500'000;
// What one lost frame can cost: so many ticks, and so much time, half of what queues hold.
inline constexpr unsigned kMaxTicksPerFrame = 16;
inline constexpr std::int64_t kMaxFrameUs = 150'000;
// From a poll's end to the first answer: what an MCU may need to begin.
inline constexpr std::int64_t kFirstWindowUs = 1'000;
// From one answer to the next: an answer may begin so late, its transmitter may hold the bus for a
// byte time more, and windows begin in whole units.
inline constexpr std::int64_t kAnswerLateUs = 500;
constexpr std::int64_t window_guard_us(std::uint32_t baud) {
  return kAnswerLateUs + (10'000'000 + baud - 1) / baud + BUSHD_REPLY_UNIT_NS / 1000;
}

// So many states of runs always fit into one frame.
inline constexpr int kMotorsPerStates =
    (BUSHD_FRAME_MAX_PAYLOAD - BUSHD_TABLE_TICKS_HEADER) / BUSHD_TABLE_TICKS_MAX_ENTRY;

// Ticks that a full frame of TICKS holds. Precondition: motors > 0.
inline unsigned ticks_per_frame(unsigned motors, bushd_format format, std::uint32_t tick_ns) {
  const auto in_time = static_cast<unsigned>(kMaxFrameUs * 1000 / tick_ns);
  const unsigned room =
      bushd_ticks_capacity(static_cast<std::uint8_t>(motors), format == BUSHD_FORMAT_FINE);
  return std::min({room, kMaxTicksPerFrame, in_time});
}

}  // namespace bushd::fieldbus
