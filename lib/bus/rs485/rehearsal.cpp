#include "bus/rs485/rehearsal.h"

#include <algorithm>
#include <utility>

namespace bushd::link {

Rehearsal::Rehearsal(BusSnapshot bus, TickSource& source, std::span<const PlannedMove> moves,
                     std::uint64_t max_frames)
    : bus_(std::move(bus)),
      writer_(bus_.setup->baud),
      streams_({.setup = *bus_.setup,
                .mcus = bus_.mcus,
                .clock = bus_.clock,
                .source = source,
                .writer = writer_,
                .events = unused_}),
      max_frames_(max_frames) {
  writer_.reset(bus_.now_us);
  PerMcu<std::uint8_t> named(bus_.mcus.size());
  for (const PlannedMove& move : moves) {
    if (move.run) {
      streams_.begin_run(move.mcu, move.motor, move.start, *move.run);
    } else {
      streams_.begin(move.mcu, move.motor, move.start);
    }
    end_ = std::max(end_, source.end_tick(move.mcu, move.motor));
    if (std::exchange(named[move.mcu], 1) == 0) open_.push_back(move.mcu);
  }
}

bool Rehearsal::ticks_to_send() {
  while (!open_.empty() && !streams_.has_ticks_to_send(open_.back())) open_.pop_back();
  return !open_.empty();
}

bool Rehearsal::step() {
  if (!traffic_ || !ticks_to_send()) return false;
  // Queues are filled ahead of the time: what has not gone out by its end never will.
  const bool never = !bus_.clock.valid() || bus_.clock.tick_at(bus_.now_us) > end_;
  const bool frame =
      !never && writer_.has_room(bus_.now_us) &&
      streams_.send_stream(bus_.now_us, {.lead_us = bus_.queue_us, .target_us = bus_.queue_us});
  if (!frame) bus_.now_us += kStreamWakeUs;
  if (frame) ++traffic_->frames;
  traffic_->bytes += writer_.bytes().size();
  writer_.clear();
  if (never || traffic_->frames > max_frames_) traffic_.reset();
  return traffic_.has_value();
}

}  // namespace bushd::link
