// The way of requests from clients to the daemon: they may be late and so be overtaken, come again
// long after, or come in floods.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "clients.h"
#include "host.h"
#include "sim/random.h"

namespace bushfaults {

class Mail {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // They outlive it.
  Mail(Clients& clients, Host& host) : clients_(clients), host_(host) {}

  void send(TimeNs now_ns, const Request& request);

  // Each says what it was, for the story.
  std::string delay_next(bushd::sim::Random& random);
  // One that this daemon has got already, or an earlier one has.
  std::string repeat(TimeNs now_ns, bushd::sim::Random& random);
  std::string repeat_stale(TimeNs now_ns, bushd::sim::Random& random);
  // Of so many clients at most.
  std::string flood(TimeNs now_ns, bushd::sim::Random& random, std::int64_t clients);

  void run(TimeNs now_ns);
  // When all that is under way has come.
  TimeNs quiet_ns() const;

 private:
  struct Letter {
    TimeNs due_ns;
    Request request;
  };
  struct Sent {
    std::uint64_t daemon;  // which one was running
    Request request;
  };
  static constexpr std::size_t kRemembered = 4000;  // half an hour

  std::string repeat(TimeNs now_ns, bushd::sim::Random& random, bool stale);
  void remember(const Request& request);

  Clients& clients_;
  Host& host_;
  TimeNs delay_ns_ = 0;  // of the next request
  std::vector<Letter> letters_;
  std::deque<Sent> sent_;
};

}  // namespace bushfaults
