#include "daemon/services/emergency_stop.h"

#include <utility>

#include "daemon/confirmation.h"

namespace bushd::daemon {
EmergencyStop::EmergencyStop(Installation& installation, Interlocks& interlocks,
                             HomingQueue& homing, OpenMoves& open_moves, Outputs& outputs)
    : installation_(installation), homing_(homing), open_moves_(open_moves), outputs_(outputs) {
  interlocks.add([this]() -> Result<void> {
    if (!under_way()) return {};
    return fail("an emergency stop is under way; wait for its result");
  });
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
    stopping.done = "done; not online, so it is unknown whether they stand:" + unknown;
  }
  if (open_.size() >= kMaxOpen) {
    open_.front().asker.answer(api::Completed{
        .outcome = api::Outcome::kStopped,
        .reason = "carried out; so many stops are under way that its end is not waited for",
        .detail = {}});
    open_.pop_front();
  }
  open_.push_back(std::move(stopping));
}

Result<void> EmergencyStop::follow(std::int64_t now_us, Stopping& stopping) const {
  Result<void> good;
  std::erase_if(stopping.mcus, [&](McuId id) {
    const Mcu& mcu = installation_[id];
    if (mcu.offline()) {
      stopping.done = "done; MCU " + mcu.name() + " was lost meanwhile: " + mcu.view().detail;
      return true;
    }
    const bool latched = (mcu.report().faults & BUSHD_FAULT_EMERGENCY) != 0;
    // A ramp-down by a long table may take its time.
    if (!latched && now_us > stopping.deadline_us) {
      good = fail("MCU " + mcu.name() + " did not confirm it in time");
    }
    return latched && mcu.report().moving == 0;
  });
  return good;
}

void EmergencyStop::follow(std::int64_t now_us) {
  std::erase_if(open_, [&](Stopping& stopping) {
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
