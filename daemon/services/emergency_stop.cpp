#include "daemon/services/emergency_stop.h"

#include <utility>

#include "daemon/model/confirmation.h"

namespace bushd::daemon {
namespace {

constexpr const char* kKeptAs = "emergency/stop";

}  // namespace

EmergencyStop::EmergencyStop(Installation& installation, Interlocks& interlocks,
                             HomingQueue& homing, OpenMoves& open_moves, KeptPositions& kept,
                             Outputs& outputs)
    : installation_(installation),
      homing_(homing),
      open_moves_(open_moves),
      kept_(kept),
      outputs_(outputs) {
  interlocks.add([this]() -> Result<void> {
    if (!under_way()) return {};
    return fail("an emergency stop is under way; wait for its result");
  });
  // Its report mostly says so too; another master may have cleared that.
  interlocks.add([this](MotorId motor) -> Result<void> {
    const Mcu& mcu = installation_.mcu_of(motor);
    if (!is_bound(mcu.id)) return {};
    return fail("an emergency stop binds MCU " + mcu.name() + "; run 'bushctl clear'");
  });
}

void EmergencyStop::take_kept() {
  const state::Settings kept = kept_.settings(kKeptAs);
  for (const McuId id : installation_.mcus()) {
    if (kept.contains(installation_[id].name())) bind(id);
  }
}

void EmergencyStop::bind(McuId id) {
  Mcu& mcu = installation_[id];
  bound_.insert(id);
  mcu.bus().bind_to_stop(mcu.on_bus(), installation_.bus_of(mcu).config.emergency_stop);
}

void EmergencyStop::heard_from(McuId id) {
  std::string others;
  for (const McuId other : installation_.mcus()) {
    if (is_bound(other) || installation_[other].online()) continue;
    bind(other);
    others += " " + installation_[other].name();
  }
  if (others.empty()) return;
  outputs_.log(LogLevel::kWarning, id,
               "MCU " + installation_[id].name() +
                   " tells of an emergency stop that nobody has cleared; it binds those too that "
                   "are not online:" +
                   others);
}

void EmergencyStop::keep() {
  state::Settings bound;
  for (const McuId id : bound_) bound[installation_[id].name()] = {.value = "bound"};
  kept_.keep(kKeptAs, bound);
}

void EmergencyStop::goes_online(Mcu& mcu) {
  if (!is_bound(mcu.id)) return;
  outputs_.log(LogLevel::kWarning, mcu.id,
               "MCU " + mcu.name() +
                   " is bound by an emergency stop that nobody has cleared; run 'bushctl clear'");
}

void EmergencyStop::step(std::int64_t now_us) {
  follow(now_us);
  bool changed = false;
  for (const McuId id : installation_.mcus()) {
    if (is_bound(id) == bound_.contains(id)) continue;
    changed = true;
    if (bound_.erase(id) == 0) {
      bound_.insert(id);
      heard_from(id);
    }
  }
  if (!changed) return;
  installation_.changed = true;
  keep();
}

void EmergencyStop::request(std::int64_t now_us, const api::Asker& asker,
                            const api::EmergencyStop&) {
  asker.answer(api::Accepted{});
  outputs_.log(LogLevel::kWarning, {},
               "emergency stop, commanded by " +
                   (asker.session ? asker.session->text() : std::string("the daemon")));
  open_moves_.stopped_by(*installation_.find_or_all({}), text_of(asker));
  for (const BusId id : installation_.buses()) {
    Bus& bus = installation_[id];
    bus.master.emergency_stop(bus.config.emergency_stop);
  }
  for (const McuId id : installation_.mcus()) bound_.insert(id);
  keep();
  homing_.end_waiting();
  Stopping stopping{.asker = asker, .mcus = {}, .deadline_us = now_us + kConfirmUs};
  std::string unknown;
  for (const McuId id : installation_.mcus()) {
    if (installation_[id].online()) {
      stopping.mcus.push_back(id);
    } else {
      unknown += " " + installation_[id].name();
    }
  }
  if (!unknown.empty()) {
    stopping.done = "done; not online, so it is unknown whether they stand:" + unknown +
                    "; each is stopped as soon as it comes";
  }
  open_.add(std::move(stopping), stopped_without_end());
}

Result<void> EmergencyStop::follow(std::int64_t now_us, Stopping& stopping) const {
  Result<void> good;
  std::erase_if(stopping.mcus, [&](McuId id) {
    const Mcu& mcu = installation_[id];
    if (mcu.offline()) {
      stopping.done = "done; MCU " + mcu.name() + " was lost meanwhile: " + mcu.view().detail;
      return true;
    }
    const bool latched =
        link::has_obeyed(mcu.view(), installation_.bus_of(mcu).config.emergency_stop);
    // A ramp-down by a long table may take its time.
    if (!latched && now_us > stopping.deadline_us) {
      good = fail("MCU " + mcu.name() + " did not confirm it in time");
    }
    return latched && mcu.report().moving == 0;
  });
  return good;
}

void EmergencyStop::follow(std::int64_t now_us) {
  open_.follow([&](Stopping& stopping) {
    const auto good = follow(now_us, stopping);
    if (good && !stopping.mcus.empty()) return false;
    installation_.changed = true;
    stopping.asker.answer(
        api::Completed{.outcome = good ? api::Outcome::kDone : api::Outcome::kFault,
                       .reason = good ? stopping.done : good.error().text(),
                       .detail = {}});
    return true;
  });
}

}  // namespace bushd::daemon
