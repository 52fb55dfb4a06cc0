#include "bus/rs485/health.h"

#include <algorithm>
#include <utility>

namespace bushd::link {
namespace {

// By how much a counter that stops at its largest value has grown; after a restart it is smaller.
std::uint16_t grown(std::uint16_t now, std::uint16_t before) {
  return static_cast<std::uint16_t>(now >= before ? now - before : now);
}

}  // namespace

void ReportedCounters::follow(const bushd_report& report, McuHealth& health) {
  health.crc_errors += grown(report.bad_frames, std::exchange(crc_errors_, report.bad_frames));
  health.rejected_frames +=
      grown(report.rejected_frames, std::exchange(rejected_frames_, report.rejected_frames));
  health.ramp_downs += grown(report.ramp_downs, std::exchange(ramp_downs_, report.ramp_downs));
  health.rate_ppm = report.rate_ppb * 1e-3;
  if (report.low_water_ticks != UINT16_MAX) {
    health.low_water_ticks =
        std::min(health.low_water_ticks.value_or(UINT16_MAX), report.low_water_ticks);
  }
}

void Latency::add(std::int64_t us) {
  const auto bound = std::find_if(kBoundsUs.begin(), kBoundsUs.end(),
                                  [us](std::int64_t limit) { return us < limit; });
  ++count[static_cast<std::size_t>(bound - kBoundsUs.begin())];
  // Fades to a half within some 20 answers: a second.
  recent_us = std::max(us, recent_us - recent_us / 32);
}

}  // namespace bushd::link
