// What would go out for moves, without sending it: the stream scheduler on copies, a frame at a
// time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/rs485/bus_clock.h"
#include "bus/rs485/bus_setup.h"
#include "bus/rs485/frame_writer.h"
#include "bus/rs485/mcu_record.h"
#include "bus/rs485/stream_scheduler.h"
#include "bus/rs485/table_run.h"
#include "bus/rs485/tick_source.h"

namespace bushd::link {

// A move that a tick source has ticks for.
struct PlannedMove {
  McuIndex mcu;
  std::uint8_t motor;
  Tick start;
  std::optional<McuRun> run;
};

struct Traffic {
  std::uint64_t frames = 0;
  std::uint64_t bytes = 0;
};

// A bus as it is at one moment. Only the setup is not copied, and outlives this: it never changes.
struct BusSnapshot {
  const BusSetup* setup;
  PerMcu<McuRecord> mcus;
  BusClock clock;
  std::int64_t queue_us;  // queues are filled this far ahead
  std::int64_t now_us;
};

// On a line that has nothing else to do and loses nothing.
class Rehearsal {
 public:
  // `source` outlives it. Preconditions as of Rs485Master::begin, at the moment of the snapshot.
  // Nothing is told beyond `max_frames`: making them all takes as long as in the moves themselves.
  Rehearsal(BusSnapshot bus, TickSource& source, std::span<const PlannedMove> moves,
            std::uint64_t max_frames);
  Rehearsal(const Rehearsal&) = delete;
  Rehearsal& operator=(const Rehearsal&) = delete;

  // Makes one frame, or lets time pass until one may be due. Returns false when nothing is left to
  // do. Microseconds: O(motors of the bus).
  bool step();
  // Precondition: step() has returned false. Nothing: it is too much to be counted.
  const std::optional<Traffic>& traffic() const { return traffic_; }

 private:
  bool ticks_to_send();

  BusSnapshot bus_;
  FrameWriter writer_;
  std::vector<Event> unused_;
  StreamScheduler streams_;
  std::uint64_t max_frames_;
  Tick end_ = 0;
  std::vector<McuIndex> open_;  // that may have ticks left to be sent
  std::optional<Traffic> traffic_ = Traffic{};
};

}  // namespace bushd::link
