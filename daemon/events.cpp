// What the bus tells: MCUs that come and go, reports, and with them the ends of moves.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <variant>

#include "daemon/bus.h"
#include "daemon/core.h"
#include "daemon/faults.h"
#include "link/faults.h"

namespace bushd::daemon {
namespace {

constexpr const char* kCutOff = "it was cut off by an emergency stop and may have overrun";
// " (watchdog)"
std::string by_cause(std::uint8_t reset_cause) {
  const std::string word = reset_cause_word(reset_cause);
  return word.empty() ? word : " (" + word + ")";
}

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

constexpr const char* kUnpowered = "its drivers were switched off by overcurrent while it moved";

}  // namespace

bool Core::cuts(const Mcu& mcu, const bushd_report& report) const {
  const bool commanded = (report.faults & BUSHD_FAULT_EMERGENCY) != 0 &&
                         config_.buses[mcu.bus].emergency_stop == BUSHD_CUT;
  const bool by_input = (report.faults & BUSHD_FAULT_EMERGENCY_INPUT) != 0 &&
                        mcu.config->emergency_input == BUSHD_EMERGENCY_INPUT_CUTS;
  return commanded || by_input;
}

std::string Core::did_not_start(const Mcu& mcu) {
  return "its first ticks did not reach MCU " + mcu.config->id + " in time; it did not move";
}

void Core::handle_events(std::int64_t now_us, std::size_t bus) {
  const auto handle =
      Overloaded{[&](const link::McuOnline& event) { on_online(mcu_at(bus, event.mcu)); },
                 [&](const link::McuOffline& event) { on_offline(mcu_at(bus, event.mcu)); },
                 [&](const link::McuReported& event) { on_report(now_us, mcu_at(bus, event.mcu)); },
                 [&](const link::RequestRefused& event) {
                   if (event.type == BUSHD_MSG_HOME)
                     refuse_home(mcus_[mcu_at(bus, event.mcu)], event.status);
                 },
                 [&](const link::StartMissed& event) {
                   on_start_missed(mcus_[mcu_at(bus, event.mcu)], event.motor);
                 },
                 [&](const link::ReplacementFailed& event) {
                   on_replacement_failed(now_us, mcus_[mcu_at(bus, event.mcu)], event.motors);
                 }};
  for (const link::Event& event : buses_[bus]->master.take_events()) std::visit(handle, event);
}

void Core::on_start_missed(const Mcu& mcu, std::uint8_t output) {
  if (mcu.motor_of[output] < 0) return;
  const auto index = static_cast<std::size_t>(mcu.motor_of[output]);
  const motion::Axis& axis = motors_[index].axis;
  const bushd_report& report = view_of(mcu).report;
  const bool ran_down = report.faults != 0;  // says the report
  // Of a move that was cancelled before its start no tick is missed.
  const bool cancelled = axis.end_tick() <= axis.start_tick();
  const bool limited = !forbidden_word(report, output).empty();  // says the report
  if (ran_down || cancelled || limited) return;
  end_motor(index, motion::Outcome::kLink, did_not_start(mcu));
}

void Core::on_replacement_failed(std::int64_t now_us, const Mcu& mcu, std::uint16_t outputs) {
  std::vector<std::size_t> again;
  for (unsigned output = 0; output < BUSHD_MOTORS_PER_MCU; ++output) {
    const int motor = mcu.motor_of[output];
    if ((outputs >> output & 1) != 0 && motor >= 0) {
      again.push_back(static_cast<std::size_t>(motor));
    }
  }
  change_motors(now_us, again);
}

void Core::on_online(std::size_t index) {
  Mcu& mcu = mcus_[index];
  const link::McuView& view = view_of(mcu);
  // Positions are counts since the MCU's boot; a boot that this daemon did not see the positions of
  // has lost them.
  const bool restarted = mcu.boot_number && *mcu.boot_number != view.report.boot_number;
  const bool cut = cuts(mcu, view.report);
  const bool unpowered = (view.report.faults & BUSHD_FAULT_OVERCURRENT) != 0;
  const bool first = !mcu.boot_number;
  mcu.boot_number = view.report.boot_number;
  mcu.clearing = false;
  mcu.told.reset();
  for (unsigned output = 0; output < view.report.motor_count; ++output) {
    if (mcu.motor_of[output] < 0) continue;
    Motor& motor = motors_[static_cast<std::size_t>(mcu.motor_of[output])];
    const std::int64_t before = motor.position_steps;
    motor.position_steps = view.report.motor[output].position_steps;
    if (restarted) motor.doubt = "MCU " + mcu.config->id + " restarted";
    if (restarted && motor.alone) motor.alone->set = true;
    // Nobody here has seen whether it moved when it was cut off.
    if ((cut || unpowered) && (first || motor.position_steps != before)) {
      motor.doubt = cut ? kCutOff : kUnpowered;
    }
  }
  outputs_.log(restarted ? LogLevel::kWarning : LogLevel::kInfo,
               "MCU " + mcu.config->id + " is ready, boot number " +
                   std::to_string(view.report.boot_number) +
                   (restarted ? "; it restarted" + by_cause(view.report.reset_cause) +
                                    ", so its motors' positions are uncertain: set or home them"
                              : ""));
  home_at_start(mcu);
  changed_ = true;
}

void Core::on_offline(std::size_t index) {
  const Mcu& mcu = mcus_[index];
  const std::string cause = "MCU " + mcu.config->id + " " + view_of(mcu).detail;
  outputs_.log(LogLevel::kError, cause);
  for (const int motor : mcu.motor_of) {
    if (motor < 0) continue;
    end_motor(static_cast<std::size_t>(motor), motion::Outcome::kLink,
              cause + "; the position is the last one reported");
  }
  end_homings(mcus_[index], motion::Outcome::kLink, cause + "; it was being homed");
  changed_ = true;
}

void Core::on_report(std::int64_t now_us, std::size_t index) {
  Mcu& mcu = mcus_[index];
  const link::McuView& view = view_of(mcu);
  for (unsigned output = 0; output < view.report.motor_count; ++output) {
    if (mcu.motor_of[output] < 0) continue;
    const auto motor = static_cast<std::size_t>(mcu.motor_of[output]);
    notice_alone(motor, mcu, view.report);
    motors_[motor].position_steps = view.report.motor[output].position_steps;
    if (motors_[motor].axis.busy()) follow_motor(now_us, motor, mcu, view);
  }
  // No move has led to where these stand.
  const unsigned ended = mcu.autonomous & ~unsigned{view.report.autonomous};
  mcu.autonomous = view.report.autonomous;
  for (unsigned output = 0; output < view.report.motor_count; ++output) {
    const int motor = mcu.motor_of[output];
    if ((ended >> output & 1) == 0 || motor < 0) continue;
    Motor& alone = motors_[static_cast<std::size_t>(motor)];
    if (cuts(mcu, view.report)) alone.doubt = kCutOff;
    if (view.report.faults & BUSHD_FAULT_OVERCURRENT) alone.doubt = kUnpowered;
  }
  for (const int motor : mcu.motor_of) {
    if (motor >= 0) end_alone(static_cast<std::size_t>(motor), view);
  }
  mcu.told = view.tick;
  follow_homing(mcu);
  clear_link_fault(mcu);
  check_pending(now_us, index);
}

void Core::follow_motor(std::int64_t now_us, std::size_t index, const Mcu& mcu,
                        const link::McuView& view) {
  Motor& motor = motors_[index];
  const std::uint8_t output = motor.config->output.value;
  const bool moving = (view.report.moving >> output & 1) != 0;
  if (motor.armed && !follow_armed(index, mcu, view)) return;
  if ((view.report.autonomous >> output & 1) != 0) {
    // So it had no ticks of the move, and takes none.
    end_motor(index, motion::Outcome::kStopped,
              "the local inputs of MCU " + mcu.config->id +
                  " moved it before it could start; release them and move it again");
    return;
  }
  if (view.report.faults != 0) {
    // The MCU takes no more ticks; what it has, it runs, and then down its own table.
    if (!moving) end_faulty_motor(index, mcu, view.report);
    return;
  }
  // It has not told of the emergency stop yet, with which its plan was given up.
  if (stopping_all()) return;
  if (motor.limit == 0) {
    if (const auto change = motor.axis.executed(view.tick)) log_change(motor, *change);
    notice_limit(motor, view);
  }
  if (motor.limit != 0) {
    if (!moving) end_at_limit(index);
    return;
  }
  const std::int64_t planned = motor.axis.executed_steps();
  if (!motor.wrong && motor.position_steps != planned) {
    if (!moving && motor.position_steps == motor.axis.from_steps()) {
      // A motor at rest looks the same whether its start came and is over or never came.
      end_motor(index, motion::Outcome::kLink, did_not_start(mcu));
      return;
    }
    motor.wrong = true;
    motor.doubt = "MCU " + mcu.config->id + " counted position " +
                  std::to_string(motor.position_steps) + " where the table leads to " +
                  std::to_string(planned);
    outputs_.log(LogLevel::kError, motor.config->name + ": " + motor.doubt + "; it is stopped");
    stop_motors(now_us, {index});
  }
  if (view.tick < motor.axis.end_tick()) {
    if (motor.axis.needs_change()) change_motors(now_us, {index});
    return;
  }
  if (motor.wrong) {
    if (!moving) end_faulty_motor(index, mcu, view.report);
  } else if (motor.position_steps == motor.axis.wanted_steps()) {
    end_motor(index, motion::Outcome::kReached, "stands at its target");
  } else if (motor.axis.stopping()) {
    end_motor(index, motion::Outcome::kStopped, "stopped on request");
  } else {
    // It was given a target that its table could not lead to without a rest.
    log_result(motor, "turned");
    start_run(index, motor.axis.wanted_steps(),
              master_of(mcu).earliest_start(now_us, mcu.in_bus, output));
  }
}

// It stands, and not by its plan.
void Core::end_faulty_motor(std::size_t index, const Mcu& mcu, const bushd_report& report) {
  Motor& motor = motors_[index];
  // One that has not made a step cannot overrun.
  const bool stepped = motor.position_steps != motor.axis.from_steps();
  if (motor.wrong) {
    end_motor(index, motion::Outcome::kFault, motor.doubt + "; check the position and set it");
  } else if ((report.faults & BUSHD_FAULT_OVERCURRENT) != 0 && !motor.armed) {
    const std::string why =
        "MCU " + mcu.config->id + " switched its drivers off because " + stop_cause(report);
    if (stepped) motor.doubt = kUnpowered;
    end_motor(index, motion::Outcome::kFault,
              stepped ? why + "; check the position and set it"
                      : "it did not move: " + why +
                            "; find the cause, then 'bushctl clear' and 'enable'");
  } else if ((report.faults & (BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT)) != 0) {
    const bool commanded = (report.faults & BUSHD_FAULT_EMERGENCY) != 0;
    const std::string by =
        commanded ? "an emergency stop" : "the emergency input of MCU " + mcu.config->id;
    const bool overran = cuts(mcu, report) && stepped;
    if (overran) motor.doubt = kCutOff;
    end_motor(index, motion::Outcome::kStopped,
              overran
                  ? "cut off by " + by + "; it may have overrun, so check the position and set it"
                  : "stopped by " + by);
  } else if (motor.armed) {
    end_motor(index, motion::Outcome::kLink,
              "MCU " + mcu.config->id + " disarmed it by itself because " + stop_cause(report));
  } else {
    end_motor(index, motion::Outcome::kLink,
              "MCU " + mcu.config->id + " ran it down by itself because " + stop_cause(report));
  }
}

// The daemon knows where the motors are again, so the fault has served its purpose; it stays
// latched as long as a motor moves or a move has not got its result. An emergency stop is for
// people to clear, and clearing is for all faults at once.
void Core::clear_link_fault(Mcu& mcu) {
  const link::McuView& view = view_of(mcu);
  const bool faulty = (view.report.faults & (BUSHD_FAULT_LINK | BUSHD_FAULT_SYNC)) != 0 &&
                      (view.report.faults & link::kPeoplesFaults) == 0 && !stopping_all();
  if (faulty && !mcu.clearing && view.report.moving == 0) {
    outputs_.log(LogLevel::kWarning, "MCU " + mcu.config->id + ": " + stop_cause(view.report) +
                                         "; positions are read, clearing the fault");
    master_of(mcu).control(mcu.in_bus, BUSHD_CONTROL_CLEAR_FAULTS);
  }
  if (mcu.clearing != faulty) changed_ = true;
  mcu.clearing = faulty && view.report.moving == 0;
}

void Core::end_motor(std::size_t index, motion::Outcome outcome, const std::string& reason) {
  Motor& motor = motors_[index];
  if (!motor.axis.busy()) return;
  const Mcu& mcu = mcus_[motor.mcu];
  master_of(mcu).drop(mcu.in_bus, motor.config->output.value);
  motor.axis.finish();
  motor.wrong = false;
  motor.limit = 0;
  // The log of moves knows nothing of one that has not started.
  if (!motor.armed) log_result(motor, motion::outcome_word(outcome));
  if (std::exchange(motor.armed, std::nullopt)) take_back_companions(index);
  const bool planned = outcome == motion::Outcome::kReached || outcome == motion::Outcome::kStopped;
  if (!planned) outputs_.log(LogLevel::kWarning, motor.config->name + ": " + reason);
  end_part(index, outcome, reason);
}

void Core::log_change(const Motor& motor, const motion::Change& change) {
  nlohmann::json line = {{"event", change.target_steps ? "retarget" : "stop"},
                         {"id", motor.log_id},
                         {"motor", motor.config->name},
                         {"tick", change.at}};
  if (change.target_steps) line["target_steps"] = *change.target_steps;
  outputs_.move_log(line.dump());
}

void Core::log_result(const Motor& motor, const std::string& result) {
  const nlohmann::json line = {{"event", "result"},
                               {"id", motor.log_id},
                               {"motor", motor.config->name},
                               {"result", result},
                               {"position_steps", motor.position_steps}};
  outputs_.move_log(line.dump());
}

void Core::log_set(const Motor& motor) {
  const nlohmann::json line = {
      {"event", "set"}, {"motor", motor.config->name}, {"position_steps", motor.position_steps}};
  outputs_.move_log(line.dump());
}

void Core::end_part(std::size_t index, motion::Outcome outcome, const std::string& reason) {
  const Motor& motor = motors_[index];
  changed_ = true;
  const auto finished = book_.end({.motor = index,
                                   .outcome = outcome,
                                   .position_steps = motor.position_steps,
                                   .reason = motor.config->name + ": " + reason});
  if (!finished) return;
  const auto open = open_moves_.extract(finished->move);
  answer(open.mapped().client, reply_t::RESULT, motion::outcome_word(finished->outcome),
         finished->reason, reply_to(*finished, open.mapped().tables));
}

reply_t Core::reply_to(const motion::MoveResult& result,
                       const std::vector<tables::TablePtr>& moved_by) const {
  reply_t reply{};
  std::vector<const tables::Table*> told;
  for (std::size_t i = 0; i < result.motors.size(); ++i) {
    const motion::MotorOutcome& part = result.motors[i];
    reply.motors.push_back(motors_[part.motor].config->name);
    reply.motor_results.push_back(motion::outcome_word(part.outcome));
    reply.position_steps.push_back(part.position_steps);
    const auto found = std::find(told.begin(), told.end(), moved_by[i].get());
    reply.table_of_motor.push_back(static_cast<std::int16_t>(found - told.begin()));
    if (found != told.end()) continue;
    told.push_back(moved_by[i].get());
    reply.tables.push_back(ref_to(*moved_by[i]));
  }
  return reply;
}

}  // namespace bushd::daemon
