// The front end on LCM: everybody on the network, known by sessions.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "api/sessions.h"
#include "daemon/fronts/publishing.h"
#include "daemon/fronts/reception.h"
#include "lcm/transport.h"

namespace bushd::daemon {

class LcmFront : public Listener {
 public:
  struct Setup {
    lcm::Transport& transport;
    // For what ends motion, with nothing else before it; null: `transport` takes that too. What
    // else comes on the same channels, as the beginnings of jogs, is heard on both and taken from
    // `transport`.
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

  enum class Takes { kAll, kStops, kOthers };
  Result<void> listen(lcm::Transport& transport, std::string_view channel, Takes takes);
  // `utime_us`: when it came.
  void on_message(std::string_view channel, lcm::Payload payload, std::int64_t utime_us,
                  Takes takes);
  void on_description(lcm::Payload payload);
  void on_request(const lcm::ClientMessage& message, std::size_t bytes, std::int64_t utime_us);
  // Where the answers to a request are kept, and under which session; null: nowhere.
  struct Book {
    api::Sessions* sessions = nullptr;
    std::int64_t session = 0;
  };
  // Sets `book`: where its answers are recorded; none: nowhere.
  api::Sessions::Ruling rule_without_session(const lcm::ClientMessage& message, Book& book);
  void answer(const lcm::RequestId& id, const Book& book, const api::Reply& reply);
  void publish(const lcm::Packet& packet);

  Setup setup_;
  Reception& reception_;
  Publishing& publishing_;
  std::function<std::int64_t()> unix_us_;
  api::Sessions sessions_;
  // Requests that end motion and have no session, or one that is not known: by their session, who
  // sent them and when, so that one that is repeated ends nothing that was asked for since.
  api::Sessions without_session_;
  std::uint64_t dropped_ = 0;
  std::string trouble_;
  std::uint64_t others_heard_ = 0;
  std::string other_bus_;
};

}  // namespace bushd::daemon
