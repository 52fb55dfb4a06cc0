// Runs as they are made to the image for ATmega2560 by tests of its slots.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/avr/avr_fixture.h"

namespace bushd::sim {

// A side of 238 codes, from 1000 / 280 of the cruise down.
inline std::vector<std::uint16_t> ramp_to(std::uint16_t cruise) {
  std::vector<std::uint16_t> codes;
  for (int i = 0; i < 238; ++i) {
    codes.push_back(static_cast<std::uint16_t>(cruise * (1000 - 3 * i) / 280));
  }
  return codes;
}

// Delays of the steps 1..n of a run by that, from rest to rest: max(A(k-1), D(n-k), c).
inline std::vector<std::uint16_t> delays_of_run(std::uint16_t cruise, std::size_t n) {
  const std::vector<std::uint16_t> ramp = ramp_to(cruise);
  const auto code = [&](std::size_t i) { return i < ramp.size() ? ramp[i] : cruise; };
  std::vector<std::uint16_t> delays;
  for (std::size_t k = 1; k <= n; ++k) {
    delays.push_back(std::max({code(k - 1), code(n - k), cruise}));
  }
  return delays;
}

struct RampLoad {
  bushd_format format;
  std::uint32_t tick_ns;
  std::uint32_t unit_ns;
  std::uint16_t cruise;   // in units
  std::uint32_t poll_ms;  // 0: nothing is asked meanwhile
  int phase = 0;          // in which polls meet the ticks
};

// `more` is of what runs.
inline std::string name_of(const RampLoad& load, const std::string& more = {}) {
  return (load.format == BUSHD_FORMAT_FINE ? "Fine" : "Coarse") +
         std::to_string(load.tick_ns / 1000) + "us" + more +
         (load.poll_ms != 0 ? "Answering" : "") +
         (load.phase != 0 ? "Phase" + std::to_string(load.phase) : "");
}

class AvrRamps : public AvrAlone {
 protected:
  static constexpr std::int64_t kSlots = 128;
  struct Place {
    std::int64_t slot;       // from the run's start
    bool at_border = false;  // a hundredth of a slot later it is in the next one
  };

  void make_ready(const RampLoad& load) {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(load.tick_ns, load.format));
    ASSERT_NO_FATAL_FAILURE(
        master_.upload_table(kAddress, 0, load.unit_ns, ramp_to(load.cruise), load.cruise));
    ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  }

  // Making sixteen runs takes some ticks, well before they begin. Ticks are the master's: only what
  // it sends meets them in another phase.
  void pass_until_made(const RampLoad& load) {
    pass(8 * TimeNs{load.tick_ns} + load.phase * 61'000);
  }
  TimeNs end_of_run_ns(const RampLoad& load, const Place& last) const {
    return bus_.now_ns() + static_cast<TimeNs>(last.slot / kSlots + 41) * load.tick_ns;
  }

  // By motor. All pulses begin within the time of one slot, counted from where theirs does. A place
  // may be told a hundredth of a slot late (docs/protocol.md).
  void expect_steps_in_slots(const std::vector<std::vector<Place>>& places,
                             std::uint32_t tick_ns) const {
    const auto time_of = [=](std::int64_t slot) { return slot * tick_ns / kSlots; };
    const TimeNs slot_ns = time_of(1);
    TimeNs earliest_ns = 0;
    TimeNs latest_ns = 0;
    TimeNs begin_ns = 0;
    for (std::uint8_t m = 0; m < places.size(); ++m) {
      SCOPED_TRACE("motor " + std::to_string(m));
      const std::vector<TimeNs> made = recorder_.times(0, Signal::kStep, m, true);
      ASSERT_EQ(made.size(), places[m].size());
      if (m == 0) begin_ns = made[0] - time_of(places[m][0].slot);
      for (std::size_t i = 0; i < made.size(); ++i) {
        const Place& place = places[m][i];
        TimeNs late_ns = made[i] - begin_ns - time_of(place.slot);
        if (place.at_border && late_ns > slot_ns / 2) late_ns -= slot_ns;
        earliest_ns = std::min(earliest_ns, late_ns);
        latest_ns = std::max(latest_ns, late_ns);
        ASSERT_LT(latest_ns - earliest_ns, slot_ns) << "step " << i;
      }
    }
  }
};

}  // namespace bushd::sim
