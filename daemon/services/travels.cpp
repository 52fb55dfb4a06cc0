#include "daemon/services/travels.h"

#include <utility>

#include "base/output_bits.h"
#include "motion/report_words.h"
#include "words/remedy.h"

namespace bushd::daemon {
namespace {

using api::Outcome;

struct TravelEnd {
  Outcome outcome;
  std::string reason;
};

TravelEnd end_of_travel(const bushd_report& report, const std::string& mcu) {
  switch (report.homing) {
    case BUSHD_TRAVEL_DONE:
      return {Outcome::kReached, "done"};
    case BUSHD_TRAVEL_NOT_SEEN:
      return {Outcome::kFault, "its sensor has not seen the step in time; check the sensor"};
    case BUSHD_TRAVEL_EARLY:
      return {Outcome::kLimit, "its limit switch was active before its last step"};
    case BUSHD_TRAVEL_NOT_REACHED:
      return {Outcome::kFault, "its limit switch was not active after its last step"};
    case BUSHD_TRAVEL_NOT_LEFT:
      return {Outcome::kFault, "the limit switch that it came from is still active"};
    default:
      break;
  }
  if (report.faults & BUSHD_FAULT_LINK) {
    return {Outcome::kLink, "MCU " + mcu +
                                " ended its travel because it received nothing from the daemon; "
                                "'bushctl clear', then start it again"};
  }
  if (report.faults != 0) {
    return {Outcome::kStopped, "its travel was ended because " + motion::stop_cause(report)};
  }
  return {Outcome::kStopped, "its travel was ended on request"};
}

bool is_under_way(const bushd_report& report) {
  return report.homing >= BUSHD_TRAVEL_STEPS && report.homing <= BUSHD_TRAVEL_RETURN;
}

}  // namespace

Result<void> has_both_limits(const config::Motor& motor) {
  const auto& positive = motor.inputs.positive;
  const auto& negative = motor.inputs.negative;
  if (positive && negative && positive->number != negative->number) return {};
  return fail("it needs a limit switch of its own at each end; see its 'inputs'");
}

Travels::Travels(Installation& installation, const Interlocks& interlocks, OpenMoves& open_moves,
                 KeptPositions& kept, IdleDrivers& idle_drivers, Outputs& outputs)
    : installation_(installation),
      interlocks_(interlocks),
      open_(open_moves),
      kept_(kept),
      idle_drivers_(idle_drivers),
      outputs_(outputs) {
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) tasks_.add();
}

Result<void> Travels::may_travel(MotorId id, const bushd_travel& message) const {
  const motion::Motor& motor = installation_[id];
  const Mcu& mcu = installation_.mcu_of(id);
  if (auto may = interlocks_.may_move(id); !may) return may;
  if (motor.has_plan()) return fail("moves, by another's request");
  if (motor.hold().is_set()) {
    return fail(motor.hold().text() + "; run " + words::remedy("release", motor.name()) + " first");
  }
  if (!mcu.can_travel() || (message.edge != BUSHD_EDGE_NONE && !mcu.can_trigger())) {
    return fail("the firmware of MCU " + mcu.name() + " cannot do that by itself");
  }
  if (message.kind == BUSHD_TRAVEL_LIMITS) {
    if (auto has = has_both_limits(installation_.config()[id]); !has) return has;
  }
  if (const auto& task = tasks_[mcu.id]) {
    return fail("MCU " + mcu.name() + " has " + installation_[task->motor].name() +
                " travel; one at a time");
  }
  const std::int64_t steps = std::int64_t{message.steps} * message.direction;
  return motor.reach().may_move_to(motor.position_steps() + steps);
}

void Travels::request(const api::Asker& asker, MotorId id, const bushd_travel& message) {
  if (const auto may = may_travel(id, message); !may) {
    return asker.answer(api::Refused{installation_[id].name() + ": " + may.error().text()});
  }
  asker.answer(api::Accepted{});
  open_.open(asker, {id}, OpenMoves::Purpose::kTravel);
  Task task{.motor = id, .message = message};
  task.message.motor = installation_[id].output().value;
  tasks_[installation_.mcu_of(id).id] = std::move(task);
  installation_[id].give_to_mcu(motion::Travelling{});
  installation_.changed = true;
}

void Travels::step(std::int64_t now_us) {
  for (const McuId id : installation_.mcus()) {
    if (tasks_[id] && !tasks_[id]->number) ask(now_us, installation_[id]);
  }
}

// As soon as the disk knows of the motion, its drivers are enabled, and reports have told the
// number that the MCU has.
void Travels::ask(std::int64_t now_us, Mcu& mcu) {
  Task& task = *tasks_[mcu.id];
  if (const auto may = interlocks_.may_begin(task.motor); !may) {
    return end(mcu, Outcome::kStopped, "it did not begin: " + may.error().text());
  }
  const auto ready = kept_.make_ready(now_us, task.motor);
  const bool powered = idle_drivers_.make_ready(now_us, mcu.id);
  if (ready && (!*ready || !powered || mcu.busy())) return;
  kept_.not_wanted(task.motor);
  if (!ready) return end(mcu, Outcome::kFault, ready.error().text());
  task.number = mcu.offers.travel->travel(mcu.on_bus(), task.message);
}

void Travels::end_overtaken(std::int64_t) {
  for (const McuId id : installation_.mcus()) {
    const auto& task = tasks_[id];
    if (!task || task->number) continue;
    const MotorId motor = task->motor;
    const auto by = open_.precedence().overtaken(open_.asker_of(motor)->after_stops, {motor});
    if (!by) continue;
    open_.stopped_by({motor}, by->by);
    end(installation_[id], Outcome::kStopped, "it was stopped before it began");
  }
}

void Travels::stop(MotorId id) {
  Mcu& mcu = installation_.mcu_of(id);
  auto& task = tasks_[mcu.id];
  if (!task || task->motor != id || task->given_up) return;
  if (!task->number) return end(mcu, Outcome::kStopped, "it was stopped before it began");
  task->given_up = true;
  mcu.offers.travel->end_travel(mcu.on_bus(), installation_[id].output().value);
}

const bushd_report* Travels::progress(MotorId id) const {
  const Mcu& mcu = installation_.mcu_of(id);
  const auto& task = tasks_[mcu.id];
  const bool begun = task && task->motor == id && task->number && !mcu.busy() &&
                     mcu.report().trigger_number == *task->number;
  return begun ? &mcu.report() : nullptr;
}

void Travels::reports(std::int64_t, Mcu& mcu) {
  const auto& task = tasks_[mcu.id];
  if (!task || !task->number || mcu.busy()) return;
  const bushd_report& report = mcu.report();
  const Output output = installation_[task->motor].output();
  if (has_bit(report.autonomous, output) || has_bit(report.moving, output)) return;
  const TravelEnd ending = end_of_travel(report, mcu.name());
  end(mcu, ending.outcome, ending.reason);
}

void Travels::refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) {
  const auto& task = tasks_[mcu.id];
  if (type != BUSHD_MSG_TRAVEL || !task || !task->number || task->given_up) return;
  end(mcu, Outcome::kFault,
      "MCU " + mcu.name() + " refused to have it travel: " + bushd_status_text(status));
}

void Travels::goes_offline(Mcu& mcu, const std::string& cause) {
  if (tasks_[mcu.id]) end(mcu, Outcome::kLink, cause + "; it travelled by itself");
}

// What an MCU still does was asked for by a daemon before, or by this one before the MCU was lost.
void Travels::goes_online(Mcu& mcu) {
  if (mcu.offers.travel == nullptr || !is_under_way(mcu.report())) return;
  // A travel of a program is the program's.
  const bool programmed =
      mcu.can_have_program() && mcu.offers.programs->program(mcu.on_bus()).under_way();
  if (programmed) return;
  for (const MotorId id : mcu.motors()) {
    const Output output = installation_[id].output();
    if (!has_bit(mcu.report().autonomous, output)) continue;
    outputs_.log(LogLevel::kWarning, id,
                 installation_[id].name() + ": its travel of before does not go on");
    mcu.offers.travel->end_travel(mcu.on_bus(), output.value);
  }
}

void Travels::end(Mcu& mcu, Outcome outcome, const std::string& reason) {
  const Task task = *std::exchange(tasks_[mcu.id], std::nullopt);
  kept_.not_wanted(task.motor);
  motion::Motor& motor = installation_[task.motor];
  motor.take_from_mcu(motion::Travelling{});
  const bool cut = installation_.config()[task.motor].limit_action == BUSHD_STOP_IMMEDIATE;
  if (task.number && cut && mcu.report().homing == BUSHD_TRAVEL_EARLY && mcu.online()) {
    motor.trust().is_uncertain(
        "it was stopped immediately at its limit switch and may have overrun");
  }
  if (outcome != Outcome::kReached && !task.given_up) {
    outputs_.log(LogLevel::kWarning, task.motor, motor.name() + ": " + reason);
  }
  installation_.changed = true;
  open_.end(task.motor, outcome, reason);
}

}  // namespace bushd::daemon
