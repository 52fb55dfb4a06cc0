// Who is on a bus, whatever their addresses.
#pragma once

#include <chrono>
#include <vector>

#include "base/result.h"
#include "raw_bus.h"
#include "raw_bus_report.h"

namespace bushctl {

// More than any adapter takes to hand over what has arrived.
inline constexpr std::chrono::microseconds kAnswerPatience{60'000};

// Asks in rounds, until several in a row have found nothing new.
bushd::Result<std::vector<Found>> find_all(RawBus& line);

}  // namespace bushctl
