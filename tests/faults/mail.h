// The way between clients and the daemon, and the clients' ends of their sessions: they say hello,
// count their requests, and repeat what is not answered. Messages may be lost, be late and so be
// overtaken, come again long after, or come in floods; numbers leap, and are used twice.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
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
  Mail(Clients& clients, Host& host, std::uint64_t seed);

  // Gives it a number in a session of its client, which opens one before if it has none.
  void send(TimeNs now_ns, Request request);
  // One that was sent lately.
  void send_again();

  // Each says what it was, for the story.
  std::string delay_next(bushd::sim::Random& random);
  std::string lose_next(bushd::sim::Random& random);
  std::string lose_answers(bushd::sim::Random& random);
  // The next number of some client is a window or far more above its last, or one that lies that
  // far below it.
  std::string leap_next(bushd::sim::Random& random);
  std::string reuse_next(bushd::sim::Random& random);
  // One that this daemon has got already, or an earlier one has.
  std::string repeat(bushd::sim::Random& random) { return repeat(random, false); }
  std::string repeat_stale(bushd::sim::Random& random) { return repeat(random, true); }
  // Requests of so many clients at most.
  std::string flood(TimeNs now_ns, bushd::sim::Random& random, std::int64_t clients);

  void run(TimeNs now_ns);
  // Clients give up what is not answered, and nothing is lost any more.
  void settle();
  // When all that is under way has come.
  TimeNs quiet_ns() const;

 private:
  struct Letter {
    TimeNs due_ns;
    Message message;
  };
  struct Sent {
    std::int64_t run;  // of the daemon that was running
    Request request;
  };
  struct Client {
    std::int64_t nonce = 0;
    std::int64_t session = 0;  // 0: none
    std::int64_t last = 0;     // the highest number in it
    std::optional<TimeNs> hello_due_ns{};
    std::deque<Request> waiting{};  // for a session
  };
  // Not answered so far.
  struct Open {
    TimeNs due_ns;
    int left;  // repetitions
  };
  static constexpr std::size_t kRemembered = 4000;  // half an hour
  static constexpr std::size_t kLately = 30;

  void hear(const bushd::lcm::DaemonMessage& message);
  void welcome(const bushd::lcm::Welcome& welcome);
  void hear(const bushd::lcm::ReplyMessage& reply);
  void say_hello(TimeNs now_ns, const std::string& name, Client& client);
  // Nothing: there is none left in this session.
  std::optional<std::int64_t> number_in(Client& client);
  void number_and_post(TimeNs now_ns, Client& client, Request request);
  void post(TimeNs now_ns, const Message& message);
  void deliver(const Message& message);
  void repeat_open(TimeNs now_ns);
  std::string repeat(bushd::sim::Random& random, bool stale);

  Clients& clients_;
  Host& host_;
  bushd::sim::Random random_;
  TimeNs now_ns_ = 0;
  std::map<std::string, Client> by_name_;
  std::map<Key, std::pair<Request, Open>> open_;
  std::int64_t stops_ = 0;  // without a session
  TimeNs repeat_due_ns_ = 0;
  TimeNs delay_ns_ = 0;    // of the next message
  std::int64_t lose_ = 0;  // of the next messages
  std::int64_t lose_answers_ = 0;
  std::int64_t leap_ = 0;
  std::int64_t reuse_ = 0;
  std::vector<Letter> letters_;
  std::deque<Sent> sent_;
};

}  // namespace bushfaults
