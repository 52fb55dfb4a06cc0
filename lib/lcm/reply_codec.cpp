// What the daemon answers.
#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include "base/overloaded.h"
#include "lcm/camac_codec.h"
#include "lcm/codec.h"
#include "lcm/packet.h"
#include "lcm/snapshot_codec.h"
#include "lcm/table_codec.h"
#include "lcm/wire.h"

namespace bushd::lcm {
namespace {

constexpr int kMostDecimals = units::Coordinates::kMostDecimals;

std::string text(std::string_view word) {
  return std::string(word);
}

reply_header_t header(std::int64_t utime_us, const RequestId& id, const api::Reply& reply) {
  reply_header_t out{};
  out.utime_us = utime_us;
  out.session = id.session;
  out.client_id = id.client_id;
  out.number = id.number;
  out.parts = 1;
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

template <class T>
using Piece = std::span<const T>;

move_plan_t plan_message(const api::MovePlan& plan, Piece<api::MovePlan::Motor> motors) {
  move_plan_t message{};
  message.duration_us = plan.duration_us;
  message.ticks = plan.ticks;
  message.frames = plan.traffic ? plan.traffic->frames : -1;
  message.bytes = plan.traffic ? plan.traffic->bytes : -1;
  message.limited_by = plan.limited_by;
  for (const api::MovePlan::Motor& motor : motors) {
    message.motors.push_back(motor.motor);
    message.steps.push_back(motor.steps);
    message.motor_duration_us.push_back(motor.duration_us);
    message.peak_steps_per_s.push_back(motor.peak_steps_per_s);
  }
  message.motor_count = count(motors);
  message.points_us = plan.points_us;
  message.point_count = count(plan.points_us);
  return message;
}

api::MovePlan plan_of(const move_plan_t& message) {
  api::MovePlan plan;
  plan.duration_us = message.duration_us;
  plan.ticks = message.ticks;
  if (message.frames >= 0) {
    plan.traffic = api::MovePlan::Traffic{.frames = message.frames, .bytes = message.bytes};
  }
  plan.limited_by = message.limited_by;
  for (std::size_t i = 0; i < message.motors.size(); ++i) {
    plan.motors.push_back({.motor = message.motors[i],
                           .steps = message.steps[i],
                           .duration_us = message.motor_duration_us[i],
                           .peak_steps_per_s = message.peak_steps_per_s[i]});
  }
  plan.points_us = message.points_us;
  return plan;
}

// Each table is told once.
void put(answer_t& answer, Piece<api::MotorResult> motors) {
  std::vector<api::TableRef> told;
  for (const api::MotorResult& motor : motors) {
    answer.motors.push_back(motor.motor);
    answer.outcomes.push_back(text(word(motor.outcome)));
    answer.position_steps.push_back(motor.position_steps);
    answer.user_positions.push_back(motor.user);
    answer.dial_positions.push_back(motor.dial);
    answer.units.push_back(motor.unit);
    answer.precisions.push_back(static_cast<std::int8_t>(motor.precision));
    answer.asked_by.push_back(motor.who);
    answer.legs.push_back(static_cast<std::int8_t>(motor.legs));
    answer.most_steps_per_s.push_back(motor.most_steps_per_s);
    const auto table = std::find(told.begin(), told.end(), motor.table);
    answer.table_of_motor.push_back(static_cast<std::int16_t>(table - told.begin()));
    if (table != told.end()) continue;
    told.push_back(motor.table);
    answer.tables.push_back(message_of(motor.table));
  }
  answer.motor_count = count(answer.motors);
  answer.table_count = count(answer.tables);
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

past_motion_t motion_message(const api::PastMotion& motion) {
  past_motion_t message{};
  message.utime_us = motion.utime_us;
  message.what = motion.what;
  message.who = motion.who;
  message.from_steps = motion.from_steps;
  message.to_steps = motion.to_steps;
  message.outcome = motion.outcome;
  message.reason = motion.reason;
  message.from_text = motion.from_text;
  message.to_text = motion.to_text;
  return message;
}

// Of an array of strings.
std::size_t size_of(std::string_view string) {
  return sizeof(std::int32_t) + string.size() + 1;
}

// What an element takes in a message, or a little more: its table may have been told already.
std::size_t size_of(const api::MotorResult& motor) {
  const auto table = static_cast<std::size_t>(message_of(motor.table)._getEncodedSizeNoHash());
  return size_of(motor.motor) + size_of(word(motor.outcome)) + size_of(motor.unit) +
         size_of(motor.who) + sizeof(std::int64_t) + 3 * sizeof(double) + 2 * sizeof(std::int8_t) +
         sizeof(std::int16_t) + table;
}
std::size_t size_of(const api::MovePlan::Motor& motor) {
  return size_of(motor.motor) + 2 * sizeof(std::int64_t) + sizeof(double);
}
std::size_t size_of(const api::TableEntry& entry) {
  return static_cast<std::size_t>(entry_message(entry)._getEncodedSizeNoHash());
}

std::size_t size_of(const api::PastMotion& motion) {
  return static_cast<std::size_t>(motion_message(motion)._getEncodedSizeNoHash());
}

std::size_t size_of(const api::MotorSetting& setting) {
  return size_of(setting.motor) + size_of(setting.key) + size_of(setting.value) +
         size_of(setting.in_file);
}

std::size_t size_of(const camac::Response&) {
  return 2 * sizeof(std::int8_t) + sizeof(std::int32_t);
}

// A list in pieces that fit a message each, beside `rest` bytes. At least one piece, maybe empty.
template <class T>
std::vector<Piece<T>> pieces(const std::vector<T>& list, std::size_t rest) {
  std::vector<Piece<T>> out;
  std::size_t begin = 0;
  std::size_t size = rest;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::size_t more = size_of(list[i]);
    if (size + more > kMaxMessageBytes && i > begin) {
      out.push_back(Piece<T>(list).subspan(begin, i - begin));
      begin = i;
      size = rest;
    }
    size += more;
  }
  out.push_back(Piece<T>(list).subspan(begin));
  return out;
}

// A message for each piece; `put` puts it there.
template <class Answer, class T>
bushd::Result<std::vector<Packet>> in_parts(const char* channel, const Answer& answer,
                                            const std::vector<T>& list, auto put) {
  constexpr std::size_t kFixed = 256;  // what `put` adds beside the elements
  std::vector<Packet> out;
  const auto all = pieces(list, static_cast<std::size_t>(answer.getEncodedSize()) + kFixed);
  for (const Piece<T> piece : all) {
    Answer part = answer;
    part.reply.part = count(out);
    part.reply.parts = count(all);
    put(part, piece);
    auto made = packet(channel, part);
    if (!made) return fail(made.error());
    out.push_back(std::move(*made));
  }
  return out;
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
  if (header.part < 0 || header.part >= header.parts) return std::nullopt;
  ReplyMessage out{
      .id = {.session = header.session, .client_id = header.client_id, .number = header.number},
      .reply = api::Accepted{},
      .part = header.part,
      .parts = header.parts};
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
                      .table = ref_of(message.tables[table]),
                      .who = message.asked_by[i],
                      .legs = message.legs[i],
                      .most_steps_per_s = message.most_steps_per_s[i]});
  }
  return motors;
}

void put(configuration_answer_t& answer, Piece<api::MotorSetting> settings) {
  for (const auto& [motor, key, value, in_file] : settings) {
    answer.setting_motors.push_back(motor);
    answer.keys.push_back(key);
    answer.values.push_back(value);
    answer.values_in_file.push_back(in_file);
  }
  answer.setting_count = count(settings);
}

}  // namespace

bushd::Result<std::vector<Packet>> encode(std::int64_t utime_us, const RequestId& id,
                                          const api::Reply& reply) {
  answer_t answer{};
  answer.reply = header(utime_us, id, reply);
  table_answer_t table_answer{};
  table_answer.reply = answer.reply;
  history_answer_t history_answer{};
  history_answer.reply = answer.reply;
  configuration_answer_t configuration_answer{};
  configuration_answer.reply = answer.reply;
  camac_reply_t camac_answer{};
  camac_answer.reply = answer.reply;
  const auto alone = [&](const char* channel,
                         const auto& message) -> bushd::Result<std::vector<Packet>> {
    auto made = packet(channel, message);
    if (!made) return fail(made.error());
    return std::vector<Packet>{std::move(*made)};
  };
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return alone("REPLY", answer);
  return std::visit(
      Overloaded{
          [&](std::monostate) { return alone("REPLY", answer); },
          [&](const std::vector<api::MotorResult>& motors) {
            return in_parts("REPLY", answer, motors,
                            [](answer_t& part, auto piece) { put(part, piece); });
          },
          [&](const api::MovePlan& plan) {
            return in_parts("REPLY", answer, plan.motors, [&plan](answer_t& part, auto piece) {
              part.plan.push_back(plan_message(plan, piece));
              part.plan_count = 1;
            });
          },
          [&](const api::TableList& list) {
            return in_parts("TABLE_REPLY", table_answer, list.entries,
                            [](table_answer_t& part, auto piece) {
                              for (const auto& entry : piece) {
                                part.entries.push_back(entry_message(entry));
                              }
                              part.entry_count = count(piece);
                            });
          },
          [&](const api::MotionHistory& history) {
            return in_parts("HISTORY_REPLY", history_answer, history.motions,
                            [](history_answer_t& part, auto piece) {
                              for (const auto& motion : piece) {
                                part.motions.push_back(motion_message(motion));
                              }
                              part.motion_count = count(piece);
                            });
          },
          [&](const api::Configuration& configuration) {
            configuration_answer.path = configuration.path;
            configuration_answer.sha256 = configuration.sha256;
            return in_parts("CONFIGURATION_REPLY", configuration_answer, configuration.settings,
                            [](auto& part, auto piece) { put(part, piece); });
          },
          [&](const api::CamacResult& result) {
            put(camac_answer, result);
            return in_parts("CAMAC_REPLY", camac_answer, result.block.responses,
                            [](auto& part, auto piece) { put(part, piece); });
          },
          [&](const tables::TableContent& content) {
            table_answer.tables.push_back(message_of(content));
            table_answer.table_count = 1;
            return alone("TABLE_REPLY", table_answer);
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

std::optional<DaemonMessage> decode_history_answer(Payload payload) {
  const auto message = decode<history_answer_t>(payload);
  if (!message) return std::nullopt;
  auto out = with_phase(message->reply);
  if (!out) return std::nullopt;
  auto* completed = std::get_if<api::Completed>(&out->reply);
  if (completed == nullptr) return out;
  api::MotionHistory history;
  for (const past_motion_t& motion : message->motions) {
    history.motions.push_back({.utime_us = motion.utime_us,
                               .what = motion.what,
                               .who = motion.who,
                               .from_steps = motion.from_steps,
                               .to_steps = motion.to_steps,
                               .outcome = motion.outcome,
                               .reason = motion.reason,
                               .from_text = motion.from_text,
                               .to_text = motion.to_text});
  }
  completed->detail = std::move(history);
  return out;
}

std::optional<DaemonMessage> decode_configuration_answer(Payload payload) {
  const auto message = decode<configuration_answer_t>(payload);
  if (!message) return std::nullopt;
  auto out = with_phase(message->reply);
  if (!out) return std::nullopt;
  auto* completed = std::get_if<api::Completed>(&out->reply);
  if (completed == nullptr) return out;
  api::Configuration configuration{.path = message->path, .sha256 = message->sha256};
  for (std::size_t i = 0; i < message->setting_motors.size(); ++i) {
    configuration.settings.push_back({.motor = message->setting_motors[i],
                                      .key = message->keys[i],
                                      .value = message->values[i],
                                      .in_file = message->values_in_file[i]});
  }
  completed->detail = std::move(configuration);
  return out;
}

std::optional<DaemonMessage> decode_camac_answer(Payload payload) {
  const auto message = decode<camac_reply_t>(payload);
  if (!message) return std::nullopt;
  auto out = with_phase(message->reply);
  if (!out) return std::nullopt;
  auto* completed = std::get_if<api::Completed>(&out->reply);
  if (completed == nullptr) return out;
  completed->detail = result_of(*message);
  return out;
}

std::optional<DaemonMessage> decode_welcome(Payload payload) {
  const auto message = decode<welcome_t>(payload);
  if (!message) return std::nullopt;
  return Welcome{.hello = {.client_id = message->client_id, .nonce = message->nonce},
                 .run = message->run,
                 .session = message->session};
}

namespace {

void append(auto& list, auto&& more) {
  list.insert(list.end(), std::make_move_iterator(more.begin()),
              std::make_move_iterator(more.end()));
}

// Lists go on; of all else each part says the same.
void append(api::Reply& reply, api::Reply&& part) {
  auto* whole = std::get_if<api::Completed>(&reply);
  auto* more = std::get_if<api::Completed>(&part);
  if (whole == nullptr || more == nullptr) return;
  std::visit(
      Overloaded{[](std::vector<api::MotorResult>& to, std::vector<api::MotorResult>& from) {
                   append(to, from);
                 },
                 [](api::MovePlan& to, api::MovePlan& from) { append(to.motors, from.motors); },
                 [](api::TableList& to, api::TableList& from) { append(to.entries, from.entries); },
                 [](api::MotionHistory& to, api::MotionHistory& from) {
                   append(to.motions, from.motions);
                 },
                 [](api::Configuration& to, api::Configuration& from) {
                   append(to.settings, from.settings);
                 },
                 [](api::CamacResult& to, api::CamacResult& from) {
                   append(to.block.responses, from.block.responses);
                 },
                 [](auto&, auto&) {}},
      whole->detail, more->detail);
}

}  // namespace

std::optional<api::Reply> ReplyParts::add(ReplyMessage message) {
  // A reply of 2048 motors has three; who says more is not to be believed.
  constexpr std::int32_t kMaxParts = 64;
  if (message.parts > kMaxParts) return std::nullopt;
  parts_.try_emplace(message.part, std::move(message.reply));
  if (count(parts_) < message.parts) return std::nullopt;
  auto part = parts_.begin();
  api::Reply whole = std::move(part->second);
  while (++part != parts_.end()) append(whole, std::move(part->second));
  parts_.clear();
  return whole;
}

}  // namespace bushd::lcm
