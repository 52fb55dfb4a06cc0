// What the daemon answers.
#include <algorithm>
#include <iterator>
#include <utility>

#include "base/overloaded.h"
#include "lcm/codec.h"
#include "lcm/messages.h"

namespace bushd::lcm {
namespace {

ReplyHeader header(std::int64_t utime_us, const RequestId& id, const api::Reply& reply) {
  using Phase = ReplyHeader::Phase;
  ReplyHeader out{.utime_us = utime_us, .id = id};
  std::visit(Overloaded{[&](const api::Accepted&) { out.phase = Phase::kAccepted; },
                        [&](const api::Refused& refused) {
                          out.phase = Phase::kRefused;
                          out.reason = refused.reason;
                        },
                        [&](const api::Completed& completed) {
                          out.phase = Phase::kResult;
                          out.outcome = std::string(word(completed.outcome));
                          out.reason = completed.reason;
                        }},
             reply);
  return out;
}

// The list of a reply, which may be too long for one message.
auto& list_of(std::vector<api::MotorResult>& motors) {
  return motors;
}
auto& list_of(api::MovePlan& plan) {
  return plan.motors;
}
auto& list_of(api::TableList& list) {
  return list.entries;
}
auto& list_of(api::MotionHistory& history) {
  return history.motions;
}
auto& list_of(api::Configuration& configuration) {
  return configuration.settings;
}
auto& list_of(api::CamacResult& result) {
  return result.block.responses;
}
auto& list_of(api::ProgramList& list) {
  return list.programs;
}

// A reply of 2048 motors has three; who says more is not to be believed.
constexpr std::size_t kMaxParts = 64;

using Packets = bushd::Result<std::vector<Packet>>;

// In one message.
template <class Message>
Packets whole(const Message& message) {
  auto made = packet(message);
  if (!made) return fail(made.error());
  return std::vector<Packet>{std::move(*made)};
}

// In one message, or in as many as it takes, each with an equal piece of its list. `message_with`
// makes a message of a detail.
template <class Detail>
Packets in_parts(const Detail& detail, auto message_with) {
  bool good = true;
  const std::vector<std::uint8_t> bytes = bytes_of(message_with(detail), good);
  if (!good || bytes.size() <= kMaxMessageBytes) return whole(message_with(detail));
  Detail piece = detail;
  const auto list = std::exchange(list_of(piece), {});
  for (std::size_t parts = bytes.size() / kMaxMessageBytes + 1;; ++parts) {
    std::vector<Packet> packets;
    for (std::size_t part = 0; part < parts; ++part) {
      const auto at = [&](std::size_t i) {
        return list.begin() + static_cast<std::ptrdiff_t>(list.size() * i / parts);
      };
      list_of(piece).assign(at(part), at(part + 1));
      auto message = message_with(piece);
      message.reply.part = static_cast<std::int32_t>(part);
      message.reply.parts = static_cast<std::int32_t>(parts);
      auto made = packet(message);
      if (!made && parts < kMaxParts) break;  // too long: in more parts
      if (!made) return fail(made.error());
      packets.push_back(std::move(*made));
    }
    if (packets.size() == parts) return packets;
  }
}

template <class Message>
std::optional<DaemonMessage> decode_answer(Payload payload) {
  auto message = decode<Message>(payload);
  if (!message) return std::nullopt;
  ReplyHeader& header = message->reply;
  ReplyMessage out{.id = std::move(header.id),
                   .reply = api::Accepted{},
                   .part = header.part,
                   .parts = header.parts};
  if (header.phase == ReplyHeader::Phase::kRefused) {
    out.reply = api::Refused{std::move(header.reason)};
  }
  if (header.phase == ReplyHeader::Phase::kResult) {
    const auto outcome = api::outcome_of(header.outcome);
    if (!outcome) return std::nullopt;
    out.reply = api::Completed{.outcome = *outcome,
                               .reason = std::move(header.reason),
                               .detail = std::move(*message).detail()};
  }
  return out;
}

// Lists go on; of all else each part says the same.
void append(api::Reply& reply, api::Reply&& part) {
  auto* whole = std::get_if<api::Completed>(&reply);
  auto* more = std::get_if<api::Completed>(&part);
  if (whole == nullptr || more == nullptr) return;
  std::visit(
      []<class To, class From>(To& to, From& from) {
        if constexpr (std::is_same_v<To, From> && requires { list_of(to); }) {
          std::ranges::move(list_of(from), std::back_inserter(list_of(to)));
        }
      },
      whole->detail, more->detail);
}

}  // namespace

bushd::Result<std::vector<Packet>> encode(std::int64_t utime_us, const RequestId& id,
                                          const api::Reply& reply) {
  const ReplyHeader begin = header(utime_us, id, reply);
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return whole(Answer{begin});
  return std::visit(
      Overloaded{
          [&](std::monostate) { return whole(Answer{begin}); },
          [&](const std::vector<api::MotorResult>& motors) {
            return in_parts(motors, [&](const auto& piece) { return Answer{begin, piece}; });
          },
          [&](const api::MovePlan& plan) {
            return in_parts(plan, [&](const auto& piece) { return Answer{begin, {}, {piece}}; });
          },
          [&](const api::TableList& list) {
            return in_parts(list,
                            [&](const auto& piece) { return TableAnswer{begin, piece.entries}; });
          },
          [&](const api::TableFile& table) { return whole(TableAnswer{begin, {}, {table}}); },
          [&]<class Content>(const Content& content) {
            return in_parts(
                content, [&](const Content& piece) { return AnswerWith<Content>{begin, piece}; });
          }},
      completed->detail);
}

std::optional<DaemonMessage> decode_reply(std::string_view channel, Payload payload) {
  std::optional<DaemonMessage> reply;
  for_each_message(kOfDaemon, [&]<class Message>(const On<Message>& on) {
    if constexpr (kIsAnswer<Message>) {
      if (on.channel == channel) reply = decode_answer<Message>(payload);
    }
  });
  return reply;
}

std::optional<api::Reply> ReplyParts::add(ReplyMessage message) {
  if (message.parts > static_cast<std::int32_t>(kMaxParts)) return std::nullopt;
  parts_.try_emplace(message.part, std::move(message.reply));
  if (static_cast<std::int32_t>(parts_.size()) < message.parts) return std::nullopt;
  auto part = parts_.begin();
  api::Reply whole = std::move(part->second);
  while (++part != parts_.end()) append(whole, std::move(part->second));
  parts_.clear();
  return whole;
}

}  // namespace bushd::lcm
