// Streams: ticks on their way to the MCUs, and what reports say of those sent.
//
// A motor that runs by its table is told its run's state (TABLE_TICKS) where that is shorter than
// its displacements, and so as many ticks at once as its MCU can hold. What a report shows as
// missing is sent again, and only that: an MCU keeps what it has beyond a gap.
#include <algorithm>
#include <bit>
#include <utility>

#include "link/master.h"
#include "link/master_limits.h"

namespace bushd::link {
namespace {

constexpr std::uint8_t kMaxEpochsAhead = 100;  // MCUs take up to 127
// States of runs hold for any time, so queues are filled twice as deep with them: half as many
// frames.
constexpr Tick kTableDepth = 2;
constexpr Tick kSpareTicks = 4;  // an MCU's ticks run on while a frame is under way

std::uint16_t bit(unsigned motor) {
  return static_cast<std::uint16_t>(1u << motor);
}

}  // namespace

void Master::begin(McuIndex mcu, std::uint8_t motor, Tick start) {
  drop(mcu, motor);
  Stream& stream = mcus_[mcu].stream[motor];
  stream = {};
  stream.active = true;
  stream.start = stream.next = stream.sent = start;
}

void Master::begin_table_run(McuIndex mcu, std::uint8_t motor, Tick start, std::int32_t steps) {
  begin(mcu, motor, start);
  mcus_[mcu].stream[motor].run_steps = steps;
}

void Master::follow_table_run(McuIndex mcu, std::uint8_t motor, Tick start, std::int32_t steps) {
  begin_table_run(mcu, motor, start, steps);
  Stream& stream = mcus_[mcu].stream[motor];
  stream.next = stream.sent = source_.end_tick(mcu, motor);
  stream.finished = true;
}

void Master::drop(McuIndex mcu, std::uint8_t motor) {
  Mcu& m = mcus_[mcu];
  Stream& stream = m.stream[motor];
  stream.active = false;
  // A run that the MCU has broken off does not occupy the motor until where it was to end.
  if (stream.run_steps) stream.next = m.view.known_until[motor];
  // Nor is a replacement that has been asked for and not yet sent.
  m.replacing &= static_cast<std::uint16_t>(~bit(motor));
}

void Master::replace(McuIndex mcu, std::uint16_t motors, Tick first) {
  Mcu& m = mcus_[mcu];
  std::uint16_t sent = 0;  // motors of which ticks from `first` on have been sent already
  Tick earliest = first;
  for (unsigned i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    Stream& stream = m.stream[i];
    if ((motors >> i & 1) == 0 || !stream.active) continue;
    const bool begun = stream.sent != stream.start;
    if (begun && (stream.sent > first || stream.unsure)) {
      sent |= bit(i);
      // Where it has become too late for that, the MCU refuses the other tick until it runs dry.
      if (!too_late(stream.sent, tick_at(stepped_us_))) earliest = std::min(earliest, stream.sent);
    } else {
      // A table run of which nothing has been sent is another one now; it goes out as a stream.
      stream.run_steps.reset();
    }
    stream.finished = false;
  }
  if (sent == 0) return;
  // Two wishes before the first was sent: one replacement must serve both, so it takes the earlier
  // tick. If that is too late by now, it fails as a whole and is planned again.
  m.replace_at = m.replacing == 0 ? earliest : std::min(m.replace_at, earliest);
  m.replacing |= sent;
}

// Until its source has planned anew, a motor whose replacement failed has no ticks that could be
// sent: so nothing is, in the step in which one fails.
bool Master::fail_late_replacements(std::int64_t now_us) {
  bool failed = false;
  for (const McuIndex i : mcus_.indices()) {
    Mcu& mcu = mcus_[i];
    if (mcu.replacing == 0 || !too_late(mcu.replace_at, tick_at(now_us))) continue;
    const std::uint16_t motors = std::exchange(mcu.replacing, std::uint16_t{0});
    events_.push_back(ReplacementFailed{.mcu = i, .motors = motors});
    failed = true;
  }
  return failed;
}

bool Master::send_due_replacement(std::int64_t now_us) {
  for (const McuIndex i : mcus_.indices()) {
    Mcu& mcu = mcus_[i];
    if (mcu.replacing == 0 || mcu.replaced != 0) continue;
    const std::uint16_t mask = std::exchange(mcu.replacing, std::uint16_t{0});
    const auto motors = static_cast<std::uint8_t>(std::popcount(mask));
    const bool fine = setup_.format == BUSHD_FORMAT_FINE;
    const unsigned count =
        std::min<unsigned>(bushd_ticks_capacity(motors, fine), kMaxTicksPerFrame);
    // Another epoch at each try: frames of one that failed may still be on their way.
    if (static_cast<std::uint8_t>(mcu.newest_epoch - mcu.epoch) >= kMaxEpochsAhead) {
      mcu.newest_epoch = mcu.epoch;
    }
    mcu.epoch = ++mcu.newest_epoch;
    for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      if ((mask >> m & 1) == 0) continue;
      mcu.stream[m].run_steps.reset();
      mcu.stream[m].gap.reset();
      mcu.stream[m].sent = mcu.replace_at;
    }
    send_ticks(now_us, i, mask, mcu.replace_at, count, BUSHD_TICKS_REPLACE);
    mcu.replaced = mask;
    mcu.poll_wanted = true;
    return true;
  }
  return false;
}

// A replacement leaves an MCU with little more than one frame of ticks, far less than an answer may
// take. So more goes out before anybody knows whether it was taken: if it was not, its followers
// are of an epoch that the MCU does not have and change nothing.
bool Master::send_stream(std::int64_t now_us, std::int64_t lead_us, bool only_replaced) {
  if (!clock_.valid()) return false;
  const Tick now = tick_at(now_us);
  // The neediest first; one whose queue is full must not keep the others waiting.
  std::vector<std::pair<Tick, McuIndex>> needy;
  for (const McuIndex i : mcus_.indices()) {
    const Mcu& mcu = mcus_[i];
    if (mcu.view.phase != McuPhase::kOnline || (only_replaced && mcu.replaced == 0)) continue;
    Tick next = INT64_MAX;
    for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      if (sendable(mcu, m)) next = std::min(next, mcu.stream[m].next);
    }
    if (next != INT64_MAX) needy.emplace_back(next, i);
  }
  std::sort(needy.begin(), needy.end());
  return std::any_of(needy.begin(), needy.end(), [&](const auto& entry) {
    return send_ticks_of(now_us, entry.second, now, ticks_in(lead_us));
  });
}

// One frame for the motors of an MCU whose next tick is the oldest. Motors that start, start later
// or are ahead have frames of their own until the others have caught up.
bool Master::send_ticks_of(std::int64_t now_us, McuIndex index, Tick now, Tick lead) {
  Mcu& mcu = mcus_[index];
  Tick first = INT64_MAX;
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (sendable(mcu, m)) first = std::min(first, mcu.stream[m].next);
  }
  std::uint16_t running = 0;
  std::uint16_t starting = 0;
  std::uint16_t moving = 0;
  Tick join = INT64_MAX;
  for (unsigned i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    const Stream& stream = mcu.stream[i];
    if (!sendable(mcu, i)) continue;
    if (stream.next != first) {
      join = std::min(join, stream.next);
      continue;
    }
    if (stream.gap) join = std::min(join, stream.gap->until);
    const bool starts = stream.next == stream.start;
    (starts ? (stream.run_steps ? running : starting) : moving) |= bit(i);
  }
  const Tick depth = mcu.view.identity.queue_ticks - kSpareTicks;
  // Table runs need no queue: they are given as soon as the MCU takes them.
  if (running != 0) return first <= now + depth && send_table_runs(now_us, index, running, first);
  // A quarter of a small queue is empty before it is worth a frame.
  if (first > now + std::min(lead, depth * 3 / 4)) return false;
  const std::uint16_t mask = starting != 0 ? starting : moving;
  const unsigned flags = starting != 0 ? BUSHD_TICKS_START : 0;
  const Tick deep = std::min(now + std::min(kTableDepth * lead, depth), join);
  if (deep > first && send_table_ticks(now_us, index, mask, first, deep - first, flags))
    return true;
  const auto motors = static_cast<std::uint8_t>(std::popcount(mask));
  const bool fine = setup_.format == BUSHD_FORMAT_FINE;
  const Tick capacity = std::min<Tick>(bushd_ticks_capacity(motors, fine), kMaxTicksPerFrame);
  Tick last = first + 1;  // nothing of what comes after the end need be sent
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) != 0) last = std::max(last, source_.end_tick(index, m));
  }
  const Tick count = std::min({capacity, join - first, last - first});
  // Only whole frames: a queue filled tick by tick would cost more in headers than in ticks.
  if (first + count > now + std::min(lead, depth)) return false;
  send_ticks(now_us, index, mask, first, static_cast<unsigned>(count), flags);
  return true;
}

bool Master::send_table_runs(std::int64_t now_us, McuIndex index, std::uint16_t mask, Tick first) {
  Mcu& mcu = mcus_[index];
  std::array<bushd_table_run_entry, BUSHD_MOTORS_PER_MCU> entries;
  std::uint8_t count = 0;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) == 0) continue;
    Stream& stream = mcu.stream[m];
    const std::int32_t steps = *stream.run_steps;
    entries[count++] = {
        .motor = m,
        .slot = mcu.setup.table_of_motor[m].value_or(0),
        .direction = static_cast<std::int8_t>(steps < 0 ? -1 : 1),
        .steps = static_cast<std::uint32_t>(std::abs(static_cast<std::int64_t>(steps)))};
    note_sent(index, m, first, source_.end_tick(index, m));
  }
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  const std::size_t size = bushd_encode_table_run(mcu.epoch, static_cast<std::uint32_t>(first),
                                                  entries.data(), count, payload.data());
  writer_.send(now_us, mcu.setup.address, BUSHD_MSG_TABLE_RUN, {payload.data(), size});
  return true;
}

// As many of these ticks as all motors run by their tables, if that is worth it.
bool Master::send_table_ticks(std::int64_t now_us, McuIndex index, std::uint16_t mask, Tick first,
                              Tick max_ticks, unsigned flags) {
  const Mcu& mcu = mcus_[index];
  if (!setup_.table_ticks) return false;
  if ((mcu.view.identity.capabilities & BUSHD_CAN_TABLE_TICKS) == 0) return false;
  auto ticks = static_cast<unsigned>(std::min<Tick>(max_ticks, UINT16_MAX));
  std::array<bushd_run, BUSHD_MOTORS_PER_MCU> run;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) == 0) continue;
    const auto segment = source_.run_at(index, m, first, ticks);
    if (!segment) return false;
    run[m] = segment->run;
    ticks = std::min(ticks, segment->ticks);
  }
  std::array<bushd_table_ticks_entry, BUSHD_MOTORS_PER_MCU> entries;
  std::uint8_t motors = 0;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) == 0) continue;
    entries[motors++] = {
        .motor = m,
        .state = bushd_run_save(&run[m], setup_.tick_ns, static_cast<std::uint16_t>(ticks))};
  }
  std::array<std::uint8_t,
             BUSHD_TABLE_TICKS_HEADER + BUSHD_TABLE_TICKS_MAX_ENTRY * BUSHD_MOTORS_PER_MCU>
      payload;
  const std::size_t size = bushd_encode_table_ticks(
      mcu.epoch, static_cast<std::uint8_t>(flags), static_cast<std::uint32_t>(first),
      static_cast<std::uint16_t>(ticks), entries.data(), motors, payload.data());
  const std::size_t width = setup_.format == BUSHD_FORMAT_FINE ? 2 : 1;
  const std::size_t as_ticks = BUSHD_TICKS_HEADER + motors * (2 + width * ticks);
  if (size > BUSHD_FRAME_MAX_PAYLOAD || size > as_ticks) return false;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) != 0) note_sent(index, m, first, first + ticks);
  }
  writer_.send(now_us, mcu.setup.address, BUSHD_MSG_TABLE_TICKS, {payload.data(), size});
  return true;
}

void Master::send_ticks(std::int64_t now_us, McuIndex index, std::uint16_t mask, Tick first,
                        unsigned count, unsigned flags) {
  Mcu& mcu = mcus_[index];
  const auto motors = static_cast<std::size_t>(std::popcount(mask));
  std::array<std::int16_t, kMaxTicksPerFrame * BUSHD_MOTORS_PER_MCU> displacement;
  std::array<std::uint16_t, BUSHD_MOTORS_PER_MCU> delay;
  std::size_t column = 0;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mask >> m & 1) == 0) continue;
    delay[column] = source_.render(index, m, first, count, &displacement[column], motors);
    note_sent(index, m, first, first + count);
    ++column;
  }
  const bool fine = setup_.format == BUSHD_FORMAT_FINE;
  if (fine) flags |= BUSHD_TICKS_FINE;
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  std::size_t size = bushd_encode_ticks_head(
      mcu.epoch, static_cast<std::uint8_t>(flags), static_cast<std::uint32_t>(first),
      static_cast<std::uint8_t>(count), mask, delay.data(), payload.data());
  for (std::size_t i = 0; i < count * motors; ++i) {
    if (fine) {
      bushd_put_i16(&payload[size], displacement[i]);
      size += 2;
    } else {
      payload[size++] = static_cast<std::uint8_t>(displacement[i]);
    }
  }
  writer_.send(now_us, mcu.setup.address, BUSHD_MSG_TICKS, {payload.data(), size});
}

void Master::note_sent(McuIndex index, std::uint8_t motor, Tick first, Tick until) {
  Mcu& mcu = mcus_[index];
  Stream& stream = mcu.stream[motor];
  if (first < stream.sent) ++mcu.health.repeats;
  stream.next = until;
  if (stream.gap && until >= stream.gap->until) {
    stream.next = std::max(until, stream.gap->known_to);
    stream.gap.reset();
  }
  stream.sent = std::max(stream.sent, stream.next);
  stream.finished = stream.next >= source_.end_tick(index, motor);
}

// A replacement was taken if the MCU is in the epoch that it opened.
void Master::follow_replacements(McuIndex index) {
  Mcu& mcu = mcus_[index];
  const bool taken = mcu.view.report.epoch == mcu.epoch;
  std::uint16_t failed = taken ? std::uint16_t{0} : mcu.replaced;
  for (unsigned m = 0; taken && m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mcu.replaced >> m & 1) != 0) mcu.stream[m].unsure = false;
  }
  mcu.replaced = 0;
  mcu.epoch = mcu.view.report.epoch;
  // What was queued before stays in force, whatever has been sent since. If not even the start has
  // come, it has to be sent again, as one.
  for (unsigned m = 0; m < mcu.view.report.motor_count; ++m) {
    if ((failed >> m & 1) == 0) continue;
    Stream& stream = mcu.stream[m];
    stream.next = stream.sent = std::max(mcu.view.known_until[m], stream.start);
    stream.unsure = stream.sent != stream.start;
    stream.gap.reset();
    stream.finished = false;
  }
  // One not even sent must be known to have failed before its tick is taken for executed.
  if (mcu.replacing != 0 && too_late(mcu.replace_at, mcu.view.tick)) {
    failed |= std::exchange(mcu.replacing, std::uint16_t{0});
  }
  if (failed != 0) {
    events_.push_back(ReplacementFailed{.mcu = index, .motors = failed});
  }
}

// All frames sent before the poll were handled before its answer was made: what is not known is
// lost.
void Master::follow_streams(McuIndex index) {
  Mcu& mcu = mcus_[index];
  const bushd_report& report = mcu.view.report;
  for (std::uint8_t m = 0; m < report.motor_count; ++m) {
    Stream& stream = mcu.stream[m];
    if (!stream.active) continue;
    // It has the whole move.
    if (stream.run_steps && (report.running >> m & 1) != 0) continue;
    const Tick known = mcu.view.known_until[m];
    const bool moving = (report.moving >> m & 1) != 0;
    // Of a stream that has not begun nothing can be missing; but a busy line may keep it waiting
    // past its start.
    const bool begun = stream.sent != stream.start;
    // A frame that it shares with others may have gone on past its end: that is rest, and no MCU
    // takes it alone.
    const Tick needed = std::min(stream.sent, source_.end_tick(index, m));
    if (begun ? known >= needed : moving || known <= stream.start) continue;
    if (!moving && known > stream.start) {
      stream.active = false;
      events_.push_back(StartMissed{.mcu = index, .motor = m});
      continue;
    }
    go_back(mcu, m);
  }
}

// To the first tick that the MCU does not have.
void Master::go_back(Mcu& mcu, std::uint8_t motor) {
  Stream& stream = mcu.stream[motor];
  const bushd_report& report = mcu.view.report;
  stream.next = std::max(mcu.view.known_until[motor], stream.start);
  stream.gap.reset();
  stream.finished = false;
  Tick missing = stream.run_steps ? 0 : stream.sent - stream.next;
  if ((report.islands >> motor & 1) != 0) {
    const auto unwrap = [&](std::uint16_t tick) {
      return mcu.view.tick +
             static_cast<std::int16_t>(tick - static_cast<std::uint16_t>(report.tick));
    };
    const Gap gap = {.until = unwrap(report.island_from), .known_to = unwrap(report.island_until)};
    // What an MCU says is believed only as far as it can be true.
    if (stream.next < gap.until && gap.until < gap.known_to && gap.known_to <= stream.sent) {
      stream.gap = gap;
      missing -= gap.known_to - gap.until;
    }
  }
  mcu.health.missed_ticks += static_cast<std::uint64_t>(std::max<Tick>(missing, 0));
}

void Master::drop_streams(Mcu& mcu) {
  for (Stream& stream : mcu.stream) stream = {};
  mcu.replacing = 0;
  mcu.replaced = 0;
}

}  // namespace bushd::link
