// Exactly once over a transport that loses, repeats and reorders.
//
// A client asks for a session of this run of the daemon and counts its requests in it. In a known
// session a number that has not been seen is new and is carried out; one that has been seen gets
// its answer again, or is told that the answer is no longer kept; one below the window of the
// newest 1024 is refused, because nobody knows any more. So is a session that this run does not
// know: the request may have been carried out by the run before, or before the session was
// forgotten. Nothing is ever carried out twice, whatever is forgotten; memory is bounded in bytes.
//
// Within a session the numbers say what was asked first: a request that arrives after one that ends
// motion, and has a lower number, is taken as if it had arrived before that.
//
// No I/O, no clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "api/number_window.h"
#include "api/reply.h"
#include "api/request.h"

namespace bushd::api {

// How the refusal of a request in an unknown session begins: its client is to open a new one.
inline constexpr std::string_view kUnknownSession = "the session is unknown";

class Sessions {
 public:
  struct Limits {
    // Beyond, the session longest silent is forgotten. Sessions without a request are counted by
    // themselves, so that a flood of hellos forgets nobody who works.
    std::size_t sessions = 768;
    std::size_t idle_sessions = 256;
    // Answers that are kept. Beyond, the oldest of that session goes; for all sessions together,
    // the oldest of the session that keeps most.
    std::size_t bytes_per_session = 1024 * 1024;  // that of 2048 motors takes half of it
    std::size_t bytes = 16 * 1024 * 1024;
  };
  // What an answer takes beside its own memory.
  static constexpr std::size_t kBytesPerAnswer = 160;
  // Requests of a session that have ended motion, whose numbers are remembered. Where there are
  // more, those before the oldest one count as asked before all that were.
  static constexpr std::size_t kMostStops = 64;

  // `seed` tells this run of the daemon from others: sessions of two runs differ unless the seeds
  // are equal.
  explicit Sessions(std::uint64_t seed) : Sessions(seed, Limits()) {}
  Sessions(std::uint64_t seed, Limits limits) : limits_(limits), seed_(seed) {}
  Sessions(const Sessions&) = delete;
  Sessions& operator=(const Sessions&) = delete;

  // A session, never 0. The same client with the same nonce gets the same one again, as long as it
  // is known: the answer to its hello may have been lost. `client_id`: of bounded length.
  std::int64_t open(const std::string& client_id, std::int64_t nonce);

  // What to do with a request.
  struct Ruling {
    bool carry_out = false;
    // Its answers are to be recorded. Not so where repeating is safe and no session is known.
    bool record = false;
    // To be sent at once. Without it, and without carry_out, the answer is still to come.
    std::optional<Reply> reply{};
    // To be carried out as if it had arrived after so many that end motion (Asker::after_stops).
    std::uint64_t after_stops = 0;
  };
  // Notes the number, if it is new. What ends motion is carried out whatever is known of its
  // session, but for one that is answered again; what only reads always is. `stops`: so many that
  // end motion have arrived, from whomever.
  Ruling rule(std::int64_t session, const std::string& client_id, std::int64_t number,
              const Request& request, std::uint64_t stops = 0);

  // The answer to a request that was to be recorded; the one before is replaced. Of what has been
  // forgotten it is ignored.
  void record(std::int64_t session, std::int64_t number, const Reply& reply);

  std::size_t count() const { return sessions_.size(); }
  // Bytes of all answers kept; at most Limits::bytes.
  std::size_t bytes() const { return bytes_; }

 private:
  struct Answer {
    std::size_t kind;  // index in Request
    std::size_t bytes = kBytesPerAnswer;
    std::optional<Reply> reply{};
    std::list<std::int64_t>::iterator age{};  // in Known::by_age
  };
  struct Known {
    std::string client_id;
    std::int64_t nonce;
    bool idle = true;
    std::list<std::int64_t>::iterator use{};  // in idle_ or used_
    NumberWindow numbers{};
    std::map<std::int64_t, Answer> answers{};
    std::list<std::int64_t> by_age{};  // numbers of `answers`, oldest first
    std::size_t bytes = 0;
    // Numbers of requests that end motion, and how many had arrived before the first one of those
    // from each on: these do not fall as numbers rise.
    std::map<std::int64_t, std::uint64_t> stops{};
  };
  using Iterator = std::unordered_map<std::int64_t, Known>::iterator;

  std::int64_t next_session();
  Iterator find(std::int64_t session, const std::string& client_id);
  void use(Iterator session);
  void close_oldest(std::list<std::int64_t>& order);
  void drop_answer(Known& session, std::int64_t number);
  void fit(Known& session);
  Ruling rule_known(Iterator session, std::int64_t number, const Request& request,
                    std::uint64_t stops);
  static void note_stop(Known& session, std::int64_t number, std::uint64_t stops);

  Limits limits_;
  std::uint64_t seed_;
  std::uint64_t opened_ = 0;
  std::unordered_map<std::int64_t, Known> sessions_;
  std::map<std::pair<std::string, std::int64_t>, std::int64_t> by_hello_;
  std::list<std::int64_t> idle_;  // longest silent first
  std::list<std::int64_t> used_;
  std::size_t bytes_ = 0;
};

}  // namespace bushd::api
