#include "promise.h"

#include <fmt/core.h>

#include <algorithm>

#include "api/session.h"
#include "api/sessions.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;
namespace lcm = bushd::lcm;

// Requests that are kept, with what was said to them: more than a client of bushfaults repeats.
constexpr std::size_t kKept = 20'000;

// The answer without its time.
std::vector<std::uint8_t> essence(const lcm::ReplyMessage& message) {
  std::vector<std::uint8_t> all;
  const auto parts = lcm::encode(0, message.id, message.reply).value();
  for (const lcm::Packet& part : parts) {
    all.insert(all.end(), part.payload.begin(), part.payload.end());
  }
  return all;
}

bool is_refusal(const api::Reply& reply, std::string_view part) {
  const auto* refused = std::get_if<api::Refused>(&reply);
  return refused != nullptr && refused->reason.find(part) != std::string::npos;
}

// In unsigned arithmetic, no difference overflows.
std::uint64_t below(std::int64_t highest, std::int64_t number) {
  return static_cast<std::uint64_t>(highest) - static_cast<std::uint64_t>(number);
}

}  // namespace

void Promise::daemon_started() {
  sessions_.clear();
  books_.clear();
  books_used_.clear();
  by_hello_.clear();
  idle_.clear();
  used_.clear();
  asked_.clear();
  order_.clear();
  waiting_.clear();
  on_the_way_.clear();
  given_.reset();
  hello_.reset();
}

void Promise::give(const lcm::Hello& hello) {
  hello_ = GivenHello{.hello = hello, .answered = false};
}

Promise::Wrong Promise::hear(const lcm::Welcome& welcome) {
  if (!hello_ || hello_->answered || hello_->hello.client_id != welcome.hello.client_id ||
      hello_->hello.nonce != welcome.hello.nonce) {
    return "a welcome to " + welcome.hello.client_id + " who has not said hello";
  }
  hello_->answered = true;
  const std::pair hello(welcome.hello.client_id, welcome.hello.nonce);
  if (const auto known = by_hello_.find(hello); known != by_hello_.end()) {
    if (known->second == welcome.session) return std::nullopt;
    return welcome.hello.client_id + " gets another session for the hello that it has repeated";
  }
  if (welcome.session == 0 || !ever_.insert(welcome.session).second) {
    return "a new session has a number that was used before";
  }
  by_hello_[hello] = welcome.session;
  sessions_[welcome.session] = {.client = hello.first, .nonce = hello.second};
  idle_.push_back(welcome.session);
  if (idle_.size() > kIdleSessions) forget_oldest(idle_);
  return std::nullopt;
}

Promise::Wrong Promise::hello_given() {
  const bool answered = hello_->answered || !api::is_client_id(hello_->hello.client_id);
  const std::string client = hello_->hello.client_id;
  hello_.reset();
  if (answered) return std::nullopt;
  return "no welcome to " + client;
}

Promise::Session* Promise::find(std::int64_t session, const std::string& client) {
  const auto found = sessions_.find(session);
  return found != sessions_.end() && found->second.client == client ? &found->second : nullptr;
}

void Promise::use(std::int64_t number, Session& session) {
  if (session.idle) {
    idle_.remove(number);
    session.idle = false;
  } else {
    used_.remove(number);
  }
  used_.push_back(number);
  if (used_.size() > kUsedSessions) forget_oldest(used_);
}

void Promise::forget_oldest(std::list<std::int64_t>& order) {
  const auto session = sessions_.find(order.front());
  by_hello_.erase({session->second.client, session->second.nonce});
  sessions_.erase(session);
  order.pop_front();
}

Promise::Duty Promise::Numbers::duty_of(std::int64_t number, std::size_t kind, bool stop) {
  const auto holds = [&](std::int64_t n) {
    return highest && n <= *highest && below(*highest, n) < kNumbers;
  };
  if (highest && number <= *highest && !holds(number)) {
    return stop && !stops.contains(number) ? Duty::kElsewhere : Duty::kTooOld;
  }
  if (const auto before = seen.find(number); before != seen.end()) {
    if (before->second == kind) return Duty::kAnswerAgain;
    return stop ? Duty::kElsewhere : Duty::kOtherRequest;
  }
  highest = highest ? std::max(*highest, number) : number;
  std::erase_if(seen, [&](const auto& entry) { return !holds(entry.first); });
  seen.emplace(number, kind);
  if (stop) {
    std::erase_if(stops, [&](std::int64_t n) { return !holds(n); });
    stops.insert(number);
    if (stops.size() > kStops) stops.erase(stops.begin());
  }
  return Duty::kCarryOut;
}

// One that its session does not know of is told from its repetitions by when it was sent.
Promise::Numbers& Promise::book_of(const Request& request) {
  const BookKey key(request.session, request.client, request.sent_us);
  const auto [book, first] = books_.try_emplace(key);
  if (!first) books_used_.remove(key);
  books_used_.push_back(key);
  if (books_used_.size() > kBooks) {
    books_.erase(books_used_.front());
    books_used_.pop_front();
  }
  return book->second;
}

Promise::Duty Promise::duty_of(Request& request, std::size_t kind) {
  const bool stop = request.ends_motion();
  Session* session = find(request.session, request.client);
  if (session == nullptr && !stop) return Duty::kUnknownSession;
  if (session != nullptr) {
    use(request.session, *session);
    const Duty duty = session->numbers.duty_of(request.number, kind, stop);
    if (duty != Duty::kElsewhere) return duty;
  }
  request.unordered = true;
  const Duty duty = book_of(request).duty_of(request.number, kind, stop);
  return duty == Duty::kElsewhere ? Duty::kCarryOut : duty;
}

void Promise::give(Request request) {
  const Key key = key_of(request.id());
  const std::size_t kind = api_of(request).index();
  const Duty duty = duty_of(request, kind);
  if (asked_.try_emplace(key).second) order_.push_back(key);
  given_ = Given{.request = std::move(request), .duty = duty, .kind = kind};
  forget_some();
}

void Promise::forget_some() {
  while (order_.size() > kKept) {
    const Key key = order_.front();
    order_.pop_front();
    const auto oldest = asked_.find(key);
    if (oldest->second.finished()) {
      asked_.erase(oldest);
    } else {
      order_.push_back(key);
      return;
    }
  }
}

Promise::Wrong Promise::given() {
  const Given given = *std::exchange(given_, std::nullopt);
  const Request& request = given.request;
  if (given.duty == Duty::kCarryOut) {
    if (request.ends_motion() && !given.carried_out) {
      return "a stop is not carried out: " + text_of(request);
    }
    if (!request.ends_motion() && !given.refused) waiting_[request.client].push_back(request);
    return std::nullopt;
  }
  if (given.carried_out) return "carried out again: " + text_of(request);
  ++not_carried_out_;
  // What still waits has not been answered so far.
  const bool silent = given.duty == Duty::kAnswerAgain &&
                      !asked_.at(key_of(request.id())).told.contains(given.kind);
  if (given.answers == 1 || (silent && given.answers == 0)) return std::nullopt;
  return fmt::format("{} answers at once to what is not to be carried out: {}", given.answers,
                     text_of(request));
}

std::optional<Request> Promise::carried_out(const std::string& client, std::int64_t number) {
  ++carried_out_;
  if (given_ && given_->request.client == client && given_->request.number == number) {
    if (!given_->request.ends_motion()) return std::nullopt;  // it has not had its turn
    given_->carried_out = true;
    Asked& asked = asked_.at(key_of(given_->request.id()));
    ++asked.carried_out;
    asked.told.erase(given_->kind);
    return given_->request;
  }
  const auto waiting = waiting_.find(client);
  if (waiting == waiting_.end() || waiting->second.front().number != number) return std::nullopt;
  Request request = std::move(waiting->second.front());
  waiting->second.pop_front();
  if (waiting->second.empty()) waiting_.erase(waiting);
  ++asked_.at(key_of(request.id())).carried_out;
  return request;
}

Promise::Wrong Promise::answered(const Key& key, std::size_t kind, const api::Reply& reply) {
  const auto& [session, client, number] = key;
  const lcm::ReplyMessage message{.id = {.session = session, .client_id = client, .number = number},
                                  .reply = reply};
  Asked& asked = asked_.at(key);
  const bool completed = std::holds_alternative<api::Completed>(reply);
  const bool refused = std::holds_alternative<api::Refused>(reply);
  const bool first = asked.accepted + asked.refused < asked.carried_out;
  // A result may come alone: what was over before it began.
  const bool alone = completed && asked.completed == asked.accepted && first;
  const bool room = completed ? alone || asked.completed < asked.accepted : first;
  if (!room) return "one reply too many:" + text_of(message);
  if (alone) ++asked.accepted;
  ++(completed ? asked.completed : refused ? asked.refused : asked.accepted);
  asked.told[kind] = essence(message);
  on_the_way_.push_back(asked.told[kind]);
  return std::nullopt;
}

Promise::Wrong Promise::check_again(const lcm::ReplyMessage& message, const Asked& asked) const {
  const bool right = [&] {
    switch (given_->duty) {
      case Duty::kTooOld:
        return is_refusal(message.reply, "below the highest of this session");
      case Duty::kUnknownSession:
        return is_refusal(message.reply, api::kUnknownSession);
      case Duty::kOtherRequest:
        return is_refusal(message.reply, "was another request's");
      case Duty::kAnswerAgain: {
        const auto told = asked.told.find(given_->kind);
        return is_refusal(message.reply, "carried out earlier, answer not kept") ||
               (told != asked.told.end() && told->second == essence(message));
      }
      case Duty::kCarryOut:
      case Duty::kElsewhere:
        break;
    }
    return false;
  }();
  if (right) return std::nullopt;
  return "not the answer that was to come:" + text_of(message);
}

Promise::Wrong Promise::hear(const lcm::ReplyMessage& message) {
  const bool at_once = given_ && given_->request.id() == message.id && !given_->carried_out;
  if (!at_once) {
    if (on_the_way_.empty() || on_the_way_.front() != essence(message)) {
      return "an answer that the core has not given:" + text_of(message);
    }
    on_the_way_.pop_front();
    return std::nullopt;
  }
  ++given_->answers;
  Asked& asked = asked_.at(key_of(message.id));
  if (given_->duty != Duty::kCarryOut) return check_again(message, asked);
  // Too many wait already.
  if (given_->request.ends_motion() || !is_refusal(message.reply, "wait")) {
    return "said before it was carried out:" + text_of(message);
  }
  given_->refused = true;
  ++asked.carried_out;
  ++asked.refused;
  asked.told[given_->kind] = essence(message);
  return std::nullopt;
}

}  // namespace bushfaults
