// What a client of the daemon needs: commands that arrive although datagrams may be lost, and
// snapshots of the state. docs/lcm.md has the rules that this follows.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/result.h"
#include "lcm/snapshot.h"
#include "lcm/transport.h"

namespace bushd::lcm {

inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";
inline constexpr const char* kDefaultPrefix = "BUSHD";

struct ClientOptions {
  std::string url = kDefaultUrl;
  std::string prefix = kDefaultPrefix;            // of the channels, [lcm] prefix in bushd.toml
  std::string program = "client";                 // begins the client_id
  int interrupt_fd = -1;                          // once readable, waiting ends; -1: never
  std::chrono::milliseconds resend_every{300};    // until the daemon has answered
  std::chrono::milliseconds answer_within{3000};  // then it is given up
  // While a result is awaited: how often it is asked for again, should the answer be lost, and how
  // long the daemon's state may stay away.
  std::chrono::milliseconds ask_again_every{1000};
  std::chrono::milliseconds silence_limit{5000};
};

// One thread.
class Client {
 public:
  using Clock = std::chrono::steady_clock;

  static Result<std::unique_ptr<Client>> open(ClientOptions options);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  enum class Until { kAnswered, kResult };

  // Sends the command, of which client_id, number, utime_us and motor_count are filled in here, and
  // waits. kAnswered: returns ACCEPTED or REFUSED (or RESULT, when that came first). kResult:
  // REFUSED or RESULT. `on_reply` sees each different reply once. Fails when no daemon answers,
  // when it falls silent or restarts meanwhile (what the command did is then unknown), when
  // interrupted, and for commands that cannot be sent.
  Result<reply_t> run(command_t command, Until until,
                      const std::function<void(const reply_t&)>& on_reply = {});

  // Sends the request, of which client_id, number, utime_us and counts are filled in here, until it
  // is answered.
  Result<table_reply_t> ask(table_request_t request);

  // The newest complete snapshot that arrives from now on.
  Result<Snapshot> snapshot(std::chrono::milliseconds timeout);

  // The same of the buses' health.
  Result<Health> health(std::chrono::milliseconds timeout);

  // interrupt_fd has become readable during one of the calls above.
  bool interrupted() const { return interrupted_; }

  const std::string& id() const { return id_; }
  Transport& transport() { return *transport_; }

 private:
  Client(std::unique_ptr<Transport> transport, ClientOptions options);
  Result<void> listen();
  void on_reply(const reply_t& reply);
  void on_state(const state_t& state);
  // Handles what has been waiting since the last call of ours.
  void drain();
  // The newest of what is collected from now on.
  template <class Whole>
  Result<Whole> await(std::optional<Whole>& newest, std::chrono::milliseconds timeout);
  // Handles messages until `deadline`, or until there were some. Fails when interrupted.
  Result<void> wait(Clock::time_point deadline);
  Error no_daemon() const;

  std::unique_ptr<Transport> transport_;
  ClientOptions options_;
  std::string id_;
  std::int64_t number_ = 0;
  bool interrupted_ = false;

  // Of the command under way.
  std::optional<reply_t> accepted_;
  std::optional<reply_t> final_;  // REFUSED or RESULT

  std::optional<table_reply_t> table_reply_;  // to the request under way

  SnapshotCollector collector_;
  std::optional<Snapshot> newest_;
  HealthCollector health_collector_;
  std::optional<Health> newest_health_;
  std::optional<std::int64_t> sequence_;  // of the state heard last
  Clock::time_point state_heard_{};
  bool restarted_ = false;
};

}  // namespace bushd::lcm
