// What travels on each channel, as types that declare their fields (base/fields.h): what lib/api
// has, behind what each message begins with. For the codecs and their tests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "lcm/codec.h"
#include "lcm/wire.h"

namespace bushd::lcm {

struct RequestHeader {
  std::int64_t utime_us = 0;
  RequestId id;

  static constexpr std::string_view kName = "request";
  static constexpr std::string_view kMeaning =
      "Begins every request. An answer repeats session, client_id and number.";
  static void fields(auto& self, auto& visit) {
    visit({"utime_us", fields::Unit{"us since 1970"},
           "the client's clock; for logs, and to know stops that are repeated"},
          self.utime_us);
    RequestId::fields(self.id, visit);
  }
};
template <class Content>  // or a reference to it
struct RequestMessage {
  using Value = RequestMessage<std::remove_cvref_t<Content>>;
  RequestHeader request;
  Content content;
  using About = std::remove_cvref_t<Content>;
  static void fields(auto& self, auto& visit) {
    visit("request", self.request);
    std::remove_cvref_t<Content>::fields(self.content, visit);
  }
};

struct ReplyHeader {
  enum class Phase { kAccepted, kRefused, kResult };
  static constexpr fields::OneOf kPhase{{{"ACCEPTED"}, {"REFUSED"}, {"RESULT"}}};

  std::int64_t utime_us = 0;
  RequestId id;
  Phase phase = Phase::kAccepted;
  std::string outcome{};
  std::string reason{};
  std::int32_t part = 0;
  std::int32_t parts = 1;

  static constexpr std::string_view kName = "reply header";
  static constexpr std::string_view kMeaning =
      "Begins every answer. A request gets REFUSED and nothing more, or ACCEPTED and later exactly "
      "one RESULT.";
  static void fields(auto& self, auto& visit) {
    visit(kUtimeOfDaemon, self.utime_us);
    RequestId::fields(self.id, visit);
    visit("phase", self.phase, kPhase);
    visit({"outcome", "with RESULT: done, reached, stopped, limit, link, fault; else \"\""},
          self.outcome);
    visit({"reason", "names the motor and the cause; \"\" with ACCEPTED"}, self.reason);
    visit({"part", "0 .. parts - 1"}, self.part);
    visit({"parts",
           "1; a RESULT whose list is long comes in so many messages, in any order, that differ in "
           "`part`, their time and their piece of the list"},
          self.parts);
    visit.require(self.part >= 0 && self.part < self.parts);
  }
};

struct Answer {
  ReplyHeader reply;
  std::vector<api::MotorResult> motors{};
  std::vector<api::MovePlan> plan{};  // one or none

  static constexpr std::string_view kName = "answer";
  static constexpr std::string_view kMeaning =
      "Answers all requests but those that have an answer of their own: motors of a move, or its "
      "plan, or nothing.";
  static void fields(auto& self, auto& visit) {
    visit("reply", self.reply);
    visit.list({"motor_count", "with RESULT of a move; else 0"},
               {"motors", "what became of each, in the request's order"}, self.motors);
    visit.list({"plan_count", "1 with RESULT of a dry run, else 0"}, "plan", self.plan);
  }
  api::Detail detail() && {
    if (!plan.empty()) return std::move(plan.front());
    if (!motors.empty()) return std::move(motors);
    return {};
  }
};

struct TableAnswer {
  ReplyHeader reply;
  std::vector<api::TableEntry> entries{};
  std::vector<api::TableFile> tables{};  // one or none

  static constexpr std::string_view kName = "table answer";
  static constexpr std::string_view kMeaning =
      "Answers list_tables_t, get_table_t and set_table_t.";
  static void fields(auto& self, auto& visit) {
    visit("reply", self.reply);
    visit.list("entry_count",
               {"entries", "of list_tables_t all, in parts; of set_table_t the one, as it is now"},
               self.entries);
    visit.list("table_count", {"tables", "of get_table_t the one"}, self.tables);
  }
  api::Detail detail() && {
    if (!tables.empty()) return std::move(tables.front());
    return api::TableList{std::move(entries)};
  }
};

// An answer that has a channel of its own.
template <class Content>
struct AnswerWith {
  ReplyHeader reply;
  Content content;
  using About = Content;
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
  using About = Content;
  static void fields(auto& self, auto& visit) {
    visit({"utime_us", fields::Unit{"us since 1970"}, "the sender's clock"}, self.utime_us);
    Content::fields(self.content, visit);
  }
};

// That of a request: its name in capitals, with underscores.
std::string channel_of_request(std::string_view name);

// A message that is no request, and its channel.
template <class MessageType>
struct On {
  using Message = MessageType;
  std::string_view channel;
};
inline constexpr std::tuple kOfDaemon{On<Timed<Welcome>>{"WELCOME"},
                                      On<Answer>{"REPLY"},
                                      On<TableAnswer>{"TABLE_REPLY"},
                                      On<AnswerWith<api::MotionHistory>>{"HISTORY_REPLY"},
                                      On<AnswerWith<api::Configuration>>{"CONFIGURATION_REPLY"},
                                      On<AnswerWith<api::CamacResult>>{"CAMAC_REPLY"},
                                      On<StateMessage>{"STATE"},
                                      On<DescriptionMessage>{"DESCRIPTION"},
                                      On<HealthMessage>{"HEALTH"},
                                      On<CamacLamMessage>{"CAMAC_LAM"},
                                      On<AnswerWith<api::ProgramList>>{"PROGRAM_REPLY"}};
inline constexpr std::tuple kOfClients{On<Timed<Hello>>{"HELLO"}, On<Subscription>{"SUBSCRIBE"},
                                       On<RequestMessage<GetStatus>>{"GET_STATUS"}};

void for_each_message(const auto& all, auto&& use) {
  std::apply([&](const auto&... on) { (use(on), ...); }, all);
}

// A message that refers to what it tells has a `Value` that owns the same.
template <class T>
struct OwnerOf {
  using Type = T;
};
template <class T>
  requires requires { typename T::Value; }
struct OwnerOf<T> {
  using Type = typename T::Value;
};

// Precondition: it is no request.
template <class Message>
std::string_view channel_of() {
  std::string_view channel;
  const auto find = [&]<class M>(const On<M>& on) {
    if (std::is_same_v<M, typename OwnerOf<Message>::Type>) channel = on.channel;
  };
  for_each_message(kOfDaemon, find);
  for_each_message(kOfClients, find);
  return channel;
}

// An answer; nothing of another channel.
template <class Message>
inline constexpr bool kIsAnswer = requires(Message message) { std::move(message).detail(); };
std::optional<DaemonMessage> decode_reply(std::string_view channel, Payload payload);

template <class Message>
bushd::Result<Packet> packet(std::string_view channel, const Message& message) {
  auto payload = encode(channel, message);
  if (!payload) return fail(payload.error());
  return Packet{.channel = std::string(channel), .payload = std::move(*payload)};
}
template <class Message>
bushd::Result<Packet> packet(const Message& message) {
  return packet(channel_of<Message>(), message);
}

}  // namespace bushd::lcm
