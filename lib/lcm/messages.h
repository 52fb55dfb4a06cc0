// What travels on each channel, as types that declare their fields (base/fields.h): what lib/api
// has, behind what each message begins with. For the codecs and their tests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "lcm/codec.h"
#include "lcm/wire.h"

namespace bushd::lcm {

// Begins every request: request_t.
struct RequestHeader {
  std::int64_t utime_us = 0;
  RequestId id;
  static void fields(auto& self, auto& visit) {
    visit("utime_us", self.utime_us);
    RequestId::fields(self.id, visit);
  }
};
template <class Content>  // or a reference to it
struct RequestMessage {
  using Value = RequestMessage<std::remove_cvref_t<Content>>;
  RequestHeader request;
  Content content;
  static void fields(auto& self, auto& visit) {
    visit("request", self.request);
    std::remove_cvref_t<Content>::fields(self.content, visit);
  }
};

// Begins every answer: reply_header_t.
struct ReplyHeader {
  enum class Phase { kAccepted, kRefused, kResult };
  std::int64_t utime_us = 0;
  RequestId id;
  Phase phase = Phase::kAccepted;
  std::string outcome{};
  std::string reason{};
  std::int32_t part = 0;
  std::int32_t parts = 1;
  static void fields(auto& self, auto& visit) {
    visit("utime_us", self.utime_us);
    RequestId::fields(self.id, visit);
    visit("phase", self.phase, fields::OneOf<3>{});
    visit("outcome", self.outcome);
    visit("reason", self.reason);
    visit("part", self.part);
    visit("parts", self.parts);
    visit.require(self.part >= 0 && self.part < self.parts);
  }
};

// Channel REPLY: motors of a move, or its plan, or nothing.
struct Answer {
  ReplyHeader reply;
  std::vector<api::MotorResult> motors{};
  std::vector<api::MovePlan> plan{};  // one or none
  static void fields(auto& self, auto& visit) {
    visit("reply", self.reply);
    visit.list("motor_count", "motors", self.motors);
    visit.list("plan_count", "plan", self.plan);
  }
  api::Detail detail() && {
    if (!plan.empty()) return std::move(plan.front());
    if (!motors.empty()) return std::move(motors);
    return {};
  }
};

// Channel TABLE_REPLY: a list of tables, or a table.
struct TableAnswer {
  ReplyHeader reply;
  std::vector<api::TableEntry> entries{};
  std::vector<api::TableFile> tables{};  // one or none
  static void fields(auto& self, auto& visit) {
    visit("reply", self.reply);
    visit.list("entry_count", "entries", self.entries);
    visit.list("table_count", "tables", self.tables);
  }
  api::Detail detail() && {
    if (!tables.empty()) return std::move(tables.front());
    return api::TableList{std::move(entries)};
  }
};

// Channels HISTORY_REPLY, CONFIGURATION_REPLY, CAMAC_REPLY and PROGRAM_REPLY.
template <class Content>
struct AnswerWith {
  ReplyHeader reply;
  Content content;
  static void fields(auto& self, auto& visit) {
    visit("reply", self.reply);
    Content::fields(self.content, visit);
  }
  api::Detail detail() && { return std::move(content); }
};

// What has the time of its sender in front of it.
template <class Content>
struct Timed {
  std::int64_t utime_us = 0;
  Content content;
  static void fields(auto& self, auto& visit) {
    visit("utime_us", self.utime_us);
    Content::fields(self.content, visit);
  }
};

// An answer; nothing of another channel.
std::optional<DaemonMessage> decode_reply(std::string_view channel, Payload payload);

template <class Message>
bushd::Result<Packet> packet(std::string_view channel, const Message& message) {
  auto payload = encode(channel, message);
  if (!payload) return fail(payload.error());
  return Packet{.channel = std::string(channel), .payload = std::move(*payload)};
}

}  // namespace bushd::lcm
