#include "bus/rs485/stream_scheduler.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "bus/rs485/horizon.h"

namespace bushd::link {
namespace {

// A replacement that was not taken, for whatever reason, is planned again further ahead: in the end
// beyond any delay that passes, 10, 30, 70, ... ms.
constexpr std::int64_t kRetryLeadUs = 10'000;
constexpr unsigned kMostDoublings = 5;
constexpr unsigned kMostHalvings = 2;

}  // namespace

StreamScheduler::StreamScheduler(const Surroundings& around)
    : setup_(around.setup),
      records_(around.mcus),
      clock_(around.clock),
      source_(around.source),
      writer_(around.writer),
      events_(around.events),
      mcus_(around.setup.mcus.size()) {}

void StreamScheduler::begin(McuIndex mcu, std::uint8_t motor, Tick start) {
  drop(mcu, motor);
  Stream& stream = mcus_[mcu].stream[motor];
  stream = {};
  stream.active = true;
  mcus_[mcu].starting |= bit(motor);
  stream.start = stream.from = stream.from_before = stream.next = stream.sent = start;
}

void StreamScheduler::begin_run(McuIndex mcu, std::uint8_t motor, Tick start, const McuRun& run) {
  begin(mcu, motor, start);
  mcus_[mcu].stream[motor].run = run;
}

void StreamScheduler::follow_run(McuIndex mcu, std::uint8_t motor, Tick start, const McuRun& run) {
  begin_run(mcu, motor, start, run);
  Stream& stream = mcus_[mcu].stream[motor];
  const auto* on_line = std::get_if<LineRun>(&run);
  stream.next = stream.sent =
      on_line != nullptr ? start + on_line->ticks : source_.end_tick(mcu, motor);
  stream.finished = stream.told = true;  // the MCU has it
}

void StreamScheduler::drop(McuIndex mcu, std::uint8_t motor) {
  Mcu& m = mcus_[mcu];
  Stream& stream = m.stream[motor];
  stream.active = false;
  // A run that the MCU has broken off does not occupy the motor until where it was to end.
  if (stream.run) stream.next = records_[mcu].view.known_until[motor];
  // Nor is a replacement that has been asked for and not yet sent.
  m.replacing &= static_cast<std::uint16_t>(~bit(motor));
}

void StreamScheduler::drop_all(McuIndex mcu) {
  mcus_[mcu].stream.fill({});
  mcus_[mcu].replacing = 0;
  mcus_[mcu].replaced = 0;
  mcus_[mcu].failures = 0;
}

void StreamScheduler::came_online(McuIndex mcu) {
  mcus_[mcu].epoch = mcus_[mcu].newest_epoch = records_[mcu].view.report.epoch;
}

bool StreamScheduler::runs_line() const {
  return std::ranges::any_of(mcus_, [](const Mcu& mcu) {
    return std::ranges::any_of(mcu.stream, [](const Stream& stream) {
      return stream.active && stream.run && std::holds_alternative<LineRun>(*stream.run);
    });
  });
}

bool StreamScheduler::confirmation_is_due(std::int64_t since_us) const {
  return std::ranges::any_of(
      mcus_, [&](const Mcu& mcu) { return mcu.replaced != 0 && mcu.replaced_us <= since_us; });
}

bool StreamScheduler::has_ticks_to_send(McuIndex mcu) const {
  const auto& streams = mcus_[mcu].stream;
  return std::any_of(streams.begin(), streams.end(),
                     [](const Stream& s) { return s.active && !s.finished; });
}

std::uint16_t StreamScheduler::active(McuIndex mcu) const {
  std::uint16_t motors = 0;
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (mcus_[mcu].stream[m].active) motors |= bit(m);
  }
  return motors;
}

std::optional<Tick> StreamScheduler::next_end(McuIndex mcu) const {
  std::optional<Tick> next;
  for (std::uint8_t motor = 0; motor < BUSHD_MOTORS_PER_MCU; ++motor) {
    if (!mcus_[mcu].stream[motor].active) continue;
    const Tick end = source_.end_tick(mcu, motor);
    if (end > records_[mcu].view.tick) next = std::min(next.value_or(INT64_MAX), end);
  }
  return next;
}

std::optional<Tick> StreamScheduler::last_end(McuIndex mcu) const {
  std::optional<Tick> last;
  for (std::uint8_t motor = 0; motor < BUSHD_MOTORS_PER_MCU; ++motor) {
    if (mcus_[mcu].stream[motor].active) last = std::max(last, {source_.end_tick(mcu, motor)});
  }
  return last;
}

// A start waits for the replacement before it to be confirmed: if that was not taken, neither would
// the start be, and a replacement of the start would not be taken either.
std::optional<Tick> StreamScheduler::Mcu::next_tick() const {
  std::optional<Tick> next;
  for (unsigned motor = 0; motor < BUSHD_MOTORS_PER_MCU; ++motor) {
    if (replaced != 0 && stream[motor].starts()) continue;
    if (sendable(motor)) next = std::min(next.value_or(INT64_MAX), stream[motor].next);
  }
  return next;
}

void StreamScheduler::replace(McuIndex mcu, std::uint16_t motors, Tick first, std::int64_t now_us) {
  if (motors == 0) return;
  Mcu& m = mcus_[mcu];
  const Tick arrival = clock_.tick_at(arrival_us(now_us, motors, ticks_of_replacement(m, motors)));
  std::uint16_t sent = 0;  // motors of which ticks from `first` on have been sent already
  Tick earliest = first;
  for (unsigned i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    Stream& stream = m.stream[i];
    if ((motors >> i & 1) == 0 || !stream.active) continue;
    if (stream.begun() && (stream.sent > first || stream.unsure)) {
      sent |= bit(i);
      // Where it has become too late for that, the MCU refuses the other tick until it runs dry.
      if (!too_late(stream.sent, arrival)) earliest = std::min(earliest, stream.sent);
    } else {
      // A table run of which nothing has been sent is another one now; it goes out as a stream.
      stream.run.reset();
      stream.finished = false;
    }
  }
  if (sent == 0) return;
  // Two wishes before the first was sent: one replacement must serve both, so it takes the earlier
  // tick. If that is too late by now, it fails as a whole and is planned again.
  m.replace_at = m.replacing == 0 ? earliest : std::min(m.replace_at, earliest);
  m.replacing |= sent;
}

std::int64_t StreamScheduler::frame_us(std::uint16_t mask, Tick ticks) const {
  const std::size_t motors = static_cast<std::size_t>(std::popcount(mask));
  const std::size_t width = setup_.format == BUSHD_FORMAT_FINE ? 2 : 1;
  const std::size_t payload =
      BUSHD_TICKS_HEADER + motors * (2 + width * static_cast<std::size_t>(ticks));
  return writer_.line_us(payload + BUSHD_FRAME_OVERHEAD + 1);
}

Tick StreamScheduler::ticks_of_replacement(const Mcu& mcu, std::uint16_t mask) const {
  return std::max<Tick>(ticks_per_frame(mask) >> std::min(mcu.failures, kMostHalvings), 1);
}

bool StreamScheduler::rests(McuIndex index) const {
  const Mcu& mcu = mcus_[index];
  for (std::uint8_t m = 0; mcu.replacing >> m != 0; ++m) {
    if ((mcu.replacing >> m & 1) != 0 && source_.end_tick(index, m) > mcu.replace_at) return false;
  }
  return mcu.replacing != 0;
}

Tick StreamScheduler::ticks_of_waiting(McuIndex mcu) const {
  return rests(mcu) ? 1 : ticks_of_replacement(mcus_[mcu], mcus_[mcu].replacing);
}

std::int64_t StreamScheduler::arrival_us(std::int64_t now_us, std::uint16_t mask,
                                         Tick ticks) const {
  return std::max(now_us, writer_.free_us()) + frame_us(mask, ticks);
}

std::int64_t StreamScheduler::round_us() const {
  std::int64_t us = 0;
  for (const McuIndex i : mcus_.indices()) {
    const std::uint16_t mask = active(i);
    if (mask != 0) us += frame_us(mask, ticks_per_frame(mask));
  }
  return us;
}

std::int64_t StreamScheduler::replacements_us(std::span<const ToReplace> together) const {
  std::int64_t us = 0;
  for (const McuIndex i : mcus_.indices()) {
    std::uint16_t mask = mcus_[i].replacing;
    for (const ToReplace& asked : together) {
      if (asked.mcu == i) mask |= asked.motors;
    }
    if (mask != 0) us += frame_us(mask, ticks_of_replacement(mcus_[i], mask));
  }
  return us;
}

std::int64_t StreamScheduler::carried_us(std::int64_t now_us, const LineUse& use,
                                         std::span<const ToReplace> together) const {
  const std::int64_t own_us = replacements_us(together);
  std::int64_t at_us = std::max({now_us, use.free_us, writer_.free_us()}) + own_us;
  unsigned failures = 0;
  bool confirmed = true;
  for (const ToReplace& asked : together) {
    failures = std::max(failures, mcus_[asked.mcu].failures);
    if (mcus_[asked.mcu].replaced != 0) confirmed &= !records_[asked.mcu].poll_wanted;
  }
  // Before one that is sent and not confirmed no other one goes to its MCU.
  if (!confirmed) at_us += use.confirm_us;
  // The ticks of motors that go on.
  const Tick critical = clock_.tick_at(at_us) + clock_.ticks_in(use.margin_us);
  for (const McuIndex i : mcus_.indices()) {
    std::uint16_t asked = 0;
    for (const ToReplace& one : together) asked |= one.mcu == i ? one.motors : std::uint16_t{0};
    std::uint16_t needy = 0;
    for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      const bool goes_on = mcus_[i].sendable(m) && (asked >> m & 1) == 0;
      if (goes_on && mcus_[i].stream[m].next < critical) needy |= bit(m);
    }
    if (needy != 0) at_us += frame_us(needy, ticks_per_frame(needy));
  }
  return at_us + kRetryLeadUs * ((1 << std::min(failures, kMostDoublings)) - 1);
}

// Sent in vain it would take line and followers with it, for nothing.
void StreamScheduler::fail_late_replacements(std::int64_t now_us) {
  for (const McuIndex i : mcus_.indices()) {
    Mcu& mcu = mcus_[i];
    mcu.unplanned = 0;
    if (mcu.replacing == 0) continue;
    const std::int64_t at_us = arrival_us(now_us, mcu.replacing, ticks_of_waiting(i));
    if (!too_late(mcu.replace_at, clock_.tick_at(at_us))) continue;
    mcu.unplanned = std::exchange(mcu.replacing, std::uint16_t{0});
    ++mcu.failures;
    events_.push_back(ReplacementFailed{.mcu = i, .motors = mcu.unplanned});
  }
}

void StreamScheduler::follow_report(McuIndex mcu) {
  follow_replacements(mcu);
  follow_streams(mcu);
}

// A replacement was taken if the MCU is in the epoch that it opened.
void StreamScheduler::follow_replacements(McuIndex index) {
  Mcu& mcu = mcus_[index];
  const McuView& view = records_[index].view;
  const bool taken = view.report.epoch == mcu.epoch;
  std::uint16_t failed = taken ? std::uint16_t{0} : mcu.replaced;
  if (taken && mcu.replaced != 0) mcu.failures = 0;
  for (unsigned m = 0; taken && m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((mcu.replaced >> m & 1) != 0) mcu.stream[m].unsure = false;
  }
  mcu.replaced = 0;
  mcu.epoch = view.report.epoch;
  // What was queued before stays in force, whatever has been sent since. If not even the start has
  // come, it has to be sent again, as one.
  for (unsigned m = 0; m < view.report.motor_count; ++m) {
    if ((failed >> m & 1) == 0) continue;
    Stream& stream = mcu.stream[m];
    stream.from = stream.from_before;
    stream.next = stream.sent = std::max(view.known_until[m], stream.from);
    stream.unsure = stream.begun();
    stream.beyond_gap.reset();
    stream.finished = false;
  }
  // One not even sent must be known to have failed before its tick is taken for executed.
  if (mcu.replacing != 0 && too_late(mcu.replace_at, view.tick)) {
    failed |= std::exchange(mcu.replacing, std::uint16_t{0});
  }
  if (failed == 0) return;
  ++mcu.failures;
  events_.push_back(ReplacementFailed{.mcu = index, .motors = failed});
}

// All frames sent before the poll were handled before its answer was made: what is not known is
// lost.
void StreamScheduler::follow_streams(McuIndex index) {
  const McuView& view = records_[index].view;
  const bushd_report& report = view.report;
  for (std::uint8_t m = 0; m < report.motor_count; ++m) {
    Stream& stream = mcus_[index].stream[m];
    if (!stream.active) continue;
    if (stream.run && (report.running >> m & 1) != 0) {
      stream.taken = true;  // the whole move
      continue;
    }
    const Tick known = view.known_until[m];
    const bool moving = (report.moving >> m & 1) != 0;
    // A frame that it shares with others may have gone on past its end: that is rest, and no MCU
    // takes it alone.
    const Tick needed = std::min(stream.sent, source_.end_tick(index, m));
    // Nothing can be missing of a stream that has not begun; but a busy bus may keep it waiting
    // past its start.
    if (stream.begun() ? known >= needed : moving || known <= stream.start) {
      stream.taken = stream.begun();
      continue;
    }
    if (!moving && known > stream.start) {
      miss_start(index, m);
      continue;
    }
    go_back(index, m);
  }
}

// To the first tick that the MCU does not have.
void StreamScheduler::go_back(McuIndex index, std::uint8_t motor) {
  Stream& stream = mcus_[index].stream[motor];
  const McuView& view = records_[index].view;
  const bushd_report& report = view.report;
  stream.next = std::max(view.known_until[motor], stream.from);
  stream.beyond_gap.reset();
  stream.finished = false;
  Tick missing = stream.run ? 0 : stream.sent - stream.next;
  if ((report.out_of_order >> motor & 1) != 0) {
    const auto unwrap = [&](std::uint16_t tick) {
      return view.tick + static_cast<std::int16_t>(tick - static_cast<std::uint16_t>(report.tick));
    };
    const OutOfOrderRange range = {.from = unwrap(report.out_of_order_from),
                                   .until = unwrap(report.out_of_order_until)};
    // What an MCU says is believed only as far as it can be true.
    if (stream.next < range.from && range.from < range.until && range.until <= stream.sent) {
      stream.beyond_gap = range;
      missing -= range.until - range.from;
    }
  }
  records_[index].health.missed_ticks += static_cast<std::uint64_t>(std::max<Tick>(missing, 0));
}

}  // namespace bushd::link
