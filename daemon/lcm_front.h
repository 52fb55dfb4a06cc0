// The front end on LCM: everybody on the network, known by sessions.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "api/sessions.h"
#include "daemon/publishing.h"
#include "daemon/reception.h"
#include "lcm/transport.h"

namespace bushd::daemon {

class LcmFront : public Listener {
 public:
  struct Setup {
    lcm::Transport& transport;
    // For stops alone, with nothing else before them; null: `transport` takes those too.
    lcm::Transport* stops = nullptr;
    std::string prefix;
    bool commands = true;    // false: publishes only
    std::int64_t run = 0;    // of the daemon
    std::uint64_t seed = 0;  // of the sessions' numbers
  };
  // Everything outlives this.
  LcmFront(Setup setup, Reception& reception, Publishing& publishing,
           std::function<std::int64_t()> unix_us);

  Result<void> subscribe();
  void handle();
  void hear(Topic, const lcm::Packet& packet) override { publish(packet); }

  std::uint64_t dropped() const;
  // Whether LCM took the last message; why not.
  const std::string& trouble() const { return trouble_; }
  // Messages of daemons that are not this one, and a bus of the one heard last.
  std::uint64_t others_heard() const { return others_heard_; }
  const std::string& other_bus() const { return other_bus_; }

 private:
  class LcmSession;

  void on_message(std::string_view channel, lcm::Payload payload);
  void on_description(lcm::Payload payload);
  void on_request(const lcm::RequestId& id, const api::Request& request, std::size_t bytes);
  void answer(const lcm::RequestId& id, bool record, const api::Reply& reply);
  void publish(const lcm::Packet& packet);

  Setup setup_;
  Reception& reception_;
  Publishing& publishing_;
  std::function<std::int64_t()> unix_us_;
  api::Sessions sessions_;
  std::uint64_t dropped_ = 0;
  std::string trouble_;
  std::uint64_t others_heard_ = 0;
  std::string other_bus_;
};

}  // namespace bushd::daemon
