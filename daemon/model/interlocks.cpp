#include "daemon/model/interlocks.h"

#include "motion/report_words.h"
#include "words/remedy.h"

namespace bushd::daemon {

Result<void> Interlocks::may_move() const {
  if (installation_.shutting_down) return fail("the daemon is shutting down");
  for (const ForAll& check : for_all_) {
    if (auto may = check(); !may) return may;
  }
  return {};
}

Result<void> Interlocks::may_move(MotorId motor) const {
  if (auto may = may_home(motor); !may) return may;
  const Mcu& mcu = installation_.mcu_of(motor);
  const std::vector<MotorId> left = installation_.to_be_homed(mcu);
  if (left.empty()) return {};
  const std::string& name = installation_[left.front()].name();
  return fail("MCU " + mcu.name() + " is not ready before " + name +
              " has been homed; wait for that, or run " + words::remedy("home", name));
}

Result<void> Interlocks::may_home(MotorId motor) const {
  if (auto may = may_move(); !may) return may;
  if (auto may = installation_[motor].reach().may_be_used(); !may) return may;
  const Mcu& mcu = installation_.mcu_of(motor);
  if (auto online = mcu.must_be_online(); !online) return online;
  if (auto may = may_move_by(mcu); !may) return may;
  for (const MotorId other : mcu.motors()) {
    if (!mcu.offers.one_at_a_time || other == motor || !installation_[other].has_plan()) continue;
    return fail(motion::busy_text(installation_[other]) + ", and the board " + mcu.name() +
                " moves one motor at a time; wait for its end, or stop it");
  }
  for (const ForMotor& check : for_motor_) {
    if (auto may = check(motor); !may) return may;
  }
  return {};
}

Result<void> Interlocks::may_begin(MotorId motor) const {
  if (auto may = may_move(); !may) return may;
  return may_move_by(installation_.mcu_of(motor));
}

Result<void> Interlocks::may_move_by(const Mcu& mcu) const {
  if (!mcu.online()) return mcu.must_be_online();
  if (mcu.report().faults != 0) {
    return fail("MCU " + mcu.name() + " has a fault: " + motion::fault_text(mcu.report()));
  }
  if ((mcu.report().flags & BUSHD_FLAG_ENABLED) == 0 && !mcu.asleep) {
    return fail("the drivers of MCU " + mcu.name() + " are disabled; run " +
                words::remedy("enable", installation_[mcu.motors().front()].name()));
  }
  const Bus& bus = installation_.bus_of(mcu);
  if (bus.two_masters) {
    return fail("another master talks on bus " + bus.config.name +
                ": end it, or take it off the bus");
  }
  return {};
}

}  // namespace bushd::daemon
