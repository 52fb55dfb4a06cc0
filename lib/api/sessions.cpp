#include "api/sessions.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace bushd::api {
namespace {

// A bijection of 64 bits (splitmix64): different inputs give different sessions.
std::uint64_t mix(std::uint64_t value) {
  value = (value ^ value >> 30) * 0xBF58476D1CE4E5B9u;
  value = (value ^ value >> 27) * 0x94D049BB133111EBu;
  return value ^ value >> 31;
}

Reply unknown_session() {
  return Refused{std::string(kUnknownSession) +
                 ": it has been forgotten, or the daemon has restarted; this request "
                 "may have been carried out earlier. Look at the state and open a new session"};
}

Reply too_old(std::int64_t number) {
  return Refused{"number " + std::to_string(number) + " is more than " +
                 std::to_string(NumberWindow::kNumbers - 1) +
                 " below the highest of this session; this request may have been carried out "
                 "earlier. Count up"};
}

Reply not_kept() {
  return Refused{"carried out earlier, answer not kept; 'bushctl status' shows the motors"};
}

Reply other_request(std::int64_t number) {
  return Refused{"number " + std::to_string(number) +
                 " was another request's in this session; count up"};
}

}  // namespace

std::int64_t Sessions::next_session() {
  std::int64_t session = 0;
  while (session == 0) {
    session = static_cast<std::int64_t>(mix(seed_ + ++opened_ * 0x9E3779B97F4A7C15u));
  }
  return session;
}

std::int64_t Sessions::open(const std::string& client_id, std::int64_t nonce) {
  const std::pair hello(client_id, nonce);
  if (const auto known = by_hello_.find(hello); known != by_hello_.end()) return known->second;
  const std::int64_t number = next_session();
  const auto session =
      sessions_.emplace(number, Known{.client_id = client_id, .nonce = nonce}).first;
  session->second.use = idle_.insert(idle_.end(), number);
  by_hello_.emplace(hello, number);
  if (idle_.size() > limits_.idle_sessions) close_oldest(idle_);
  return number;
}

Sessions::Iterator Sessions::find(std::int64_t session, const std::string& client_id) {
  const auto found = sessions_.find(session);
  return found != sessions_.end() && found->second.client_id == client_id ? found : sessions_.end();
}

void Sessions::use(Iterator session) {
  Known& known = session->second;
  auto& from = std::exchange(known.idle, false) ? idle_ : used_;
  used_.splice(used_.end(), from, known.use);
  if (used_.size() > limits_.sessions) close_oldest(used_);
}

void Sessions::close_oldest(std::list<std::int64_t>& order) {
  const auto session = sessions_.find(order.front());
  bytes_ -= session->second.bytes;
  by_hello_.erase({session->second.client_id, session->second.nonce});
  sessions_.erase(session);
  order.pop_front();
}

Sessions::Ruling Sessions::rule(std::int64_t session, const std::string& client_id,
                                std::int64_t number, const Request& request, std::uint64_t stops) {
  const bool stop = ends_motion(request);
  if (is_repeatable(request) && !stop) return {.carry_out = true, .after_stops = stops};
  const auto found = find(session, client_id);
  if (found == sessions_.end()) {
    if (stop) return {.carry_out = true, .after_stops = stops};
    return {.reply = unknown_session()};
  }
  Known& known = found->second;
  const bool stopped_before = known.stops.contains(number);
  Ruling ruling = rule_known(found, number, request, stops);
  // Whoever can speak may stop.
  const bool refused = ruling.reply && std::holds_alternative<Refused>(*ruling.reply);
  const auto answer = known.answers.find(number);
  const bool answered_before =
      answer == known.answers.end() ? stopped_before : answer->second.kind == request.index();
  if (stop && refused && !answered_before) return {.carry_out = true, .after_stops = stops};
  return ruling;
}

void Sessions::note_stop(Known& session, std::int64_t number, std::uint64_t stops) {
  std::erase_if(session.stops,
                [&](const auto& stop) { return !session.numbers.holds(stop.first); });
  // What is asked for before it was so before the stops with higher numbers, too.
  const auto next = session.stops.upper_bound(number);
  if (next != session.stops.end()) stops = std::min(stops, next->second);
  session.stops.emplace_hint(next, number, stops);
  if (session.stops.size() <= kMostStops) return;
  const auto oldest = session.stops.begin();
  std::next(oldest)->second = oldest->second;
  session.stops.erase(oldest);
}

Sessions::Ruling Sessions::rule_known(Iterator session, std::int64_t number, const Request& request,
                                      std::uint64_t stops) {
  use(session);
  Known& known = session->second;
  switch (known.numbers.note(number)) {
    case NumberWindow::Seen::kTooOld:
      return {.reply = too_old(number)};
    case NumberWindow::Seen::kBefore: {
      const auto answer = known.answers.find(number);
      if (answer == known.answers.end()) return {.reply = not_kept()};
      if (answer->second.kind != request.index()) return {.reply = other_request(number)};
      return {.reply = answer->second.reply};
    }
    case NumberWindow::Seen::kNew:
      break;
  }
  // What the window has left behind can never be asked for again.
  while (!known.answers.empty() && !known.numbers.holds(known.answers.begin()->first)) {
    drop_answer(known, known.answers.begin()->first);
  }
  Answer answer{.kind = request.index()};
  answer.age = known.by_age.insert(known.by_age.end(), number);
  known.bytes += answer.bytes;
  bytes_ += answer.bytes;
  known.answers.emplace(number, std::move(answer));
  fit(known);
  const auto overtaken_by = known.stops.upper_bound(number);
  const std::uint64_t after =
      overtaken_by == known.stops.end() ? stops : std::min(stops, overtaken_by->second);
  if (ends_motion(request)) note_stop(known, number, stops);
  return {.carry_out = true, .record = true, .after_stops = after};
}

void Sessions::record(std::int64_t session, std::int64_t number, const Reply& reply) {
  const auto found = sessions_.find(session);
  if (found == sessions_.end()) return;
  Known& known = found->second;
  const auto answer = known.answers.find(number);
  if (answer == known.answers.end()) return;
  const std::size_t bytes = kBytesPerAnswer + memory_of(reply);
  known.bytes += bytes - answer->second.bytes;
  bytes_ += bytes - answer->second.bytes;
  answer->second.bytes = bytes;
  answer->second.reply = reply;
  known.by_age.splice(known.by_age.end(), known.by_age, answer->second.age);
  fit(known);
}

void Sessions::drop_answer(Known& session, std::int64_t number) {
  const auto answer = session.answers.find(number);
  session.bytes -= answer->second.bytes;
  bytes_ -= answer->second.bytes;
  session.by_age.erase(answer->second.age);
  session.answers.erase(answer);
}

void Sessions::fit(Known& session) {
  while (session.bytes > limits_.bytes_per_session) drop_answer(session, session.by_age.front());
  while (bytes_ > limits_.bytes) {
    const auto most = std::max_element(
        sessions_.begin(), sessions_.end(),
        [](const auto& a, const auto& b) { return a.second.bytes < b.second.bytes; });
    drop_answer(most->second, most->second.by_age.front());
  }
}

}  // namespace bushd::api
