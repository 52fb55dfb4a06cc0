// Which motors may be on one line or path.
#pragma once

#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

// On one bus that has ticks, or each at a serial port of its own, where ports keep pace with each
// other.
Result<void> may_be_one_line(const Installation& installation, const std::vector<MotorId>& motors);

// On one bus that has ticks: paths, too.
Result<void> on_one_bus(const Installation& installation, const std::vector<MotorId>& motors);

// On one MCU, which makes lines by the elementary law by itself.
Result<void> may_be_elementary(const Installation& installation,
                               const std::vector<MotorId>& motors);

}  // namespace bushd::daemon
