// What the daemon publishes, and all that it says.
#include <array>

#include "lcm/codec.h"
#include "lcm/messages.h"

namespace bushd::lcm {
namespace {

template <class Message>
std::optional<DaemonMessage> decode_as(Payload payload) {
  auto message = decode<Message>(payload);
  if (!message) return std::nullopt;
  return std::move(*message);
}

std::optional<DaemonMessage> decode_welcome(Payload payload) {
  auto message = decode<Timed<Welcome>>(payload);
  if (!message) return std::nullopt;
  return std::move(message->content);
}

}  // namespace

bushd::Result<Packet> encode(const Part& part, std::int64_t dropped_messages,
                             const api::StateSnapshot& state) {
  return packet("STATE", StateMessageOf<const api::StateSnapshot&>{part, dropped_messages, state});
}

bushd::Result<Packet> encode(const Part& part, const api::Description& description) {
  return packet("DESCRIPTION", SnapshotMessage<const api::Description&>{part, description});
}

bushd::Result<Packet> encode(const Part& part, const api::HealthSnapshot& health) {
  return packet("HEALTH", SnapshotMessage<const api::HealthSnapshot&>{part, health});
}

bushd::Result<Packet> encode(std::int64_t utime_us, const api::CamacLam& lam) {
  return packet("CAMAC_LAM", CamacLamMessage{utime_us, lam});
}

bushd::Result<Packet> encode(std::int64_t utime_us, const Welcome& welcome) {
  return packet("WELCOME", Timed<Welcome>{utime_us, welcome});
}

std::span<const std::string_view> daemon_channels() {
  static constexpr std::array<std::string_view, 11> kChannels = {
      "WELCOME",      "REPLY", "TABLE_REPLY", "HISTORY_REPLY", "CONFIGURATION_REPLY",
      "CAMAC_REPLY",  "STATE", "DESCRIPTION", "HEALTH",        "CAMAC_LAM",
      "PROGRAM_REPLY"};
  return kChannels;
}

std::optional<DaemonMessage> decode_daemon_message(std::string_view channel, Payload payload) {
  if (channel == "STATE") return decode_as<StateMessage>(payload);
  if (channel == "DESCRIPTION") return decode_as<DescriptionMessage>(payload);
  if (channel == "HEALTH") return decode_as<HealthMessage>(payload);
  if (channel == "CAMAC_LAM") return decode_as<CamacLamMessage>(payload);
  if (channel == "WELCOME") return decode_welcome(payload);
  return decode_reply(channel, payload);
}

}  // namespace bushd::lcm
