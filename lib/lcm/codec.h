// Requests, replies and snapshots of lib/api as messages, and back. Both transports carry the same
// packets: LCM as a channel and a payload, the control socket as both in one packet.
//
// Channels are named without the prefix here: "MOVE", "REPLY", ...
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "api/snapshot.h"
#include "base/result.h"

namespace bushd::lcm {

using Payload = std::span<const std::uint8_t>;

struct Packet {
  std::string channel{};
  std::vector<std::uint8_t> payload{};
};

inline constexpr fields::Field kUtimeOfDaemon{"utime_us", fields::Unit{"us since 1970"},
                                              "the daemon's clock"};

// Whose request it is: what begins every request and is repeated in every answer.
struct RequestId {
  std::int64_t session = 0;
  std::string client_id{};
  std::int64_t number = 0;
  static void fields(auto& self, auto& visit) {
    visit({"session",
           "of this run of the daemon, as welcome_t gave it; on the control socket and with stops "
           "0 will do"},
          self.session);
    visit({"client_id", "1..64 printable characters without blanks"}, self.client_id);
    visit({"number", "the client's own count of requests in this session"}, self.number);
  }
  friend bool operator==(const RequestId&, const RequestId&) = default;
};

struct Hello {
  std::string client_id{};
  std::int64_t nonce = 0;

  static constexpr std::string_view kName = "hello";
  static constexpr std::string_view kMeaning =
      "Asks for a session; answered on <prefix>_WELCOME. May be repeated until it is answered.";
  static void fields(auto& self, auto& visit) {
    visit({"client_id", "1..64 printable characters without blanks"}, self.client_id);
    visit({"nonce",
           "random: the same client_id and nonce get the same session, another nonce another one"},
          self.nonce);
  }
};
struct Welcome {
  Hello hello;
  std::int64_t run = 0;
  std::int64_t session = 0;

  static constexpr std::string_view kName = "welcome";
  static constexpr std::string_view kMeaning = "Answers hello_t.";
  static void fields(auto& self, auto& visit) {
    visit({"run", "of the daemon, as in mcu_state_t"}, self.run);
    Hello::fields(self.hello, visit);
    visit({"session", "never 0"}, self.session);
  }
};
struct Subscription {
  bool state = false;
  bool description = false;
  bool health = false;

  static constexpr std::string_view kName = "subscribe";
  static constexpr std::string_view kMeaning =
      "On the control socket only: what this connection hears without asking, at first nothing.";
  static void fields(auto& self, auto& visit) {
    visit("state", self.state);
    visit("description", self.description);
    visit("health", self.health);
  }
};
struct GetStatus {
  static constexpr std::string_view kName = "get status";
  static constexpr std::string_view kMeaning =
      "Description, state and health at once, and then answer_t: on the control socket to who "
      "asks, else published.";
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
};

// All that a client may say.
struct ClientMessage {
  RequestId id;               // of a request, or of GetStatus
  std::int64_t utime_us = 0;  // of a request: the client's clock, the same in each repetition
  std::variant<Hello, Subscription, GetStatus, api::Request> content{};
};

// Channels that clients speak on, and those of them on which comes what ends motion
// (api::ends_motion).
std::span<const std::string_view> client_channels();
std::span<const std::string_view> urgent_channels();
bool is_urgent_channel(std::string_view channel);

// Nothing for a payload that is not exactly one message of the channel's type, and for a channel
// that clients do not speak on. What is in it is as wrong as it may be: the core looks at it.
std::optional<ClientMessage> decode_client_message(std::string_view channel, Payload payload);

// Fails where the message does not fit a packet, or a text contains a NUL.
bushd::Result<Packet> encode(std::int64_t utime_us, const RequestId& id,
                             const api::Request& request);
bushd::Result<Packet> encode(std::int64_t utime_us, const RequestId& id, GetStatus);
bushd::Result<Packet> encode(std::int64_t utime_us, const Hello& hello);
bushd::Result<Packet> encode(const Subscription& subscription);

// As many packets as it takes: a long list comes in parts.
bushd::Result<std::vector<Packet>> encode(std::int64_t utime_us, const RequestId& id,
                                          const api::Reply& reply);
bushd::Result<Packet> encode(std::int64_t utime_us, const Welcome& welcome);

// Which one of the snapshots that together are the whole.
struct Part {
  std::int64_t utime_us = 0;
  std::int64_t run = 0;
  std::int64_t sequence = 0;
  std::int32_t part = 0;
  std::int32_t parts = 1;
  static void fields(auto& self, auto& visit) {
    visit(kUtimeOfDaemon, self.utime_us);
    visit({"run", "of the daemon: another one tells of a restart"}, self.run);
    visit({"sequence", "of the message, growing within a run"}, self.sequence);
    visit({"part", "0 .. parts - 1"}, self.part);
    visit({"parts", "that together are the whole"}, self.parts);
  }
};
bushd::Result<Packet> encode(const Part& part, std::int64_t dropped_messages,
                             const api::StateSnapshot& state);
bushd::Result<Packet> encode(const Part& part, const api::Description& description);
bushd::Result<Packet> encode(const Part& part, const api::HealthSnapshot& health);

bushd::Result<Packet> encode(std::int64_t utime_us, const api::CamacLam& lam);

struct ReplyMessage {
  RequestId id;
  api::Reply reply;  // with its piece of the list
  std::int32_t part = 0;
  std::int32_t parts = 1;
};

// Puts a reply together again, whatever is lost, repeated and reordered.
class ReplyParts {
 public:
  // Returns the reply once the last of its parts has come.
  std::optional<api::Reply> add(ReplyMessage message);

 private:
  std::map<std::int32_t, api::Reply> parts_;
};
template <class Snapshot>  // or a reference to one
struct SnapshotMessage {
  using Value = SnapshotMessage<std::remove_cvref_t<Snapshot>>;
  Part part;
  Snapshot snapshot;
  using About = std::remove_cvref_t<Snapshot>;
  static void fields(auto& self, auto& visit) {
    Part::fields(self.part, visit);
    std::remove_cvref_t<Snapshot>::fields(self.snapshot, visit);
  }
};
template <class Snapshot>
struct StateMessageOf {
  using Value = StateMessageOf<std::remove_cvref_t<Snapshot>>;
  Part part;
  std::int64_t dropped_messages = 0;
  Snapshot snapshot;
  using About = std::remove_cvref_t<Snapshot>;
  static void fields(auto& self, auto& visit) {
    Part::fields(self.part, visit);
    visit({"dropped_messages", "that the daemon could not use so far: broken, hostile or too many"},
          self.dropped_messages);
    std::remove_cvref_t<Snapshot>::fields(self.snapshot, visit);
  }
};
using StateMessage = StateMessageOf<api::StateSnapshot>;
using DescriptionMessage = SnapshotMessage<api::Description>;
using HealthMessage = SnapshotMessage<api::HealthSnapshot>;

struct CamacLamMessage {
  std::int64_t utime_us = 0;
  api::CamacLam lam;
  using About = api::CamacLam;
  static void fields(auto& self, auto& visit) {
    visit(kUtimeOfDaemon, self.utime_us);
    api::CamacLam::fields(self.lam, visit);
  }
};

// All that the daemon may say.
using DaemonMessage = std::variant<Welcome, ReplyMessage, StateMessage, DescriptionMessage,
                                   HealthMessage, CamacLamMessage>;

std::span<const std::string_view> daemon_channels();

// Nothing for what is no message of the daemon's, nor for one with an unknown word in an
// enumeration.
std::optional<DaemonMessage> decode_daemon_message(std::string_view channel, Payload payload);
// What may be a description begins with it; the rest is not looked at.
std::optional<Part> part_of_description(Payload payload);

}  // namespace bushd::lcm
