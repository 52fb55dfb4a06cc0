#include "control/server.h"

#include <fcntl.h>
#include <grp.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace bushd::control {
namespace {

constexpr Server::Connection kListener = 0;
constexpr int kBacklog = 256;
// No connection waits longer to be accepted, not even where all connect at once.
constexpr std::int64_t kMostUnreadNs = 30'000'000'000;
constexpr std::size_t kAcceptedAtOnce = 64;

Error system_error(const std::string& what, const std::string& path) {
  return {.message = what + ": " + std::strerror(errno), .file = path};
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

// Closed unless it is released.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

int open_spare() {
  return ::open("/dev/null", O_RDONLY | O_CLOEXEC);
}

Result<void> give_to_group(const std::string& path, const std::string& group) {
  if (group.empty()) return {};
  const struct group* entry = ::getgrnam(group.c_str());
  if (entry == nullptr) {
    return fail(Error{.message = "there is no group \"" + group +
                                 "\" of users; make it, or "
                                 "change [control] group",
                      .file = path});
  }
  // A service whose unit has that group needs no right to give files away, and may have none.
  struct stat status{};
  if (::stat(path.c_str(), &status) == 0 && status.st_gid == entry->gr_gid) return {};
  if (::chown(path.c_str(), static_cast<uid_t>(-1), entry->gr_gid) != 0) {
    Error error = system_error("the socket cannot be given to group " + group, path);
    error.message +=
        ". Started by systemd: 'systemctl edit bushd' with [Service] and Group=" + group +
        "; else the daemon's user has to be in that group";
    return fail(std::move(error));
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Server>> Server::open(const std::string& path, const std::string& group,
                                             Limits limits) {
  sockaddr_un address{};
  if (path.size() >= sizeof address.sun_path) {
    return fail(Error{.message = "the path of the control socket is too long", .file = path});
  }
  std::error_code ignored;  // if it fails, so does what follows
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (std::filesystem::create_directory(folder, ignored)) ::chmod(folder.c_str(), 0755);
  // Who holds the lock may replace a socket that a daemon has left behind.
  const std::string lock_path = path + ".lock";
  auto taken = PidLock::take(lock_path);
  if (!taken.holder.empty()) {
    return fail(Error{.message = "another daemon has this control socket, " + taken.holder +
                                 "; end it, or give this one another [control] path",
                      .file = path});
  }
  if (!taken.lock) {
    return fail(
        Error{.message = "the control socket cannot be made: " + taken.error, .file = lock_path});
  }
  Descriptor listener(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (listener.get() < 0) return fail(system_error("the control socket cannot be made", path));
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  ::unlink(path.c_str());
  const mode_t mask = ::umask(0177);
  const int bound =
      ::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  ::umask(mask);
  if (bound != 0) return fail(system_error("the control socket cannot be made", path));
  if (const auto given = give_to_group(path, group); !given) return fail(given.error());
  if (::chmod(path.c_str(), 0660) != 0 || ::listen(listener.get(), kBacklog) != 0) {
    return fail(system_error("the control socket cannot be opened", path));
  }
  Descriptor epoll(::epoll_create1(EPOLL_CLOEXEC));
  if (epoll.get() < 0) return fail(system_error("epoll", path));
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = kListener;
  if (::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, listener.get(), &event) != 0) {
    return fail(system_error("epoll", path));
  }
  return std::unique_ptr<Server>(
      new Server(path, std::move(*taken.lock), listener.release(), epoll.release(), limits));
}

Server::Server(std::string path, PidLock lock, int listener, int epoll, Limits limits)
    : path_(std::move(path)),
      lock_(std::move(lock)),
      listener_(listener),
      epoll_(epoll),
      spare_(open_spare()),
      limits_(limits),
      buffer_(kMaxPacketBytes),
      nobody_came_ns_(now_ns()) {}

Server::~Server() {
  for (const auto& [connection, peer] : peers_) ::close(peer.fd);
  ::unlink(path_.c_str());
  ::close(listener_);
  ::close(epoll_);
  if (spare_ >= 0) ::close(spare_);
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
  for (std::size_t i = 0; i < kAcceptedAtOnce; ++i) {
    const std::int64_t before_ns = now_ns();
    const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0 && errno == EAGAIN) nobody_came_ns_ = before_ns;
    if (fd >= 0) {
      accept_one(fd);
    } else if (errno == EMFILE || errno == ENFILE) {
      // A connection that is not accepted would wake the loop for ever.
      ::close(std::exchange(spare_, -1));
      const int turned_away = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (turned_away >= 0) ::close(turned_away);
      spare_ = open_spare();
      if (turned_away < 0) return;
      ++dropped_;
    } else if (errno != ECONNABORTED && errno != EINTR) {
      return;
    }
  }
}

void Server::accept_one(int fd) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (peers_.size() >= limits_.connections ||
      ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) {
    ::close(fd);
    ++dropped_;
    return;
  }
  const Connection connection = ++last_;
  Peer& peer = peers_.emplace(connection, Peer{.fd = fd}).first->second;
  const int on = 1;
  static_cast<void>(::setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on));
  int waiting = 0;
  if (::ioctl(fd, FIONREAD, &waiting) == 0) {
    peer.unstamped_bytes = static_cast<std::size_t>(std::max(waiting, 0));
  }
  peer.connected_after_ns = nobody_came_ns_;
  watch(connection, peer, EPOLL_CTL_ADD);
  if (handlers_.opened) {
    handlers_.opened(connection,
                     {.pid = credentials.pid, .uid = credentials.uid, .gid = credentials.gid});
  }
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
    doom(connection, found->second);
  }
}

void Server::doom(Connection connection, Peer& peer) {
  if (std::exchange(peer.doomed, true)) return;
  ++dropped_;
  doomed_.push_back(connection);
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
  if (handlers_.closed) handlers_.closed(connection);
}

void Server::send(Connection connection, std::shared_ptr<const std::vector<std::uint8_t>> packet) {
  const auto found = peers_.find(connection);
  if (found == peers_.end() || found->second.doomed) return;
  Peer& peer = found->second;
  const std::size_t size = packet->size();
  const bool waited = !peer.unread.empty();
  if (peer.unread_bytes + size > limits_.unread_bytes ||
      unread_bytes_ + size > limits_.unread_bytes_in_all) {
    return doom(connection, peer);
  }
  peer.unread.push_back(std::move(packet));
  peer.unread_bytes += size;
  unread_bytes_ += size;
  if (waited) return;
  // It has left. What it has sent before, a stop perhaps, is still to be read; then it is closed.
  if (!flush(peer)) return forget_unread(peer);
  if (!peer.unread.empty()) watch(connection, peer, EPOLL_CTL_MOD);
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
