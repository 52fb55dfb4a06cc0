// The front end on the control socket: every connection is a session by itself, and the kernel says
// whose it is.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>

#include "control/server.h"
#include "daemon/publishing.h"
#include "daemon/reception.h"

namespace bushd::daemon {

class SocketFront : public Listener {
 public:
  // Everything outlives this. `run` of the daemon.
  SocketFront(control::Server& server, std::int64_t run, Reception& reception,
              Publishing& publishing, std::function<std::int64_t()> unix_us);
  ~SocketFront() override;

  void handle() { server_.handle(); }
  void hear(Topic topic, const lcm::Packet& packet) override;
  std::uint64_t dropped() const { return server_.dropped(); }

 private:
  using Connection = control::Server::Connection;
  class SocketSession;
  struct Client {
    api::Credentials credentials;
    lcm::Subscription subscription{};
    std::shared_ptr<SocketSession> session{};  // from its first message with a name on
  };

  void on_packet(Connection connection, control::View packet, const control::Server::Sent& sent);
  void on_closed(Connection connection);
  void on_hello(Connection connection, const lcm::Hello& hello);
  bool known(Connection connection, Client& client, const std::string& client_id);
  void send(Connection connection, const lcm::Packet& packet);
  void answer(Connection connection, const std::string& client_id, std::int64_t number,
              const api::Reply& reply);

  control::Server& server_;
  std::int64_t run_;
  Reception& reception_;
  Publishing& publishing_;
  std::function<std::int64_t()> unix_us_;
  std::map<Connection, Client> clients_;
};

}  // namespace bushd::daemon
