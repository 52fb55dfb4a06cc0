// How long frames take on the line of hall(), at 500000 baud, a delimiter before each of them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/frame.h"
#include "engine/message.h"

namespace bushd::test {

inline constexpr std::int64_t kHallTickUs = 2'560;

constexpr std::int64_t hall_line_us(std::size_t payload) {
  return static_cast<std::int64_t>(payload + BUSHD_FRAME_OVERHEAD + 1) * 20;
}

// A poll of so many MCUs, until the last of these answers has come: docs/protocol.md has 1 ms until
// the first window, and behind each answer 0.5 ms and a byte; windows begin in whole units of 10
// us.
constexpr std::int64_t hall_poll_us(int mcus, std::size_t answer) {
  const auto entries = static_cast<std::size_t>(mcus) * BUSHD_POLL_ENTRY;
  return hall_line_us(1 + entries) + 1'010 + mcus * (hall_line_us(answer) + 530);
}

// Payloads of answers with news of the last SYNC: at rest, of motors that have come to rest, and of
// motors that plans move.
inline constexpr std::size_t kAnswerAtRest = 22 + 16;
constexpr std::size_t answer_at_end(int motors) {
  return kAnswerAtRest + 6 * static_cast<std::size_t>(motors);
}
constexpr std::size_t answer_in_motion(int motors) {
  return answer_at_end(motors) + 12;
}

}  // namespace bushd::test
