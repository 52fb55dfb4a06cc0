#include <fmt/format.h>
#include <grp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "client/link.h"
#include "control/packet.h"

namespace bushd::client {
namespace {

constexpr int kEndsWithinMs = 200;
constexpr int kPacketsAtOnce = 256;

// Precondition: it fits.
sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  return address;
}

// Who has a right to this socket, and how one becomes one of them.
std::string no_right(const std::string& path) {
  struct stat status{};
  const group* entry = ::stat(path.c_str(), &status) == 0 ? ::getgrgid(status.st_gid) : nullptr;
  if (entry != nullptr && entry->gr_gid == 0) {
    return "this user has no right to the control socket: it is for root only. Set [control] group "
           "in bushd.toml, and restart bushd";
  }
  if (entry == nullptr) return "this user has no right to the control socket";
  return fmt::format(
      "this user has no right to the control socket: it is for the group {0}. Run 'sudo usermod "
      "-aG {0} USER', then log in again",
      entry->gr_name);
}

// There is no daemon behind this path, as connect() says.
std::string no_daemon(const std::string& path, int error, const std::string& another) {
  const std::string start =
      "Start it with 'sudo systemctl start bushd', or 'bushd --config FILE'; for another daemon "
      "use " +
      another;
  if (error == ENOENT || error == ENOTDIR) {
    return fmt::format("no control socket at {}: bushd is not running. {}", path, start);
  }
  if (error == ECONNREFUSED) {
    return fmt::format("nobody listens at the control socket {}: bushd has ended. {}", path, start);
  }
  if (error == EAGAIN) {
    return fmt::format(
        "bushd takes no connection at {}: it hangs, or others take all of its time; its log may "
        "tell why",
        path);
  }
  return fmt::format("no bushd at the control socket {}: {}. {}", path, std::strerror(error),
                     start);
}

// Whether somebody listens there still, and goes on: a process that ends closes its descriptors one
// after the other, and what waits at the socket with it. Nobody is asked.
bool is_served(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const sockaddr_un address = address_of(path);
  bool served = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  pollfd polled{.fd = fd, .events = POLLIN, .revents = 0};
  if (served && ::poll(&polled, 1, kEndsWithinMs) > 0) served = (polled.revents & POLLHUP) == 0;
  if (fd >= 0) ::close(fd);
  return served;
}

// `looks`: it may take a moment to find out.
std::string why_closed(const std::string& path, bool looks) {
  if (!looks) {
    return fmt::format(
        "the daemon has ended, or has closed this connection at {}: it has restarted, or this "
        "client did not read what it was sent; its log tells why",
        path);
  }
  if (!is_served(path)) return fmt::format("the daemon has ended; it was at {}", path);
  return fmt::format(
      "bushd has closed this connection at {}: too many clients are connected, this one did not "
      "read what it was sent, or the daemon has restarted; its log tells why",
      path);
}

class SocketLink : public Link {
 public:
  SocketLink(int fd, std::string path, std::chrono::milliseconds send_within)
      : fd_(fd),
        path_(std::move(path)),
        send_within_ms_(static_cast<int>(send_within.count())),
        buffer_(control::kMaxPacketBytes) {}
  ~SocketLink() override { ::close(fd_); }

  int fd() const override { return fd_; }

  Result<void> send(const lcm::Packet& packet) override {
    const auto bytes = control::packet_of(packet);
    // A daemon that is busy takes it a moment later.
    pollfd polled{.fd = fd_, .events = POLLOUT, .revents = 0};
    ::poll(&polled, 1, send_within_ms_);
    if (::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
      return fail(
          fmt::format("the daemon does not take messages at {}: {}", path_, std::strerror(errno)));
    }
    return {};
  }

  Result<void> handle(const Handler& handler) override {
    for (int i = 0; i < kPacketsAtOnce; ++i) {
      iovec part{.iov_base = buffer_.data(), .iov_len = buffer_.size()};
      msghdr header{};
      header.msg_iov = &part;
      header.msg_iovlen = 1;
      const ssize_t n = ::recvmsg(fd_, &header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
      if (n < 0 && (errno == EAGAIN || errno == EINTR)) return {};
      if (n <= 0) return fail(why_closed(path_, send_within_ms_ > 0));
      if ((header.msg_flags & MSG_TRUNC) != 0) continue;
      const auto view = control::view_of({buffer_.data(), static_cast<std::size_t>(n)});
      if (!view) continue;
      if (const auto message = lcm::decode_daemon_message(view->channel, view->payload)) {
        handler(*message);
      }
    }
    return {};
  }

  bool loses() const override { return false; }
  std::string remedy() const override {
    return fmt::format("bushd does not answer at {}; its log may tell why", path_);
  }

 private:
  int fd_;
  std::string path_;
  int send_within_ms_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace

Result<std::unique_ptr<Link>> open_socket(const std::string& path, const std::string& another,
                                          Patience patience) {
  if (path.size() >= sizeof sockaddr_un{}.sun_path) {
    return fail(Error{.message = "the path of the control socket is too long", .file = path});
  }
  // connect() waits for room among those that a daemon has not taken yet.
  const auto connect_ms = patience.connect.count();
  const int waits = connect_ms == 0 ? SOCK_NONBLOCK : 0;
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | waits, 0);
  if (fd < 0) return fail(std::string("no socket: ") + std::strerror(errno));
  auto link = std::make_unique<SocketLink>(fd, path, patience.send);
  const timeval within{.tv_sec = connect_ms / 1000, .tv_usec = connect_ms % 1000 * 1000};
  ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &within, sizeof within);
  const sockaddr_un address = address_of(path);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    if (error == EACCES) return fail(Error{.message = no_right(path), .file = path});
    return fail(no_daemon(path, error, another));
  }
  return link;
}

bool is_barred(const std::string& path) {
  return ::access(path.c_str(), R_OK | W_OK) != 0 && errno == EACCES;
}

}  // namespace bushd::client
