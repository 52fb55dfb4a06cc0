// How much of a bus the protocol needs when every motor moves: the reason to refuse a
// configuration.
#pragma once

#include <cstdint>
#include <span>

#include "engine/message.h"

namespace bushd::fieldbus {

// Share of the bus that may be planned: the rest is for repeats, turnaround and adapter latency.
inline constexpr double kMaxBusLoad = 0.85;

// Share (1.0 = all) of a bus of `baud` that ticks of `tick_ns` need with `motors_per_mcu` motors
// on each MCU, everything moving: tick frames with running delays, polls and reports, SYNCs. A
// byte takes 10 bits.
double bus_load(std::uint32_t baud, std::uint32_t tick_ns, bushd_format format,
                std::span<const std::uint8_t> motors_per_mcu);

}  // namespace bushd::fieldbus
