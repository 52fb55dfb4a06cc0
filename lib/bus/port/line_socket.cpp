#include "bus/port/line_socket.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace bushd::serial {

Result<LineSocket> LineSocket::connect(const std::string& port) {
  const std::string path = path_of(port);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return fail("its path is too long for a socket");
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  LineSocket socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket.fd_ < 0 ||
      ::connect(socket.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return fail(std::string(std::strerror(errno)));
  }
  return socket;
}

LineSocket::~LineSocket() {
  if (fd_ >= 0) ::close(fd_);
}

Result<void> LineSocket::order(const LineOrder& order) {
  const ssize_t sent = ::send(fd_, &order, sizeof order, MSG_NOSIGNAL);
  // Full: as many orders wait already, and the last state is told for them too.
  if (sent == sizeof order || (sent < 0 && errno == EAGAIN)) return {};
  return fail("its simulated modem lines are gone");
}

Result<std::optional<LineState>> LineSocket::state() {
  for (;;) {
    LineState state;
    const ssize_t got = ::recv(fd_, &state, sizeof state, 0);
    if (got == sizeof state) {
      state_ = state;
      continue;
    }
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == EAGAIN) return state_;
    return fail("its simulated modem lines are gone");
  }
}

}  // namespace bushd::serial
