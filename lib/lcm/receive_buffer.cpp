#include "lcm/receive_buffer.h"

#include <sys/socket.h>

namespace bushd::lcm {
namespace {

int receive_buffer(int socket) {
  int bytes = 0;
  socklen_t size = sizeof bytes;
  return getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, &size) == 0 ? bytes : 0;
}

}  // namespace

void enlarge_receive_buffer(int socket) {
  const int before = receive_buffer(socket);
  if (before >= 2 * kReceiveBufferBytes) return;
  const auto set = [socket](int name, int bytes) {
    return setsockopt(socket, SOL_SOCKET, name, &bytes, sizeof bytes) == 0;
  };
  if (set(SO_RCVBUFFORCE, kReceiveBufferBytes)) return;
  set(SO_RCVBUF, kReceiveBufferBytes);
  // A default above the maximum is more than the kernel gives to who asks.
  if (receive_buffer(socket) < before) set(SO_RCVBUF, before / 2);
}

}  // namespace bushd::lcm
