#include "mail.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "api/sessions.h"
#include "times.h"

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

constexpr std::uint32_t kMailStream = 404;  // of randomness
// As bushctl does.
constexpr TimeNs kRepeatNs = 300 * kMs;
constexpr int kRepetitions = 10;
constexpr std::int64_t kWindow = 1024;
constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();

// A client may begin anywhere.
std::int64_t first_number(bushd::sim::Random& random) {
  switch (random.below(8)) {
    case 0:
      return kMin + 1 + random.between(0, 3);  // the number before it is one too
    case 1:
      return kMax - random.between(0, 200);
    case 2:
      return -random.between(0, 1000);
    default:
      return 1;
  }
}

}  // namespace

Mail::Mail(Clients& clients, Host& host, std::uint64_t seed)
    : clients_(clients), host_(host), random_(seed, kMailStream) {
  host_.on_message = [this](const bushd::lcm::DaemonMessage& message) { hear(message); };
}

void Mail::hear(const bushd::lcm::DaemonMessage& message) {
  const auto* hello = std::get_if<bushd::lcm::Welcome>(&message);
  const auto* reply = std::get_if<bushd::lcm::ReplyMessage>(&message);
  if (hello == nullptr && reply == nullptr) return;
  if (lose_answers_ > 0) {
    --lose_answers_;
  } else if (hello != nullptr) {
    welcome(*hello);
  } else {
    hear(*reply);
  }
}

void Mail::welcome(const bushd::lcm::Welcome& welcome) {
  Client& client = by_name_[welcome.hello.client_id];
  if (client.nonce != welcome.hello.nonce || client.session != 0) return;
  client.session = welcome.session;
  client.last = first_number(random_) - 1;
  client.hello_due_ns.reset();
  for (Request& request : std::exchange(client.waiting, {})) {
    number_and_post(now_ns_, client, std::move(request));
  }
}

void Mail::hear(const bushd::lcm::ReplyMessage& reply) {
  open_.erase(key_of(reply.id));
  const auto* refused = std::get_if<bushd::api::Refused>(&reply.reply);
  if (refused == nullptr || !refused->reason.starts_with(bushd::api::kUnknownSession)) return;
  Client& client = by_name_[reply.id.client_id];
  if (client.session == reply.id.session) client.session = 0;
}

void Mail::say_hello(TimeNs now_ns, const std::string& name, Client& client) {
  client.hello_due_ns = now_ns + kRepeatNs;
  post(now_ns, bushd::lcm::Hello{.client_id = name, .nonce = client.nonce});
}

void Mail::send(TimeNs now_ns, Request request) {
  now_ns_ = now_ns;
  request.sent_us = now_ns / 1000;
  if (!bushd::api::is_client_id(request.client)) return post(now_ns, request);
  // Whoever can speak may stop.
  if (request.is_stop() && random_.one_in(2)) {
    request.number = ++stops_;
    return post(now_ns, request);
  }
  Client& client = by_name_[request.client];
  if (client.session != 0) return number_and_post(now_ns, client, std::move(request));
  const std::string name = request.client;
  client.waiting.push_back(std::move(request));
  if (client.hello_due_ns) return;
  client.nonce = static_cast<std::int64_t>(random_.below(1u << 31));
  say_hello(now_ns, name, client);
}

std::optional<std::int64_t> Mail::number_in(Client& client) {
  const auto leap = static_cast<std::uint64_t>(std::exchange(leap_, 0)) + 1;
  const auto room = static_cast<std::uint64_t>(kMax) - static_cast<std::uint64_t>(client.last);
  if (leap > room) return std::nullopt;
  client.last = static_cast<std::int64_t>(static_cast<std::uint64_t>(client.last) + leap);
  return client.last;
}

void Mail::number_and_post(TimeNs now_ns, Client& client, Request request) {
  const bool reuse = reuse_ > 0 && !request.is_stop() && client.last > kMin + reuse_;
  const auto number = reuse ? client.last - std::exchange(reuse_, 0) : number_in(client);
  if (!number) {
    client.session = 0;
    return send(now_ns, std::move(request));
  }
  request.session = client.session;
  request.number = *number;
  post(now_ns, request);
  const bool repeats = request.client.front() == 'c' && request.damage == Damage::kNone;
  if (!repeats) return;
  open_[key_of(request.id())] = {request, {.due_ns = now_ns + kRepeatNs, .left = kRepetitions}};
}

void Mail::post(TimeNs now_ns, const Message& message) {
  if (lose_ > 0) {
    --lose_;
    return;
  }
  const TimeNs delay_ns = std::exchange(delay_ns_, 0);
  if (delay_ns != 0) return letters_.push_back({now_ns + delay_ns, message});
  deliver(message);
}

void Mail::deliver(const Message& message) {
  if (const auto* request = std::get_if<Request>(&message)) {
    if (sent_.size() == kRemembered) sent_.pop_front();
    sent_.push_back({host_.run_number(), *request});
  }
  host_.receive(message);
}

void Mail::send_again() {
  if (sent_.empty()) return;
  const std::size_t lately = std::min(sent_.size(), kLately);
  host_.receive(sent_[sent_.size() - 1 - random_.below(lately)].request);
}

std::string Mail::delay_next(bushd::sim::Random& random) {
  delay_ns_ = random.magnitude(kMs, 10'000 * kMs);
  return fmt::format("by {} ms", delay_ns_ / kMs);
}

std::string Mail::lose_next(bushd::sim::Random& random) {
  lose_ = random.magnitude(1, 16);
  return fmt::format("{} of them", lose_);
}

std::string Mail::lose_answers(bushd::sim::Random& random) {
  lose_answers_ = random.magnitude(1, 16);
  return fmt::format("{} of them", lose_answers_);
}

std::string Mail::leap_next(bushd::sim::Random& random) {
  leap_ = random.one_in(4) ? random.magnitude(1, kMax / 4) : random.between(1, kWindow + 4);
  return fmt::format("by {}", leap_);
}

std::string Mail::reuse_next(bushd::sim::Random& random) {
  reuse_ = random.one_in(2) ? random.magnitude(1, 100) : random.between(kWindow - 4, kWindow + 4);
  return fmt::format("{} below the highest", reuse_);
}

std::string Mail::repeat(bushd::sim::Random& random, bool stale) {
  std::vector<const Request*> candidates;
  for (const Sent& sent : sent_) {
    if ((sent.run != host_.run_number()) == stale) candidates.push_back(&sent.request);
  }
  if (candidates.empty()) return "(there is none)";
  const Request& request = *random.pick(candidates);
  host_.receive(request);
  return text_of(request);
}

std::string Mail::flood(TimeNs now_ns, bushd::sim::Random& random, std::int64_t clients) {
  const std::int64_t requests = random.magnitude(50, 2'000);
  const std::int64_t of = random.magnitude(clients / 100 + 1, clients);
  for (std::int64_t n = 0; n < requests; ++n) {
    send(now_ns, clients_.one_of_flood(static_cast<std::size_t>(n % of)));
  }
  return fmt::format("of {} requests by {} clients", requests, std::min(of, requests));
}

void Mail::repeat_open(TimeNs now_ns) {
  for (auto& [key, entry] : open_) {
    auto& [request, open] = entry;
    if (open.due_ns > now_ns) continue;
    open.due_ns = now_ns + kRepeatNs;
    --open.left;
    post(now_ns, request);
  }
  std::erase_if(open_, [](const auto& entry) { return entry.second.second.left == 0; });
  for (auto& [name, client] : by_name_) {
    if (client.hello_due_ns && *client.hello_due_ns <= now_ns) say_hello(now_ns, name, client);
  }
}

void Mail::run(TimeNs now_ns) {
  now_ns_ = now_ns;
  const auto due = [now_ns](const Letter& letter) { return letter.due_ns <= now_ns; };
  for (const Letter& letter : letters_) {
    if (due(letter)) deliver(letter.message);
  }
  std::erase_if(letters_, due);
  if (now_ns < repeat_due_ns_) return;
  repeat_due_ns_ = now_ns + kMs * 10;
  repeat_open(now_ns);
}

void Mail::settle() {
  lose_ = 0;
  lose_answers_ = 0;
  open_.clear();
  for (auto& [name, client] : by_name_) client.waiting.clear();
}

TimeNs Mail::quiet_ns() const {
  TimeNs latest_ns = 0;
  for (const Letter& letter : letters_) latest_ns = std::max(latest_ns, letter.due_ns);
  return latest_ns;
}

}  // namespace bushfaults
