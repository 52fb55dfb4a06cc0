// Times and sizes that more than one file of the master needs.
#pragma once

#include <cstdint>

#include "fieldbus/line_times.h"

namespace bushd::link {

using fieldbus::kFirstSlotUs;
using fieldbus::kMaxTicksPerFrame;
using fieldbus::kPollPeriodUs;
using fieldbus::kSlotGuardUs;
using fieldbus::kSyncPeriodUs;

inline constexpr int kMaxSilent = 10;  // unanswered requests in a row: about half a second
inline constexpr std::int64_t kRetryUs = 500'000;  // between two looks for a silent MCU
inline constexpr std::int64_t kRefusedRetryUs =
    2'000'000;  // for an MCU that does not fit: no hurry

}  // namespace bushd::link
