// How motions begin: what their first frames take, whether they have come, and what becomes of
// those that have not.
#include <algorithm>
#include <bit>

#include "bus/bus_budget.h"
#include "bus/bus_times.h"
#include "bus/rs485/horizon.h"
#include "bus/rs485/stream_scheduler.h"

namespace bushd::link {

bool StreamScheduler::tells_states(McuIndex mcu) const {
  return setup_.table_ticks &&
         (records_[mcu].view.identity.capabilities & BUSHD_CAN_TABLE_TICKS) != 0;
}

bool StreamScheduler::tells_at_once(const ToBegin& begin) const {
  if (begin.messages == StartMessages::kTicks) return false;
  return begin.messages != StartMessages::kStates || tells_states(begin.mcu);
}

std::int64_t StreamScheduler::first_frames_us(const ToBegin& begin) const {
  const auto motors = static_cast<std::size_t>(std::popcount(begin.motors));
  const auto frame = [this](std::size_t payload) {
    return writer_.line_us(payload + BUSHD_FRAME_OVERHEAD + 1);
  };
  if (begin.messages == StartMessages::kTableRun) {
    return frame(BUSHD_TABLE_RUN_HEADER + motors * BUSHD_TABLE_RUN_MAX_ENTRY);
  }
  if (begin.messages == StartMessages::kLineRun) {
    return frame(BUSHD_LINE_RUN_HEADER + motors * BUSHD_LINE_RUN_ENTRY);
  }
  constexpr auto kMost = static_cast<std::size_t>(fieldbus::kMotorsPerStates);
  const std::size_t frames = (motors + kMost - 1) / kMost;
  return static_cast<std::int64_t>(frames) * frame(BUSHD_TABLE_TICKS_HEADER) +
         writer_.line_us(motors * BUSHD_TABLE_TICKS_MAX_ENTRY);
}

std::int64_t StreamScheduler::withdrawal_us(std::span<const ToBegin> together) const {
  std::int64_t us = 0;
  for (const ToBegin& begin : together) us += frame_us(begin.motors, 1);
  return us;
}

double StreamScheduler::load_with(std::span<const ToBegin> more) const {
  std::vector<fieldbus::Streamed> streamed;
  for (const McuIndex i : mcus_.indices()) {
    std::uint16_t ticks = 0;
    std::uint16_t states = 0;
    for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      const Stream& stream = mcus_[i].stream[m];
      if (!stream.active || stream.run || stream.finished) continue;
      const bool by_states = tells_states(i) && source_.plan_at(i, m, stream.next).has_value();
      (by_states ? states : ticks) |= bit(m);
    }
    for (const ToBegin& begin : more) {
      if (begin.mcu != i) continue;
      if (begin.messages == StartMessages::kTicks) ticks |= begin.motors;
      if (begin.messages == StartMessages::kStates) {
        (tells_states(i) ? states : ticks) |= begin.motors;
      }
    }
    states &= static_cast<std::uint16_t>(~ticks);
    streamed.push_back({.by_ticks = static_cast<std::uint8_t>(std::popcount(ticks)),
                        .by_states = static_cast<std::uint8_t>(std::popcount(states))});
  }
  return fieldbus::stream_load(setup_.baud, static_cast<std::uint32_t>(setup_.tick_ns),
                               setup_.format, streamed);
}

void StreamScheduler::confirm_start(Tick at) {
  if (std::ranges::find(to_confirm_, at) == to_confirm_.end()) to_confirm_.push_back(at);
}

// One that is cancelled before it begins needs nothing, and one that has another target by now is
// told of that.
std::uint16_t StreamScheduler::to_begin_at(McuIndex mcu, Tick at) const {
  std::uint16_t mask = 0;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    const Stream& stream = mcus_[mcu].stream[m];
    const bool begins = stream.active && stream.start == at && stream.from == at;
    if (begins && source_.end_tick(mcu, m) > at) mask |= bit(m);
  }
  return mask;
}

bool StreamScheduler::is_open(McuIndex mcu, Tick at) const {
  const std::uint16_t mask = to_begin_at(mcu, at);
  for (std::uint8_t m = 0; mask >> m != 0; ++m) {
    if ((mask >> m & 1) != 0 && !mcus_[mcu].stream[m].taken) return true;
  }
  return false;
}

bool StreamScheduler::start_is_open(McuIndex mcu) const {
  return std::ranges::any_of(to_confirm_, [&](Tick at) {
    const std::uint16_t mask = to_begin_at(mcu, at);
    for (std::uint8_t m = 0; mask >> m != 0; ++m) {
      const Stream& stream = mcus_[mcu].stream[m];
      if ((mask >> m & 1) != 0 && stream.told && !stream.taken) return true;
    }
    return false;
  });
}

Tick StreamScheduler::last_to_withdraw(Tick at) {
  return at - first_changeable(1);  // this clock lags by a part of a tick
}

std::int64_t StreamScheduler::withdrawal_us(Tick at) const {
  std::int64_t us = 0;
  for (const McuIndex i : mcus_.indices()) {
    if (const std::uint16_t mask = to_begin_at(i, at); mask != 0) us += frame_us(mask, 1);
  }
  return us;
}

bool StreamScheduler::withdraw_late_starts(std::int64_t free_us, std::int64_t margin_us) {
  bool late = false;
  for (Mcu& mcu : mcus_) mcu.withdraws = mcu.withdraws && mcu.replacing != 0;
  std::erase_if(to_confirm_, [&](Tick at) {
    bool open = false;
    for (const McuIndex i : mcus_.indices()) open = open || is_open(i, at);
    if (!open) return true;
    const std::int64_t arrival_us = free_us + withdrawal_us(at);
    if (clock_.tick_at(arrival_us + margin_us) < last_to_withdraw(at)) return false;
    // Where that cannot be told them in time they begin, some perhaps without others.
    const bool too_late_for_rest = too_late(at, clock_.tick_at(arrival_us));
    if (!too_late_for_rest && waits_for_replacement(at)) return false;
    late = true;
    if (too_late_for_rest) return true;
    for (const McuIndex i : mcus_.indices()) mcus_[i].withdraws = to_begin_at(i, at) != 0;
    events_.push_back(StartUnconfirmed{at});
    return true;
  });
  return late;
}

// An MCU gets no other replacement before it has said whether it has taken the one before.
bool StreamScheduler::waits_for_replacement(Tick at) const {
  for (const McuIndex i : mcus_.indices()) {
    if (mcus_[i].replaced != 0 && to_begin_at(i, at) != 0) return true;
  }
  return false;
}

std::int64_t StreamScheduler::withdrawal_due_us(std::int64_t free_us,
                                                std::int64_t margin_us) const {
  std::int64_t first_us = INT64_MAX;
  for (const Tick at : to_confirm_) {
    if (waits_for_replacement(at)) continue;
    const Tick tick = clock_.tick_at(free_us + withdrawal_us(at) + margin_us);
    const Tick left = std::max<Tick>(last_to_withdraw(at) - tick, 0);
    first_us = std::min(first_us, free_us + left * setup_.tick_ns / 1000);
  }
  return first_us;
}

bool StreamScheduler::withdraws() const {
  for (const McuIndex i : mcus_.indices()) {
    if (mcus_[i].withdraws && mcus_[i].replaced == 0 && rests(i)) return true;
  }
  return false;
}

void StreamScheduler::fail_late_starts(std::int64_t now_us) {
  if (!clock_.valid()) return;
  const Tick arrival = clock_.tick_at(std::max(now_us, writer_.free_us()) + frame_us(bit(0), 1));
  for (const McuIndex i : mcus_.indices()) {
    Mcu& mcu = mcus_[i];
    for (std::uint8_t m = 0; mcu.starting >> m != 0; ++m) {
      if ((mcu.starting >> m & 1) == 0) continue;
      const Stream& stream = mcu.stream[m];
      if (!stream.active || stream.told) mcu.starting &= static_cast<std::uint16_t>(~bit(m));
      if (mcu.sendable(m) && !stream.told && too_late(stream.start, arrival)) miss_start(i, m);
    }
  }
}

bool StreamScheduler::start_was_lost(McuIndex mcu, std::uint8_t motor) const {
  const Stream& stream = mcus_[mcu].stream[motor];
  const std::uint16_t refused = records_[mcu].view.report.rejected_frames;
  return stream.told && refused == stream.refused_before && refused != UINT16_MAX;
}

// A motion that was cancelled before its start misses nothing. The MCU has refused what was sent
// behind the start.
void StreamScheduler::miss_start(McuIndex index, std::uint8_t motor) {
  Stream& stream = mcus_[index].stream[motor];
  stream.active = false;
  stream.next = records_[index].view.known_until[motor];
  if (source_.end_tick(index, motor) <= stream.start) return;
  events_.push_back(StartMissed{.mcu = index, .motor = motor});
}

}  // namespace bushd::link
