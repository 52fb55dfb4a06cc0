// What the daemon publishes, and all that it says.
#include <array>
#include <tuple>
#include <utility>

#include "lcm/codec.h"
#include "lcm/messages.h"

namespace bushd::lcm {
namespace {

std::optional<DaemonMessage> told(Timed<Welcome>&& message) {
  return std::move(message.content);
}
std::optional<DaemonMessage> told(auto&& message) {
  return std::forward<decltype(message)>(message);
}

}  // namespace

bushd::Result<Packet> encode(const Part& part, std::int64_t dropped_messages,
                             const api::StateSnapshot& state) {
  return packet(StateMessageOf<const api::StateSnapshot&>{part, dropped_messages, state});
}

bushd::Result<Packet> encode(const Part& part, const api::Description& description) {
  return packet(SnapshotMessage<const api::Description&>{part, description});
}

bushd::Result<Packet> encode(const Part& part, const api::HealthSnapshot& health) {
  return packet(SnapshotMessage<const api::HealthSnapshot&>{part, health});
}

bushd::Result<Packet> encode(std::int64_t utime_us, const api::CamacLam& lam) {
  return packet(CamacLamMessage{utime_us, lam});
}

bushd::Result<Packet> encode(std::int64_t utime_us, const Welcome& welcome) {
  return packet(Timed<Welcome>{utime_us, welcome});
}

std::span<const std::string_view> daemon_channels() {
  static constexpr auto kChannels =
      std::apply([](const auto&... on) { return std::array{on.channel...}; }, kOfDaemon);
  return kChannels;
}

std::optional<DaemonMessage> decode_daemon_message(std::string_view channel, Payload payload) {
  std::optional<DaemonMessage> out;
  for_each_message(kOfDaemon, [&]<class Message>(const On<Message>& on) {
    if constexpr (!kIsAnswer<Message>) {
      if (on.channel != channel) return;
      if (auto message = decode<Message>(payload)) out = told(std::move(*message));
    }
  });
  return out ? out : decode_reply(channel, payload);
}

std::optional<Part> part_of_description(Payload payload) {
  return decode_first<DescriptionMessage, Part>(payload);
}

}  // namespace bushd::lcm
