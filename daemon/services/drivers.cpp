#include "daemon/services/drivers.h"

#include <algorithm>
#include <string>

#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

// Each waits for its MCUs to confirm it, and a flood of them keeps these busy.
constexpr std::size_t kMaxOpen = 256;

// What the report of an MCU shows against an action being done there.
Result<void> check(std::uint8_t action, const bushd_report& report) {
  const bool enabled = (report.flags & BUSHD_FLAG_ENABLED) != 0;
  if (action == BUSHD_CONTROL_ENABLE && !enabled) return fail("did not enable its drivers");
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
    return fail("the drivers of MCU " + mcu.name() + " are being disabled; enable them first");
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
  const auto mcus = mcus_of(names, action != BUSHD_CONTROL_ENABLE);
  if (!mcus) return asker.answer(api::Refused{mcus.error().text()});
  if (open_.size() >= kMaxOpen) {
    return asker.answer(api::Refused{std::to_string(open_.size()) +
                                     " requests about drivers and faults wait for their MCUs "
                                     "already; try again in a moment"});
  }
  open_.push_back({Confirmation(asker, *mcus, now_us), action});
  for (const McuId mcu : *mcus) installation_[mcu].control(action);
}

Result<std::vector<McuId>> Drivers::mcus_of(const api::MotorNames& names, bool at_rest_only) const {
  const auto motors = installation_.find_or_all(names);
  if (!motors) return fail(motors.error());
  const std::vector<McuId> mcus = installation_.mcus_of(*motors);
  for (const McuId id : mcus) {
    const Mcu& mcu = installation_[id];
    if (const auto online = mcu.must_be_online(); !online) return fail(online.error());
    for (const MotorId motor : mcu.motors()) {
      if (!at_rest_only || installation_[motor].is<motion::Resting>()) continue;
      return fail(installation_[motor].busy_text() + "; stop it first");
    }
  }
  return mcus;
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
    operation.confirmation.answer(*ended);
    return true;
  });
}

}  // namespace bushd::daemon
