#include "link/line_budget.h"

#include <algorithm>

namespace bushd::link {
namespace {

// Whoever takes the line begins with a delimiter.
constexpr double kFrameCost = BUSHD_FRAME_OVERHEAD + 1.0;

}  // namespace

double line_load(std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
                 std::span<const std::uint8_t> motors_per_mcu) {
  const double tick_s = tick_ns * 1e-9;
  const bool fine = format == BUSHD_FORMAT_FINE;
  double bytes_per_s = (kFrameCost + 10.0) / (kSyncPeriodUs * 1e-6);
  for (const std::uint8_t motors : motors_per_mcu) {
    const double poll = 2.0 * kFrameCost + BUSHD_REPORT_SIZE(motors);
    bytes_per_s += poll / (kPollPeriodUs * 1e-6);
    if (motors == 0) continue;
    const double ticks =
        std::min<unsigned>(bushd_ticks_capacity(motors, fine, true), kMaxTicksPerFrame);
    const double frame =
        kFrameCost + BUSHD_TICKS_HEADER + 2.0 * motors + ticks * motors * (fine ? 2.0 : 1.0);
    bytes_per_s += frame / (ticks * tick_s);
  }
  return bytes_per_s * 10.0 / baud;
}

}  // namespace bushd::link
