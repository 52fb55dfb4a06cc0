#include "page.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/overloaded.h"
#include "checks.h"

namespace bushweb {
namespace {

constexpr const char* kNoToken =
    "this page may only look: run 'bushctl web-token' as a member of the group bushd, and enter "
    "what it prints on this page";
constexpr const char* kNoStop =
    "this page may not stop either: from here that needs a token too, which 'bushctl web-token' "
    "makes";
constexpr const char* kTooFast =
    "this page sends too many messages: 100 a second are taken, and all stops";
constexpr const char* kTooLarge =
    "a message above 4 KiB is taken from who may command only: enter a token";
constexpr const char* kLate =
    "this came late: the page had not heard of bushd-web for 2 s when it was asked for, so it is "
    "not carried out. Ask again";
constexpr const char* kUrgent = "\n";  // behind the name of a daemon: a link for stops alone
constexpr const char* kTooMany = "256 requests of this page are under way: wait for one of them";

}  // namespace

Page::Page(Surroundings& surroundings, Rights rights, std::int64_t now_us)
    : surroundings_(surroundings), rights_(std::move(rights)), filled_at_us_(now_us) {}

// A connection in the name of somebody who has no right any more ends, and his jogs with it.
void Page::set_rights(const Rights& rights) {
  if (rights == rights_) return;
  rights_ = rights;
  for (auto& [daemon, link] : std::exchange(links_, {})) {
    for (const auto& [number, id] : link.ids) {
      surroundings_.tell(refused(id,
                                 "the rights of this page have changed; what became of this "
                                 "is in the history of the motors"));
    }
  }
}

bool Page::is_within_rate(std::size_t bytes, std::int64_t now_us) {
  const double passed_s = static_cast<double>(now_us - filled_at_us_) * 1e-6;
  filled_at_us_ = now_us;
  messages_left_ = std::min(kBurst, messages_left_ + passed_s * kPerSecond);
  bytes_left_ = std::min(kByteBurst, bytes_left_ + passed_s * kBytesPerSecond);
  const double large = bytes > kSmall ? static_cast<double>(bytes) : 0;
  if (messages_left_ < 1 || bytes_left_ < large) return false;
  messages_left_ -= 1;
  bytes_left_ -= large;
  return true;
}

// What is large is not even read where it may not be sent; a stop is small.
void Page::hear(std::string_view text, std::int64_t now_us) {
  const bool in_time = is_within_rate(text.size(), now_us);
  if (text.size() > kSmall && !rights_.may_command) {
    return surroundings_.tell(refused(0, kTooLarge));
  }
  if (text.size() > kSmall && !in_time) return surroundings_.tell(refused(0, kTooFast));
  const FromPage message = parse(text);
  const auto* asked = std::get_if<Ask>(&message.what);
  if (!in_time && (asked == nullptr || !api::ends_motion(asked->request))) {
    return surroundings_.tell(refused(message.id, kTooFast));
  }
  std::visit(bushd::Overloaded{
                 [&](const Ask& what) { ask(message.id, what, now_us); },
                 [&](const Check& what) { surroundings_.tell(checked(message.id, what.table)); },
                 [&](const Doctor& what) {
                   if (surroundings_.has_daemon(what.daemon)) {
                     surroundings_.run_doctor(what.daemon, message.id);
                   } else {
                     surroundings_.tell(refused(message.id, "there is no such daemon"));
                   }
                 },
                 [&](const Wrong& what) { surroundings_.tell(refused(message.id, what.why)); }},
             message.what);
}

std::string Page::why_not(const Ask& ask, std::int64_t now_us) const {
  const api::Request& request = ask.request;
  if (!rights_.may_command && !only_reads(request)) {
    if (!is_stop(request)) return kNoToken;
    if (!rights_.may_stop) return kNoStop;
  }
  if (api::ends_motion(request)) return "";
  if (ask.heard && now_us - *ask.heard > kLateUs) return kLate;
  return open_requests() < kMostOpen ? "" : kTooMany;
}

std::size_t Page::open_requests() const {
  std::size_t open = 0;
  for (const auto& [daemon, link] : links_) open += link.ids.size();
  return open;
}

std::string Page::program() const {
  return "web:" + rights_.user.value_or("*");
}

void Page::ask(std::int64_t id, const Ask& ask, std::int64_t now_us) {
  std::string why = why_not(ask, now_us);
  if (!surroundings_.has_daemon(ask.daemon)) why = "there is no such daemon";
  if (why.empty()) {
    why = send(id, ask, ask.daemon);
    // The connection may be full of what the page has asked before; a stop does not wait behind.
    if (!why.empty() && api::ends_motion(ask.request)) why = send(id, ask, ask.daemon + kUrgent);
  }
  if (!why.empty()) surroundings_.tell(refused(id, why));
}

std::string Page::send(std::int64_t id, const Ask& ask, const std::string& link_name) {
  Link& link = links_[link_name];
  if (!link.connection) {
    auto connected = surroundings_.connect(ask.daemon, link_name, program());
    if (!connected) return connected.error().text();
    link.connection = std::move(*connected);
  }
  const auto number = link.connection->send(ask.request);
  if (!number) return number.error().text();
  link.ids[*number] = id;
  return "";
}

void Page::on_reply(const std::string& name, std::int64_t number, const api::Reply& reply) {
  Link& link = links_[name];
  const auto found = link.ids.find(number);
  if (found == link.ids.end()) return;
  surroundings_.tell(bushweb::reply(found->second, reply));
  if (api::is_final(reply)) link.ids.erase(found);
}

void Page::on_end(const std::string& name, const std::string& why) {
  const Link link = std::move(links_[name]);
  links_.erase(name);
  for (const auto& [number, id] : link.ids) surroundings_.tell(refused(id, why));
}

}  // namespace bushweb
