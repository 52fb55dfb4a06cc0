// How much of a bus the protocol needs: the reason to refuse a configuration, or what would stream
// more than the line can carry.
#pragma once

#include <cstdint>
#include <span>

#include "engine/message.h"

namespace bushd::fieldbus {

// Share of the bus that may be planned: the rest is for repeats, turnaround and adapter latency.
inline constexpr double kMaxBusLoad = 0.85;

// Share (1.0 = all) of a bus of `baud` that polls, reports and SYNCs need with `motors_per_mcu`
// motors on each MCU, all of them moving. A byte takes 10 bits.
double poll_load(std::uint32_t baud, std::span<const std::uint8_t> motors_per_mcu);

// Motors of an MCU whose motion is streamed.
struct Streamed {
  std::uint8_t by_ticks = 0;   // tick by tick
  std::uint8_t by_states = 0;  // as states of their runs
};
// The share that streams of ticks of `tick_ns` need: tick frames with running delays; states as
// often as they are told at most.
double stream_load(std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
                   std::span<const Streamed> mcus);

// Both, with all motors streamed by ticks.
double bus_load(std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
                std::span<const std::uint8_t> motors_per_mcu);

}  // namespace bushd::fieldbus
