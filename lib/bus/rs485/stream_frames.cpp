// Which frame of ticks goes out next, and what it holds.
#include <algorithm>
#include <bit>
#include <cstdlib>
#include <utility>

#include "bus/bus_times.h"
#include "bus/rs485/stream_scheduler.h"

namespace bushd::link {
namespace {

using fieldbus::kMaxTicksPerFrame;

constexpr std::uint8_t kMaxEpochsAhead = 100;  // MCUs take up to 127
// States of runs hold for any time, so queues are filled twice as deep with them: half as many
// frames.
constexpr Tick kTableDepth = 2;
constexpr Tick kSpareTicks = 4;  // an MCU's ticks run on while a frame is under way

constexpr bool has(std::uint16_t mask, unsigned motor) {
  return (mask >> motor & 1) != 0;
}

}  // namespace

bool StreamScheduler::send_due_replacement(std::int64_t now_us) {
  for (const McuIndex i : mcus_.indices()) {
    Mcu& mcu = mcus_[i];
    if (mcu.replacing == 0 || mcu.replaced != 0) continue;
    const auto ticks = static_cast<unsigned>(ticks_of_waiting(i));
    const std::uint16_t mask = std::exchange(mcu.replacing, std::uint16_t{0});
    // Another epoch at each try: frames of one that failed may still be on their way.
    if (static_cast<std::uint8_t>(mcu.newest_epoch - mcu.epoch) >= kMaxEpochsAhead) {
      mcu.newest_epoch = mcu.epoch;
    }
    mcu.epoch = ++mcu.newest_epoch;
    for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      if (!has(mask, m)) continue;
      mcu.stream[m].run.reset();
      mcu.stream[m].beyond_gap.reset();
      mcu.stream[m].sent = mcu.replace_at;
      mcu.stream[m].from_before = mcu.stream[m].from;
      mcu.stream[m].from = std::min(mcu.stream[m].from, mcu.replace_at);
    }
    send_ticks(now_us, i, mask, mcu.replace_at, ticks, BUSHD_TICKS_REPLACE);
    mcu.withdraws = false;
    mcu.replaced = mask;
    mcu.replaced_us = now_us;
    records_[i].poll_wanted = true;
    return true;
  }
  return false;
}

// A replacement leaves an MCU with little more than one frame of ticks, far less than an answer may
// take. So more goes out before anybody knows whether it was taken: if it was not, its followers
// are of an epoch that the MCU does not have and change nothing.
bool StreamScheduler::send_stream(std::int64_t now_us, const Filling& filling) {
  if (!clock_.valid()) return false;
  // The neediest first; one whose queue is full must not keep the others waiting.
  std::vector<std::pair<Tick, McuIndex>> needy;
  for (const McuIndex i : mcus_.indices()) {
    finish_ended(i);
    const Mcu& mcu = mcus_[i];
    const bool online = records_[i].view.phase == McuPhase::kOnline;
    if (!online) continue;
    if (const auto next = mcu.next_tick()) needy.emplace_back(*next, i);
  }
  std::sort(needy.begin(), needy.end());
  return std::any_of(needy.begin(), needy.end(), [&](const auto& entry) {
    return send_ticks_of(now_us, entry.second, filling);
  });
}

bool StreamScheduler::send_critical(std::int64_t now_us, const Filling& filling,
                                    std::int64_t margin_us) {
  Filling critical = filling;
  if (const std::int64_t waits_us = replacements_us({}); waits_us != 0) {
    critical.lead_us = std::max(writer_.free_us() - now_us, std::int64_t{0}) + waits_us + margin_us;
  }
  return send_stream(now_us, critical);
}

// A motor that was to have another plan, and did not get it, may have been told all of its own. An
// MCU refuses more for it, and with it all that the frame has for others.
void StreamScheduler::finish_ended(McuIndex index) {
  Mcu& mcu = mcus_[index];
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    Stream& stream = mcu.stream[m];
    if (!mcu.sendable(m) || !stream.begun()) continue;
    stream.finished = stream.next >= source_.end_tick(index, m);
  }
}

bool StreamScheduler::behind(std::int64_t now_us, std::int64_t lead_us) const {
  if (!clock_.valid()) return false;
  const Tick now = clock_.tick_at(now_us);
  const Tick lead = clock_.ticks_in(lead_us);
  for (const McuIndex i : mcus_.indices()) {
    if (records_[i].view.phase != McuPhase::kOnline) continue;
    // A small queue takes whole frames only, so it is never kept fuller than that.
    const Tick depth = (records_[i].view.identity.queue_ticks - kSpareTicks) / 2;
    const Tick enough = now + std::min(lead, depth);
    const Mcu& mcu = mcus_[i];
    for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      if (mcu.sendable(m) && mcu.stream[m].next < enough) return true;  // starts that wait, too
    }
  }
  return false;
}

// Motors that start, start later or are ahead have frames of their own until the others have caught
// up.
StreamScheduler::Choice StreamScheduler::choose(const Mcu& mcu, Tick first) {
  Choice choice{.first = first};
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    const Stream& stream = mcu.stream[m];
    if (!mcu.sendable(m) || (mcu.replaced != 0 && stream.starts())) continue;
    if (stream.next != first) {
      choice.join = std::min(choice.join, stream.next);
      continue;
    }
    if (stream.beyond_gap) choice.join = std::min(choice.join, stream.beyond_gap->from);
    std::uint16_t& kind = !stream.starts()                                ? choice.goes_on
                          : !stream.run                                   ? choice.starts
                          : std::holds_alternative<TableRun>(*stream.run) ? choice.runs
                                                                          : choice.lines;
    kind |= static_cast<std::uint16_t>(1u << m);
  }
  return choice;
}

bool StreamScheduler::send_ticks_of(std::int64_t now_us, McuIndex index, const Filling& filling) {
  const Tick now = clock_.tick_at(now_us);
  const Tick lead = clock_.ticks_in(filling.lead_us);
  const Choice choice = choose(mcus_[index], *mcus_[index].next_tick());
  const Tick first = choice.first;
  const Tick depth = records_[index].view.identity.queue_ticks - kSpareTicks;
  // Runs need no queue: they are given as soon as the MCU takes them.
  if (choice.runs != 0 || choice.lines != 0) {
    if (first > now + depth) return false;
    if (choice.runs != 0) {
      send_table_runs(now_us, index, choice.runs, first);
    } else {
      send_line_run(now_us, index, choice.lines, first);
    }
    return true;
  }
  // A quarter of a small queue is empty before it is worth a frame.
  if (first > now + std::min(lead, depth * 3 / 4)) return false;
  const std::uint16_t mask = choice.starts != 0 ? choice.starts : choice.goes_on;
  const unsigned flags = choice.starts != 0 ? BUSHD_TICKS_START : 0;
  const Tick target = kTableDepth * clock_.ticks_in(filling.target_us);
  const Tick deep = std::min(now + std::min(target, depth), choice.join);
  if (deep > first && send_table_ticks(now_us, index, mask, first, deep - first, flags)) {
    return true;
  }
  Tick last = first + 1;  // nothing of what comes after the end need be sent
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (has(mask, m)) last = std::max(last, source_.end_tick(index, m));
  }
  const Tick count = std::min({ticks_per_frame(mask), choice.join - first, last - first});
  // Only whole frames: a queue filled tick by tick would cost more in headers than in ticks.
  if (first + count > now + std::min(clock_.ticks_in(filling.target_us), depth)) return false;
  send_ticks(now_us, index, mask, first, static_cast<unsigned>(count), flags);
  return true;
}

void StreamScheduler::send_table_runs(std::int64_t now_us, McuIndex index, std::uint16_t mask,
                                      Tick first) {
  const McuSetup& setup = records_[index].setup;
  std::array<bushd_table_run_entry, BUSHD_MOTORS_PER_MCU> entries;
  std::uint8_t count = 0;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (!has(mask, m)) continue;
    entries[count++] = entry_of(m, setup.table_of_motor[m].value_or(0),
                                std::get<TableRun>(*mcus_[index].stream[m].run));
    note_sent(index, m, first, source_.end_tick(index, m));
  }
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  const std::size_t size = bushd_encode_table_run(
      mcus_[index].epoch, static_cast<std::uint32_t>(first), entries.data(), count, payload.data());
  writer_.send(now_us, setup.address, BUSHD_MSG_TABLE_RUN, {payload.data(), size});
}

void StreamScheduler::send_line_run(std::int64_t now_us, McuIndex index, std::uint16_t mask,
                                    Tick first) {
  std::array<bushd_line_entry, BUSHD_MOTORS_PER_MCU> entries;
  std::uint8_t count = 0;
  bushd_line_run message{};
  message.epoch = mcus_[index].epoch;
  message.first_tick = static_cast<std::uint32_t>(first);
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (!has(mask, m)) continue;
    const auto& run = std::get<LineRun>(*mcus_[index].stream[m].run);
    message.line = line_part_of(run);
    entries[count++] = {m, static_cast<std::int8_t>(run.direction), run.increment};
    // Also when it has made its last step: a replacement must take it off the line.
    note_sent(index, m, first, first + run.ticks);
  }
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  const std::size_t size = bushd_encode_line_run(&message, entries.data(), count, payload.data());
  writer_.send(now_us, records_[index].setup.address, BUSHD_MSG_LINE_RUN, {payload.data(), size});
}

// As many of these ticks as all motors run by their tables, if that is worth it.
bool StreamScheduler::send_table_ticks(std::int64_t now_us, McuIndex index, std::uint16_t mask,
                                       Tick first, Tick max_ticks, unsigned flags) {
  const McuRecord& record = records_[index];
  if (!tells_states(index)) return false;
  auto ticks = static_cast<unsigned>(std::min<Tick>(max_ticks, UINT16_MAX));
  std::array<bushd_run, BUSHD_MOTORS_PER_MCU> run;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (!has(mask, m)) continue;
    const auto segment = source_.run_at(index, m, first, ticks);
    if (!segment) return false;
    run[m] = segment->run;
    ticks = std::min(ticks, segment->ticks);
  }
  std::array<bushd_table_ticks_entry, BUSHD_MOTORS_PER_MCU> entries;
  std::uint8_t motors = 0;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (!has(mask, m)) continue;
    entries[motors++] = {
        .motor = m,
        .state = bushd_run_save(&run[m], setup_.tick_ns, static_cast<std::uint16_t>(ticks))};
  }
  std::array<std::uint8_t,
             BUSHD_TABLE_TICKS_HEADER + BUSHD_TABLE_TICKS_MAX_ENTRY * BUSHD_MOTORS_PER_MCU>
      payload;
  const std::size_t size = bushd_encode_table_ticks(
      mcus_[index].epoch, static_cast<std::uint8_t>(flags), static_cast<std::uint32_t>(first),
      static_cast<std::uint16_t>(ticks), entries.data(), motors, payload.data());
  const std::size_t width = setup_.format == BUSHD_FORMAT_FINE ? 2 : 1;
  const std::size_t as_ticks = BUSHD_TICKS_HEADER + motors * (2 + width * ticks);
  if (size > BUSHD_FRAME_MAX_PAYLOAD) {
    std::uint16_t some = mask;
    while (std::popcount(some) > fieldbus::kMotorsPerStates) some ^= std::bit_floor(some);
    return some != mask && send_table_ticks(now_us, index, some, first, max_ticks, flags);
  }
  if (size > as_ticks) return false;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (has(mask, m)) note_sent(index, m, first, first + ticks);
  }
  writer_.send(now_us, record.setup.address, BUSHD_MSG_TABLE_TICKS, {payload.data(), size});
  return true;
}

Tick StreamScheduler::ticks_per_frame(std::uint16_t mask) const {
  return fieldbus::ticks_per_frame(static_cast<unsigned>(std::popcount(mask)), setup_.format,
                                   setup_.tick_ns);
}

void StreamScheduler::send_ticks(std::int64_t now_us, McuIndex index, std::uint16_t mask,
                                 Tick first, unsigned count, unsigned flags) {
  const auto motors = static_cast<std::size_t>(std::popcount(mask));
  std::array<std::int16_t, kMaxTicksPerFrame * BUSHD_MOTORS_PER_MCU> displacement;
  std::array<std::uint16_t, BUSHD_MOTORS_PER_MCU> delay;
  std::size_t column = 0;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (!has(mask, m)) continue;
    delay[column] = source_.render(index, m, first, count, &displacement[column], motors);
    note_sent(index, m, first, first + count);
    // At rest for good, before its end if the run was cancelled before its start. An MCU refuses
    // more for it, and with it all that the frame has for others.
    if (delay[column] == 0) mcus_[index].stream[m].finished = true;
    ++column;
  }
  const bool fine = setup_.format == BUSHD_FORMAT_FINE;
  if (fine) flags |= BUSHD_TICKS_FINE;
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  std::size_t size = bushd_encode_ticks_head(
      mcus_[index].epoch, static_cast<std::uint8_t>(flags), static_cast<std::uint32_t>(first),
      static_cast<std::uint8_t>(count), mask, delay.data(), payload.data());
  for (std::size_t i = 0; i < count * motors; ++i) {
    if (fine) {
      bushd_put_i16(&payload[size], displacement[i]);
      size += 2;
    } else {
      payload[size++] = static_cast<std::uint8_t>(displacement[i]);
    }
  }
  writer_.send(now_us, records_[index].setup.address, BUSHD_MSG_TICKS, {payload.data(), size});
}

void StreamScheduler::note_sent(McuIndex index, std::uint8_t motor, Tick first, Tick until) {
  Stream& stream = mcus_[index].stream[motor];
  if (!stream.told) stream.refused_before = records_[index].view.report.rejected_frames;
  stream.told = true;
  if (first < stream.sent) ++records_[index].health.repeats;
  stream.next = until;
  if (stream.beyond_gap && until >= stream.beyond_gap->from) {
    stream.next = std::max(until, stream.beyond_gap->until);
    stream.beyond_gap.reset();
  }
  stream.sent = std::max(stream.sent, stream.next);
  stream.finished = stream.next >= source_.end_tick(index, motor);
  if (!to_confirm_.empty() && start_is_open(index)) records_[index].poll_wanted = true;
}

}  // namespace bushd::link
