// Times of the protocol that a line's budget and its master share (docs/protocol.md, Line).
#pragma once

#include <cstdint>

namespace bushd::fieldbus {

inline constexpr std::int64_t kPollPeriodUs = 50'000;  // each MCU is asked this often
inline constexpr std::int64_t kSyncPeriodUs = 500'000;
inline constexpr unsigned kMaxTicksPerFrame = 16;  // what one lost frame can cost
// From a poll's end to the first answer, and from one answer to the next: what an MCU may need to
// begin and to let the line go.
inline constexpr std::int64_t kFirstSlotUs = 1'000;
inline constexpr std::int64_t kSlotGuardUs = 600;

}  // namespace bushd::fieldbus
