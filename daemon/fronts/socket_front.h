// The front end on the control socket: every connection is a session by itself, and the kernel says
// whose it is.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "control/server.h"
#include "daemon/fronts/publishing.h"
#include "daemon/fronts/reception.h"

namespace bushd::daemon {

class SocketFront : public Listener {
 public:
  using Log = std::function<void(const std::string&)>;

  // Everything outlives this. `run` of the daemon. `log`: of what is wrong with clients, or with
  // the socket.
  SocketFront(control::Server& server, std::int64_t run, Reception& reception,
              Publishing& publishing, std::function<std::int64_t()> unix_us, Log log = {});
  ~SocketFront() override;

  // Who has a look at a file taken, and what was seen told, later: a disk may take its time.
  // Without it that is done at once.
  using Look = std::function<void(std::function<bool()> look, std::function<void(bool)> told)>;
  void set_look(Look look) { look_ = std::move(look); }

  void handle() { server_.handle(); }
  // Looks now and then whether the socket's file is there, and makes it again.
  void step(std::int64_t now_us);
  std::int64_t next_wake_us() const { return look_us_; }
  void hear(Topic topic, const lcm::Packet& packet) override;
  std::uint64_t dropped() const { return server_.dropped(); }

 private:
  using Connection = control::Server::Connection;
  static constexpr std::int64_t kLookEveryUs = 1'000'000;
  class SocketSession;
  struct Client {
    api::Credentials credentials;
    std::string why_stops_only;  // "": it may ask for everything
    lcm::Subscription subscription{};
    std::shared_ptr<SocketSession> session{};  // from its first message with a name on
  };

  void on_packet(Connection connection, control::View packet, const control::Server::Sent& sent);
  void on_closed(Connection connection);
  void seen(bool in_place);
  void on_hello(Connection connection, const lcm::Hello& hello);
  bool known(Connection connection, Client& client, const lcm::RequestId& id);
  void send(Connection connection, const lcm::Packet& packet);
  void answer(Connection connection, const std::string& client_id, std::int64_t number,
              const api::Reply& reply);

  control::Server& server_;
  std::int64_t run_;
  Reception& reception_;
  Publishing& publishing_;
  std::function<std::int64_t()> unix_us_;
  Log log_;
  std::map<Connection, Client> clients_;
  Look look_ = [](const std::function<bool()>& look, const std::function<void(bool)>& told) {
    told(look());
  };
  bool looking_ = false;
  std::int64_t look_us_ = 0;  // when to look for the socket's file again
  std::string trouble_;       // why it could not be made again
};

}  // namespace bushd::daemon
