// How plans change: from which tick on, and for whom.
#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "base/output_bits.h"
#include "bus/rs485/tick.h"
#include "daemon/services/moves.h"

namespace bushd::daemon {

void Moves::replan(std::int64_t now_us, const std::vector<MotorId>& motors) {
  plan(now_us, with_whole_lines(motors));
}

void Moves::plan_again(std::int64_t now_us, const std::vector<MotorId>& motors) {
  plan(now_us, motors);
}

// The motors of a line change at the same tick, or not yet: one of them may have taken a change
// that another one is not known to have taken.
std::vector<MotorId> Moves::with_whole_lines(const std::vector<MotorId>& motors) {
  std::map<std::uint64_t, bool> stop;  // whether that is for others alone, and nobody has asked
  std::set<std::uint64_t> wait;
  std::vector<MotorId> all = installation_.with_lines(motors);
  for (const MotorId id : all) {
    const motion::Motor& motor = installation_[id];
    const auto* on_line = motor.as<motion::OnLine>();
    if (on_line == nullptr) continue;
    if (motor.axis().open_change()) wait.insert(on_line->line);
    if (!motor.stops() || motor.is_paused()) continue;
    bool& by_others = stop.try_emplace(on_line->line, true).first->second;
    by_others = by_others && on_line->by_others;
  }
  std::erase_if(all, [&](MotorId id) {
    const auto* on_line = installation_[id].as<motion::OnLine>();
    return on_line != nullptr && wait.contains(on_line->line);
  });
  for (const MotorId id : all) {
    const auto* on_line = installation_[id].as<motion::OnLine>();
    const auto stopped = on_line != nullptr ? stop.find(on_line->line) : stop.end();
    if (stopped == stop.end()) continue;
    installation_[id].stop();
    if (stopped->second) installation_[id].is_stopped_by_others();
  }
  return all;
}

// Each bus sends one for each of its MCUs.
std::map<BusId, std::vector<link::ToReplace>> Moves::replacements_of(
    const std::vector<MotorId>& motors) const {
  std::map<McuId, std::uint16_t> masks;
  for (const MotorId id : motors) {
    masks[installation_.config()[id].mcu] |= bit_of(installation_[id].output());
  }
  std::map<BusId, std::vector<link::ToReplace>> of_buses;
  for (const auto& [id, mask] : masks) {
    const Mcu& mcu = installation_[id];
    of_buses[mcu.config.bus].push_back(mcu.to_replace(mask));
  }
  return of_buses;
}

std::map<McuId, motion::Tick> Moves::ticks_to_change_at(std::int64_t now_us,
                                                        const std::vector<MotorId>& motors) const {
  // One replacement serves all motors of an MCU. It can bring a motor that has not begun to rest at
  // any tick, but another beginning only at the tick where it was to begin.
  const auto together = replacements_of(motors);
  std::map<McuId, motion::Tick> at;
  for (const MotorId id : motors) {
    const Mcu& mcu = installation_.mcu_of(id);
    const motion::Axis& axis = installation_[id].axis();
    const std::vector<link::ToReplace>& of_bus = together.at(mcu.config.bus);
    const bool begins_not = motion::is_withdrawn(installation_[id]) &&
                            !link::too_late(axis.start_tick(), mcu.bus().tick_at(now_us));
    const motion::Tick first = begins_not ? axis.start_tick()
                               : axis.stopping()
                                   ? mcu.bus().earliest_replace(now_us, of_bus)
                                   : mcu.bus().earliest_retarget(now_us, of_bus, axis.start_tick());
    motion::Tick& common = at.try_emplace(mcu.id, first).first->second;
    common = std::max(common, first);
  }
  std::map<BusId, motion::Tick> of_lines;
  for (const MotorId id : motors) {
    if (!installation_[id].is<motion::OnLine>()) continue;
    const Mcu& mcu = installation_.mcu_of(id);
    // What an MCU has not taken, it should take where the others have.
    const motion::Tick others = installation_[id].axis().open_change().value_or(INT64_MIN);
    motion::Tick& common = of_lines.try_emplace(mcu.config.bus, INT64_MIN).first->second;
    common = std::max({common, at[mcu.id], others});
  }
  for (auto& [mcu, tick] : at) {
    const auto common = of_lines.find(installation_[mcu].config.bus);
    if (common != of_lines.end()) tick = std::max(tick, common->second);
  }
  at_one_tick_of_line(motors, at);
  return at;
}

void Moves::at_one_tick_of_line(const std::vector<MotorId>& motors,
                                std::map<McuId, motion::Tick>& at) const {
  std::map<std::uint64_t, motion::Tick> since_start;  // by line
  const auto for_each = [&](const auto& take) {
    for (const MotorId id : motors) {
      const auto* on_line = installation_[id].as<motion::OnLine>();
      const Mcu& mcu = installation_.mcu_of(id);
      if (on_line == nullptr || mcu.offers.paced_lines == nullptr) continue;
      // One whose run is over has other ticks since.
      if (on_line->stands || mcu.view().tick >= installation_[id].axis().over_tick()) continue;
      motion::Tick& common = since_start.try_emplace(on_line->line, INT64_MIN).first->second;
      take(at.at(mcu.id), installation_[id].axis().start_tick(), common);
    }
  };
  for_each([](motion::Tick tick, motion::Tick start, motion::Tick& common) {
    common = std::max(common, tick - start);
  });
  for_each(
      [](motion::Tick& tick, motion::Tick start, motion::Tick common) { tick = start + common; });
}

// Runs of a line that a trigger has begun are microseconds apart, so that not all are in the same
// step when they are to stop: they stop where the foremost does.
std::map<MotorId, std::uint32_t> Moves::common_ends(const std::vector<MotorId>& motors) const {
  std::map<std::uint64_t, std::uint32_t> farthest;
  const auto stops_on_line = [this](MotorId id) -> const motion::OnLine* {
    const motion::Motor& motor = installation_[id];
    const auto* on_line = motor.as<motion::OnLine>();
    const bool stops = on_line != nullptr && motor.stops() && !motor.axis().line()->track;
    return stops ? on_line : nullptr;
  };
  for (const MotorId id : motors) {
    const motion::OnLine* on_line = stops_on_line(id);
    if (on_line == nullptr) continue;
    std::uint32_t& end = farthest[on_line->line];
    end = std::max(end, installation_[id].axis().line_planned_end());
  }
  std::map<MotorId, std::uint32_t> ends;
  for (const MotorId id : motors) {
    const motion::OnLine* on_line = stops_on_line(id);
    if (on_line == nullptr) continue;
    const std::uint32_t end = farthest[on_line->line];
    if (installation_[id].axis().line_planned_end() < end) ends[id] = end;
  }
  return ends;
}

void Moves::plan(std::int64_t now_us, const std::vector<MotorId>& motors) {
  const std::map<McuId, motion::Tick> at = ticks_to_change_at(now_us, motors);
  std::map<McuId, std::uint16_t> masks;
  const auto change = [&](MotorId id, std::uint32_t least_end) {
    motion::Motor& motor = installation_[id];
    const McuId mcu = installation_.config()[id].mcu;
    const auto bit = bit_of(motor.output());
    masks[mcu] &= static_cast<std::uint16_t>(~bit);
    if (motor.has_plan() && motor.axis().change(at.at(mcu), least_end)) masks[mcu] |= bit;
  };
  std::set<MotorId> changed;
  for (const MotorId id : motors) {
    change(id, 0);
    const auto bit = bit_of(installation_[id].output());
    if ((masks[installation_.config()[id].mcu] & bit) != 0) changed.insert(id);
  }
  // One that stops already may have made its last step: its MCU would take no more.
  for (const auto& [id, end] : common_ends(motors)) {
    if (changed.contains(id)) change(id, end);
  }
  for (const auto& [id, mask] : masks) {
    Mcu& mcu = installation_[id];
    if (mask != 0) mcu.bus().replace(mcu.on_bus(), mask, at.at(id));
  }
  installation_.changed = true;
}

}  // namespace bushd::daemon
