// What would go out for moves, without sending it: the stream scheduler on copies.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "link/bus_clock.h"
#include "link/bus_setup.h"
#include "link/mcu_record.h"
#include "link/tick_source.h"

namespace bushd::link {

// A move that a tick source has ticks for.
struct PlannedMove {
  McuIndex mcu;
  std::uint8_t motor;
  Tick start;
  std::optional<std::int32_t> run_steps;  // of a table run
};

struct Traffic {
  std::uint64_t frames = 0;
  std::uint64_t bytes = 0;
};

// The bus as it is when the moves are asked for.
struct RehearsalStage {
  const BusSetup& setup;
  const PerMcu<McuRecord>& mcus;
  const BusClock& clock;
  std::int64_t queue_us;  // queues are filled this far ahead
};

// On a line that has nothing else to do and loses nothing. Preconditions as of Master::begin.
// Nothing beyond `max_frames`: making them all takes as long as in the moves themselves.
std::optional<Traffic> rehearse(std::int64_t now_us, const RehearsalStage& stage,
                                TickSource& source, std::span<const PlannedMove> moves,
                                std::uint64_t max_frames);

}  // namespace bushd::link
