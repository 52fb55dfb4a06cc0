#include "client/client.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <random>
#include <utility>

#include "api/sessions.h"
#include "control/path.h"

namespace bushd::client {
namespace {

constexpr std::size_t kMaxClientId = 64;  // api::is_client_id

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
}

std::int64_t random_number() {
  std::random_device random;
  return static_cast<std::int64_t>(std::uint64_t{random()} << 32 | random());
}

std::int64_t unix_time_us() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count();
}

// "": it is not set.
std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::vector<std::string> socket_paths(const ClientOptions& options) {
  if (!options.socket.empty()) return {options.socket};
  if (std::string path = environment("BUSHD_CONTROL"); !path.empty()) return {std::move(path)};
  return control::default_paths();
}

// By the caller or by the user; "": by nobody.
std::string named_url(const std::string& given) {
  return given.empty() ? environment("LCM_DEFAULT_URL") : given;
}

struct Opened {
  std::unique_ptr<Link> link;
  std::string barred{};
};

bool is_readable(int fd) {
  pollfd polled{.fd = fd, .events = POLLIN, .revents = 0};
  return fd >= 0 && poll(&polled, 1, 0) > 0;
}

Result<Opened> open_link(const ClientOptions& options) {
  using Way = ClientOptions::Way;
  std::string barred;
  if (options.way != Way::kLcm) {
    std::optional<Error> first;
    for (const std::string& path : socket_paths(options)) {
      auto link = open_socket(path, options.another);
      if (link) return Opened{.link = std::move(*link)};
      if (!first) first = link.error();
      if (barred.empty() && is_barred(path)) barred = link.error().text();
    }
    const bool lcm_too = !barred.empty() || !named_url(options.url).empty();
    if (options.way == Way::kSocket || !lcm_too) return fail(*first);
  }
  auto link = open_lcm(lcm_url(options.url), options.prefix);
  if (link) return Opened{.link = std::move(*link), .barred = std::move(barred)};
  // Who has not asked for LCM has the socket in mind.
  if (!barred.empty() && named_url(options.url).empty()) return fail(std::move(barred));
  Error error = link.error();
  if (!barred.empty()) error.message += " (LCM was tried because " + barred + ")";
  return fail(std::move(error));
}

}  // namespace

std::string make_id(const std::string& program) {
  const std::string tail =
      fmt::format("-{}-{:08x}", getpid(), static_cast<std::uint32_t>(random_number()));
  std::string name = program;
  std::ranges::replace(name, '@', '_');  // what is behind the first one is the host
  std::string head = name + "@" + host_name();
  head.resize(std::min(head.size(), kMaxClientId - tail.size()));
  std::replace_if(
      head.begin(), head.end(), [](unsigned char c) { return c >= 0x80 || std::isgraph(c) == 0; },
      '_');
  return head + tail;
}

std::string lcm_url(const std::string& given) {
  std::string url = named_url(given);
  return url.empty() ? kDefaultUrl : url;
}

Result<std::unique_ptr<Client>> Client::open(ClientOptions options) {
  auto opened = open_link(options);
  if (!opened) return fail(opened.error());
  return std::make_unique<Client>(std::move(opened->link), std::move(options),
                                  std::move(opened->barred));
}

Client::Client(std::unique_ptr<Link> link, ClientOptions options, std::string barred)
    : link_(std::move(link)),
      options_(std::move(options)),
      barred_(std::move(barred)),
      id_(make_id(options_.program)),
      nonce_(random_number()) {}

void Client::on_run(std::int64_t run) {
  if (run != newest_run_) {
    if (run == former_run_) heard_two_at_ = Clock::now();
    former_run_ = std::exchange(newest_run_, run);
  }
  if (run_ && *run_ != run) restarted_ = true;
  run_ = run;
}

void Client::on_welcome(const lcm::Welcome& welcome) {
  if (session_ != 0 && welcome.run != welcome_run_) heard_two_at_ = Clock::now();
  if (session_ != 0) return;
  session_ = welcome.session;
  welcome_run_ = welcome.run;
}

bool Client::hears_two() const {
  return heard_two_at_ && Clock::now() < *heard_two_at_ + options_.silence_limit;
}

Error Client::two_daemons() const {
  return {fmt::format(
      "two daemons answer on channels {0}_..., so nothing was sent: end one of them, or give it "
      "another prefix in [lcm]. 'bushctl stop' and 'bushctl estop' reach both",
      options_.prefix)};
}

Error Client::no_answer(bool sent) const {
  const std::string perhaps = sent ? "; it may still carry this out" : "";
  if (hears_two()) return two_daemons();
  const double seconds = std::chrono::duration<double>(options_.answer_within).count();
  if (link_->loses() && state_heard_at_ >= asked_at_) {
    // Who has a session has been heard before.
    const char* rest = session_ != 0 ? "; it may still carry this out"
                       : sent ? ": with [lcm] commands = false it hears the control socket only; "
                                "else it may still carry this out"
                              : "; nothing was asked of it. With [lcm] commands = false it hears "
                                "the control socket only";
    return {fmt::format("bushd sends its state but has not answered for {:g} s{}", seconds, rest)};
  }
  return {link_->remedy() + (link_->loses() ? "" : perhaps)};
}

void Client::on_message(const lcm::DaemonMessage& message) {
  if (const auto* state = std::get_if<lcm::StateMessage>(&message)) {
    on_run(state->part.run);
    state_heard_ = true;
    state_heard_at_ = Clock::now();
    collector_.add(*state);
  } else if (const auto* description = std::get_if<lcm::DescriptionMessage>(&message)) {
    collector_.add(*description);
  } else if (const auto* health = std::get_if<lcm::HealthMessage>(&message)) {
    health_heard_ = true;
    collector_.add(*health);
  } else if (const auto* welcome = std::get_if<lcm::Welcome>(&message)) {
    if (welcome->hello.client_id == id_ && welcome->hello.nonce == nonce_) on_welcome(*welcome);
  } else if (const auto* reply = std::get_if<lcm::ReplyMessage>(&message)) {
    if (reply->id.client_id != id_ || reply->id.number != waiting_.number) return;
    if (link_->loses() && reply->id.session != session_) return;
    // Who has accepted it does not refuse it: then it is no longer known what became of it.
    if (const auto* refused = std::get_if<api::Refused>(&reply->reply);
        refused != nullptr && waiting_.accepted) {
      waiting_.disowned = refused->reason;
      return;
    }
    if (!api::is_final(reply->reply)) {
      if (!waiting_.accepted) waiting_.accepted = reply->reply;
    } else if (!waiting_.final) {
      waiting_.final = waiting_.parts.add(*reply);
    }
  }
}

Result<void> Client::wait(Clock::time_point deadline, int input_fd) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  std::array<pollfd, 3> polled{{{.fd = link_->fd(), .events = POLLIN, .revents = 0},
                                {.fd = options_.interrupt_fd, .events = POLLIN, .revents = 0},
                                {.fd = input_fd, .events = POLLIN, .revents = 0}}};
  const auto ms = std::clamp<std::int64_t>(left.count(), 0, 3'600'000);
  if (poll(polled.data(), polled.size(), static_cast<int>(ms)) > 0 &&
      (polled[1].revents & POLLIN) != 0) {
    interrupted_ = true;
    return fail("interrupted");
  }
  auto handled = link_->handle([this](const lcm::DaemonMessage& message) { on_message(message); });
  if (!handled) ended_ = true;
  return handled;
}

// Only where messages may be lost.
Result<void> Client::greet(Clock::time_point give_up) {
  Clock::time_point next_send = Clock::now();
  while (session_ == 0) {
    if (Clock::now() >= give_up) return fail(no_answer(false));
    if (Clock::now() >= next_send) {
      const auto hello = lcm::encode(unix_time_us(), lcm::Hello{.client_id = id_, .nonce = nonce_});
      if (!hello) return fail(hello.error());
      if (auto sent = link_->send(*hello); !sent) return sent;
      next_send = Clock::now() + options_.resend_every;
    }
    if (auto waited = wait(std::min(next_send, give_up)); !waited) return waited;
    if (session_ == 0) continue;
    const Clock::time_point settled = Clock::now() + options_.others_answer_within;
    while (Clock::now() < settled) {
      if (auto waited = wait(settled); !waited) return waited;
    }
  }
  return {};
}

Result<api::Reply> Client::run(const api::Request& request, Until until,
                               const Meanwhile& meanwhile) {
  asked_at_ = Clock::now();
  interrupted_ = false;
  // What happened to the daemon before this request is no concern of it.
  if (auto drained = wait(Clock::now()); !drained) return fail(drained.error());
  run_.reset();
  restarted_ = false;
  // Whoever can speak may stop, without waiting for a session.
  if (link_->loses() && !api::is_repeatable(request)) {
    if (auto greeted = greet(Clock::now() + options_.answer_within); !greeted) {
      return fail(greeted.error());
    }
    if (hears_two()) {
      forget_session();
      return fail(two_daemons());
    }
  }
  if (meanwhile.on_state) {
    if (auto subscribed = subscribe(); !subscribed) return fail(subscribed.error());
  }
  const auto packet = next_packet(request);
  if (!packet) return fail(packet.error());
  waiting_ = {.number = number_};
  auto reply = await_reply({.packet = *packet}, until, meanwhile);
  // The next request needs another session if the daemon has forgotten this one.
  const auto* refused = reply ? std::get_if<api::Refused>(&*reply) : nullptr;
  const bool forgotten = refused != nullptr && refused->reason.starts_with(api::kUnknownSession);
  if (!reply || forgotten) forget_session();
  return reply;
}

void Client::forget_session() {
  session_ = 0;
  nonce_ = random_number();
}

Result<void> Client::check_alive(Clock::time_point answered) const {
  if (restarted_) {
    return fail(
        "the daemon has restarted meanwhile (or two of them use this prefix), so the result is "
        "lost; 'bushctl status' shows where the motors are");
  }
  if (waiting_.disowned) {
    return fail("the daemon accepted the command, and does not know its result any more: " +
                *waiting_.disowned + "; 'bushctl status' shows where the motors are");
  }
  if (link_->loses() &&
      Clock::now() >= std::max(state_heard_at_, answered) + options_.silence_limit) {
    return fail(
        "the daemon accepted the command and has fallen silent since; what became of it is "
        "unknown");
  }
  return {};
}

Result<lcm::Packet> Client::next_packet(const api::Request& request) {
  return lcm::encode(unix_time_us(), {.session = session_, .client_id = id_, .number = ++number_},
                     request);
}

// Over a link that loses nothing once is enough.
Result<void> Client::send_when_due(Repeated& repeated, std::chrono::milliseconds again_after) {
  if (Clock::now() < repeated.next_send || (repeated.sent && !link_->loses())) return {};
  repeated.sent = true;
  repeated.next_send = Clock::now() + again_after;
  return link_->send(repeated.packet);
}

// One that is lost is followed by another.
Result<void> Client::send_beside(const Meanwhile& meanwhile, Clock::time_point& next) {
  if (Clock::now() < next && !is_readable(meanwhile.beside_fd)) return {};
  next = Clock::now() + meanwhile.beside_every;
  const auto request = meanwhile.beside();
  if (!request) return {};
  const auto packet = next_packet(*request);
  return packet ? link_->send(*packet) : Result<void>(fail(packet.error()));
}

void Client::show_state(const Meanwhile& meanwhile, Clock::time_point& next) {
  constexpr std::chrono::milliseconds kEvery{100};
  if (!meanwhile.on_state || !state_heard_ || Clock::now() < next) return;
  if (!collector_.has_motors()) return;
  state_heard_ = false;
  next = Clock::now() + kEvery;
  meanwhile.on_state(collector_.status());
}

Result<api::Reply> Client::await_reply(Repeated request, Until until, const Meanwhile& meanwhile) {
  const Clock::time_point give_up = Clock::now() + options_.answer_within;
  Clock::time_point next_shown{};
  Clock::time_point next_beside{};
  Clock::time_point answered{};
  bool reported = false;
  std::optional<Repeated> ending;
  for (;;) {
    const auto again_after = waiting_.accepted ? options_.ask_again_every : options_.resend_every;
    if (auto sent = send_when_due(request, again_after); !sent) return fail(sent.error());
    // Before it is accepted, the one that is to end it might be carried out first.
    const bool ends = ending && waiting_.accepted;
    if (ends) {
      if (auto sent = send_when_due(*ending, options_.resend_every); !sent)
        return fail(sent.error());
    }
    const bool beside = meanwhile.beside && waiting_.accepted && !ending;
    if (beside) {
      if (auto sent = send_beside(meanwhile, next_beside); !sent) return fail(sent.error());
      if (auto end = meanwhile.end ? meanwhile.end() : std::nullopt) {
        const auto packet = next_packet(*end);
        if (!packet) return fail(packet.error());
        ending = Repeated{.packet = *packet};
        continue;
      }
    }
    Clock::time_point wake = Clock::time_point::max();  // over a link that loses nothing
    if (link_->loses() || !request.sent) wake = std::max(request.next_send, Clock::now());
    if (beside) wake = std::min(wake, next_beside);
    if (ends && link_->loses()) wake = std::min(wake, ending->next_send);
    auto waited =
        wait(waiting_.accepted ? wake : std::min(wake, give_up), beside ? meanwhile.beside_fd : -1);
    if (interrupted_ && meanwhile.on_interrupt && !ending) {
      if (const auto end = meanwhile.on_interrupt()) {
        const auto packet = next_packet(*end);
        if (!packet) return fail(packet.error());
        ending = Repeated{.packet = *packet};
        interrupted_ = false;
        waited = {};
      }
    }
    // What came before the end of the link counts.
    if (waiting_.accepted && !std::exchange(reported, true)) {
      answered = Clock::now();
      request.next_send = answered + options_.ask_again_every;
      if (meanwhile.on_reply) meanwhile.on_reply(*waiting_.accepted);
    }
    if (waiting_.final) {
      if (meanwhile.on_reply) meanwhile.on_reply(*waiting_.final);
      return *waiting_.final;
    }
    if (waiting_.accepted && until == Until::kAnswered) return *waiting_.accepted;
    if (!waited) return fail(waited.error());
    if (auto alive = check_alive(waiting_.accepted ? answered : Clock::now()); !alive) {
      return fail(alive.error());
    }
    if (!waiting_.accepted && Clock::now() >= give_up) return fail(no_answer(request.sent));
    if (waiting_.accepted) show_state(meanwhile, next_shown);
  }
}

Result<std::optional<Status>> Client::wait_for(bool& heard, bool (StatusCollector::*enough)() const,
                                               std::chrono::milliseconds timeout, int input_fd) {
  if (auto subscribed = subscribe(); !subscribed) return fail(subscribed.error());
  const Clock::time_point deadline = Clock::now() + timeout;
  while (!heard || !(collector_.*enough)()) {
    if (auto waited = wait(deadline, input_fd); !waited) return fail(waited.error());
    if (heard && (collector_.*enough)()) break;
    if (is_readable(input_fd)) return std::optional<Status>();
    if (Clock::now() >= deadline) return fail(link_->remedy());
  }
  heard = false;
  return std::optional(collector_.status());
}

Result<Status> Client::status(std::chrono::milliseconds timeout) {
  if (auto drained = wait(Clock::now()); !drained) return fail(drained.error());
  collector_.clear();
  const Clock::time_point deadline = Clock::now() + timeout;
  Clock::time_point next_send = Clock::now();
  waiting_ = {.number = ++number_};
  const auto packet = lcm::encode(
      unix_time_us(), {.session = session_, .client_id = id_, .number = number_}, lcm::GetStatus{});
  if (!packet) return fail(packet.error());
  while (!collector_.has_everything()) {
    if (Clock::now() >= deadline && hears_two()) return fail(two_daemons());
    if (Clock::now() >= deadline) return incomplete_status();
    if (Clock::now() >= next_send) {
      if (auto sent = link_->send(*packet); !sent) return fail(sent.error());
      next_send = link_->loses() ? Clock::now() + options_.resend_every : deadline;
    }
    if (auto waited = wait(std::min(next_send, deadline)); !waited) return fail(waited.error());
  }
  // What is told here is not told again by next_state() and next_health().
  state_heard_ = false;
  health_heard_ = false;
  // Over a link that loses nothing a gap is what was published before this client had subscribed.
  if (link_->loses()) collector_.expect_no_gaps();
  return collector_.status();
}

// What has come, when no more is waited for.
Result<Status> Client::incomplete_status() {
  if (!link_->loses() || collector_.empty()) return fail(link_->remedy());
  Status partial = collector_.partial_status();
  partial.answered = waiting_.final.has_value();
  collector_.expect_no_gaps();
  return partial;
}

Result<void> Client::subscribe() {
  if (link_->loses() || subscribed_) return {};
  const auto packet =
      lcm::encode(lcm::Subscription{.state = true, .description = true, .health = true});
  if (!packet) return fail(packet.error());
  subscribed_ = true;
  return link_->send(*packet);
}

Result<std::optional<Status>> Client::next_state_or_input(std::chrono::milliseconds timeout,
                                                          int input_fd) {
  return wait_for(state_heard_, &StatusCollector::has_motors, timeout, input_fd);
}

Result<std::optional<Status>> Client::next_health_or_input(std::chrono::milliseconds timeout,
                                                           int input_fd) {
  return wait_for(health_heard_, &StatusCollector::has_health, timeout, input_fd);
}

Result<Status> Client::next_state(std::chrono::milliseconds timeout) {
  auto status = next_state_or_input(timeout, -1);
  if (!status) return fail(status.error());
  return std::move(**status);
}

Result<Status> Client::next_health(std::chrono::milliseconds timeout) {
  auto status = next_health_or_input(timeout, -1);
  if (!status) return fail(status.error());
  return std::move(**status);
}

}  // namespace bushd::client
