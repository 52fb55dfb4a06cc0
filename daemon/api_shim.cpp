#include "daemon/api_shim.h"

#include <algorithm>
#include <limits>

#include "lcm/codec.h"
#include "lcm/table_codec.h"
#include "lcm/wire.h"

namespace bushd::daemon {
namespace {

// What is out of range stays so.
std::int32_t narrow(std::int64_t value) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(
      value, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()));
}

void put(command_t& command, const std::vector<api::MotorSteps>& motors) {
  for (const api::MotorSteps& motor : motors) {
    command.motors.push_back(motor.motor);
    command.steps.push_back(motor.steps);
  }
}

void put(command_t& command, const api::MotorNames& motors) {
  command.motors = motors;
  command.steps.assign(motors.size(), 0);
}

class ToCommand {
 public:
  explicit ToCommand(command_t& command) : command_(command) {}

  void operator()(const api::Move& move) {
    command_.kind = move.kind == api::Move::Kind::kAbsolute ? command_t::MOVE_ABSOLUTE
                                                            : command_t::MOVE_RELATIVE;
    command_.dry_run = move.dry_run ? 1 : 0;
    put(command_, move.motors);
  }
  void operator()(const api::Stop& stop) { motors(command_t::STOP, stop.motors); }
  void operator()(const api::EmergencyStop&) { command_.kind = command_t::EMERGENCY_STOP; }
  void operator()(const api::Enable& enable) { motors(command_t::ENABLE, enable.motors); }
  void operator()(const api::Disable& disable) { motors(command_t::DISABLE, disable.motors); }
  void operator()(const api::ClearFaults& clear) { motors(command_t::CLEAR_FAULTS, clear.motors); }
  void operator()(const api::Home& home) { motors(command_t::HOME, home.motors); }
  void operator()(const api::Disarm& disarm) { motors(command_t::DISARM, disarm.motors); }
  void operator()(const api::SetPosition& set) {
    command_.kind = command_t::SET_POSITION;
    put(command_, set.motors);
  }
  void operator()(const api::UseTable& use) {
    command_.kind = command_t::USE_TABLE;
    command_.group = use.group;
    command_.table = use.table;
  }
  void operator()(const api::ReloadTables&) { command_.kind = command_t::RELOAD_TABLES; }
  void operator()(const api::Arm& arm) {
    command_.kind = command_t::ARM;
    command_.edge = arm.edge == api::Edge::kRising ? command_t::RISING : command_t::FALLING;
    command_.delay_us = narrow(arm.delay_us);
    put(command_, arm.motors);
  }
  void operator()(const api::PositionCompare& compare) {
    command_.kind = command_t::REFERENCE;
    command_.arrivals =
        static_cast<std::int8_t>((compare.arrivals.positive ? command_t::POSITIVE : 0) |
                                 (compare.arrivals.negative ? command_t::NEGATIVE : 0));
    command_.delay_us = narrow(compare.delay_us);
    command_.width_us = narrow(compare.width_us);
    put(command_, std::vector<api::MotorSteps>{{compare.motor, compare.position_steps}});
  }
  void operator()(const api::ListTables&) {}
  void operator()(const api::GetTable&) {}
  void operator()(const api::SetTable&) {}

 private:
  void motors(std::int8_t kind, const api::MotorNames& names) {
    command_.kind = kind;
    put(command_, names);
  }

  command_t& command_;
};

api::TableRef ref_of(const table_ref_t& table) {
  return {.name = table.name,
          .revision = static_cast<std::uint32_t>(table.revision),
          .hash = table.hash};
}

api::MovePlan plan_of(const move_plan_t& message) {
  api::MovePlan plan;
  plan.duration_us = message.duration_us;
  plan.ticks = message.ticks;
  if (message.frames >= 0) {
    plan.traffic = api::MovePlan::Traffic{.frames = message.frames, .bytes = message.bytes};
  }
  for (std::size_t i = 0; i < message.motors.size(); ++i) {
    plan.motors.push_back({.motor = message.motors[i],
                           .steps = message.steps[i],
                           .duration_us = message.motor_duration_us[i],
                           .peak_steps_per_s = message.peak_steps_per_s[i]});
  }
  return plan;
}

api::Completed completed_of(const reply_t& reply) {
  api::Completed completed{.outcome = api::outcome_of(reply.result).value_or(api::Outcome::kFault),
                           .reason = reply.reason,
                           .detail = {}};
  if (!reply.plan.empty()) {
    completed.detail = plan_of(reply.plan.front());
  } else if (!reply.motors.empty()) {
    std::vector<api::MotorResult> motors;
    for (std::size_t i = 0; i < reply.motors.size(); ++i) {
      const auto table = static_cast<std::size_t>(reply.table_of_motor[i]);
      motors.push_back(
          {.motor = reply.motors[i],
           .outcome = api::outcome_of(reply.motor_results[i]).value_or(api::Outcome::kFault),
           .position_steps = reply.position_steps[i],
           .table = ref_of(reply.tables[table])});
    }
    completed.detail = std::move(motors);
  }
  return completed;
}

api::Activity activity_of(const motor_state_t& motor) {
  if (motor.armed != 0) return api::Activity::kArmed;
  return api::activity_of(motor.activity).value_or(api::Activity::kResting);
}

api::MotorState state_of(const motor_state_t& motor) {
  return {.name = motor.name,
          .position_steps = motor.position_steps,
          .target_steps = motor.target_steps,
          .velocity_steps_per_s = motor.velocity_steps_per_s,
          .activity = activity_of(motor),
          .moving = motor.moving != 0,
          .enabled = motor.enabled != 0,
          .input = motor.input != 0,
          .inhibited = api::directions_of(motor.forbidden).value_or(api::Directions{}),
          .trust = api::trust_of(motor.trust).value_or(api::Trust::kUncertain),
          .uncertain_reason = {}};
}

}  // namespace

command_t ApiShim::command(const api::Asker& asker, const api::Request& request) {
  command_t command{};
  std::visit(ToCommand(command), request);
  command.motor_count = static_cast<std::int32_t>(command.motors.size());
  // Two sessions may use the same name and number; what the core says back has to tell them apart.
  command.client_id = asker.session->text();
  command.number = asker.number;
  const UnderWay under_way{asker, request};
  while (!under_way_.emplace(std::pair{command.client_id, command.number}, under_way).second) {
    command.client_id += '\'';
  }
  return command;
}

void ApiShim::reply(const reply_t& reply) {
  const auto found = under_way_.find({reply.client_id, reply.number});
  if (found == under_way_.end()) return;
  const api::Asker asker = found->second.asker;
  if (reply.phase == reply_t::ACCEPTED) {
    accepted_(asker, found->second.request);
    return asker.answer(api::Accepted{});
  }
  under_way_.erase(found);
  if (reply.phase == reply_t::REFUSED) return asker.answer(api::Refused{reply.reason});
  asker.answer(completed_of(reply));
}

void ApiShim::state(const state_t& state) {
  const McuId mcu{static_cast<std::size_t>(state.part)};
  const config::Bus& bus = config_.bus_of(config_.mcus[mcu.value]);
  api::StateSnapshot snapshot{.bus = state.bus,
                              .mcu = state.mcu,
                              .state = api::mcu_state_of(state.mcu_state).value(),
                              .detail = state.detail,
                              .inputs = state.inputs,
                              .boot = state.boot_number,
                              .tick = state.tick,
                              .motors = {}};
  api::Description description{.bus = state.bus,
                               .mcu = state.mcu,
                               .address = state.address,
                               .tick_ns = bus.tick_ns(),
                               .emergency_stop = bus.emergency_stop == BUSHD_RAMP_DOWN
                                                     ? api::StopMode::kRamp
                                                     : api::StopMode::kImmediate,
                               .motors = {}};
  for (const motor_state_t& motor : state.motors) {
    snapshot.motors.push_back(state_of(motor));
    description.motors.push_back({.name = motor.name,
                                  .output = static_cast<std::uint8_t>(motor.output),
                                  .group = motor.group,
                                  .table = ref_of(motor.table)});
  }
  publisher_.publish(mcu, description);
  publisher_.publish(mcu, snapshot);
}

void ApiShim::health(const health_t& health) {
  const auto bytes = lcm::encode(health);
  if (!bytes) return;
  const auto message = lcm::decode_daemon_message("HEALTH", *bytes);
  if (!message) return;
  publisher_.publish(BusId{static_cast<std::size_t>(health.part)},
                     std::get<lcm::HealthMessage>(*message).snapshot);
}

bool ApiShim::is_about_table_files(const api::Request& request) {
  return std::holds_alternative<api::ListTables>(request) ||
         std::holds_alternative<api::GetTable>(request) ||
         std::holds_alternative<api::SetTable>(request);
}

table_request_t ApiShim::table_request(const api::Asker& asker, const api::Request& request) {
  table_request_t out{};
  out.client_id = asker.session->client_id();
  out.number = asker.number;
  out.kind = table_request_t::LIST;
  if (const auto* get = std::get_if<api::GetTable>(&request)) {
    out.kind = table_request_t::GET;
    out.table = get->table;
  }
  if (const auto* set = std::get_if<api::SetTable>(&request)) {
    out.kind = table_request_t::SET;
    out.table = set->table;
    out.expected_hash = set->expected_hash;
    out.content.push_back(lcm::message_of(set->content));
    out.content_count = 1;
  }
  return out;
}

api::Reply ApiShim::reply_of(const table_reply_t& reply, const api::Request& request) {
  if (reply.done == 0) return api::Refused{reply.reason};
  api::Completed completed{.outcome = api::Outcome::kDone, .reason = reply.reason, .detail = {}};
  if (std::holds_alternative<api::GetTable>(request) && !reply.tables.empty()) {
    completed.detail = lcm::content_of(reply.tables.front());
    return completed;
  }
  api::TableList list;
  for (const table_entry_t& entry : reply.entries) {
    list.entries.push_back({.name = entry.name,
                            .fault = entry.fault,
                            .table = ref_of(entry.table),
                            .codes = entry.codes,
                            .start_steps_per_s = entry.start_steps_per_s,
                            .max_steps_per_s = entry.max_steps_per_s});
  }
  completed.detail = std::move(list);
  return completed;
}

}  // namespace bushd::daemon
