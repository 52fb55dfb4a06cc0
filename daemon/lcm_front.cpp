#include "daemon/lcm_front.h"

#include <utility>

#include "base/printable.h"

namespace bushd::daemon {
namespace {

// Decoded in less than a millisecond.
constexpr std::size_t kBytesAtOnce = 64 * 1024;

}  // namespace

// One request's way back: all hear it, who asked knows it by session and number.
class LcmFront::LcmSession : public api::Session {
 public:
  LcmSession(LcmFront& front, lcm::RequestId id, bool record)
      : Session(api::Transport::kLcm, id.client_id, true),
        front_(front),
        id_(std::move(id)),
        record_(record) {}

  void answer(std::int64_t, const api::Reply& reply) override {
    front_.answer(id_, record_, reply);
  }

 private:
  LcmFront& front_;
  lcm::RequestId id_;
  bool record_;
};

LcmFront::LcmFront(Setup setup, Reception& reception, Publishing& publishing,
                   std::function<std::int64_t()> unix_us)
    : setup_(std::move(setup)),
      reception_(reception),
      publishing_(publishing),
      unix_us_(std::move(unix_us)),
      sessions_(setup_.seed) {}

Result<void> LcmFront::subscribe() {
  const auto listening = setup_.transport.subscribe_bytes(
      setup_.prefix + "_DESCRIPTION", [this](lcm::Payload payload) { on_description(payload); });
  if (!listening) return listening;
  if (!setup_.commands) return {};
  for (const std::string_view channel : lcm::client_channels()) {
    if (channel == "SUBSCRIBE") continue;  // all hear everything here
    lcm::Transport& transport =
        setup_.stops != nullptr && lcm::is_stop_channel(channel) ? *setup_.stops : setup_.transport;
    const auto subscribed = transport.subscribe_bytes(
        setup_.prefix + "_" + std::string(channel),
        [this, channel](lcm::Payload payload) { on_message(channel, payload); });
    if (!subscribed) return subscribed;
  }
  return {};
}

void LcmFront::handle() {
  if (setup_.stops != nullptr) setup_.stops->handle(kBytesAtOnce);
  setup_.transport.handle(kBytesAtOnce);
}

std::uint64_t LcmFront::dropped() const {
  return dropped_;
}

void LcmFront::on_message(std::string_view channel, lcm::Payload payload) {
  const auto message = lcm::decode_client_message(channel, payload);
  if (!message || !api::is_client_id(message->id.client_id)) {
    ++dropped_;
    return;
  }
  if (const auto* request = std::get_if<api::Request>(&message->content)) {
    on_request(message->id, *request, payload.size());
  } else if (const auto* hello = std::get_if<lcm::Hello>(&message->content)) {
    const lcm::Welcome welcome{.hello = *hello,
                               .run = setup_.run,
                               .session = sessions_.open(hello->client_id, hello->nonce)};
    if (const auto packet = lcm::encode(unix_us_(), welcome)) publish(*packet);
  } else if (std::holds_alternative<lcm::GetStatus>(message->content)) {
    publishing_.publish_newest();
    answer(message->id, false,
           api::Completed{.outcome = api::Outcome::kDone, .reason = "published", .detail = {}});
  }
}

// Its own come back to it, as to all.
void LcmFront::on_description(lcm::Payload payload) {
  const auto message = lcm::decode_daemon_message("DESCRIPTION", payload);
  const auto* of = message ? std::get_if<lcm::DescriptionMessage>(&*message) : nullptr;
  if (of == nullptr || of->part.run == setup_.run) return;
  ++others_heard_;
  other_bus_ = printable(of->snapshot.bus);
}

void LcmFront::on_request(const lcm::RequestId& id, const api::Request& request,
                          std::size_t bytes) {
  const auto ruling = sessions_.rule(id.session, id.client_id, id.number, request);
  if (ruling.reply) answer(id, false, *ruling.reply);
  if (!ruling.carry_out) return;
  reception_.take(
      {.session = std::make_shared<LcmSession>(*this, id, ruling.record), .number = id.number},
      request, bytes);
}

void LcmFront::answer(const lcm::RequestId& id, bool record, const api::Reply& reply) {
  if (record) sessions_.record(id.session, id.number, reply);
  auto packets = lcm::encode(unix_us_(), id, reply);
  if (!packets) packets = lcm::encode(unix_us_(), id, api::Refused{packets.error().text()});
  if (!packets) return;
  for (const lcm::Packet& packet : *packets) publish(packet);
}

void LcmFront::publish(const lcm::Packet& packet) {
  const auto published =
      setup_.transport.publish_bytes(setup_.prefix + "_" + packet.channel, packet.payload);
  trouble_ = published ? std::string() : published.error().text();
}

}  // namespace bushd::daemon
