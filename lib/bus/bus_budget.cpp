#include "bus/bus_budget.h"

#include <algorithm>
#include <vector>

#include "bus/bus_times.h"

namespace bushd::fieldbus {
namespace {

// Every transmitter sends a delimiter first.
constexpr double kFrameCost = BUSHD_FRAME_OVERHEAD + 1.0;
constexpr double kSyncBytes = 19.0;
constexpr double kPollEntryBytes = BUSHD_POLL_ENTRY;
// A frame of states holds 300 ms of a run, or the part of it that one state tells: a third of that
// is what motors at the edges of their ramps may need.
constexpr double kStatesPeriodS = 0.1;

// The window of one whose motors all move, with the last SYNC, whether its report fills it or not.
double report_bytes(std::uint8_t motors) {
  const auto all = static_cast<std::uint16_t>((1u << motors) - 1u);
  unsigned sections = BUSHD_TELLS_SYNC;
  if (motors != 0) sections |= BUSHD_TELLS_MOTION;
  return static_cast<double>(bushd_report_size(static_cast<std::uint8_t>(sections), all));
}

}  // namespace

double poll_load(std::uint32_t baud, std::span<const std::uint8_t> motors_per_mcu) {
  const double bytes_per_us = baud / 10.0 * 1e-6;
  const double polls_per_s = 1.0 / (kPollPeriodUs * 1e-6);
  const double guard_bytes = static_cast<double>(window_guard_us(baud)) * bytes_per_us;
  double bytes_per_s = (kFrameCost + kSyncBytes) / (kSyncPeriodUs * 1e-6);
  bytes_per_s += (kFrameCost + 1.0 + kFirstWindowUs * bytes_per_us) * polls_per_s;
  for (const std::uint8_t motors : motors_per_mcu) {
    bytes_per_s +=
        (kPollEntryBytes + kFrameCost + report_bytes(motors) + guard_bytes) * polls_per_s;
  }
  return bytes_per_s * 10.0 / baud;
}

double stream_load(std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
                   std::span<const Streamed> mcus) {
  const bool fine = format == BUSHD_FORMAT_FINE;
  double bytes_per_s = 0;
  const auto of_ticks = [&](unsigned motors) {
    if (motors == 0) return 0.0;
    const double ticks = ticks_per_frame(motors, format, tick_ns);
    const double frame =
        kFrameCost + BUSHD_TICKS_HEADER + 2.0 * motors + ticks * motors * (fine ? 2.0 : 1.0);
    return frame / (ticks * tick_ns * 1e-9);
  };
  for (const auto& [by_ticks, by_states] : mcus) {
    const int frames = (by_states + kMotorsPerStates - 1) / kMotorsPerStates;
    const double of_states = (frames * (kFrameCost + BUSHD_TABLE_TICKS_HEADER) +
                              by_states * double{BUSHD_TABLE_TICKS_MAX_ENTRY}) /
                             kStatesPeriodS;
    // Where ticks are shorter, they are sent.
    const double all_by_ticks = of_ticks(unsigned{by_ticks} + unsigned{by_states});
    bytes_per_s += std::min(of_ticks(by_ticks) + of_states, all_by_ticks);
  }
  return bytes_per_s * 10.0 / baud;
}

double bus_load(std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
                std::span<const std::uint8_t> motors_per_mcu) {
  std::vector<Streamed> all;
  for (const std::uint8_t motors : motors_per_mcu) all.push_back({.by_ticks = motors});
  return poll_load(baud, motors_per_mcu) + stream_load(baud, tick_ns, format, all);
}

}  // namespace bushd::fieldbus
