// Times and sizes that more than one file of the master needs.
#pragma once

#include <cstdint>

#include "link/line_budget.h"

namespace bushd::link {

inline constexpr int kMaxSilent = 10;  // unanswered requests in a row: about half a second
inline constexpr std::int64_t kRetryUs = 500'000;  // between two looks for a silent MCU
inline constexpr std::int64_t kRefusedRetryUs =
    2'000'000;  // for an MCU that does not fit: no hurry
// From a poll's end to the first answer, and from one answer to the next: what an MCU may need to
// begin (docs/protocol.md, Line) and to let the line go.
inline constexpr std::int64_t kFirstSlotUs = 1'000;
inline constexpr std::int64_t kSlotGuardUs = 600;

}  // namespace bushd::link
