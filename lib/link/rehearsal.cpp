#include "link/rehearsal.h"

#include <algorithm>

#include "link/stream_scheduler.h"

namespace bushd::link {

std::optional<Traffic> rehearse(std::int64_t now_us, const RehearsalStage& stage,
                                TickSource& source, std::span<const PlannedMove> moves,
                                std::uint64_t max_frames) {
  PerMcu<McuRecord> mcus = stage.mcus;
  FrameWriter writer(stage.setup.baud);
  writer.reset(now_us);
  std::vector<Event> unused;
  StreamScheduler streams({.setup = stage.setup,
                           .mcus = mcus,
                           .clock = stage.clock,
                           .source = source,
                           .writer = writer,
                           .events = unused});
  Tick end = 0;
  for (const PlannedMove& move : moves) {
    if (move.run_steps) {
      streams.begin_table_run(move.mcu, move.motor, move.start, *move.run_steps);
    } else {
      streams.begin(move.mcu, move.motor, move.start);
    }
    end = std::max(end, source.end_tick(move.mcu, move.motor));
  }
  const auto open = [&] {
    return std::any_of(moves.begin(), moves.end(), [&](const PlannedMove& move) {
      return streams.has_ticks_to_send(move.mcu);
    });
  };
  Traffic traffic;
  const StreamScheduler::Filling filling{.lead_us = stage.queue_us, .target_us = stage.queue_us};
  for (; open(); now_us += kStreamWakeUs) {
    // Queues are filled ahead of the time: what has not gone out by its end never will.
    if (!stage.clock.valid() || stage.clock.tick_at(now_us) > end) return std::nullopt;
    while (writer.has_room(now_us) && streams.send_stream(now_us, filling)) {
      if (++traffic.frames > max_frames) return std::nullopt;
    }
    traffic.bytes += writer.bytes().size();
    writer.clear();
  }
  return traffic;
}

}  // namespace bushd::link
