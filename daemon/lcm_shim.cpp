#include "daemon/lcm_shim.h"

#include <algorithm>
#include <utility>

namespace bushd::daemon {
namespace {

std::int64_t number(std::uint64_t count) {
  return static_cast<std::int64_t>(count);
}

std::vector<api::MotorAmount> steps_of(const command_t& command) {
  std::vector<api::MotorAmount> motors;
  for (std::size_t i = 0; i < command.motors.size(); ++i) {
    motors.push_back({command.motors[i], command.steps[i]});
  }
  return motors;
}

Result<api::Request> arm_of(const command_t& command) {
  if (command.edge != command_t::RISING && command.edge != command_t::FALLING) {
    return fail("edge is neither RISING nor FALLING");
  }
  return api::Arm{
      .edge = command.edge == command_t::RISING ? api::Edge::kRising : api::Edge::kFalling,
      .delay_us = command.delay_us,
      .motors = steps_of(command)};
}

Result<api::Request> compare_of(const command_t& command) {
  if (command.motors.size() != 1) return fail("a reference output follows one motor");
  if (command.arrivals < 0 || command.arrivals > command_t::POSITIVE + command_t::NEGATIVE) {
    return fail("arrivals is neither POSITIVE, NEGATIVE nor both");
  }
  return api::PositionCompare{
      .motor = command.motors.front(),
      .position = command.steps.front(),
      .arrivals = {.positive = (command.arrivals & command_t::POSITIVE) != 0,
                   .negative = (command.arrivals & command_t::NEGATIVE) != 0},
      .delay_us = command.delay_us,
      .width_us = command.width_us};
}

Result<api::Request> request_of(const command_t& command) {
  const bool moves =
      command.kind == command_t::MOVE_RELATIVE || command.kind == command_t::MOVE_ABSOLUTE;
  const bool tables =
      command.kind == command_t::USE_TABLE || command.kind == command_t::RELOAD_TABLES;
  if (command.kind == command_t::EMERGENCY_STOP) return api::EmergencyStop{};
  if (tables && !command.motors.empty()) return fail("tables are given to groups; name no motors");
  if (command.steps.size() != command.motors.size()) {
    return fail("motors and steps differ in number");
  }
  if (command.dry_run != 0 && !moves) return fail("only moves can be run dry");
  switch (command.kind) {
    case command_t::MOVE_RELATIVE:
    case command_t::MOVE_ABSOLUTE:
      return api::Move{.kind = command.kind == command_t::MOVE_RELATIVE
                                   ? api::Move::Kind::kRelative
                                   : api::Move::Kind::kAbsolute,
                       .motors = steps_of(command),
                       .dry_run = command.dry_run != 0};
    case command_t::STOP:
      return api::Stop{command.motors};
    case command_t::ENABLE:
      return api::Enable{command.motors};
    case command_t::DISABLE:
      return api::Disable{command.motors};
    case command_t::SET_POSITION:
      return api::SetPosition{steps_of(command)};
    case command_t::CLEAR_FAULTS:
      return api::ClearFaults{command.motors};
    case command_t::USE_TABLE:
      return api::UseTable{.group = command.group, .table = command.table};
    case command_t::RELOAD_TABLES:
      return api::ReloadTables{};
    case command_t::HOME:
      return api::Home{command.motors};
    case command_t::ARM:
      return arm_of(command);
    case command_t::DISARM:
      return api::Disarm{command.motors};
    case command_t::REFERENCE:
      return compare_of(command);
    default:
      return fail("there is no command kind " + std::to_string(command.kind));
  }
}

table_ref_t message_of(const api::TableRef& table) {
  table_ref_t message{};
  message.name = table.name;
  message.revision = static_cast<std::int32_t>(table.revision);
  message.hash = table.hash;
  return message;
}

void add(reply_t& reply, const std::vector<api::MotorResult>& motors) {
  std::vector<api::TableRef> told;
  for (const api::MotorResult& motor : motors) {
    reply.motors.push_back(motor.motor);
    reply.motor_results.emplace_back(api::word(motor.outcome));
    reply.position_steps.push_back(motor.position_steps);
    const auto found = std::ranges::find(told, motor.table);
    reply.table_of_motor.push_back(static_cast<std::int16_t>(found - told.begin()));
    if (found != told.end()) continue;
    told.push_back(motor.table);
    reply.tables.push_back(message_of(motor.table));
  }
}

void add(reply_t& reply, const api::MovePlan& plan) {
  move_plan_t message{};
  message.duration_us = plan.duration_us;
  message.ticks = plan.ticks;
  message.frames = plan.traffic ? plan.traffic->frames : -1;
  message.bytes = plan.traffic ? plan.traffic->bytes : -1;
  for (const api::MovePlan::Motor& motor : plan.motors) {
    message.motors.push_back(motor.motor);
    message.steps.push_back(motor.steps);
    message.motor_duration_us.push_back(motor.duration_us);
    message.peak_steps_per_s.push_back(motor.peak_steps_per_s);
  }
  message.motor_count = static_cast<std::int32_t>(message.motors.size());
  reply.plan.push_back(std::move(message));
}

void fill(reply_t& reply, const api::Accepted&) {
  reply.phase = reply_t::ACCEPTED;
  reply.reason = "accepted";
}

void fill(reply_t& reply, const api::Refused& refused) {
  reply.phase = reply_t::REFUSED;
  reply.result = "refused";
  reply.reason = refused.reason;
}

void fill(reply_t& reply, const api::Completed& completed) {
  reply.phase = reply_t::RESULT;
  reply.result = api::word(completed.outcome);
  reply.reason = completed.reason;
  if (const auto* motors = std::get_if<std::vector<api::MotorResult>>(&completed.detail)) {
    add(reply, *motors);
  }
  if (const auto* plan = std::get_if<api::MovePlan>(&completed.detail)) add(reply, *plan);
}

motor_state_t message_of(const api::MotorState& motor, const api::MotorDescription& description) {
  motor_state_t message;
  message.name = motor.name;
  message.group = description.group;
  message.table = message_of(description.table);
  message.output = description.output;
  message.position_steps = motor.position_steps;
  message.target_steps = motor.target_steps;
  message.velocity_steps_per_s = motor.velocity_steps_per_s;
  message.armed = motor.activity == api::Activity::kArmed;
  message.moving = motor.moving;
  message.activity = message.armed ? "rest" : api::word(motor.activity);
  message.enabled = motor.enabled;
  message.input = motor.input;
  message.forbidden = api::word(motor.inhibited);
  message.trust = api::word(motor.trust);
  return message;
}

mcu_health_t message_of(const api::McuHealth& health) {
  mcu_health_t message;
  message.mcu = health.mcu;
  message.address = health.address;
  message.unique_id = health.unique_id;
  message.firmware_version = health.firmware_version;
  message.boot_number = health.boot;
  message.reset_cause = health.reset_cause;
  message.current = health.current;
  message.crc_errors = number(health.crc_errors);
  message.rejected_frames = number(health.rejected_frames);
  message.run_downs = number(health.ramp_downs);
  message.timeouts = number(health.timeouts);
  message.repeats = number(health.repeats);
  message.missed_ticks = number(health.missed_ticks);
  message.restarts = number(health.restarts);
  message.low_water_ticks = health.low_water_ticks.value_or(-1);
  message.rate_ppm = health.rate_ppm;
  message.clock_offset_us = health.clock_offset_us;
  message.two_masters = health.two_masters;
  return message;
}

}  // namespace

class LcmShim::Client final : public api::Session {
 public:
  Client(LcmShim& shim, const std::string& id)
      : Session(api::Transport::kLcm, id, true), shim_(shim) {}
  void answer(std::int64_t number, const api::Reply& reply) override {
    shim_.answer(client_id(), number, reply);
  }

 private:
  LcmShim& shim_;
};

LcmShim::LcmShim(const config::Config& config, LcmOutputs& outputs, std::uint16_t master)
    : config_(config), out_(outputs), core_(config, *this, master) {
  for ([[maybe_unused]] const config::Mcu& mcu : config.mcus) descriptions_.add();
}

void LcmShim::command(std::int64_t now_us, const command_t& command) {
  if (!valid_client_id(command.client_id)) {
    out_.log(LogLevel::kWarning,
             "a command without a usable client_id (1..64 printable characters) was dropped");
    return;
  }
  const api::Asker asker{std::make_shared<Client>(*this, command.client_id), command.number};
  switch (clients_.note(command.client_id, command.number)) {
    case ClientLog::Verdict::kRepeated:
      for (const reply_t& reply : clients_.replies(command.client_id, command.number)) {
        out_.reply(reply);
      }
      return;
    case ClientLog::Verdict::kTooOld:
      return asker.answer(
          api::Refused{"number " + std::to_string(command.number) +
                       " is not above the highest that this client has used; count up"});
    case ClientLog::Verdict::kNew:
      break;
  }
  const auto request = request_of(command);
  if (!request) return asker.answer(api::Refused{request.error().text()});
  core_.request(now_us, asker, *request);
}

void LcmShim::answer(const std::string& client_id, std::int64_t command, const api::Reply& answer) {
  reply_t reply{};
  reply.utime_us = out_.wall_clock_us();
  reply.client_id = client_id;
  reply.number = command;
  std::visit([&reply](const auto& said) { fill(reply, said); }, answer);
  reply.motor_count = static_cast<std::int32_t>(reply.motors.size());
  reply.table_count = static_cast<std::int32_t>(reply.tables.size());
  reply.plan_count = static_cast<std::int32_t>(reply.plan.size());
  clients_.record(reply);
  out_.reply(reply);
}

void LcmShim::publish(McuId mcu, const api::Description& description) {
  descriptions_[mcu] = description;
}

// The core publishes all MCUs in a row, beginning with the first.
void LcmShim::publish(McuId mcu, const api::StateSnapshot& state) {
  const api::Description& description = descriptions_[mcu];
  if (mcu == McuId{}) ++state_sequence_;
  state_t message;
  message.utime_us = out_.wall_clock_us();
  message.sequence = state_sequence_;
  message.part = static_cast<std::int32_t>(mcu.value);
  message.parts = static_cast<std::int32_t>(config_.mcus.size());
  message.bus = state.bus;
  message.mcu = state.mcu;
  message.address = description.address;
  message.mcu_state = api::word(state.state);
  message.detail = state.detail;
  message.inputs = state.inputs;
  message.boot_number = state.boot;
  message.tick = state.tick;
  message.rejected_commands = number(rejected_commands_);
  for (std::size_t i = 0; i < state.motors.size(); ++i) {
    message.motors.push_back(message_of(state.motors[i], description.motors[i]));
  }
  message.motor_count = static_cast<std::int32_t>(message.motors.size());
  out_.state(message);
}

void LcmShim::publish(BusId bus, const api::HealthSnapshot& health) {
  if (bus == BusId{}) ++health_sequence_;
  health_t message;
  message.utime_us = out_.wall_clock_us();
  message.sequence = health_sequence_;
  message.part = static_cast<std::int32_t>(bus.value);
  message.parts = static_cast<std::int32_t>(config_.buses.size());
  message.bus = health.bus;
  message.port_state = health.port_state;
  message.two_masters = health.two_masters;
  message.crc_errors = number(health.crc_errors);
  message.stray_frames = number(health.stray_frames);
  message.recent_latency_us = health.recent_latency_us;
  for (const api::HealthSnapshot::Latency& latency : health.latency) {
    message.latency_below_us.push_back(latency.below_us);
    message.latency_answers.push_back(number(latency.answers));
  }
  message.latency_count = static_cast<std::int32_t>(message.latency_answers.size());
  for (const api::McuHealth& mcu : health.mcus) message.mcus.push_back(message_of(mcu));
  message.mcu_count = static_cast<std::int32_t>(message.mcus.size());
  out_.health(message);
}

// table_request_t has its own way.
void LcmShim::serve_tables(const api::Asker& asker, const api::Request&) {
  asker.answer(api::Refused{"tables are asked for by table_request_t"});
}

}  // namespace bushd::daemon
