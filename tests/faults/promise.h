// What clients are promised (docs/lcm.md, "Sessions"), as a model of its own: which requests may be
// carried out, which may not, and what is said to the others. A request that is carried out without
// being new in a known session is a violation at that moment, whatever comes of it.
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "lcm/codec.h"
#include "request.h"

namespace bushfaults {

class Promise {
 public:
  using Wrong = std::optional<std::string>;  // what is, if something is

  // Its successor knows no session.
  void daemon_started();

  // A hello arrives. Its answer comes before hello_given().
  void give(const bushd::lcm::Hello& hello);
  Wrong hear(const bushd::lcm::Welcome& welcome);
  Wrong hello_given();

  // A request arrives. What is said at once, and what is carried out at once, comes before given().
  void give(Request request);
  Wrong given();
  // The core gets it. Which one it is, unless it was not to be carried out.
  std::optional<Request> carried_out(const std::string& client, std::int64_t number);
  // The core says so to a request of that index in api::Request.
  Wrong answered(const Key& key, std::size_t kind, const bushd::api::Reply& reply);
  // It has arrived at the clients.
  Wrong hear(const bushd::lcm::ReplyMessage& message);

  // All that the core has said has arrived.
  bool heard_all() const { return on_the_way_.empty(); }
  // Requests wait to be carried out.
  bool waits() const { return !waiting_.empty(); }
  std::uint64_t carried_out() const { return carried_out_; }
  // Answered again, or refused by what is known of their session.
  std::uint64_t not_carried_out() const { return not_carried_out_; }

 private:
  static constexpr std::size_t kUsedSessions = 768;
  static constexpr std::size_t kIdleSessions = 256;
  static constexpr std::size_t kBooks = 256;
  static constexpr std::uint64_t kNumbers = 1024;

  static constexpr std::size_t kStops = 64;

  // What is to become of a request that arrives. kElsewhere: of a stop that these numbers do not
  // tell from its repetitions.
  enum class Duty { kCarryOut, kAnswerAgain, kOtherRequest, kTooOld, kUnknownSession, kElsewhere };
  struct Numbers {
    std::optional<std::int64_t> highest{};
    std::map<std::int64_t, std::size_t> seen{};  // of the newest kNumbers: index in api::Request
    std::set<std::int64_t> stops{};              // the newest kStops of them

    Duty duty_of(std::int64_t number, std::size_t kind, bool stop);
  };
  struct Session {
    std::string client;
    std::int64_t nonce;
    bool idle = true;
    Numbers numbers{};
  };
  // The session, the client, and when it was sent.
  using BookKey = std::tuple<std::int64_t, std::string, std::int64_t>;
  struct Given {
    Request request;
    Duty duty;
    std::size_t kind;  // index in api::Request
    std::size_t answers = 0;
    bool carried_out = false;
    bool refused = false;
  };
  struct Asked {
    // A stop that a session has forgotten is carried out again.
    std::uint64_t carried_out = 0;
    std::uint64_t accepted = 0;
    std::uint64_t refused = 0;
    std::uint64_t completed = 0;
    std::map<std::size_t, std::vector<std::uint8_t>> told{};  // by kind: the newest answer
    bool finished() const { return refused + completed == carried_out && carried_out > 0; }
  };

  Session* find(std::int64_t session, const std::string& client);
  void use(std::int64_t number, Session& session);
  void forget_oldest(std::list<std::int64_t>& order);
  Numbers& book_of(const Request& request);
  Duty duty_of(Request& request, std::size_t kind);
  Wrong check_again(const bushd::lcm::ReplyMessage& message, const Asked& asked) const;
  void forget_some();

  std::map<std::int64_t, Session> sessions_;
  std::map<std::pair<std::string, std::int64_t>, std::int64_t> by_hello_;
  std::map<BookKey, Numbers> books_;  // of stops that their session does not know of
  std::list<BookKey> books_used_;     // longest silent first
  std::list<std::int64_t> idle_;      // longest silent first
  std::list<std::int64_t> used_;
  std::set<std::int64_t> ever_;  // sessions of all daemons
  struct GivenHello {
    bushd::lcm::Hello hello;
    bool answered;
  };
  std::optional<GivenHello> hello_;

  std::optional<Given> given_;
  std::map<Key, Asked> asked_;
  std::deque<Key> order_;  // of asked_, oldest first
  // By client: not yet carried out. Those of one client are in the order in which they came.
  std::map<std::string, std::deque<Request>> waiting_;
  using Bytes = std::vector<std::uint8_t>;
  std::deque<Bytes> on_the_way_;  // what the core has said
  std::uint64_t carried_out_ = 0;
  std::uint64_t not_carried_out_ = 0;
};

}  // namespace bushfaults
