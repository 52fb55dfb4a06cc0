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
    "what "
    "it prints on this page";
constexpr const char* kNoStop =
    "this page may not stop either: it is not on the PC of bushd-web. Enter a token, which "
    "'bushctl "
    "web-token' makes";
constexpr const char* kTooFast =
    "this page sends too many messages: 100 a second are taken, and all stops";
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

bool Page::is_within_rate(std::int64_t now_us) {
  const double passed_s = static_cast<double>(now_us - filled_at_us_) * 1e-6;
  filled_at_us_ = now_us;
  tokens_ = std::min(kBurst, tokens_ + passed_s * kPerSecond);
  if (tokens_ < 1) return false;
  tokens_ -= 1;
  return true;
}

void Page::hear(std::string_view text, std::int64_t now_us) {
  const bool in_time = is_within_rate(now_us);
  const FromPage message = parse(text);
  const auto* asked = std::get_if<Ask>(&message.what);
  if (!in_time && (asked == nullptr || !api::ends_motion(asked->request))) {
    return surroundings_.tell(refused(message.id, kTooFast));
  }
  std::visit(bushd::Overloaded{
                 [&](const Ask& what) { ask(message.id, what); },
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

std::string Page::why_not(const api::Request& request) const {
  if (rights_.may_command || only_reads(request)) return "";
  if (!is_stop(request)) return kNoToken;
  return rights_.may_stop ? "" : kNoStop;
}

std::size_t Page::open_requests() const {
  std::size_t open = 0;
  for (const auto& [daemon, link] : links_) open += link.ids.size();
  return open;
}

std::string Page::program() const {
  return "web:" + rights_.user.value_or("anyone");
}

void Page::ask(std::int64_t id, const Ask& ask) {
  const auto refuse = [&](std::string_view why) { surroundings_.tell(refused(id, why)); };
  if (!surroundings_.has_daemon(ask.daemon)) return refuse("there is no such daemon");
  if (const std::string why = why_not(ask.request); !why.empty()) return refuse(why);
  if (!api::ends_motion(ask.request) && open_requests() >= kMostOpen) return refuse(kTooMany);
  Link& link = links_[ask.daemon];
  if (!link.connection) {
    auto connected = surroundings_.connect(ask.daemon, program());
    if (!connected) return refuse(connected.error().text());
    link.connection = std::move(*connected);
  }
  const auto number = link.connection->send(ask.request);
  if (!number) return refuse(number.error().text());
  link.ids[*number] = id;
}

void Page::on_reply(const std::string& daemon, std::int64_t number, const api::Reply& reply) {
  Link& link = links_[daemon];
  const auto found = link.ids.find(number);
  if (found == link.ids.end()) return;
  surroundings_.tell(bushweb::reply(found->second, reply));
  if (api::is_final(reply)) link.ids.erase(found);
}

void Page::on_end(const std::string& daemon, const std::string& why) {
  const Link link = std::move(links_[daemon]);
  links_.erase(daemon);
  for (const auto& [number, id] : link.ids) surroundings_.tell(refused(id, why));
}

}  // namespace bushweb
