// Whether steps are made in their slots, of motors that all make as many steps in every tick, to or
// fro, from whole positions.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "engine/message.h"
#include "sim/edge.h"
#include "sim/requests.h"
#include "sim/wire.h"

namespace bushd::sim {

inline constexpr std::size_t kSlots = 128;

struct EvenTicks {
  bushd_format format;
  std::size_t ticks;
  std::size_t steps;  // of a motor in a tick
  TimeNs tick_ns;
  TimeNs slots_ns;  // kSlots as long as the MCU makes them; a tick may be longer
};

// From the beginning of the first tick; docs/protocol.md, "TICKS".
inline std::size_t slots_to_step(const EvenTicks& of, std::size_t step) {
  const std::size_t i = step % of.steps;
  const std::size_t in_tick = of.format == BUSHD_FORMAT_FINE
                                  ? std::min((i + 1) * kSlots / of.steps, kSlots - 1)
                                  : (2 * i + 1) * kSlots / (2 * of.steps);
  return step / of.steps * kSlots + in_tick;
}

inline TimeNs time_to_step(const EvenTicks& of, std::size_t step) {
  const std::size_t slots = slots_to_step(of, step);
  return static_cast<TimeNs>(slots / kSlots) * of.tick_ns +
         static_cast<TimeNs>(slots % kSlots) * of.slots_ns / TimeNs{kSlots};
}

// TICKS in which all motors make so many steps.
inline std::vector<std::uint8_t> ticks_of_all(bushd_format format, bool starts, std::uint32_t first,
                                              const std::vector<int>& steps, std::uint16_t delay) {
  const bool fine = format == BUSHD_FORMAT_FINE;
  test::Ticks ticks{.flags = static_cast<std::uint8_t>((starts ? BUSHD_TICKS_START : 0) |
                                                       (fine ? BUSHD_TICKS_FINE : 0)),
                    .first = first,
                    .count = static_cast<std::uint8_t>(steps.size()),
                    .mask = 0xFFFF,
                    .delays = std::vector<std::uint16_t>(BUSHD_MOTORS_PER_MCU, delay)};
  for (const int of_a_motor : steps) {
    ticks.displacements.insert(ticks.displacements.end(), BUSHD_MOTORS_PER_MCU,
                               test::displacement_of(of_a_motor, fine));
  }
  return test::ticks_payload(ticks);
}

struct PulseFigures {
  TimeNs shortest_ns = kNever;
  // How long after its slot's beginning a pulse comes, counted from its motor's first one.
  TimeNs earliest_ns = 0;
  TimeNs latest_ns = 0;
};

// `edges` are of one MCU. Fails unless all its motors have made all steps, and each in its slot:
// all pulses begin within the time of one, counted from where theirs does.
inline void expect_steps_in_slots(const std::vector<Edge>& edges, const EvenTicks& of,
                                  PulseFigures* figures) {
  const TimeNs slot_ns = of.slots_ns / TimeNs{kSlots};
  std::array<std::vector<TimeNs>, BUSHD_MOTORS_PER_MCU> of_motor;  // up and down by turns
  for (const Edge& edge : edges) {
    if (edge.signal != Signal::kStep) continue;
    ASSERT_EQ(edge.level, of_motor[edge.index].size() % 2 == 0);
    of_motor[edge.index].push_back(edge.time_ns);
  }
  for (std::size_t m = 0; m < of_motor.size(); ++m) {
    SCOPED_TRACE("motor " + std::to_string(m));
    const std::vector<TimeNs>& times = of_motor[m];
    ASSERT_EQ(times.size(), 2 * of.steps * of.ticks);
    ASSERT_LT(std::abs(times[0] - of_motor[0][0]), slot_ns) << "another slot than motor 0";
    const TimeNs begin_ns = times[0] - time_to_step(of, 0);
    for (std::size_t step = 0; step < of.steps * of.ticks; ++step) {
      const TimeNs up_ns = times[2 * step];
      const TimeNs late_ns = up_ns - begin_ns - time_to_step(of, step);
      figures->shortest_ns = std::min(figures->shortest_ns, times[2 * step + 1] - up_ns);
      figures->earliest_ns = std::min(figures->earliest_ns, late_ns);
      figures->latest_ns = std::max(figures->latest_ns, late_ns);
      // A tick that was not ready would have made it late.
      ASSERT_LT(figures->latest_ns - figures->earliest_ns, slot_ns) << "step " << step;
    }
  }
}

}  // namespace bushd::sim
