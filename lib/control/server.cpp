#include "control/server.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace bushd::control {
namespace {

constexpr Server::Connection kListener = 0;
// No connection waits longer to be accepted, not even where all connect at once.
constexpr std::int64_t kMostUnreadNs = 30'000'000'000;
constexpr std::size_t kAcceptedAtOnce = 64;

std::string text_of(const api::Credentials& who) {
  return "process " + std::to_string(who.pid) + " of user " + std::to_string(who.uid);
}

std::int64_t ns_of(const timespec& time) {
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  return time.tv_sec * kNsPerS + time.tv_nsec;
}

std::int64_t now_ns() {
  timespec time{};
  ::clock_gettime(CLOCK_REALTIME, &time);
  return ns_of(time);
}

int open_spare() {
  return ::open("/dev/null", O_RDONLY | O_CLOEXEC);
}

}  // namespace

Result<std::unique_ptr<Server>> Server::open(const std::string& path, const std::string& group,
                                             Limits limits) {
  auto listener = Listener::open(path, group);
  if (!listener) return fail(listener.error());
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  if (epoll < 0) {
    return fail(Error{.message = std::string("epoll: ") + std::strerror(errno), .file = path});
  }
  auto server = std::unique_ptr<Server>(new Server(std::move(*listener), epoll, limits));
  if (const auto watched = server->watch_listener(); !watched) return fail(watched.error());
  return server;
}

Server::Server(Listener listener, int epoll, Limits limits)
    : listener_(std::move(listener)),
      epoll_(epoll),
      spare_(open_spare()),
      limits_(limits),
      places_(limits.places),
      buffer_(kMaxPacketBytes),
      nobody_came_ns_(now_ns()) {}

Server::~Server() {
  for (const auto& [connection, peer] : peers_) ::close(peer.fd);
  ::close(epoll_);
  if (spare_ >= 0) ::close(spare_);
}

Result<void> Server::watch_listener() {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = kListener;
  if (::epoll_ctl(epoll_, EPOLL_CTL_ADD, listener_.fd(), &event) == 0) return {};
  return fail(Error{.message = std::string("epoll: ") + std::strerror(errno), .file = path()});
}

Result<void> Server::restore() {
  accept_all();  // who has connected by the file that is gone
  if (auto restored = listener_.restore(); !restored) return restored;
  return watch_listener();
}

void Server::watch(Connection connection, const Peer& peer, int operation) const {
  epoll_event event{};
  event.events = EPOLLIN | (peer.unread.empty() ? 0u : static_cast<std::uint32_t>(EPOLLOUT));
  event.data.u64 = connection;
  static_cast<void>(::epoll_ctl(epoll_, operation, peer.fd, &event));
}

void Server::handle() {
  std::vector<epoll_event> events(peers_.size() + 1);
  const int n = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 0);
  events.resize(static_cast<std::size_t>(std::max(n, 0)));
  bytes_left_ = limits_.bytes_at_once;
  accept_all();
  // In turns, beginning behind who was served last.
  std::sort(events.begin(), events.end(), [this](const epoll_event& a, const epoll_event& b) {
    return a.data.u64 - turn_ - 1 < b.data.u64 - turn_ - 1;
  });
  bool any_urgent = false;
  for (const epoll_event& event : events) {
    const auto found = peers_.find(event.data.u64);
    if (bytes_left_ == 0 || found == peers_.end() || !is_urgent(found->second)) continue;
    any_urgent = true;
    handle_peer(found->first, event.events);
  }
  // Who connects from now on comes after what was urgent.
  if (any_urgent) accept_all();
  for (const epoll_event& event : events) {
    if (event.data.u64 != kListener && bytes_left_ > 0) {
      turn_ = event.data.u64;
      handle_peer(event.data.u64, event.events);
    }
  }
  for (const Connection connection : std::exchange(doomed_, {})) close(connection);
}

void Server::handle_peer(Connection connection, std::uint32_t events) {
  const auto found = peers_.find(connection);
  if (found == peers_.end()) return;
  Peer& peer = found->second;
  bool goes_on = !peer.doomed;
  if (goes_on && (events & EPOLLOUT) != 0 && !flush(peer)) forget_unread(peer);
  if (goes_on && (events & (EPOLLIN | EPOLLHUP | EPOLLERR)) != 0) goes_on = read(connection, peer);
  if (!goes_on || peer.doomed) {
    close(connection);
  } else if ((events & EPOLLOUT) != 0) {
    watch(connection, peer, EPOLL_CTL_MOD);
  }
}

bool Server::is_urgent(const Peer& peer) const {
  if (!handlers_.is_urgent || peer.doomed) return false;
  std::array<std::uint8_t, kMaxChannel + 1> head;
  const ssize_t n = ::recv(peer.fd, head.data(), head.size(), MSG_PEEK | MSG_DONTWAIT);
  if (n <= 0) return false;
  const auto view = view_of({head.data(), static_cast<std::size_t>(n)});
  return view && handlers_.is_urgent(view->channel);
}

void Server::accept_all() {
  for (std::size_t i = 0; i < kAcceptedAtOnce && make_room(); ++i) {
    const std::int64_t before_ns = now_ns();
    const int fd = ::accept4(listener_.fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0 && errno == EAGAIN) nobody_came_ns_ = before_ns;
    if (fd >= 0) {
      accept_one(fd);
    } else if (errno == EMFILE || errno == ENFILE) {
      // A connection that is not accepted would wake the loop for ever.
      ::close(std::exchange(spare_, -1));
      const int turned_away = ::accept4(listener_.fd(), nullptr, nullptr, SOCK_CLOEXEC);
      if (turned_away >= 0) ::close(turned_away);
      spare_ = open_spare();
      if (turned_away < 0) return;
      ++dropped_;
      note("a connection was turned away: bushd may open no more files; raise LimitNOFILE");
    } else if (errno != ECONNABORTED && errno != EINTR) {
      return;
    }
  }
}

void Server::accept_one(int fd) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) {
    ::close(fd);
    ++dropped_;
    return;
  }
  const api::Credentials who{
      .pid = credentials.pid, .uid = credentials.uid, .gid = credentials.gid};
  const Connection connection = ++last_;
  const bool first_for_stops = !places_.any_for_stops();
  const std::string why_stops_only = places_.take(connection, who);
  Peer& peer = peers_.emplace(connection, Peer{.fd = fd, .who = who}).first->second;
  const int on = 1;
  static_cast<void>(::setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on));
  int waiting = 0;
  if (::ioctl(fd, FIONREAD, &waiting) == 0) {
    peer.unstamped_bytes = static_cast<std::size_t>(std::max(waiting, 0));
  }
  peer.connected_after_ns = nobody_came_ns_;
  watch(connection, peer, EPOLL_CTL_ADD);
  if (!why_stops_only.empty() && first_for_stops) {
    note(why_stops_only + "; further connections may stop motors and no more");
  }
  if (handlers_.opened) handlers_.opened(connection, who, why_stops_only);
}

bool Server::make_room() {
  if (places_.has_room()) return true;
  pollfd listener{.fd = listener_.fd(), .events = POLLIN, .revents = 0};
  if (::poll(&listener, 1, 0) <= 0) return true;  // nobody comes
  const auto goes = places_.who_goes([this](Connection connection) {
    int waiting = 0;
    return ::ioctl(peers_.at(connection).fd, FIONREAD, &waiting) == 0 && waiting > 0;
  });
  if (!goes) return false;
  ++dropped_;
  close(*goes);
  return true;
}

void Server::note(const std::string& text) const {
  if (handlers_.noted) handlers_.noted("control socket: " + text);
}

bool Server::read(Connection connection, Peer& peer) {
  constexpr std::size_t kPerPacket = 512;
  iovec part{.iov_base = buffer_.data(), .iov_len = buffer_.size()};
  // Descriptors that somebody sends along are closed by the kernel: there is room for a time only.
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control{};
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t n = ::recvmsg(peer.fd, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  // ECONNRESET comes once: it has left without reading all of ours, and what it has sent comes
  // next.
  if (n < 0) return errno == EAGAIN || errno == EINTR || errno == ECONNRESET;
  if (n == 0) return false;
  const std::span<const std::uint8_t> bytes(buffer_.data(), static_cast<std::size_t>(n));
  bytes_left_ -= std::min(bytes_left_, bytes.size() + kPerPacket);
  const Sent sent = sent_at(peer, bytes.size(), message);
  const auto view = (message.msg_flags & MSG_TRUNC) != 0 ? std::nullopt : view_of(bytes);
  if (!view) {
    reject(connection);
  } else if (handlers_.packet) {
    handlers_.packet(connection, *view, sent);
  }
  return true;
}

// The kernel writes the time of a packet down from when it has been asked to.
Server::Sent Server::sent_at(Peer& peer, std::size_t bytes, const msghdr& message) {
  if (peer.unstamped_bytes > 0) {
    peer.unstamped_bytes -= std::min(peer.unstamped_bytes, bytes);
    const std::int64_t now = now_ns();
    return {.earliest_ns = std::max(peer.connected_after_ns, now - kMostUnreadNs),
            .latest_ns = now};
  }
  const cmsghdr* head = CMSG_FIRSTHDR(&message);
  if (head == nullptr || head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_TIMESTAMPNS) {
    return {.earliest_ns = now_ns(), .latest_ns = now_ns()};
  }
  timespec time{};
  std::memcpy(&time, CMSG_DATA(head), sizeof time);
  const std::int64_t ns = ns_of(time);
  return {.earliest_ns = ns, .latest_ns = ns};
}

void Server::reject(Connection connection) {
  ++dropped_;
  const auto found = peers_.find(connection);
  if (found != peers_.end() && ++found->second.bad >= limits_.bad_packets) {
    note(text_of(found->second.who) + " sends what is no message; its connection is closed");
    doom(connection, found->second);
  }
}

void Server::doom(Connection connection, Peer& peer) {
  if (std::exchange(peer.doomed, true)) return;
  ++dropped_;
  doomed_.push_back(connection);
  forget_unread(peer);
  // Wakes the loop, should this not be within handle().
  ::shutdown(peer.fd, SHUT_RDWR);
}

void Server::forget_unread(Peer& peer) {
  unread_bytes_ -= std::exchange(peer.unread_bytes, 0);
  peer.unread.clear();
}

void Server::close(Connection connection) {
  const auto found = peers_.find(connection);
  if (found == peers_.end()) return;
  unread_bytes_ -= found->second.unread_bytes;
  ::close(found->second.fd);  // takes it out of the epoll set
  peers_.erase(found);
  places_.give_back(connection);
  if (handlers_.closed) handlers_.closed(connection);
}

void Server::send(Connection connection, std::shared_ptr<const std::vector<std::uint8_t>> packet) {
  const auto found = peers_.find(connection);
  if (found == peers_.end() || found->second.doomed) return;
  Peer& peer = found->second;
  const bool waited = !peer.unread.empty();
  bytes_left_ -= std::min(bytes_left_, packet->size());
  peer.unread_bytes += packet->size();
  unread_bytes_ += packet->size();
  peer.unread.push_back(std::move(packet));
  // It may have read since. If it has left, what it has sent before, a stop perhaps, is still to be
  // read; then it is closed.
  const bool too_much = peer.unread_bytes > most_unread();
  if ((!waited || too_much) && !flush(peer)) return forget_unread(peer);
  if (peer.unread_bytes > most_unread()) return close_deaf(connection, peer);
  if (!waited && !peer.unread.empty()) watch(connection, peer, EPOLL_CTL_MOD);
  while (unread_bytes_ > most_unread_in_all()) relieve();
}

void Server::close_deaf(Connection connection, Peer& peer) {
  note(text_of(peer.who) + " does not read: " + std::to_string(peer.unread_bytes) +
       " bytes wait for it; its connection is closed");
  doom(connection, peer);
}

// Who reads, however late, does not go.
void Server::relieve() {
  const auto most = std::ranges::max_element(
      peers_, {}, [](const auto& entry) { return entry.second.unread_bytes; });
  Peer& peer = most->second;
  const std::size_t before = peer.unread_bytes;
  if (!flush(peer)) return forget_unread(peer);
  if (peer.unread_bytes == before) close_deaf(most->first, peer);
}

bool Server::flush(Peer& peer) {
  while (!peer.unread.empty()) {
    const std::vector<std::uint8_t>& packet = *peer.unread.front();
    const ssize_t n = ::send(peer.fd, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    peer.unread_bytes -= packet.size();
    unread_bytes_ -= packet.size();
    peer.unread.pop_front();
  }
  return true;
}

}  // namespace bushd::control
