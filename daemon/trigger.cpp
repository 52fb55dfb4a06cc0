// Moves that wait for the trigger of their MCU, and its reference output.
//
// An armed motor is busy without a start: its axis is started anew once a report tells when the MCU
// has begun. From then on its move is a table run like any other.
#include <algorithm>
#include <set>

#include "daemon/bus.h"
#include "daemon/core.h"

namespace bushd::daemon {
namespace {

constexpr motion::Tick kNever = INT64_MAX / 2;

template <class Number>
bool within(Number value, Number least, Number most) {
  return value >= least && value <= most;
}

}  // namespace

std::string Core::refuse_arming(const command_t& command) const {
  if (command.edge != command_t::RISING && command.edge != command_t::FALLING) {
    return "edge is neither RISING nor FALLING";
  }
  if (!within<std::int64_t>(command.delay_us, BUSHD_TRIGGER_MIN_DELAY_US,
                            BUSHD_TRIGGER_MAX_DELAY_US)) {
    return "a delay of " + std::to_string(command.delay_us) +
           " us after the trigger; allowed: " + std::to_string(BUSHD_TRIGGER_MIN_DELAY_US) +
           " to " + std::to_string(BUSHD_TRIGGER_MAX_DELAY_US);
  }
  for (std::size_t i = 0; i < command.motors.size(); ++i) {
    const Motor& motor = motors_[*find_motor(command.motors[i])];
    const Mcu& mcu = mcus_[motor.mcu];
    const link::Master& master = master_of(mcu);
    if (command.steps[i] == 0) return motor.config->name + ": a move of no steps";
    if (motor.axis.busy()) return motor.config->name + " moves; stop it first";
    if (!master.can_trigger(mcu.in_bus) || !master.can_run_tables(mcu.in_bus)) {
      return motor.config->name + ": MCU " + mcu.config->id +
             " has no trigger input; move it without one, or by an MCU that has";
    }
    for (const int other : mcu.motor_of) {
      if (other < 0 || !motors_[static_cast<std::size_t>(other)].armed) continue;
      return motors_[static_cast<std::size_t>(other)].config->name +
             " waits for the trigger of MCU " + mcu.config->id + " already; disarm it first";
    }
  }
  return {};
}

void Core::arm(const command_t& command) {
  const Client client{command.client_id, command.number};
  answer(client, reply_t::ACCEPTED, "", "accepted");
  OpenMove open{.client = client, .tables = {}};
  std::vector<std::size_t> motors;
  std::unordered_map<std::size_t, std::vector<link::Master::Armed>> moves;  // by MCU
  for (std::size_t i = 0; i < command.motors.size(); ++i) {
    motors.push_back(*find_motor(command.motors[i]));
    Motor& motor = motors_[motors.back()];
    open.tables.push_back(service_[motor.config->group.value].table);
    moves[motor.mcu].push_back({.motor = motor.config->output.value,
                                .steps = static_cast<std::int32_t>(command.steps[i])});
    motor.axis.start(motor.position_steps, command.steps[i], kNever);
    motor.armed = Motor::Armed{.number = 0, .steps = command.steps[i]};
  }
  open_moves_.emplace(book_.open(motors), std::move(open));
  std::unordered_map<std::size_t, std::uint8_t> numbers;
  for (const auto& [index, of_mcu] : moves) {
    const Mcu& mcu = mcus_[index];
    numbers[index] = master_of(mcu).arm(mcu.in_bus, static_cast<bushd_edge>(command.edge),
                                        static_cast<std::uint32_t>(command.delay_us), of_mcu);
  }
  for (const std::size_t motor : motors) {
    motors_[motor].armed->number = numbers[motors_[motor].mcu];
  }
  changed_ = true;
}

void Core::disarm(const std::vector<std::size_t>& motors) {
  for (const std::size_t index : mcus_of(motors)) {
    const Mcu& mcu = mcus_[index];
    master_of(mcu).disarm(mcu.in_bus);
  }
}

void Core::take_back(const std::vector<std::size_t>& motors) {
  for (const std::size_t motor : motors) motors_[motor].armed->stops = true;
  disarm(motors);
}

void Core::take_back_companions(std::size_t index) {
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    // Those of its own MCU have ended by what has ended it.
    Motor& other = motors_[i];
    if (!other.armed || other.armed->stops || other.mcu == motors_[index].mcu ||
        book_.move_of(i) != book_.move_of(index)) {
      continue;
    }
    other.armed->ended = motors_[index].config->name;
    others.push_back(i);
  }
  take_back(others);
}

bool Core::follow_armed(std::size_t index, const Mcu& mcu, const link::McuView& view) {
  Motor& motor = motors_[index];
  const bushd_report& report = view.report;
  const Motor::Armed armed = *motor.armed;
  const bool told = report.trigger_number == armed.number;
  if (told && report.trigger_state == BUSHD_TRIGGER_STARTED) {
    const auto start = view.tick + static_cast<std::int32_t>(report.start_tick - report.tick);
    motor.armed.reset();
    motor.axis.start(motor.axis.from_steps(), armed.steps, start, report.start_ns);
    if (armed.stops) motor.axis.stop();
    log_start(motor, armed.steps, start, report.start_ns, true);
    master_of(mcu).follow_table_run(mcu.in_bus, motor.config->output.value, start,
                                    static_cast<std::int32_t>(armed.steps));
    changed_ = true;
    return true;
  }
  if (report.faults != 0) return true;
  if (master_of(mcu).busy(mcu.in_bus)) return false;
  const std::string name = "MCU " + mcu.config->id;
  const bool refused_for_limit = !told && report.last_rejection == BUSHD_E_FORBIDDEN;
  if (refused_for_limit || (told && report.trigger_state == BUSHD_TRIGGER_FORBIDDEN)) {
    end_motor(index, motion::Outcome::kLimit,
              "a limit switch forbids that direction, or that of another motor that waited with "
              "it; it did not move. Move that motor away from its switch, and arm again");
  } else if (!told) {
    end_motor(index, motion::Outcome::kFault,
              name + " did not arm it: " + bushd_status_text(report.last_rejection) +
                  "; 'bushctl status' tells how that MCU is, arm again when it is ready");
  } else if (report.trigger_state == BUSHD_TRIGGER_DISARMED) {
    end_motor(index, motion::Outcome::kStopped,
              armed.ended.empty()
                  ? "disarmed before the trigger came"
                  : "disarmed, because " + armed.ended + ", armed with it, does not wait any more");
  } else if (report.trigger_state == BUSHD_TRIGGER_LATE) {
    end_motor(index, motion::Outcome::kFault,
              "the trigger came, but " + name +
                  " noticed it too late to begin in time; it did not move, arm it again");
  } else if (report.trigger_state == BUSHD_TRIGGER_FAULT) {
    end_motor(index, motion::Outcome::kFault,
              "a fault of " + name + " disarmed it; 'bushctl status' tells which");
  }
  return false;
}

std::string Core::refuse_reference(const command_t& command) const {
  if (command.motors.size() != 1) return "a reference output follows one motor";
  const Motor& motor = motors_[*find_motor(command.motors.front())];
  const Mcu& mcu = mcus_[motor.mcu];
  const link::McuView& view = view_of(mcu);
  if (view.phase != link::McuPhase::kOnline) {
    return "MCU " + mcu.config->id + " is offline: " + view.detail;
  }
  if (!master_of(mcu).can_compare_position(mcu.in_bus)) {
    return "MCU " + mcu.config->id + " has no reference output";
  }
  if (!within<int>(command.arrivals, 0, command_t::POSITIVE + command_t::NEGATIVE)) {
    return "arrivals is neither POSITIVE, NEGATIVE nor both";
  }
  if (command.arrivals == 0) return {};
  if (!within<std::int64_t>(command.steps.front(), -INT32_MAX, INT32_MAX)) {
    return motor.config->name + ": positions lie within +-" + std::to_string(INT32_MAX);
  }
  if (!within<std::int64_t>(command.delay_us, 0, BUSHD_REFERENCE_MAX_DELAY_US)) {
    return "a delay of " + std::to_string(command.delay_us) +
           " us before the pulse; allowed: 0 to " + std::to_string(BUSHD_REFERENCE_MAX_DELAY_US);
  }
  if (!within<std::int64_t>(command.width_us, 1, BUSHD_REFERENCE_MAX_WIDTH_US)) {
    return "a pulse of " + std::to_string(command.width_us) + " us; allowed: 1 to " +
           std::to_string(BUSHD_REFERENCE_MAX_WIDTH_US);
  }
  return {};
}

void Core::set_reference(const command_t& command) {
  const Motor& motor = motors_[*find_motor(command.motors.front())];
  const Mcu& mcu = mcus_[motor.mcu];
  const bool on = command.arrivals != 0;
  master_of(mcu).position_compare(
      mcu.in_bus, {.motor = motor.config->output.value,
                   .arrivals = static_cast<std::uint8_t>(command.arrivals),
                   .position_steps = on ? static_cast<std::int32_t>(command.steps.front()) : 0,
                   .delay_us = on ? static_cast<std::uint32_t>(command.delay_us) : 0,
                   .width_us = on ? static_cast<std::uint32_t>(command.width_us) : 1});
}

}  // namespace bushd::daemon
