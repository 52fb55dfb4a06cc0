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
  void give(const Request& request);
  Wrong given();
  // The core gets it. Which one it is, unless it was not to be carried out.
  std::optional<Request> carried_out(const std::string& client, std::int64_t number);
  // The core says so.
  Wrong answered(const Key& key, const bushd::api::Reply& reply);
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
  static constexpr std::uint64_t kNumbers = 1024;

  struct Session {
    std::string client;
    std::int64_t nonce;
    bool idle = true;
    std::optional<std::int64_t> highest{};
    std::set<std::int64_t> seen{};  // of the newest kNumbers
  };
  // What is to become of a request that arrives.
  enum class Duty { kCarryOut, kAnswerAgain, kTooOld, kUnknownSession };
  struct Given {
    Request request;
    Duty duty;
    bool same_kind;  // as what had this number before
    std::size_t answers = 0;
    bool carried_out = false;
    bool refused = false;
  };
  struct Asked {
    std::size_t kind = 0;  // index in api::Request
    // A stop that no session remembers may be carried out any number of times.
    std::uint64_t carried_out = 0;
    std::uint64_t accepted = 0;
    std::uint64_t refused = 0;
    std::uint64_t completed = 0;
    std::optional<std::vector<std::uint8_t>> told{};  // the newest answer
    bool finished() const { return refused + completed == carried_out && carried_out > 0; }
  };

  Session* find(std::int64_t session, const std::string& client);
  void use(std::int64_t number, Session& session);
  void forget_oldest(std::list<std::int64_t>& order);
  Duty duty_of(const Request& request);
  Wrong check_again(const bushd::lcm::ReplyMessage& message, const Asked& asked) const;
  void forget_some();

  std::map<std::int64_t, Session> sessions_;
  std::map<std::pair<std::string, std::int64_t>, std::int64_t> by_hello_;
  std::list<std::int64_t> idle_;  // longest silent first
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
