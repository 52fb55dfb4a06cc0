// How well a bus does, counted since the master began. For people and for alarms: nothing in here
// decides anything.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "engine/message.h"

namespace bushd::link {

struct McuHealth {
  // Told by the MCU, over all its boots that were seen.
  std::uint64_t crc_errors = 0;       // frames that reached it broken
  std::uint64_t rejected_frames = 0;  // valid frames that it could not use
  std::uint64_t ramp_downs = 0;       // motors that ran dry and came to rest by their own table
  // Seen by the master.
  std::uint64_t timeouts = 0;      // requests without an answer
  std::uint64_t repeats = 0;       // stream frames sent again
  std::uint64_t missed_ticks = 0;  // ticks that were sent and found missing
  std::uint64_t restarts = 0;
  // The fewest ticks that a moving motor had queued, since reset_low_water(); none: none moved.
  std::optional<std::uint16_t> low_water_ticks;
  double rate_ppm = 0.0;  // how much faster than its crystal the MCU counts, to follow the bus
  // By how much later it heard the last SYNC than the first MCU that is in step, by its clock. Of a
  // serial port that makes pulses: by how much it was ahead of the slowest port of its last line.
  double clock_offset_us = 0.0;
};

// The counters of an MCU as last reported: what they have grown by goes into its health.
class ReportedCounters {
 public:
  void follow(const bushd_report& report, McuHealth& health);

 private:
  std::uint16_t crc_errors_ = 0;
  std::uint16_t rejected_frames_ = 0;
  std::uint16_t ramp_downs_ = 0;
};

// The latency of an adapter: from when the bus has carried an answer's last byte to when the
// program had it.
struct Latency {
  static constexpr std::array<std::int64_t, 7> kBoundsUs = {500,   1'000,  2'000, 4'000,
                                                            8'000, 16'000, 32'000};
  // Answers by latency: count[i] below kBoundsUs[i], the last one all above.
  std::array<std::uint64_t, kBoundsUs.size() + 1> count{};
  std::int64_t recent_us = 0;  // of late: the largest, fading

  void add(std::int64_t us);
};

struct BusHealth {
  std::uint64_t crc_errors = 0;    // frames that reached the master broken
  std::uint64_t stray_frames = 0;  // valid frames that nobody had been asked for
  std::uint64_t line_bytes = 0;    // sent and received
  Latency latency;
};

}  // namespace bushd::link
