// Homing: the MCUs do it by themselves (docs/protocol.md, HOME). Here is who may be homed, in which
// order, and what came of it. An MCU homes one motor at a time, so those of one MCU wait in a row.
#include <algorithm>

#include "daemon/bus.h"
#include "daemon/core.h"
#include "daemon/faults.h"

namespace bushd::daemon {
namespace {

constexpr std::uint32_t kMoreSlowSteps = 1000;  // than a ramp has

bool has_motor(const auto& homings, std::size_t motor) {
  return std::any_of(homings.begin(), homings.end(),
                     [motor](const auto& homing) { return homing.motor == motor; });
}

struct Ending {
  motion::Outcome outcome;
  std::string reason;
};

Ending ending_of(const bushd_report& report, const std::string& mcu) {
  switch (report.homing) {
    case BUSHD_HOMING_DONE:
      return {motion::Outcome::kReached, "homed"};
    case BUSHD_HOMING_NOT_FOUND:
      return {motion::Outcome::kFault,
              "its switch was not found within home.most_steps; check the switch and 'home'"};
    case BUSHD_HOMING_STUCK:
      return {motion::Outcome::kFault,
              "its switch stayed active all the way back; is it stuck, or are "
              "home.slow_most_steps too few?"};
    case BUSHD_HOMING_LOST:
      return {motion::Outcome::kFault,
              "its switch was not found again by the slow approach; check its contact"};
    default:
      break;
  }
  const unsigned stops =
      BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_OVERCURRENT;
  if (report.faults & stops) {
    return {motion::Outcome::kStopped,
            "homing was ended because " + stop_cause(report) + "; 'bushctl clear', then home it"};
  }
  if (report.faults & BUSHD_FAULT_LINK) {
    return {motion::Outcome::kLink,
            "MCU " + mcu + " gave up homing because it heard nobody; home it again"};
  }
  return {motion::Outcome::kStopped, "homing was stopped on request"};
}

const char* remedy_of(unsigned refusal) {
  switch (refusal) {
    case BUSHD_E_FORBIDDEN:
      return "move it off that switch first";
    case BUSHD_E_STATE:
      return "home it when the motors of this MCU stand";
    default:
      return "check its 'home' and its table in the configuration";
  }
}

}  // namespace

bool Core::is_homing(std::size_t motor) const {
  return has_motor(mcus_[motors_[motor].mcu].homings, motor);
}

bool Core::is_moved_locally(std::size_t index) const {
  const Motor& motor = motors_[index];
  const link::McuView& view = view_of(mcus_[motor.mcu]);
  const unsigned autonomous = view.reported ? view.report.autonomous : 0u;
  return (autonomous >> motor.config->output.value & 1) != 0 && !is_homing(index);
}

bool Core::is_moving(std::size_t motor) const {
  return motors_[motor].axis.busy() || is_homing(motor) || is_moved_locally(motor);
}

bushd_home Core::home_command(const Motor& motor) const {
  const config::Home& home = *motor.config->home;
  const bushd_table& table = table_of(*motor.config).view();
  const std::uint64_t first = std::max(table.accel.code[0], table.decel.code[0]);
  const std::uint64_t slow_ns =
      std::max<std::uint64_t>({first * table.time_unit_ns, config_.buses[motor.bus].tick_ns(),
                               1'000'000'000u / home.slow_steps_per_s});
  const std::uint64_t units = (slow_ns + BUSHD_HOME_UNIT_NS - 1) / BUSHD_HOME_UNIT_NS;
  return {.motor = motor.config->output.value,
          .direction = static_cast<std::int8_t>(home.positive ? 1 : -1),
          .most_steps = home.most_steps,
          .slow_steps = home.slow_most_steps.value_or(table.decel.count + kMoreSlowSteps),
          .slow_delay = static_cast<std::uint16_t>(std::min<std::uint64_t>(units, UINT16_MAX)),
          .position_steps = home.position_steps};
}

std::string Core::refuse_homing(std::size_t index) const {
  const Motor& motor = motors_[index];
  const Mcu& mcu = mcus_[motor.mcu];
  if (!motor.config->home) return "its configuration has no 'home', so nobody knows where to look";
  if (motor.axis.busy()) return "it moves; stop it first";
  if (const std::string why = refuse_motion(index); !why.empty()) return why;
  if ((view_of(mcu).identity.capabilities & BUSHD_CAN_HOME) == 0) {
    return "MCU " + mcu.config->id +
           " cannot home; find out where it stands and say 'bushctl set NAME STEPS'";
  }
  return {};
}

void Core::start_homing(const command_t& command) {
  OpenMove open{.client = {command.client_id, command.number}, .tables = {}};
  std::vector<std::size_t> motors;
  for (const std::string& name : command.motors) {
    motors.push_back(*find_motor(name));
    open.tables.push_back(service_[motors_[motors.back()].config->group.value].table);
  }
  answer(open.client, reply_t::ACCEPTED, "", "accepted");
  open_moves_.emplace(book_.open(ids_of(motors)), std::move(open));
  for (const std::size_t motor : motors) queue_homing(motor);
}

void Core::queue_homing(std::size_t index) {
  Mcu& mcu = mcus_[motors_[index].mcu];
  mcu.homings.push_back({.motor = index});
  if (mcu.homings.size() == 1) begin_homing(mcu);
  changed_ = true;
}

void Core::begin_homing(Mcu& mcu) {
  Homing& homing = mcu.homings.front();
  homing.asked = true;
  master_of(mcu).home(mcu.in_bus, home_command(motors_[homing.motor]));
}

void Core::follow_homing(Mcu& mcu) {
  if (mcu.homings.empty() || master_of(mcu).busy(mcu.in_bus)) return;
  const link::McuView& view = view_of(mcu);
  const std::size_t index = mcu.homings.front().motor;
  const std::uint8_t output = motors_[index].config->output.value;
  if (((view.report.autonomous | view.report.moving) >> output & 1) != 0) return;
  const Ending ending = ending_of(view.report, mcu.config->id);
  if (ending.outcome == motion::Outcome::kReached) motors_[index].doubt.clear();
  end_homing(mcu, ending.outcome, ending.reason);
}

void Core::end_homing(Mcu& mcu, motion::Outcome outcome, const std::string& reason) {
  const Homing homing = mcu.homings.front();
  mcu.homings.pop_front();
  const Motor& motor = motors_[homing.motor];
  const std::string text = motor.config->name + ": " + reason;
  outputs_.log(outcome == motion::Outcome::kReached ? LogLevel::kInfo : LogLevel::kWarning, text);
  end_part(homing.motor, outcome, reason);
  if (!mcu.homings.empty()) begin_homing(mcu);
}

void Core::end_homings(Mcu& mcu, motion::Outcome outcome, const std::string& reason) {
  for (const Homing& homing : std::exchange(mcu.homings, {})) {
    end_part(homing.motor, outcome, reason);
  }
}

void Core::refuse_home(Mcu& mcu, std::uint8_t status) {
  if (mcu.homings.empty()) return;
  end_homing(mcu, motion::Outcome::kFault,
             "MCU " + mcu.config->id + " refused to home it: " + bushd_status_text(status) + "; " +
                 remedy_of(status));
}

bool Core::forget_waiting_homing(std::size_t index) {
  auto& homings = mcus_[motors_[index].mcu].homings;
  const auto waiting = [index](const Homing& h) { return h.motor == index && !h.asked; };
  if (std::erase_if(homings, waiting) == 0) return false;
  end_part(index, motion::Outcome::kStopped, "stopped before it was its turn to be homed");
  return true;
}

void Core::stop_homing(std::size_t index) {
  Mcu& mcu = mcus_[motors_[index].mcu];
  if (forget_waiting_homing(index) || !is_homing(index)) return;
  bushd_home give_up = home_command(motors_[index]);
  give_up.most_steps = 0;
  master_of(mcu).home(mcu.in_bus, give_up);
}

void Core::home_at_start(Mcu& mcu) {
  for (const int motor : mcu.motor_of) {
    if (motor < 0) continue;
    const auto index = static_cast<std::size_t>(motor);
    const auto& home = motors_[index].config->home;
    const bool homed = (view_of(mcu).report.homed >> motors_[index].config->output.value & 1) != 0;
    if (!home || !home->at_start || (homed && motors_[index].doubt.empty())) continue;
    if (const std::string why = refuse_homing(index); !why.empty()) {
      outputs_.log(LogLevel::kWarning, motors_[index].config->name + " is not homed: " + why);
      continue;
    }
    queue_homing(index);
  }
}

}  // namespace bushd::daemon
