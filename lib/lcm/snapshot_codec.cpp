// What the daemon publishes.
#include "lcm/snapshot_codec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "lcm/packet.h"
#include "lcm/wire.h"

namespace bushd::lcm {
namespace {

std::int64_t number(std::uint64_t counted) {
  return static_cast<std::int64_t>(counted);
}
std::uint64_t counted(std::int64_t number) {
  return static_cast<std::uint64_t>(number);
}

void put_part(auto& message, const Part& part) {
  message.utime_us = part.utime_us;
  message.sequence = part.sequence;
  message.part = part.part;
  message.parts = part.parts;
  if constexpr (requires { message.run; }) message.run = part.run;
}

Part part_of(const auto& message) {
  Part part{.utime_us = message.utime_us,
            .sequence = message.sequence,
            .part = message.part,
            .parts = message.parts};
  if constexpr (requires { message.run; }) part.run = message.run;
  return part;
}

motor_t message_of(const api::MotorState& motor) {
  motor_t message{};
  message.name = motor.name;
  message.position_steps = motor.position_steps;
  message.user_position = motor.user;
  message.dial_position = motor.dial;
  message.user_target = motor.user_target;
  message.target_steps = motor.target_steps;
  message.velocity_steps_per_s = motor.velocity_steps_per_s;
  message.moving = motor.moving ? 1 : 0;
  message.activity = word(motor.activity);
  message.enabled = motor.enabled ? 1 : 0;
  message.input = motor.input ? 1 : 0;
  message.inputs = motor.inputs;
  message.inhibited = word(motor.inhibited);
  message.trust = word(motor.trust);
  message.uncertain_reason = motor.uncertain_reason;
  message.heard_utime_us = motor.heard_utime_us.value_or(0);
  message.paused = motor.paused ? 1 : 0;
  message.held = motor.held ? 1 : 0;
  message.armed_by = motor.armed_by;
  message.on_line = motor.line ? 1 : 0;
  if (motor.line) {
    message.line_fraction = motor.line->fraction;
    message.line_left_s = static_cast<double>(motor.line->left_us) * 1e-6;
  }
  return message;
}

std::optional<api::MotorState> state_of(const motor_t& message) {
  const auto activity = api::activity_of(message.activity);
  const auto inhibited = api::directions_of(message.inhibited);
  const auto trust = api::trust_of(message.trust);
  if (!activity || !inhibited || !trust) return std::nullopt;
  std::optional<std::int64_t> heard_utime_us;
  if (message.heard_utime_us != 0) heard_utime_us = message.heard_utime_us;
  std::optional<api::MotorState::Line> line;
  if (message.on_line != 0) {
    // What hostile numbers make of it need only be some number.
    const double left_us = std::clamp(message.line_left_s, 0.0, 1e9) * 1e6;
    line = {.fraction = message.line_fraction,
            .left_us = std::isnan(left_us) ? 0 : std::llround(left_us)};
  }
  return api::MotorState{.name = message.name,
                         .position_steps = message.position_steps,
                         .user = message.user_position,
                         .dial = message.dial_position,
                         .target_steps = message.target_steps,
                         .user_target = message.user_target,
                         .velocity_steps_per_s = message.velocity_steps_per_s,
                         .activity = *activity,
                         .moving = message.moving != 0,
                         .enabled = message.enabled != 0,
                         .input = message.input != 0,
                         .inputs = message.inputs,
                         .inhibited = *inhibited,
                         .trust = *trust,
                         .uncertain_reason = message.uncertain_reason,
                         .heard_utime_us = heard_utime_us,
                         .paused = message.paused != 0,
                         .held = message.held != 0,
                         .armed_by = message.armed_by,
                         .line = line};
}

void put_scale(motor_description_t& message, const api::MotorDescription& motor) {
  const auto coordinates = units::Coordinates::make(motor.scale);
  message.description = motor.text;
  message.unit = motor.scale.unit;
  message.steps_per_unit = to_text(motor.scale.steps_per_unit);
  message.negative = motor.scale.negative ? 1 : 0;
  message.offset = motor.scale.offset;
  message.precision = static_cast<std::int8_t>(motor.scale.decimals.value_or(0));
  if (!motor.soft_limits || !coordinates) return;
  message.soft_limits = 1;
  message.dial_low = motor.soft_limits->low;
  message.dial_high = motor.soft_limits->high;
  const units::SoftLimits user = coordinates->on_user_scale(*motor.soft_limits);
  message.user_low = user.low;
  message.user_high = user.high;
}

std::optional<api::MotorDescription> description_of(const motor_description_t& message) {
  const auto steps_per_unit = units::parse_ratio(message.steps_per_unit);
  if (!steps_per_unit) return std::nullopt;
  if (message.output < 0 || message.output > std::numeric_limits<std::uint8_t>::max()) {
    return std::nullopt;
  }
  if (message.precision < 0 || message.precision > units::Coordinates::kMostDecimals) {
    return std::nullopt;
  }
  auto coordinates = units::Coordinates::make({.unit = message.unit,
                                               .steps_per_unit = *steps_per_unit,
                                               .negative = message.negative != 0,
                                               .offset = message.offset,
                                               .decimals = message.precision});
  if (!coordinates) return std::nullopt;
  api::MotorDescription out{.name = message.name,
                            .output = static_cast<std::uint8_t>(message.output),
                            .group = message.group,
                            .table = ref_of(message.table),
                            .text = message.description,
                            .scale = coordinates->scale(),
                            .soft_limits = {}};
  if (message.soft_limits == 0) return out;
  if (!std::isfinite(message.dial_low) || !std::isfinite(message.dial_high)) return std::nullopt;
  out.soft_limits = units::SoftLimits{message.dial_low, message.dial_high};
  return out;
}

mcu_health_t message_of(const api::McuHealth& health) {
  mcu_health_t message{};
  message.mcu = health.mcu;
  message.address = health.address;
  message.unique_id = health.unique_id;
  message.firmware_version = health.firmware_version;
  message.boot_number = health.boot;
  message.reset_cause = health.reset_cause;
  message.current = health.current;
  message.crc_errors = number(health.crc_errors);
  message.rejected_frames = number(health.rejected_frames);
  message.ramp_downs = number(health.ramp_downs);
  message.timeouts = number(health.timeouts);
  message.repeats = number(health.repeats);
  message.missed_ticks = number(health.missed_ticks);
  message.restarts = number(health.restarts);
  message.low_water_ticks = health.low_water_ticks.value_or(-1);
  message.rate_ppm = health.rate_ppm;
  message.clock_offset_us = health.clock_offset_us;
  message.two_masters = health.two_masters ? 1 : 0;
  return message;
}

api::McuHealth health_of(const mcu_health_t& message) {
  api::McuHealth health{.mcu = message.mcu,
                        .address = message.address,
                        .unique_id = message.unique_id,
                        .firmware_version = message.firmware_version,
                        .boot = message.boot_number,
                        .reset_cause = message.reset_cause,
                        .current = message.current,
                        .crc_errors = counted(message.crc_errors),
                        .rejected_frames = counted(message.rejected_frames),
                        .ramp_downs = counted(message.ramp_downs),
                        .timeouts = counted(message.timeouts),
                        .repeats = counted(message.repeats),
                        .missed_ticks = counted(message.missed_ticks),
                        .restarts = counted(message.restarts),
                        .low_water_ticks = {},
                        .rate_ppm = message.rate_ppm,
                        .clock_offset_us = message.clock_offset_us,
                        .two_masters = message.two_masters != 0};
  if (message.low_water_ticks >= 0) health.low_water_ticks = message.low_water_ticks;
  return health;
}

std::optional<DaemonMessage> decode_state(Payload payload) {
  const auto message = decode<mcu_state_t>(payload);
  if (!message) return std::nullopt;
  const auto state = api::mcu_state_of(message->state);
  if (!state) return std::nullopt;
  StateMessage out;
  out.part = part_of(*message);
  out.dropped_messages = message->dropped_messages;
  out.snapshot = {.bus = message->bus,
                  .mcu = message->mcu,
                  .state = *state,
                  .detail = message->detail,
                  .inputs = message->inputs,
                  .boot = message->boot_number,
                  .tick = message->tick,
                  .motors = {}};
  for (const motor_t& motor : message->motors) {
    auto one = state_of(motor);
    if (!one) return std::nullopt;
    out.snapshot.motors.push_back(std::move(*one));
  }
  return out;
}

std::optional<DaemonMessage> decode_description(Payload payload) {
  const auto message = decode<mcu_description_t>(payload);
  if (!message) return std::nullopt;
  const bool ramps = message->emergency_stop == word(api::StopMode::kRamp);
  DescriptionMessage out{
      .part = part_of(*message),
      .snapshot = {.bus = message->bus,
                   .mcu = message->mcu,
                   .address = message->address,
                   .tick_ns = message->tick_ns,
                   .emergency_stop = ramps ? api::StopMode::kRamp : api::StopMode::kImmediate,
                   .port = message->port,
                   .motors = {}}};
  for (const motor_description_t& motor : message->motors) {
    auto one = description_of(motor);
    if (!one) return std::nullopt;
    out.snapshot.motors.push_back(std::move(*one));
  }
  return out;
}

std::optional<DaemonMessage> decode_health(Payload payload) {
  const auto message = decode<health_t>(payload);
  if (!message) return std::nullopt;
  HealthMessage out{.part = part_of(*message),
                    .snapshot = {.bus = message->bus,
                                 .port_state = message->port_state,
                                 .two_masters = message->two_masters != 0,
                                 .crc_errors = counted(message->crc_errors),
                                 .stray_frames = counted(message->stray_frames),
                                 .recent_latency_us = message->recent_latency_us,
                                 .latency = {},
                                 .mcus = {}}};
  for (std::size_t i = 0; i < message->latency_below_us.size(); ++i) {
    out.snapshot.latency.push_back({.below_us = message->latency_below_us[i],
                                    .answers = counted(message->latency_answers[i])});
  }
  for (const mcu_health_t& mcu : message->mcus) out.snapshot.mcus.push_back(health_of(mcu));
  return out;
}

std::optional<DaemonMessage> decode_camac_lam(Payload payload) {
  const auto message = decode<camac_lam_t>(payload);
  if (!message) return std::nullopt;
  return CamacLamMessage{.utime_us = message->utime_us,
                         .lam = {.crate = message->crate,
                                 .raised = static_cast<std::uint32_t>(message->raised),
                                 .requests = static_cast<std::uint32_t>(message->requests),
                                 .demand = message->demand != 0}};
}

using SnapshotDecoder = std::optional<DaemonMessage> (*)(Payload);

constexpr std::array<std::pair<std::string_view, SnapshotDecoder>, 10> kSnapshotDecoders = {{
    {"WELCOME", decode_welcome},
    {"REPLY", decode_answer},
    {"TABLE_REPLY", decode_table_answer},
    {"HISTORY_REPLY", decode_history_answer},
    {"CONFIGURATION_REPLY", decode_configuration_answer},
    {"CAMAC_REPLY", decode_camac_answer},
    {"STATE", decode_state},
    {"DESCRIPTION", decode_description},
    {"HEALTH", decode_health},
    {"CAMAC_LAM", decode_camac_lam},
}};

constexpr auto kDaemonChannels = [] {
  std::array<std::string_view, kSnapshotDecoders.size()> channels;
  for (std::size_t i = 0; i < channels.size(); ++i) channels[i] = kSnapshotDecoders[i].first;
  return channels;
}();

}  // namespace

table_ref_t message_of(const api::TableRef& table) {
  table_ref_t message{};
  message.name = table.name;
  message.revision = static_cast<std::int32_t>(table.revision);
  message.hash = table.hash;
  return message;
}

api::TableRef ref_of(const table_ref_t& message) {
  return {.name = message.name,
          .revision = message.revision > 0 ? static_cast<std::uint32_t>(message.revision) : 0,
          .hash = message.hash};
}

bushd::Result<Packet> encode(const Part& part, std::int64_t dropped_messages,
                             const api::StateSnapshot& state) {
  mcu_state_t message{};
  put_part(message, part);
  message.bus = state.bus;
  message.mcu = state.mcu;
  message.state = word(state.state);
  message.detail = state.detail;
  message.inputs = state.inputs;
  message.boot_number = state.boot;
  message.tick = state.tick;
  message.dropped_messages = dropped_messages;
  for (const api::MotorState& motor : state.motors) message.motors.push_back(message_of(motor));
  message.motor_count = count(message.motors);
  return packet("STATE", message);
}

bushd::Result<Packet> encode(const Part& part, const api::Description& description) {
  mcu_description_t message{};
  put_part(message, part);
  message.bus = description.bus;
  message.mcu = description.mcu;
  message.address = description.address;
  message.tick_ns = description.tick_ns;
  message.emergency_stop = word(description.emergency_stop);
  message.port = description.port;
  for (const api::MotorDescription& motor : description.motors) {
    motor_description_t one{};
    one.name = motor.name;
    one.output = motor.output;
    one.group = motor.group;
    one.table = message_of(motor.table);
    put_scale(one, motor);
    message.motors.push_back(std::move(one));
  }
  message.motor_count = count(message.motors);
  return packet("DESCRIPTION", message);
}

bushd::Result<Packet> encode(const Part& part, const api::HealthSnapshot& health) {
  health_t message{};
  put_part(message, part);
  message.bus = health.bus;
  message.port_state = health.port_state;
  message.two_masters = health.two_masters ? 1 : 0;
  message.crc_errors = number(health.crc_errors);
  message.stray_frames = number(health.stray_frames);
  message.recent_latency_us = health.recent_latency_us;
  for (const api::HealthSnapshot::Latency& latency : health.latency) {
    message.latency_below_us.push_back(latency.below_us);
    message.latency_answers.push_back(number(latency.answers));
  }
  message.latency_count = count(message.latency_answers);
  for (const api::McuHealth& mcu : health.mcus) message.mcus.push_back(message_of(mcu));
  message.mcu_count = count(message.mcus);
  return packet("HEALTH", message);
}

bushd::Result<Packet> encode(std::int64_t utime_us, const api::CamacLam& lam) {
  camac_lam_t message{};
  message.utime_us = utime_us;
  message.crate = lam.crate;
  message.raised = static_cast<std::int32_t>(lam.raised);
  message.requests = static_cast<std::int32_t>(lam.requests);
  message.demand = lam.demand ? 1 : 0;
  return packet("CAMAC_LAM", message);
}

std::span<const std::string_view> daemon_channels() {
  return kDaemonChannels;
}

std::optional<DaemonMessage> decode_daemon_message(std::string_view channel, Payload payload) {
  for (const auto& [name, decoder] : kSnapshotDecoders) {
    if (name == channel) return decoder(payload);
  }
  return std::nullopt;
}

}  // namespace bushd::lcm
