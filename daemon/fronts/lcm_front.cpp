#include "daemon/fronts/lcm_front.h"

#include <fmt/format.h>

#include <utility>

#include "base/printable.h"

namespace bushd::daemon {
namespace {

// Decoded in less than a millisecond.
constexpr std::size_t kBytesAtOnce = 64 * 1024;
constexpr api::Sessions::Limits kWithoutSession{
    .sessions = 256, .idle_sessions = 1, .bytes_per_session = 64 * 1024, .bytes = 1024 * 1024};

}  // namespace

// One request's way back: all hear it, who asked knows it by session and number.
class LcmFront::LcmSession : public api::Session {
 public:
  LcmSession(LcmFront& front, lcm::RequestId id, Book book)
      : Session(api::Transport::kLcm, id.client_id, true),
        front_(front),
        id_(std::move(id)),
        book_(book) {}

  void answer(std::int64_t, const api::Reply& reply) override { front_.answer(id_, book_, reply); }

 private:
  LcmFront& front_;
  lcm::RequestId id_;
  Book book_;
};

LcmFront::LcmFront(Setup setup, Reception& reception, Publishing& publishing,
                   std::function<std::int64_t()> unix_us)
    : setup_(std::move(setup)),
      reception_(reception),
      publishing_(publishing),
      unix_us_(std::move(unix_us)),
      sessions_(setup_.seed),
      without_session_(setup_.seed, kWithoutSession) {}

Result<void> LcmFront::subscribe() {
  const auto listening = setup_.transport.subscribe(
      setup_.prefix + "_DESCRIPTION", [this](lcm::Payload payload) { on_description(payload); });
  if (!listening) return listening;
  if (!setup_.commands) return {};
  for (const std::string_view channel : lcm::client_channels()) {
    if (channel == "SUBSCRIBE") continue;  // all hear everything here
    const bool apart = setup_.stops != nullptr && lcm::is_urgent_channel(channel);
    if (const auto all = listen(setup_.transport, channel, apart ? Takes::kOthers : Takes::kAll);
        !all) {
      return all;
    }
    if (!apart) continue;
    if (const auto stops = listen(*setup_.stops, channel, Takes::kStops); !stops) return stops;
  }
  return {};
}

Result<void> LcmFront::listen(lcm::Transport& transport, std::string_view channel, Takes takes) {
  return transport.subscribe(setup_.prefix + "_" + std::string(channel),
                             [this, channel, takes, &transport](lcm::Payload payload) {
                               on_message(channel, payload, transport.received_utime_us(), takes);
                             });
}

void LcmFront::handle() {
  if (setup_.stops != nullptr) setup_.stops->handle(kBytesAtOnce);
  setup_.transport.handle(kBytesAtOnce);
}

std::uint64_t LcmFront::dropped() const {
  return dropped_;
}

void LcmFront::on_message(std::string_view channel, lcm::Payload payload, std::int64_t utime_us,
                          Takes takes) {
  const auto message = lcm::decode_client_message(channel, payload);
  const auto* request = message ? std::get_if<api::Request>(&message->content) : nullptr;
  const bool is_other = request != nullptr && !api::ends_motion(*request);
  if (takes != Takes::kAll && is_other != (takes == Takes::kOthers)) return;
  if (!message || !api::is_client_id(message->id.client_id)) {
    ++dropped_;
    return;
  }
  if (std::holds_alternative<api::Request>(message->content)) {
    on_request(*message, payload.size(), utime_us);
  } else if (const auto* hello = std::get_if<lcm::Hello>(&message->content)) {
    const lcm::Welcome welcome{.hello = *hello,
                               .run = setup_.run,
                               .session = sessions_.open(hello->client_id, hello->nonce)};
    if (const auto packet = lcm::encode(unix_us_(), welcome)) publish(*packet);
  } else if (std::holds_alternative<lcm::GetStatus>(message->content)) {
    publishing_.publish_newest();
    answer(message->id, {}, api::done("published"));
  }
}

// Its own come back to it, as to all; of many motors they are long.
void LcmFront::on_description(lcm::Payload payload) {
  const auto part = lcm::part_of_description(payload);
  if (!part || part->run == setup_.run) return;
  const auto message = lcm::decode_daemon_message("DESCRIPTION", payload);
  const auto* of = message ? std::get_if<lcm::DescriptionMessage>(&*message) : nullptr;
  if (of == nullptr) return;
  ++others_heard_;
  other_bus_ = printable(of->snapshot.bus);
}

// A repetition says the same session and time as the first one did. A client without a clock is
// taken at its word each time: better a stop too many.
api::Sessions::Ruling LcmFront::rule_without_session(const lcm::ClientMessage& message,
                                                     Book& book) {
  const auto& request = std::get<api::Request>(message.content);
  const std::uint64_t stops = reception_.stops();
  if (message.utime_us == 0 || !api::ends_motion(request)) {
    book = {};
    return {.carry_out = true, .after_stops = stops};
  }
  const std::string sender = fmt::format("{} {}", message.id.session, message.id.client_id);
  book = {&without_session_, without_session_.open(sender, message.utime_us)};
  return without_session_.rule(book.session, sender, message.id.number, request, stops);
}

void LcmFront::on_request(const lcm::ClientMessage& message, std::size_t bytes,
                          std::int64_t utime_us) {
  const lcm::RequestId& id = message.id;
  const auto& request = std::get<api::Request>(message.content);
  Book book{&sessions_, id.session};
  auto ruling = sessions_.rule(id.session, id.client_id, id.number, request, reception_.stops());
  // One that its session does not know of is not ordered by its number.
  const std::int64_t stream = ruling.record ? id.session : 0;
  if (ruling.carry_out && !ruling.record) ruling = rule_without_session(message, book);
  if (ruling.reply) answer(id, {}, *ruling.reply);
  if (!ruling.carry_out) return;
  constexpr std::int64_t kNsPerUs = 1000;
  const std::int64_t came_ns = utime_us * kNsPerUs;
  reception_.take(
      {.session = std::make_shared<LcmSession>(*this, id, ruling.record ? book : Book{}),
       .number = id.number,
       .after_stops = ruling.after_stops},
      request, bytes,
      Arrival{.earliest_ns = came_ns, .latest_ns = came_ns + kNsPerUs - 1, .stream = stream});
}

void LcmFront::answer(const lcm::RequestId& id, const Book& book, const api::Reply& reply) {
  if (book.sessions != nullptr) book.sessions->record(book.session, id.number, reply);
  auto packets = lcm::encode(unix_us_(), id, reply);
  if (!packets) packets = lcm::encode(unix_us_(), id, api::Refused{packets.error().text()});
  if (!packets) return;
  for (const lcm::Packet& packet : *packets) publish(packet);
}

void LcmFront::publish(const lcm::Packet& packet) {
  const auto published =
      setup_.transport.publish(setup_.prefix + "_" + packet.channel, packet.payload);
  trouble_ = published ? std::string() : published.error().text();
}

}  // namespace bushd::daemon
