// What clients say. The channel of a request is its name (api::name_of) in capitals, with
// underscores.
#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "lcm/codec.h"
#include "lcm/messages.h"

namespace bushd::lcm {
namespace {

using Decoder = std::optional<ClientMessage> (*)(Payload);

template <class Content>
std::optional<ClientMessage> decode_request(Payload payload) {
  auto message = decode<RequestMessage<Content>>(payload);
  if (!message) return std::nullopt;
  using Told = std::conditional_t<std::is_same_v<Content, GetStatus>, GetStatus, api::Request>;
  return ClientMessage{.id = std::move(message->request.id),
                       .utime_us = message->request.utime_us,
                       .content = Told(std::move(message->content))};
}

std::optional<ClientMessage> decode_hello(Payload payload) {
  auto message = decode<Timed<Hello>>(payload);
  if (!message) return std::nullopt;
  return ClientMessage{.id = {.client_id = message->content.client_id},
                       .content = std::move(message->content)};
}

std::optional<ClientMessage> decode_subscription(Payload payload) {
  const auto message = decode<Subscription>(payload);
  if (!message) return std::nullopt;
  return ClientMessage{.id = {}, .content = *message};
}

// A channel is urgent by what a request without values does: of jogs, that is their end.
static_assert(api::ends(api::Jog{}.motion()), "ends of jogs are urgent");

// Requests first, in the order of api::Request.
struct Channels {
  std::vector<std::string> names{};
  std::vector<std::string_view> views{};
  std::map<std::string_view, Decoder> decoders{};
  std::vector<std::string_view> urgent{};

  template <class... Content>
  explicit Channels(const std::variant<Content...>* /*requests*/)
      : names{channel_of_request(Content::kName)..., "HELLO", "SUBSCRIBE", "GET_STATUS"},
        views(names.begin(), names.end()) {
    const std::vector<Decoder> all{decode_request<Content>..., decode_hello, decode_subscription,
                                   decode_request<GetStatus>};
    for (std::size_t i = 0; i < all.size(); ++i) decoders.emplace(views[i], all[i]);
    const std::array ends{api::ends_motion(Content{})...};
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (ends[i]) urgent.push_back(views[i]);
    }
  }
};

const Channels& channels() {
  static const Channels channels(static_cast<const api::Request::variant*>(nullptr));
  return channels;
}

}  // namespace

std::string channel_of_request(std::string_view name) {
  std::string channel(name);
  for (char& c : channel) {  // not by toupper(): that depends on the program's locale
    if (c == ' ') c = '_';
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return channel;
}

std::span<const std::string_view> client_channels() {
  return channels().views;
}

std::span<const std::string_view> urgent_channels() {
  return channels().urgent;
}

bool is_urgent_channel(std::string_view channel) {
  return std::ranges::find(urgent_channels(), channel) != urgent_channels().end();
}

std::optional<ClientMessage> decode_client_message(std::string_view channel, Payload payload) {
  const auto decoder = channels().decoders.find(channel);
  return decoder == channels().decoders.end() ? std::nullopt : decoder->second(payload);
}

bushd::Result<Packet> encode(std::int64_t utime_us, const RequestId& id,
                             const api::Request& request) {
  return std::visit(
      [&]<class Content>(const Content& content) {
        return packet(client_channels()[request.index()],
                      RequestMessage<const Content&>{{utime_us, id}, content});
      },
      request);
}

bushd::Result<Packet> encode(std::int64_t utime_us, const RequestId& id, GetStatus) {
  return packet(RequestMessage<GetStatus>{{utime_us, id}, {}});
}

bushd::Result<Packet> encode(std::int64_t utime_us, const Hello& hello) {
  return packet(Timed<Hello>{utime_us, hello});
}

bushd::Result<Packet> encode(const Subscription& subscription) {
  return packet(subscription);
}

}  // namespace bushd::lcm
