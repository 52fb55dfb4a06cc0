// Commands of clients: refused with a reason, or accepted and later answered with exactly one
// result. Moves and stops are here, what waits for an MCU's word is in pending.cpp.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/bus.h"
#include "daemon/core.h"
#include "daemon/faults.h"

namespace bushd::daemon {
namespace {

// MCUs count positions in 32 bits.
constexpr std::int64_t kMaxPosition = INT32_MAX;

constexpr std::int8_t kNoKind = 12;  // between HOME and ARM

bool is_move(std::int8_t kind) {
  return kind == command_t::MOVE_RELATIVE || kind == command_t::MOVE_ABSOLUTE ||
         kind == command_t::ARM;
}

bool is_table_change(std::int8_t kind) {
  return kind == command_t::USE_TABLE || kind == command_t::RELOAD_TABLES;
}

}  // namespace

void Core::command(std::int64_t now_us, const command_t& command) {
  if (!valid_client_id(command.client_id)) {
    outputs_.log(LogLevel::kWarning,
                 "a command without a usable client_id (1..64 printable characters) was dropped");
    return;
  }
  const Client client{command.client_id, command.number};
  switch (clients_.note(client.id, client.number)) {
    case ClientLog::Verdict::kRepeated:
      for (const reply_t& reply : clients_.replies(client.id, client.number)) outputs_.reply(reply);
      return;
    case ClientLog::Verdict::kTooOld:
      answer(client, reply_t::REFUSED, "refused",
             "number " + std::to_string(client.number) +
                 " is not above the highest that this client has used; count up");
      return;
    case ClientLog::Verdict::kNew:
      break;
  }
  if (const std::string why = refuse(command); !why.empty()) {
    answer(client, reply_t::REFUSED, "refused", why);
    return;
  }
  if (command.kind == command_t::ARM) {
    arm(command);
  } else if (is_move(command.kind) && command.dry_run != 0) {
    dry_run(now_us, command);
  } else if (is_move(command.kind)) {
    start_move(now_us, command);
  } else if (command.kind == command_t::HOME) {
    start_homing(command);
  } else if (is_table_change(command.kind)) {
    start_table_change(client, command.kind, command.group, command.table);
  } else {
    start_pending(now_us, command);
  }
}

std::optional<std::size_t> Core::find_motor(const std::string& name) const {
  const auto found = motor_by_name_.find(name);
  if (found == motor_by_name_.end()) return std::nullopt;
  return found->second;
}

std::string Core::refuse(const command_t& command) const {
  // Whatever else is wrong with the command: it is for all motors, and no time to be particular.
  if (command.kind == command_t::EMERGENCY_STOP) return {};
  if (command.kind < command_t::MOVE_RELATIVE || command.kind > command_t::REFERENCE ||
      command.kind == kNoKind) {
    return "there is no command kind " + std::to_string(command.kind);
  }
  if (is_table_change(command.kind)) return refuse_table_change(command);
  if (command.steps.size() != command.motors.size()) return "motors and steps differ in number";
  std::set<std::string> seen;
  for (const std::string& name : command.motors) {
    if (!find_motor(name))
      return "there is no motor \"" + name.substr(0, 64) + "\"; 'bushctl status' lists them";
    if (!seen.insert(name).second) return "motor " + name + " is named twice";
  }
  const bool homes = command.kind == command_t::HOME;
  const bool targets = is_move(command.kind) || command.kind == command_t::SET_POSITION ||
                       command.kind == command_t::REFERENCE;
  if ((targets || homes) && command.motors.empty()) return "no motor is named";
  if (command.kind == command_t::REFERENCE) return refuse_reference(command);
  if ((is_move(command.kind) || homes) && shutting_down_) return "the daemon is shutting down";
  if (stopping_all() &&
      (is_move(command.kind) || homes || command.kind == command_t::CLEAR_FAULTS)) {
    return "an emergency stop is under way; wait for its result";
  }
  if (command.dry_run != 0 && (!is_move(command.kind) || command.kind == command_t::ARM))
    return "only moves can be run dry";
  for (std::size_t i = 0; i < command.motors.size(); ++i) {
    const std::size_t index = *find_motor(command.motors[i]);
    const Motor& motor = motors_[index];
    const std::int64_t value = command.steps[i];
    // Compared before any arithmetic: the sum of two values from outside could overflow.
    if (targets && (value > 2 * kMaxPosition || value < -2 * kMaxPosition)) {
      return motor.config->name + ": " + std::to_string(value) +
             " steps is out of range; allowed: +-" + std::to_string(kMaxPosition);
    }
    if (is_move(command.kind)) {
      const std::int64_t target = target_of(command, i);
      const std::string why = refuse_move(index, target, target - motor.position_steps);
      if (!why.empty()) return motor.config->name + ": " + why;
    }
    if (homes) {
      if (const std::string why = refuse_homing(index); !why.empty()) {
        return motor.config->name + ": " + why;
      }
    }
    if (command.kind == command_t::SET_POSITION) {
      if (is_moving(index)) return busy_text(motor) + "; its position can be set at rest only";
      if (being_set(index)) {
        return motor.config->name + ": its position is being set; wait for that result";
      }
      if (value > kMaxPosition || value < -kMaxPosition) {
        return motor.config->name + ": positions lie within +-" + std::to_string(kMaxPosition);
      }
    }
  }
  if (command.kind == command_t::ARM) return refuse_arming(command);
  if (command.kind == command_t::STOP || command.kind == command_t::DISARM) return {};
  for (const std::size_t m : mcus_of(motors_named(command))) {
    const link::McuView& view = view_of(mcus_[m]);
    if (view.phase != link::McuPhase::kOnline) {
      return "MCU " + mcus_[m].config->id + " is offline: " + view.detail;
    }
    const bool at_rest_only =
        command.kind == command_t::DISABLE || command.kind == command_t::CLEAR_FAULTS;
    for (const int motor : mcus_[m].motor_of) {
      if (at_rest_only && motor >= 0 && is_moving(static_cast<std::size_t>(motor))) {
        return busy_text(motors_[static_cast<std::size_t>(motor)]) + "; stop it first";
      }
    }
  }
  return {};
}

std::string Core::busy_text(const Motor& motor) {
  return motor.config->name + (motor.armed ? " waits for the trigger" : " moves");
}

std::string Core::refuse_motion(std::size_t index) const {
  const Motor& motor = motors_[index];
  const Mcu& mcu = mcus_[motor.mcu];
  const link::McuView& view = view_of(mcu);
  if (motor.armed) return "waits for the trigger; disarm it first";
  // One that moves keeps its table.
  const TableChange* change = motor.axis.busy() ? nullptr : changing(motor.mcu);
  if (change != nullptr) {
    return "MCU " + mcu.config->id + " is about to get another table, for group " +
           config_.groups[change->parts.front().group].name + "; wait for that result";
  }
  if (view.phase != link::McuPhase::kOnline) {
    return "MCU " + mcu.config->id + " is offline: " + view.detail;
  }
  if (view.report.faults != 0)
    return "MCU " + mcu.config->id + " has a fault: " + fault_text(view.report);
  if ((view.report.flags & BUSHD_FLAG_ENABLED) == 0) {
    return "the drivers of MCU " + mcu.config->id + " are disabled; enable them first";
  }
  if (buses_[motor.bus]->two_masters) {
    return "another master talks on bus " + config_.buses[motor.bus].name +
           ": end it, or take it off the line";
  }
  // A move begins where the motor stands when it is accepted, and makes its steps with drivers on.
  if (being_set(index)) return "its position is being set; wait for that result";
  if (being_disabled(motor.mcu)) {
    return "the drivers of MCU " + mcu.config->id + " are being disabled; enable them first";
  }
  if (is_homing(index)) return "it is being homed; wait for that result";
  if (is_moved_locally(index)) {
    return "the local inputs of MCU " + mcu.config->id + " move it; release them first";
  }
  return {};
}

std::string Core::refuse_move(std::size_t index, std::int64_t target, std::int64_t steps) const {
  const Motor& motor = motors_[index];
  if (const std::string why = refuse_motion(index); !why.empty()) return why;
  if (!motor.doubt.empty()) {
    return "its position is uncertain, because " + motor.doubt + "; " +
           (motor.config->home ? "say 'bushctl home NAME', or find out where it stands and say "
                                 "'bushctl set NAME STEPS'"
                               : "find out where it stands and say 'bushctl set NAME STEPS'");
  }
  if (target > kMaxPosition || target < -kMaxPosition || std::abs(steps) > kMaxPosition) {
    return "target " + std::to_string(target) + " is beyond +-" + std::to_string(kMaxPosition) +
           " steps";
  }
  if (const std::string why = refuse_direction(motor, steps); !why.empty()) return why;
  if (motor.axis.duration_ticks(steps) > motion::Axis::kMaxDurationTicks) {
    const double tick_s = config_.buses[motor.bus].tick_us * 1e-6;
    const double days = motor.axis.duration_ticks(steps) * tick_s / 86400;
    return std::to_string(steps) + " steps would take " + std::to_string(std::llround(days)) +
           " days with this table; the longest move is " +
           std::to_string(std::llround(motion::Axis::kMaxDurationTicks * tick_s / 86400)) + " days";
  }
  return {};
}

bool Core::being_set(std::size_t motor) const {
  return std::any_of(pending_.begin(), pending_.end(), [motor](const Pending& pending) {
    return pending.kind == command_t::SET_POSITION &&
           std::find(pending.motors.begin(), pending.motors.end(), motor) != pending.motors.end();
  });
}

bool Core::being_disabled(std::size_t mcu) const {
  return std::any_of(pending_.begin(), pending_.end(), [mcu](const Pending& pending) {
    return pending.kind == command_t::DISABLE &&
           std::find(pending.mcus.begin(), pending.mcus.end(), mcu) != pending.mcus.end();
  });
}

std::int64_t Core::target_of(const command_t& command, std::size_t i) const {
  if (command.kind == command_t::MOVE_ABSOLUTE) return command.steps[i];
  const Motor& motor = motors_[*find_motor(command.motors[i])];
  return command.steps[i] + (motor.axis.busy() ? motor.axis.final_steps() : motor.position_steps);
}

void Core::start_move(std::int64_t now_us, const command_t& command) {
  const Client client{command.client_id, command.number};
  std::vector<std::size_t> motors;
  std::vector<std::int64_t> targets;
  std::vector<std::size_t> moving;
  // All motors of a bus that are at rest start in the same tick: the earliest that suits every one
  // of them.
  std::unordered_map<std::size_t, motion::Tick> start;
  for (std::size_t i = 0; i < command.motors.size(); ++i) {
    motors.push_back(*find_motor(command.motors[i]));
    targets.push_back(target_of(command, i));
    const Motor& motor = motors_[motors.back()];
    const Mcu& mcu = mcus_[motor.mcu];
    if (motor.axis.busy()) {
      moving.push_back(motors.back());
      continue;
    }
    const motion::Tick earliest =
        master_of(mcu).earliest_start(now_us, mcu.in_bus, motor.config->output.value);
    motion::Tick& common = start.try_emplace(motor.bus, earliest).first->second;
    common = std::max(common, earliest);
  }
  answer(client, reply_t::ACCEPTED, "", "accepted");
  for (const std::size_t motor : moving) take_over(motor, client);
  OpenMove open{.client = client, .tables = {}};
  for (const std::size_t motor : motors) {
    open.tables.push_back(service_[motors_[motor].config->group.value].table);
  }
  open_moves_.emplace(book_.open(motors), std::move(open));
  for (std::size_t i = 0; i < motors.size(); ++i) {
    motion::Axis& axis = motors_[motors[i]].axis;
    if (axis.busy()) {
      axis.aim(targets[i]);
    } else {
      start_run(motors[i], targets[i], start[motors_[motors[i]].bus]);
    }
  }
  std::erase_if(moving, [this](std::size_t m) { return !motors_[m].axis.needs_change(); });
  change_motors(now_us, moving);
}

void Core::take_over(std::size_t index, const Client& by) {
  const std::string meanwhile =
      "was given a new target by command " + std::to_string(by.number) + " of " + by.id;
  for (Pending& pending : pending_) {
    if (pending.kind != command_t::STOP || std::erase(pending.motors, index) == 0) continue;
    pending.done = motors_[index].config->name + " " + meanwhile + " while it ran down";
  }
  end_part(index, motion::Outcome::kStopped, meanwhile + "; it moves on");
}

void Core::start_run(std::size_t index, std::int64_t target, motion::Tick start) {
  Motor& motor = motors_[index];
  const Mcu& mcu = mcus_[motor.mcu];
  const std::int64_t steps = target - motor.position_steps;
  motor.axis.start(motor.position_steps, steps, start);
  const bool whole = by_table(motor, steps);
  log_start(motor, steps, start, 0, whole);
  const std::uint8_t output = motor.config->output.value;
  if (steps == 0) {
    end_motor(index, motion::Outcome::kReached, "stands at its target already");
  } else if (whole) {
    master_of(mcu).begin_table_run(mcu.in_bus, output, start, static_cast<std::int32_t>(steps));
  } else {
    master_of(mcu).begin(mcu.in_bus, output, start);
  }
  changed_ = true;
}

void Core::log_start(Motor& motor, std::int64_t steps, motion::Tick start, std::uint32_t late_ns,
                     bool by_table) {
  const config::Bus& bus = config_.buses[motor.bus];
  motor.log_id = ++last_log_id_;
  nlohmann::json line = {{"event", "move"},
                         {"id", motor.log_id},
                         {"motor", motor.config->name},
                         {"bus", bus.name},
                         {"address", mcus_[motor.mcu].config->address.value},
                         {"output", motor.config->output.value},
                         {"table_file", table_of(*motor.config).path()},
                         {"table_sha256", table_of(*motor.config).content_hash()},
                         {"tick_ns", bus.tick_ns()},
                         {"format", bus.format == BUSHD_FORMAT_FINE ? "fine" : "coarse"},
                         {"moves", by_table ? "table" : "stream"},
                         {"start_tick", start},
                         {"steps", steps},
                         {"from_steps", motor.axis.from_steps()}};
  if (late_ns != 0) line["late_ns"] = late_ns;
  if (const bushd_emission& emission = mcus_[motor.mcu].config->emission.settings;
      emission.mode != BUSHD_EMISSION_EVEN) {
    line["emission"] = fieldbus::kEmissionNames.at(emission.mode);
    line["step_us"] = emission.step_us;
    line["dir_setup_us"] = emission.dir_setup_us;
    if (emission.mode == BUSHD_EMISSION_STAGGERED) line["settle_us"] = emission.settle_us;
    if (emission.mode == BUSHD_EMISSION_PHASES) {
      line["phase_sequence"] = fieldbus::kSequenceNames.at(emission.sequence);
    }
  }
  outputs_.move_log(line.dump());
}

bool Core::by_table(const Motor& motor, std::int64_t steps) const {
  const Mcu& mcu = mcus_[motor.mcu];
  return config_.buses[motor.bus].table_runs && master_of(mcu).can_run_tables(mcu.in_bus) &&
         std::abs(steps) <= kMaxPosition;
}

void Core::stop_motors(std::int64_t now_us, const std::vector<std::size_t>& motors) {
  std::vector<std::size_t> changed;
  std::vector<std::size_t> armed;
  for (const std::size_t index : motors) {
    stop_homing(index);
    motion::Axis& axis = motors_[index].axis;
    if (!axis.busy()) continue;
    if (motors_[index].armed) {
      armed.push_back(index);
      continue;
    }
    axis.stop();
    if (axis.needs_change()) changed.push_back(index);
  }
  take_back(armed);
  change_motors(now_us, changed);
}

void Core::change_motors(std::int64_t now_us, const std::vector<std::size_t>& motors) {
  // One replacement serves all motors of an MCU. It can bring a motor that has not begun to rest at
  // any tick, but another beginning only at the tick where it was to begin.
  std::unordered_map<std::size_t, motion::Tick> at;  // by MCU
  for (const std::size_t index : motors) {
    const Motor& motor = motors_[index];
    const link::Master& master = master_of(mcus_[motor.mcu]);
    const motion::Tick earliest = motor.axis.stopping()
                                      ? master.earliest_replace(now_us)
                                      : master.earliest_retarget(now_us, motor.axis.start_tick());
    motion::Tick& common = at.try_emplace(motor.mcu, earliest).first->second;
    common = std::max(common, earliest);
  }
  std::unordered_map<std::size_t, std::uint16_t> masks;  // by MCU
  for (const std::size_t index : motors) {
    Motor& motor = motors_[index];
    if (!motor.axis.busy() || !motor.axis.change(at[motor.mcu])) continue;
    masks[motor.mcu] |= static_cast<std::uint16_t>(1u << motor.config->output.value);
  }
  for (const auto& [index, mask] : masks) {
    const Mcu& mcu = mcus_[index];
    master_of(mcu).replace(mcu.in_bus, mask, at[index]);
  }
  changed_ = true;
}

std::vector<std::size_t> Core::motors_named(const command_t& command) const {
  std::vector<std::size_t> motors;
  for (const std::string& name : command.motors) motors.push_back(*find_motor(name));
  if (motors.empty()) {
    for (std::size_t i = 0; i < motors_.size(); ++i) motors.push_back(i);
  }
  return motors;
}

std::vector<std::size_t> Core::mcus_of(const std::vector<std::size_t>& motors) const {
  std::set<std::size_t> mcus;
  for (const std::size_t motor : motors) mcus.insert(motors_[motor].mcu);
  return {mcus.begin(), mcus.end()};
}

void Core::answer(const Client& client, std::int8_t phase, const std::string& result,
                  const std::string& reason, reply_t reply) {
  reply.utime_us = outputs_.wall_clock_us();
  reply.client_id = client.id;
  reply.number = client.number;
  reply.phase = phase;
  reply.result = result;
  reply.reason = reason;
  reply.motor_count = static_cast<std::int32_t>(reply.motors.size());
  reply.table_count = static_cast<std::int32_t>(reply.tables.size());
  reply.plan_count = static_cast<std::int32_t>(reply.plan.size());
  clients_.record(reply);
  outputs_.reply(reply);
}

}  // namespace bushd::daemon
