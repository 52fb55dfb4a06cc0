#include "daemon/services/drivers.h"

#include <algorithm>
#include <string>
#include <utility>

#include "motion/report_words.h"
#include "words/remedy.h"

namespace bushd::daemon {
namespace {

// Each waits for its MCUs to confirm it, and a flood of them keeps these busy.
constexpr std::size_t kMaxOpen = 256;

// What the report of an MCU shows against an action being done there.
Result<void> check(std::uint8_t action, const bushd_report& report) {
  const bool enabled = (report.flags & BUSHD_FLAG_ENABLED) != 0;
  if (action == BUSHD_CONTROL_ENABLE && !enabled) {
    const std::string fault = motion::fault_text(report);
    return fail("did not enable its drivers" + (fault.empty() ? fault : ": " + fault));
  }
  if (action == BUSHD_CONTROL_DISABLE && enabled) return fail("did not disable its drivers");
  if (action == BUSHD_CONTROL_CLEAR_FAULTS && report.faults != 0) {
    return fail("still has a fault: " + motion::fault_text(report));
  }
  return {};
}

}  // namespace

Drivers::Drivers(Installation& installation, Interlocks& interlocks,
                 const EmergencyStop& emergency_stop)
    : installation_(installation), emergency_stop_(emergency_stop) {
  // A move makes its steps with drivers on.
  interlocks.add([this](MotorId motor) -> Result<void> {
    const Mcu& mcu = installation_.mcu_of(motor);
    if (!being_disabled(mcu.id)) return {};
    return fail("the drivers of MCU " + mcu.name() + " are being disabled; run " +
                words::remedy("enable", installation_[motor].name()));
  });
}

void Drivers::request(std::int64_t now_us, const api::Asker& asker, const api::Enable& request) {
  begin(now_us, asker, request.motors, BUSHD_CONTROL_ENABLE);
}

void Drivers::request(std::int64_t now_us, const api::Asker& asker, const api::Disable& request) {
  begin(now_us, asker, request.motors, BUSHD_CONTROL_DISABLE);
}

void Drivers::request(std::int64_t now_us, const api::Asker& asker,
                      const api::ClearFaults& request) {
  // It would lift the stop where it has been heard, before it is everywhere.
  if (emergency_stop_.under_way()) {
    return asker.answer(api::Refused{"an emergency stop is under way; wait for its result"});
  }
  begin(now_us, asker, request.motors, BUSHD_CONTROL_CLEAR_FAULTS);
}

void Drivers::begin(std::int64_t now_us, const api::Asker& asker, const api::MotorNames& names,
                    std::uint8_t action) {
  auto targets = targets_of(names);
  if (!targets) return asker.answer(api::Refused{targets.error().text()});
  if (action == BUSHD_CONTROL_CLEAR_FAULTS && names.empty()) leave_out_what_is_well(*targets);
  if (const auto may_do = may(action, targets->mcus); !may_do) {
    return asker.answer(api::Refused{may_do.error().text()});
  }
  if (open_.size() >= kMaxOpen) {
    return asker.answer(api::Refused{std::to_string(open_.size()) +
                                     " requests about drivers and faults wait for their MCUs "
                                     "already; try again in a moment"});
  }
  std::string done = "done" + also_meant(names, targets->mcus);
  if (!targets->out_of_reach.empty()) done += "; not online, so not done there:";
  for (const McuId mcu : targets->out_of_reach) done += " " + installation_[mcu].name();
  open_.push_back({Confirmation(asker, targets->mcus, now_us), action, std::move(done)});
  for (const McuId mcu : targets->mcus) {
    installation_[mcu].bus().control(installation_[mcu].on_bus(), action);
    if (action != BUSHD_CONTROL_CLEAR_FAULTS && listener_) listener_(mcu);
  }
}

Result<Drivers::Targets> Drivers::targets_of(const api::MotorNames& names) const {
  const auto motors = installation_.find_or_all(names);
  if (!motors) return fail(motors.error());
  Targets targets;
  for (const McuId id : installation_.mcus_of(*motors)) {
    const auto online = installation_[id].must_be_online();
    if (!online && !names.empty()) return fail(online.error());
    (online ? targets.mcus : targets.out_of_reach).push_back(id);
  }
  if (targets.mcus.empty()) {
    return fail(installation_[targets.out_of_reach.front()].must_be_online().error());
  }
  return targets;
}

// Drivers and faults are of an MCU: who names some of its motors hears which others it concerns.
std::string Drivers::also_meant(const api::MotorNames& names,
                                const std::vector<McuId>& mcus) const {
  if (names.empty()) return {};
  std::string others;
  for (const McuId id : mcus) {
    std::string at;
    for (const MotorId motor : installation_[id].motors()) {
      const std::string& name = installation_[motor].name();
      if (std::ranges::find(names, name) != names.end()) continue;
      at += (at.empty() ? "" : ", ") + name;
    }
    if (!at.empty())
      others += "; of the whole MCU " + installation_[id].name() + ", so of " + at + " too";
  }
  return others;
}

// Who clears what has stopped some motors does not mean the others, which go on. Where nothing is
// to be cleared, all are meant.
void Drivers::leave_out_what_is_well(Targets& targets) const {
  const auto is_ill = [this](McuId id) {
    const Mcu& mcu = installation_[id];
    return mcu.report().faults != 0 || mcu.view().bound_by_stop;
  };
  if (std::ranges::none_of(targets.mcus, is_ill)) return;
  std::erase_if(targets.mcus, [&](McuId id) { return !is_ill(id); });
}

Result<void> Drivers::may(std::uint8_t action, const std::vector<McuId>& mcus) const {
  if (action == BUSHD_CONTROL_ENABLE) return {};
  for (const McuId id : mcus) {
    for (const MotorId motor : installation_[id].motors()) {
      if (installation_[motor].is<motion::Resting>()) continue;
      const bool armed = installation_[motor].is<motion::Armed>();
      return fail(motion::busy_text(installation_[motor]) + "; run " +
                  words::remedy(armed ? "disarm" : "stop", installation_[motor].name()) + " first");
    }
  }
  return {};
}

bool Drivers::being_disabled(McuId mcu) const {
  return std::ranges::any_of(open_, [mcu](const Operation& operation) {
    return operation.action == BUSHD_CONTROL_DISABLE && operation.confirmation.awaits(mcu);
  });
}

void Drivers::follow(std::int64_t now_us, const Mcu* reported) {
  std::erase_if(open_, [&](Operation& operation) {
    const auto ended = operation.confirmation.follow(
        now_us, reported, installation_,
        [&](const Mcu& mcu) { return check(operation.action, mcu.report()); });
    if (!ended) return false;
    installation_.changed = true;
    operation.confirmation.answer(*ended, operation.done);
    return true;
  });
}

}  // namespace bushd::daemon
