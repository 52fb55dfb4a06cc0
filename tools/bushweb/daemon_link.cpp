#include "daemon_link.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <utility>

#include "client/client.h"
#include "lcm/codec.h"

namespace bushweb {
namespace {

namespace client = bushd::client;
namespace lcm = bushd::lcm;

constexpr const char* kAnother = "--daemon NAME=SOCKET";

std::int64_t unix_time_us() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count();
}

// What /proc/PID/stat has behind the name, in which there may be anything: fields 14 and 15 of all.
std::optional<double> cpu_seconds_of(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string text;
  if (!std::getline(file, text)) return std::nullopt;
  std::istringstream fields(text.substr(std::min(text.rfind(')') + 1, text.size())));
  std::string skipped;
  for (int i = 3; i < 14; ++i) fields >> skipped;
  double user = 0;
  double system = 0;
  if (!(fields >> user >> system)) return std::nullopt;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

bushd::Result<void> send(client::Link& link, const bushd::Result<lcm::Packet>& packet) {
  if (!packet) return bushd::fail(packet.error());
  return link.send(*packet);
}

}  // namespace

bushd::Result<std::unique_ptr<DaemonLink>> DaemonLink::open(Poller& poller,
                                                            const std::string& socket,
                                                            const std::string& program,
                                                            Handlers handlers) {
  auto link = client::open_socket(socket, kAnother, client::kNoPatience);
  if (!link) return bushd::fail(link.error());
  return std::unique_ptr<DaemonLink>(
      new DaemonLink(poller, std::move(*link), client::make_id(program), std::move(handlers)));
}

DaemonLink::DaemonLink(Poller& poller, std::unique_ptr<client::Link> link, std::string id,
                       Handlers handlers)
    : poller_(poller), link_(std::move(link)), id_(std::move(id)), handlers_(std::move(handlers)) {
  poller_.add(link_->fd(), [this] { handle(); });
}

DaemonLink::~DaemonLink() {
  poller_.remove(link_->fd());
}

bushd::Result<std::int64_t> DaemonLink::send(const api::Request& request) {
  const auto packet =
      lcm::encode(unix_time_us(), {.session = 0, .client_id = id_, .number = ++number_}, request);
  if (auto sent = bushweb::send(*link_, packet); !sent) return bushd::fail(sent.error());
  return number_;
}

void DaemonLink::handle() {
  const auto handled = link_->handle([this](const lcm::DaemonMessage& message) {
    const auto* reply = std::get_if<lcm::ReplyMessage>(&message);
    if (reply == nullptr || reply->id.client_id != id_) return;
    if (!api::is_final(reply->reply)) return handlers_.reply(reply->id.number, reply->reply);
    auto& parts = parts_[reply->id.number];
    const auto whole = parts.add(*reply);
    if (!whole) return;
    parts_.erase(reply->id.number);
    handlers_.reply(reply->id.number, *whole);
  });
  if (handled) return;
  // What is called destroys this.
  const auto ended = std::move(handlers_.ended);
  ended(handled.error().text());
}

Watch::Watch(Poller& poller, DaemonName daemon)
    : poller_(poller), daemon_(std::move(daemon)), mirror_(daemon_.name) {}

Watch::~Watch() {
  if (link_) poller_.remove(link_->fd());
}

void Watch::tick(std::int64_t now_us) {
  if (link_ || now_us < try_at_us_) return;
  try_at_us_ = now_us + kTryAgainUs;
  if (const auto connected = connect(); !connected) disconnect(connected.error().text());
}

// What is told from here on and what is there already; the former first, so that nothing is missed.
bushd::Result<void> Watch::connect() {
  auto link = client::open_socket(daemon_.socket, kAnother, client::kNoPatience);
  if (!link) return bushd::fail(link.error());
  link_ = std::move(*link);
  poller_.add(link_->fd(), [this] { handle(); });
  const lcm::Subscription everything{.state = true, .description = true, .health = true};
  if (auto sent = send(*link_, lcm::encode(everything)); !sent) return sent;
  const lcm::RequestId id{.session = 0, .client_id = client::make_id("web"), .number = 1};
  if (auto sent = send(*link_, lcm::encode(unix_time_us(), id, lcm::GetStatus{})); !sent) {
    return sent;
  }
  mirror_.connect();
  return {};
}

std::optional<double> Watch::cpu_s() const {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (!link_ || ::getsockopt(link_->fd(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return {};
  return cpu_seconds_of(peer.pid);
}

void Watch::handle() {
  const auto handled =
      link_->handle([this](const lcm::DaemonMessage& message) { mirror_.hear(message); });
  if (!handled) disconnect(handled.error().text());
}

void Watch::disconnect(const std::string& why) {
  if (link_) poller_.remove(link_->fd());
  link_.reset();
  mirror_.lose(why);
}

}  // namespace bushweb
