// What the daemon answers.
#include <algorithm>

#include "lcm/codec.h"
#include "lcm/snapshot_codec.h"
#include "lcm/table_codec.h"
#include "lcm/wire.h"

namespace bushd::lcm {
namespace {

constexpr int kMostDecimals = units::Coordinates::kMostDecimals;

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

std::int32_t count(const auto& elements) {
  return static_cast<std::int32_t>(elements.size());
}

std::string text(std::string_view word) {
  return std::string(word);
}

reply_header_t header(std::int64_t utime_us, const RequestId& id, const api::Reply& reply) {
  reply_header_t out{};
  out.utime_us = utime_us;
  out.session = id.session;
  out.client_id = id.client_id;
  out.number = id.number;
  std::visit(Overloaded{[&](const api::Accepted&) { out.phase = reply_header_t::ACCEPTED; },
                        [&](const api::Refused& refused) {
                          out.phase = reply_header_t::REFUSED;
                          out.reason = refused.reason;
                        },
                        [&](const api::Completed& completed) {
                          out.phase = reply_header_t::RESULT;
                          out.outcome = word(completed.outcome);
                          out.reason = completed.reason;
                        }},
             reply);
  return out;
}

move_plan_t plan_message(const api::MovePlan& plan) {
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
  message.motor_count = count(plan.motors);
  return message;
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

// Each table is told once.
void put(answer_t& answer, const std::vector<api::MotorResult>& motors) {
  std::vector<api::TableRef> told;
  for (const api::MotorResult& motor : motors) {
    answer.motors.push_back(motor.motor);
    answer.outcomes.push_back(text(word(motor.outcome)));
    answer.position_steps.push_back(motor.position_steps);
    answer.user_positions.push_back(motor.user);
    answer.dial_positions.push_back(motor.dial);
    answer.units.push_back(motor.unit);
    answer.precisions.push_back(static_cast<std::int8_t>(motor.precision));
    const auto table = std::find(told.begin(), told.end(), motor.table);
    answer.table_of_motor.push_back(static_cast<std::int16_t>(table - told.begin()));
    if (table != told.end()) continue;
    told.push_back(motor.table);
    answer.tables.push_back(message_of(motor.table));
  }
  answer.motor_count = count(answer.motors);
  answer.table_count = count(answer.tables);
}

template <class Message>
bushd::Result<Packet> packet(const char* channel, const Message& message) {
  auto payload = encode(message);
  if (!payload) return fail(payload.error());
  return Packet{.channel = channel, .payload = std::move(*payload)};
}

table_entry_t entry_message(const api::TableEntry& entry) {
  table_entry_t message{};
  message.name = entry.name;
  message.table = message_of(entry.table);
  message.fault = entry.fault;
  message.codes = entry.codes;
  message.start_steps_per_s = entry.start_steps_per_s;
  message.max_steps_per_s = entry.max_steps_per_s;
  return message;
}

bushd::Result<Packet> encode_list(table_answer_t answer, const api::TableList& list) {
  constexpr std::size_t kRoomForReason = 64;
  std::size_t size = static_cast<std::size_t>(answer.getEncodedSize()) + kRoomForReason;
  for (const api::TableEntry& entry : list.entries) {
    const table_entry_t message = entry_message(entry);
    size += static_cast<std::size_t>(message._getEncodedSizeNoHash());
    if (size > kMaxMessageBytes) break;
    answer.entries.push_back(message);
  }
  answer.entry_count = count(answer.entries);
  if (const std::size_t left = list.entries.size() - answer.entries.size(); left > 0) {
    answer.reply.reason = std::to_string(left) + " more do not fit one message";
  }
  return packet("TABLE_REPLY", answer);
}

bushd::Result<Packet> encode_content(table_answer_t answer, const tables::TableContent& content) {
  answer.tables.push_back(message_of(content));
  answer.table_count = 1;
  return packet("TABLE_REPLY", answer);
}

api::TableEntry entry_of(const table_entry_t& message) {
  return {.name = message.name,
          .fault = message.fault,
          .table = ref_of(message.table),
          .codes = message.codes,
          .start_steps_per_s = message.start_steps_per_s,
          .max_steps_per_s = message.max_steps_per_s};
}

std::optional<ReplyMessage> with_phase(const reply_header_t& header) {
  ReplyMessage out{
      .id = {.session = header.session, .client_id = header.client_id, .number = header.number},
      .reply = api::Accepted{}};
  if (header.phase == reply_header_t::ACCEPTED) return out;
  if (header.phase == reply_header_t::REFUSED) {
    out.reply = api::Refused{header.reason};
    return out;
  }
  const auto outcome = api::outcome_of(header.outcome);
  if (header.phase != reply_header_t::RESULT || !outcome) return std::nullopt;
  out.reply = api::Completed{.outcome = *outcome, .reason = header.reason, .detail = {}};
  return out;
}

std::optional<std::vector<api::MotorResult>> motors_of(const answer_t& message) {
  std::vector<api::MotorResult> motors;
  for (std::size_t i = 0; i < message.motors.size(); ++i) {
    const auto outcome = api::outcome_of(message.outcomes[i]);
    const auto table = static_cast<std::size_t>(message.table_of_motor[i]);
    if (!outcome || message.table_of_motor[i] < 0 || table >= message.tables.size()) {
      return std::nullopt;
    }
    motors.push_back({.motor = message.motors[i],
                      .outcome = *outcome,
                      .position_steps = message.position_steps[i],
                      .user = message.user_positions[i],
                      .dial = message.dial_positions[i],
                      .unit = message.units[i],
                      .precision = std::clamp<int>(message.precisions[i], 0, kMostDecimals),
                      .table = ref_of(message.tables[table])});
  }
  return motors;
}

}  // namespace

bushd::Result<Packet> encode(std::int64_t utime_us, const RequestId& id, const api::Reply& reply) {
  answer_t answer{};
  answer.reply = header(utime_us, id, reply);
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return packet("REPLY", answer);
  table_answer_t table_answer{};
  table_answer.reply = answer.reply;
  return std::visit(
      Overloaded{[&](std::monostate) { return packet("REPLY", answer); },
                 [&](const std::vector<api::MotorResult>& motors) {
                   put(answer, motors);
                   return packet("REPLY", answer);
                 },
                 [&](const api::MovePlan& plan) {
                   answer.plan.push_back(plan_message(plan));
                   answer.plan_count = 1;
                   return packet("REPLY", answer);
                 },
                 [&](const api::TableList& list) { return encode_list(table_answer, list); },
                 [&](const tables::TableContent& content) {
                   return encode_content(table_answer, content);
                 }},
      completed->detail);
}

bushd::Result<Packet> encode(std::int64_t utime_us, const Welcome& welcome) {
  welcome_t message{};
  message.utime_us = utime_us;
  message.run = welcome.run;
  message.client_id = welcome.hello.client_id;
  message.nonce = welcome.hello.nonce;
  message.session = welcome.session;
  return packet("WELCOME", message);
}

std::optional<DaemonMessage> decode_answer(Payload payload) {
  const auto message = decode<answer_t>(payload);
  if (!message) return std::nullopt;
  auto out = with_phase(message->reply);
  if (!out) return std::nullopt;
  auto* completed = std::get_if<api::Completed>(&out->reply);
  if (completed == nullptr) return out;
  if (!message->plan.empty()) {
    completed->detail = plan_of(message->plan.front());
  } else if (!message->motors.empty()) {
    auto motors = motors_of(*message);
    if (!motors) return std::nullopt;
    completed->detail = std::move(*motors);
  }
  return out;
}

std::optional<DaemonMessage> decode_table_answer(Payload payload) {
  const auto message = decode<table_answer_t>(payload);
  if (!message) return std::nullopt;
  auto out = with_phase(message->reply);
  if (!out) return std::nullopt;
  auto* completed = std::get_if<api::Completed>(&out->reply);
  if (completed == nullptr) return out;
  if (!message->tables.empty()) {
    completed->detail = content_of(message->tables.front());
    return out;
  }
  api::TableList list;
  for (const table_entry_t& entry : message->entries) list.entries.push_back(entry_of(entry));
  completed->detail = std::move(list);
  return out;
}

std::optional<DaemonMessage> decode_welcome(Payload payload) {
  const auto message = decode<welcome_t>(payload);
  if (!message) return std::nullopt;
  return Welcome{.hello = {.client_id = message->client_id, .nonce = message->nonce},
                 .run = message->run,
                 .session = message->session};
}

}  // namespace bushd::lcm
