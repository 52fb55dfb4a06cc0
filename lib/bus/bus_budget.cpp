#include "bus/bus_budget.h"

#include <algorithm>

#include "bus/bus_times.h"

namespace bushd::fieldbus {
namespace {

// Every transmitter sends a delimiter first.
constexpr double kFrameCost = BUSHD_FRAME_OVERHEAD + 1.0;
constexpr double kSyncBytes = 19.0;
constexpr double kPollEntryBytes = BUSHD_POLL_ENTRY;

// The window of one whose motors all move, with the last SYNC, whether its report fills it or not.
double report_bytes(std::uint8_t motors) {
  const auto all = static_cast<std::uint16_t>((1u << motors) - 1u);
  unsigned sections = BUSHD_TELLS_SYNC;
  if (motors != 0) sections |= BUSHD_TELLS_MOTION;
  return static_cast<double>(bushd_report_size(static_cast<std::uint8_t>(sections), all));
}

}  // namespace

double bus_load(std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
                std::span<const std::uint8_t> motors_per_mcu) {
  const double tick_s = tick_ns * 1e-9;
  const bool fine = format == BUSHD_FORMAT_FINE;
  const double bytes_per_us = baud / 10.0 * 1e-6;
  const double polls_per_s = 1.0 / (kPollPeriodUs * 1e-6);
  double bytes_per_s = (kFrameCost + kSyncBytes) / (kSyncPeriodUs * 1e-6);
  bytes_per_s += (kFrameCost + 1.0 + kFirstWindowUs * bytes_per_us) * polls_per_s;
  const double guard_bytes = static_cast<double>(window_guard_us(baud)) * bytes_per_us;
  for (const std::uint8_t motors : motors_per_mcu) {
    const double report = kPollEntryBytes + kFrameCost + report_bytes(motors) + guard_bytes;
    bytes_per_s += report * polls_per_s;
    if (motors == 0) continue;
    const double ticks = ticks_per_frame(motors, format, tick_ns);
    const double frame =
        kFrameCost + BUSHD_TICKS_HEADER + 2.0 * motors + ticks * motors * (fine ? 2.0 : 1.0);
    bytes_per_s += frame / (ticks * tick_s);
  }
  return bytes_per_s * 10.0 / baud;
}

}  // namespace bushd::fieldbus
