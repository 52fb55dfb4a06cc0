#include "daemon/services/line_room.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/output_bits.h"
#include "base/overloaded.h"

namespace bushd::daemon {

using link::StartMessages;

bool LineRoom::concerns_any() const {
  return std::ranges::any_of(installation_.config().buses, [](const config::Bus& bus) {
    return bus.streams != config::Streams::kFit;
  });
}

// How the motor's motion is told. None: its MCU makes it when the trigger comes, or nothing moves.
// A motor that moves by a run of its MCU is streamed from its new target on.
std::optional<StartMessages> LineRoom::messages_of(const api::Request& request, MotorId id,
                                                   bool by_mcus) const {
  const Mcu& mcu = installation_.mcu_of(id);
  const auto whole = [&]() -> std::optional<StartMessages> {
    constexpr bushd_delay kNoLimit = 0;
    const bool by_table = installation_[id].stands() && installation_.by_table(mcu, 1, kNoLimit);
    return by_table ? StartMessages::kTableRun : StartMessages::kStates;
  };
  const auto as_ticks = []() -> std::optional<StartMessages> { return StartMessages::kTicks; };
  return std::visit(
      Overloaded{[&](const api::Move&) { return whole(); },
                 [&](const api::Jog&) { return std::optional(StartMessages::kStates); },
                 [&](const api::MoveLine&) {
                   return by_mcus ? std::optional(StartMessages::kLineRun) : as_ticks();
                 },
                 [&](const api::MovePath&) { return as_ticks(); },
                 [&](const api::Follow&) { return as_ticks(); },
                 [](const auto&) -> std::optional<StartMessages> { return std::nullopt; }},
      request);
}

// From rest, and where no MCU makes another line. One whose table does not come in time is streamed
// all the same.
bool LineRoom::may_be_by_mcus(const std::vector<MotorId>& motors) const {
  return std::ranges::all_of(motors, [this](MotorId id) {
    const Mcu& mcu = installation_.mcu_of(id);
    return installation_[id].stands() && mcu.makes_lines() &&
           std::ranges::none_of(mcu.motors(), [this](MotorId other) {
             return installation_[other].is<motion::OnLine>();
           });
  });
}

Result<bool> LineRoom::has_room(const api::Request& request,
                                const std::vector<MotorId>& motors) const {
  const bool by_mcus = may_be_by_mcus(motors);
  std::map<BusId, std::map<std::pair<McuId, StartMessages>, std::uint16_t>> of_buses;
  for (const MotorId id : motors) {
    const auto messages = messages_of(request, id, by_mcus);
    if (!messages) continue;
    const Mcu& mcu = installation_.mcu_of(id);
    of_buses[mcu.config.bus][{mcu.id, *messages}] |= bit_of(installation_[id].output());
  }
  bool room = true;
  for (const auto& [id, masks] : of_buses) {
    const Bus& bus = installation_[id];
    if (bus.config.streams == config::Streams::kFit) continue;
    std::vector<link::ToBegin> together;
    for (const auto& [key, mask] : masks) {
      together.push_back({installation_[key.first].on_bus(), mask, key.second});
    }
    const auto fits = has_room_on(bus, together, request);
    if (!fits) return fits;
    room = room && *fits;
  }
  return room;
}

// A jog does not wait: its key may be released long before its turn comes.
Result<bool> LineRoom::has_room_on(const Bus& bus, const std::vector<link::ToBegin>& together,
                                   const api::Request& request) const {
  const link::LineLoad load = bus.master.line_load(together);
  if (load.more <= 0 || load.all() <= load.most) return true;
  const bool alone = load.polls + load.more <= load.most;
  const bool may_wait = !std::holds_alternative<api::Jog>(request);
  if (alone && may_wait && bus.config.streams == config::Streams::kQueue) return false;
  const bool whole = std::holds_alternative<api::Move>(request);
  std::string remedy = "Wait until others have ended";
  if (alone && may_wait) remedy += ", or set streams = \"queue\" of the bus";
  if (!alone) remedy = "Move fewer motors at once";
  if (!alone && whole) remedy += ", or from rest with moves = \"table\" of the bus";
  return fail(
      fmt::format("bus {} has no room for it: polls take {:.0f} %, motions under way {:.0f} %, "
                  "these {:.0f} %; allowed: {:.0f} %. {}",
                  bus.config.name, load.polls * 100, load.streams * 100, load.more * 100,
                  load.most * 100, remedy));
}

}  // namespace bushd::daemon
