#include "daemon/fronts/socket_front.h"

#include <utility>

namespace bushd::daemon {

class SocketFront::SocketSession : public api::Session {
 public:
  SocketSession(SocketFront& front, Connection connection, std::string client_id,
                const api::Credentials& credentials)
      : Session(api::Transport::kSocket, std::move(client_id), true, credentials),
        front_(front),
        connection_(connection) {}

  void answer(std::int64_t number, const api::Reply& reply) override {
    front_.answer(connection_, client_id(), number, reply);
  }
  bool gone() const override { return gone_; }
  void is_gone() { gone_ = true; }

 private:
  SocketFront& front_;
  Connection connection_;  // never used again: after its end this is nobody's
  bool gone_ = false;
};

SocketFront::SocketFront(control::Server& server, std::int64_t run, Reception& reception,
                         Publishing& publishing, std::function<std::int64_t()> unix_us, Log log)
    : server_(server),
      run_(run),
      reception_(reception),
      publishing_(publishing),
      unix_us_(std::move(unix_us)),
      log_(std::move(log)) {
  server_.set_handlers(
      {.opened =
           [this](Connection connection, const api::Credentials& credentials,
                  const std::string& why_stops_only) {
             clients_.emplace(connection,
                              Client{.credentials = credentials, .why_stops_only = why_stops_only});
           },
       .packet = [this](Connection connection, control::View packet,
                        const control::Server::Sent& sent) { on_packet(connection, packet, sent); },
       .is_urgent = lcm::is_urgent_channel,
       .closed = [this](Connection connection) { on_closed(connection); },
       .noted = log_});
}

void SocketFront::step(std::int64_t now_us) {
  if (now_us < look_us_) return;
  look_us_ = now_us + kLookEveryUs;
  if (std::exchange(looking_, true)) return;
  look_([this] { return server_.in_place(); }, [this](bool in_place) { seen(in_place); });
}

void SocketFront::seen(bool in_place) {
  looking_ = false;
  if (in_place) return trouble_.clear();
  const auto restored = server_.restore();
  std::string trouble = restored ? "" : restored.error().text();
  if (restored && log_) {
    log_("control socket: its file " + server_.path() + " had been deleted; it is made again");
  } else if (trouble != trouble_ && log_) {
    log_("control socket: its file has been deleted, and cannot be made again: " + trouble);
  }
  trouble_ = std::move(trouble);
}

SocketFront::~SocketFront() {
  server_.set_handlers({});
}

void SocketFront::on_packet(Connection connection, control::View packet,
                            const control::Server::Sent& sent) {
  const auto message = lcm::decode_client_message(packet.channel, packet.payload);
  Client& client = clients_.at(connection);
  if (!message) return server_.reject(connection);
  if (const auto* subscription = std::get_if<lcm::Subscription>(&message->content)) {
    client.subscription = *subscription;
    return;
  }
  if (!known(connection, client, message->id)) return;
  const lcm::RequestId& id = message->id;
  if (const auto* hello = std::get_if<lcm::Hello>(&message->content)) {
    on_hello(connection, *hello);
  } else if (std::holds_alternative<lcm::GetStatus>(message->content)) {
    for (const lcm::Packet* newest : publishing_.newest()) send(connection, *newest);
    answer(connection, id.client_id, id.number, api::done("told"));
  } else if (const auto& request = std::get<api::Request>(message->content);
             !client.why_stops_only.empty() && !api::ends_motion(request)) {
    answer(connection, id.client_id, id.number,
           api::Refused{"this connection may stop motors and no more: " + client.why_stops_only +
                        "; close some of them, and connect again"});
  } else {
    reception_.take({.session = client.session, .number = id.number}, request,
                    packet.payload.size(),
                    Arrival{.earliest_ns = sent.earliest_ns,
                            .latest_ns = sent.latest_ns,
                            .stream = -static_cast<std::int64_t>(connection)});
  }
}

void SocketFront::on_closed(Connection connection) {
  const auto client = clients_.find(connection);
  if (client->second.session) client->second.session->is_gone();
  clients_.erase(client);
}

// A connection has one name for its life: answers and logs name it.
bool SocketFront::known(Connection connection, Client& client, const lcm::RequestId& id) {
  if (!api::is_client_id(id.client_id)) {
    server_.reject(connection);
    return false;
  }
  if (!client.session) {
    client.session =
        std::make_shared<SocketSession>(*this, connection, id.client_id, client.credentials);
  }
  if (client.session->client_id() == id.client_id) return true;
  answer(connection, id.client_id, id.number,
         api::Refused{"this connection is that of client_id " + client.session->client_id() +
                      ", by its first request; open one for each client_id, or use one name"});
  return false;
}

// Not needed here, but a client need not know that.
void SocketFront::on_hello(Connection connection, const lcm::Hello& hello) {
  const lcm::Welcome welcome{
      .hello = hello, .run = run_, .session = static_cast<std::int64_t>(connection)};
  if (const auto packet = lcm::encode(unix_us_(), welcome)) send(connection, *packet);
}

void SocketFront::answer(Connection connection, const std::string& client_id, std::int64_t number,
                         const api::Reply& reply) {
  const lcm::RequestId id{
      .session = static_cast<std::int64_t>(connection), .client_id = client_id, .number = number};
  auto packets = lcm::encode(unix_us_(), id, reply);
  if (!packets) packets = lcm::encode(unix_us_(), id, api::Refused{packets.error().text()});
  if (!packets) return;
  for (const lcm::Packet& packet : *packets) send(connection, packet);
}

void SocketFront::send(Connection connection, const lcm::Packet& packet) {
  server_.send(connection,
               std::make_shared<const std::vector<std::uint8_t>>(control::packet_of(packet)));
}

void SocketFront::hear(Topic topic, const lcm::Packet& packet) {
  server_.set_largest_answer(publishing_.newest_bytes());
  std::shared_ptr<const std::vector<std::uint8_t>> shared;  // made once for all
  for (const auto& [connection, client] : clients_) {
    const bool wanted = topic == Topic::kState         ? client.subscription.state
                        : topic == Topic::kDescription ? client.subscription.description
                                                       : client.subscription.health;
    if (!wanted) continue;
    if (!shared) {
      shared = std::make_shared<const std::vector<std::uint8_t>>(control::packet_of(packet));
    }
    server_.send(connection, shared);
  }
}

}  // namespace bushd::daemon
