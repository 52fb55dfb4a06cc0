// What a client of the daemon needs, over the control socket or LCM: requests that are carried out
// exactly once although datagrams may be lost, and snapshots. docs/lcm.md has the rules that this
// follows.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "api/reply.h"
#include "api/request.h"
#include "base/result.h"
#include "client/link.h"
#include "client/status.h"

namespace bushd::client {

inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";
inline constexpr const char* kDefaultPrefix = "BUSHD";

// The URL of LCM that is used where this one is given: it, else $LCM_DEFAULT_URL, else kDefaultUrl.
std::string lcm_url(const std::string& given);

// The client_id of a program: PROGRAM@HOST-PID-RANDOM (api/introduction.h). Unique among running
// clients: process numbers repeat, and containers may share a host's name.
std::string make_id(const std::string& program);

struct ClientOptions {
  enum class Way {
    // The control socket. LCM only where this user has no right to that, or where there is none
    // and a URL of LCM is given.
    kAny,
    kSocket,
    kLcm
  };
  Way way = Way::kAny;
  std::string socket = {};  // path; empty: $BUSHD_CONTROL, else the default ones (control/path.h)
  std::string url = {};     // of LCM (lcm_url)
  std::string prefix = kDefaultPrefix;            // of the channels, [lcm] prefix in bushd.toml
  std::string program = "client";                 // begins the client_id
  std::string another = kNameAnother;             // how a user names another daemon, for errors
  int interrupt_fd = -1;                          // once readable, waiting ends; -1: never
  std::chrono::milliseconds resend_every{300};    // until the daemon has answered
  std::chrono::milliseconds answer_within{3000};  // then it is given up
  // While a result is awaited: how often it is asked for again, should the answer be lost, and how
  // long the daemon's state may stay away.
  std::chrono::milliseconds ask_again_every{1000};
  std::chrono::milliseconds silence_limit{5000};
  // How long a second daemon may take to answer the HELLO that the first has answered.
  std::chrono::milliseconds others_answer_within{100};
};

// One thread.
class Client {
 public:
  using Clock = std::chrono::steady_clock;

  // Fails at once where no daemon can be: without a socket, with one at which nobody listens, or
  // to which this user has no right, and without a network for LCM. Whether one answers by LCM is
  // seen by the first request.
  static Result<std::unique_ptr<Client>> open(ClientOptions options);
  // Over a link that is there already; `barred` as below.
  Client(std::unique_ptr<Link> link, ClientOptions options, std::string barred = {});
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  enum class Until { kAnswered, kResult };

  // What the caller does while a request runs.
  struct Meanwhile {
    // Each different reply, once.
    std::function<void(const api::Reply&)> on_reply{};
    // The state, at most ten times a second, as far as it is published.
    std::function<void(const Status&)> on_state{};
    // Interrupted, after having made interrupt_fd unreadable: the request that is to end the first
    // one, whose result is awaited as before. Without, and at the second time, waiting ends.
    std::function<std::optional<api::Request>()> on_interrupt{};
    // Once the request is accepted and is not being ended, this often, and at once while
    // `beside_fd` is readable, which this changes: a request beside it, whose answer nobody waits
    // for, such as a sign of life.
    std::function<std::optional<api::Request>()> beside{};
    std::chrono::milliseconds beside_every{100};
    int beside_fd = -1;  // -1: none
    // Asked after that: the request that is to end the first one, as of an interruption.
    std::function<std::optional<api::Request>()> end{};
  };

  // Sends the request and waits. kAnswered: returns Accepted or Refused (or Completed, when that
  // came first). kResult: Refused or Completed. Fails when no daemon answers, when it falls silent
  // or restarts meanwhile (what the request did is then unknown), when interrupted, and for
  // requests that cannot be sent. Where two daemons are heard only what stops motors is sent.
  Result<api::Reply> run(const api::Request& request, Until until, const Meanwhile& meanwhile);
  Result<api::Reply> run(const api::Request& request, Until until) {
    return run(request, until, {});
  }

  // Description, state and health of everything as they are now: the daemon is asked. Where
  // messages are lost again and again it is not complete, and says so.
  Result<Status> status(std::chrono::milliseconds timeout);

  // As soon as a state, or a health, has been published since the last call of ours. Descriptions
  // are in the former.
  Result<Status> next_state(std::chrono::milliseconds timeout);
  Result<Status> next_health(std::chrono::milliseconds timeout);
  // The same; nothing as soon as `input_fd` is readable (-1: never).
  Result<std::optional<Status>> next_state_or_input(std::chrono::milliseconds timeout,
                                                    int input_fd);
  Result<std::optional<Status>> next_health_or_input(std::chrono::milliseconds timeout,
                                                     int input_fd);

  // The daemon has ended, or closed the connection: no call succeeds any more.
  bool ended() const { return ended_; }

  // interrupt_fd has become readable during the last one of the calls above, and that ended it.
  bool interrupted() const { return interrupted_; }

  // Why LCM is used although there is a control socket: this user has no right to it, and how he
  // gets it. "": that is not so.
  const std::string& barred() const { return barred_; }

  const std::string& id() const { return id_; }
  Link& link() { return *link_; }

 private:
  struct Waiting {
    std::int64_t number = 0;
    std::optional<api::Reply> accepted{};
    std::optional<api::Reply> final{};      // Refused or Completed
    lcm::ReplyParts parts{};                // of the final one
    std::optional<std::string> disowned{};  // refused after it was accepted, and why
  };

  void on_message(const lcm::DaemonMessage& message);
  void on_run(std::int64_t run);
  void on_welcome(const lcm::Welcome& welcome);
  void forget_session();
  Result<void> greet(Clock::time_point give_up);
  bool hears_two() const;
  Error two_daemons() const;
  // Nobody has answered; `sent`: a request that may be carried out nevertheless.
  Error no_answer(bool sent) const;
  Result<void> subscribe();
  Result<Status> incomplete_status();
  Result<std::optional<Status>> wait_for(bool& heard, bool (StatusCollector::*enough)() const,
                                         std::chrono::milliseconds timeout, int input_fd);
  // A packet that is sent again until there is an answer.
  struct Repeated {
    lcm::Packet packet;
    Clock::time_point next_send{};
    bool sent = false;
  };
  Result<void> send_when_due(Repeated& repeated, std::chrono::milliseconds again_after);
  Result<lcm::Packet> next_packet(const api::Request& request);
  Result<api::Reply> await_reply(Repeated request, Until until, const Meanwhile& meanwhile);
  Result<void> send_beside(const Meanwhile& meanwhile, Clock::time_point& next);
  void show_state(const Meanwhile& meanwhile, Clock::time_point& next);
  Result<void> check_alive(Clock::time_point answered) const;
  // Handles messages until `deadline`, or until there were some, or input. Fails when interrupted.
  Result<void> wait(Clock::time_point deadline, int input_fd = -1);

  std::unique_ptr<Link> link_;
  ClientOptions options_;
  std::string barred_;
  std::string id_;
  std::int64_t nonce_;
  std::int64_t session_ = 0;  // 0: none yet
  std::int64_t number_ = 0;
  Waiting waiting_;
  bool interrupted_ = false;
  bool ended_ = false;
  bool subscribed_ = false;

  StatusCollector collector_;
  bool state_heard_ = false;  // since it was set to false
  bool health_heard_ = false;
  Clock::time_point state_heard_at_{};
  Clock::time_point asked_at_{};
  std::optional<std::int64_t> run_;  // of the daemon that is heard during a request
  bool restarted_ = false;
  // A run that is heard again after another one has not been restarted: there are two.
  std::int64_t newest_run_ = 0;
  std::int64_t former_run_ = 0;
  std::int64_t welcome_run_ = 0;  // of the first who has answered this nonce
  std::optional<Clock::time_point> heard_two_at_;
};

}  // namespace bushd::client
