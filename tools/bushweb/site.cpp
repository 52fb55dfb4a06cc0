#include "site.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/json_text.h"
#include "base/printable.h"
#include "client/status_json.h"
#include "metrics.h"
#include "shallow_json.h"

namespace bushweb {
namespace {

constexpr std::size_t kMostAddresses = 256;
constexpr double kFailuresAtOnce = 10;
constexpr double kFailuresPerSecond = 0.1;
constexpr std::int64_t kOldUs = 2'000'000;
constexpr std::int64_t kExaminationUs = 30'000'000;
constexpr const char* kElsewhere =
    "this daemon is shown as another bushd-web shows it: open the page there to command it";

std::int64_t steady_us() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since).count();
}

std::int64_t unix_s() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(since_1970).count();
}

Answer error_answer(int status, const std::string& why) {
  return json_answer(status, bushd::json_text(nlohmann::json{{"error", why}}));
}

// A token has nothing but letters and digits, however people type it.
std::string cookie_value(const std::string& typed) {
  std::string value;
  std::ranges::copy_if(typed, std::back_inserter(value),
                       [](unsigned char c) { return c < 0x80 && std::isalnum(c) != 0; });
  return value;
}

}  // namespace

// A page and what it needs of the site.
class Site::OpenPage : public Surroundings {
 public:
  OpenPage(Site& site, PageId id, Visit visit, const Rights& rights)
      : site_(site), id_(id), visit_(std::move(visit)), page_(*this, rights, steady_us()) {}

  void tell(const Text& text) override { site_.outlet_.send(id_, text); }
  bool has_daemon(const std::string& daemon) const override {
    return site_.source_of(daemon) != nullptr;
  }
  bushd::Result<std::unique_ptr<Connection>> connect(const std::string& daemon,
                                                     const std::string& link,
                                                     const std::string& program) override {
    const std::string socket = site_.source_of(daemon)->socket();
    if (socket.empty()) return bushd::fail(kElsewhere);
    auto opened = DaemonLink::open(
        site_.poller_, socket, program,
        {.reply = [this, link](std::int64_t number,
                               const api::Reply& reply) { page_.on_reply(link, number, reply); },
         .ended = [this, link](const std::string& why) { page_.on_end(link, why); }});
    if (!opened) return bushd::fail(opened.error());
    return std::unique_ptr<Connection>(std::move(*opened));
  }
  void run_doctor(const std::string& daemon, std::int64_t id) override {
    site_.run_doctor(*site_.source_of(daemon), id_, id);
  }

  PageId id() const { return id_; }
  const Visit& visit() const { return visit_; }
  Page& page() { return page_; }
  void log_out() { visit_.cookies.clear(); }
  void greet() { tell(hello(site_.options_.version, page_.rights(), names())); }
  bool behind = false;  // what was told last is not all that there was
  // It was told everything after this round's news were taken: they would be older.
  std::int64_t knows_all_of = 0;

 private:
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& source : site_.sources_) names.push_back(source->mirror().daemon());
    return names;
  }

  Site& site_;
  PageId id_;
  Visit visit_;
  Page page_;
};

Site::Site(SiteOptions options, Poller& poller, Outlet& outlet, Dialer& dialer)
    : options_(std::move(options)),
      poller_(poller),
      outlet_(outlet),
      content_(Content::load(options_.folder)),
      tokens_(options_.tokens) {
  for (const DaemonName& daemon : options_.daemons) {
    sources_.push_back(std::make_unique<Watch>(poller_, daemon));
  }
  for (const RemoteName& remote : options_.remotes) {
    sources_.push_back(std::make_unique<Remote>(remote, dialer));
  }
  if (!content_) fmt::print(stderr, "bushd-web: {}\n", bushd::printable(content_.error().text()));
  refresh_tokens();
}

Site::~Site() = default;

Source* Site::source_of(const std::string& daemon) const {
  for (const auto& source : sources_) {
    if (source->mirror().daemon() == daemon) return source.get();
  }
  return nullptr;
}

Rights Site::rights_for(const Visit& visit) const {
  const auto token = tokens_.find(token_of(visit.cookies), unix_s());
  return rights_of(visit, token ? std::optional(token->name) : std::nullopt, options_.access);
}

Answer Site::answer(const Visit& visit) {
  if (const std::string why = why_not_host(visit, options_.access); !why.empty()) {
    return text_answer(421, why);
  }
  if (visit.method == "POST") {
    if (is_foreign(visit, options_.access))
      return error_answer(403, "this comes from a page of somebody else's");
    if (visit.path == "/api/login") return log_in(visit);
    if (visit.path == "/api/logout") return log_out(visit);
    return error_answer(404, "there is nothing to be sent here");
  }
  if (visit.method != "GET") return error_answer(405, "only GET and POST are answered");
  if (visit.path == "/metrics") return metrics();
  if (visit.path == "/api/state") return state(visit);
  return file(visit);
}

Answer Site::file(const Visit& visit) const {
  if (!content_) return text_answer(503, content_.error().text());
  const Answer* found = content_->find(visit.path, visit.takes_gzip);
  return found != nullptr ? *found : text_answer(404, "there is nothing here: the page is at /");
}

// More tokens from where most came from are wrong than anybody mistypes.
bool Site::may_fail_again(const std::string& peer, std::int64_t now_us) {
  if (failures_.size() >= kMostAddresses && !failures_.contains(peer)) failures_.clear();
  auto& [left, at_us] =
      failures_.try_emplace(peer, Failures{.left = kFailuresAtOnce, .at_us = now_us}).first->second;
  left = std::min(kFailuresAtOnce,
                  left + static_cast<double>(now_us - at_us) * 1e-6 * kFailuresPerSecond);
  at_us = now_us;
  return left >= 1;
}

// What is right is taken however much was wrong before: nobody keeps others from logging in.
Answer Site::log_in(const Visit& visit) {
  refresh_tokens();
  const auto told = shallow_json(visit.body);
  const auto member = told.is_object() ? told.find("token") : told.end();
  if (!told.is_object() || member == told.end() || !member->is_string()) {
    return error_answer(400, "a JSON object with \"token\" is expected");
  }
  const auto typed = member->get<std::string>();
  const std::int64_t now_s = unix_s();
  if (const auto token = tokens_.find(typed, now_s)) {
    return cookie(200, cookie_value(typed), token->expires_s - now_s);
  }
  if (!may_fail_again(visit.peer, steady_us())) {
    return error_answer(429, "too many wrong tokens came from this address: wait a minute");
  }
  failures_[visit.peer].left -= 1;
  return error_answer(403,
                      "there is no such token, or it has ended: 'bushctl web-token' makes one");
}

// All pages of this browser that are open lose the right with it.
Answer Site::log_out(const Visit& visit) {
  const std::string token = token_of(visit.cookies);
  for (const auto& [id, page] : pages_) {
    if (!token.empty() && token_of(page->visit().cookies) == token) page->log_out();
  }
  check_rights();
  return cookie(200, "", 0);
}

Answer Site::cookie(int status, const std::string& token, std::int64_t seconds) const {
  Answer answer = json_answer(status, "{}");
  answer.headers.emplace_back(
      "set-cookie",
      fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}{}", kCookie, token, seconds,
                  options_.access.tls || options_.access.behind_proxy ? "; Secure" : ""));
  return answer;
}

Answer Site::state(const Visit& visit) {
  Source* source = visit.daemon.empty() ? sources_.front().get() : source_of(visit.daemon);
  if (source == nullptr) return error_answer(404, "there is no such daemon");
  const auto status = source->mirror().status();
  if (!is_heard(*source) || status.states.empty() || status.descriptions.empty()) {
    return error_answer(503, "the daemon has not told its state for more than 2 s");
  }
  return json_answer(200, bushd::client::json(status));
}

// A daemon that hangs is connected, and what it told last is old.
bool Site::is_heard(Source& source) {
  std::int64_t& heard_at_us = heard_at_us_[source.mirror().daemon()];  // 0: never
  const std::int64_t now_us = steady_us();
  if (source.mirror().take_heard()) heard_at_us = now_us;
  return source.mirror().connected() && heard_at_us > 0 && now_us - heard_at_us < kOldUs;
}

Answer Site::metrics() {
  std::vector<Measured> daemons;
  for (const auto& source : sources_) {
    Mirror& mirror = source->mirror();
    Measured& measured = daemons.emplace_back(
        Measured{.daemon = source->mirror().daemon(), .connected = is_heard(*source)});
    if (!measured.connected) continue;
    measured.cpu_s = source->cpu_s();
    measured.status = mirror.status();
  }
  Answer answer = text_answer(200, "");
  answer.type = "application/openmetrics-text; version=1.0.0; charset=utf-8";
  answer.body = std::make_shared<const std::string>(open_metrics(daemons));
  return answer;
}

std::string Site::why_no_page(const Visit& visit) const {
  if (visit.path != "/api/live") return "pages open /api/live";
  if (std::string why = why_not_host(visit, options_.access); !why.empty()) return why;
  return is_foreign(visit, options_.access) ? "this comes from a page of somebody else's" : "";
}

bool Site::is_preferred(const Visit& visit) const {
  const Rights rights = rights_for(visit);
  return rights.may_command || rights.may_stop;
}

void Site::open(PageId id, const Visit& visit) {
  auto page = std::make_unique<OpenPage>(*this, id, visit, rights_for(visit));
  page->greet();
  catch_up(*page);
  pages_[id] = std::move(page);
}

void Site::catch_up(OpenPage& page) {
  for (const auto& source : sources_) {
    for (const Text& text : source->mirror().everything()) page.tell(text);
  }
  page.knows_all_of = round_;
}

void Site::hear(PageId id, std::string_view text) {
  const auto found = pages_.find(id);
  if (found != pages_.end()) found->second->page().hear(text, steady_us());
}

void Site::close(PageId id) {
  pages_.erase(id);
}

void Site::tick() {
  ticks_ = (ticks_ + 1) % kTicksPerSecond;
  const int turn = ticks_ % kTurns;
  if (turn == 0) take_news();
  const Text still_here = alive(steady_us());
  for (const auto& [id, page] : pages_) {
    if (id % kTurns == static_cast<PageId>(turn)) tell_news(*page, still_here);
  }
  if (ticks_ != 0) return;
  end_examinations();
  refresh_tokens();
  check_rights();
}

void Site::take_news() {
  ++round_;
  news_.clear();
  for (const auto& source : sources_) {
    source->tick(steady_us());
    is_heard(*source);
    std::ranges::move(source->mirror().news(), std::back_inserter(news_));
  }
}

void Site::tell_news(OpenPage& page, const Text& still_here) {
  if (outlet_.is_behind(page.id())) {
    page.behind = true;
    return;
  }
  if (std::exchange(page.behind, false)) {
    catch_up(page);
  } else if (page.knows_all_of != round_) {
    for (const Text& text : news_) page.tell(text);
  }
  page.tell(still_here);
}

void Site::check_rights() {
  for (const auto& [id, page] : pages_) {
    const Rights rights = rights_for(page->visit());
    if (rights == page->page().rights()) continue;
    page->page().set_rights(rights);
    page->greet();
  }
}

void Site::refresh_tokens() {
  const std::string wrong = tokens_.refresh();
  if (!wrong.empty()) fmt::print(stderr, "bushd-web: {}\n", bushd::printable(wrong));
}

void Site::run_doctor(Source& source, PageId page, std::int64_t id) {
  if (source.socket().empty()) return outlet_.send(page, refused(id, kElsewhere));
  const std::string daemon = source.mirror().daemon();
  Examination& examination = examinations_[daemon];
  const auto waits = [&](const auto& one) { return one.first == page; };
  if (std::ranges::any_of(examination.waiting, waits)) {
    return outlet_.send(page, refused(id, "the doctor is at work for this page: wait for him"));
  }
  examination.waiting.emplace_back(page, id);
  if (examination.run) return;
  examination.since_us = steady_us();
  examination.run = std::make_unique<ProgramRun>(
      poller_,
      [this, daemon](const bushd::Result<std::string>& output) { tell_findings(daemon, output); });
  const auto started =
      examination.run->start({options_.bushctl, "doctor", "--json", "--socket", source.socket()});
  if (!started) tell_findings(daemon, bushd::fail(started.error()));
}

void Site::end_examinations() {
  for (const auto& [daemon, examination] : examinations_) {
    if (steady_us() - examination.since_us < kExaminationUs) continue;
    return tell_findings(daemon, bushd::fail("bushctl doctor has not ended within 30 s"));
  }
}

void Site::tell_findings(std::string daemon, const bushd::Result<std::string>& output) {
  const Examination examination = std::move(examinations_[daemon]);
  examinations_.erase(daemon);
  const auto told =
      output ? nlohmann::ordered_json::parse(*output, nullptr, false) : nlohmann::ordered_json();
  for (const auto& [page, id] : examination.waiting) {
    if (!pages_.contains(page)) continue;
    if (told.is_object() && told.contains("findings")) {
      outlet_.send(page, result(id, "done", "examined", {{"findings", told["findings"]}}));
    } else {
      outlet_.send(page, refused(id, output ? "bushctl doctor has printed no findings"
                                            : output.error().text()));
    }
  }
}

}  // namespace bushweb
