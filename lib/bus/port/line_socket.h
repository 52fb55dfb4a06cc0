// Modem lines of a simulated port: a Unix socket (SOCK_SEQPACKET) beside the pty, PATH.lines, where
// the simulation listens. Two kinds of packets, each of one struct in the machine's byte order, for
// both ends are on one machine:
//
//     to the simulation     LineOrder: what the direction line is to be; each is answered
//     from the simulation   LineState: what the lines are, and how many bytes have left
//
// Nobody waits: a port that asks has the answer to what it asked before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "base/result.h"

namespace bushd::serial {

struct LineOrder {
  std::uint8_t sets = 0;  // 1: `direction_on` is an order, 0: only asks
  std::uint8_t direction_on = 0;
};

struct LineState {
  std::uint8_t lines = 0;  // bit 0 CD, 1 DSR, 2 CTS, 3 RI
  std::uint8_t direction_on = 0;
  std::uint8_t unused[6] = {};
  std::uint64_t left = 0;  // bytes that have left completely since this socket was connected
};

// The end of the port.
class LineSocket {
 public:
  static std::string path_of(const std::string& port) { return port + ".lines"; }
  static Result<LineSocket> connect(const std::string& port);
  LineSocket(LineSocket&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), state_(other.state_) {}
  LineSocket& operator=(LineSocket&& other) noexcept {
    std::swap(fd_, other.fd_);
    state_ = other.state_;
    return *this;
  }
  ~LineSocket();

  Result<void> order(const LineOrder& order);
  // As told last; none: nothing yet.
  Result<std::optional<LineState>> state();

 private:
  explicit LineSocket(int fd) : fd_(fd) {}

  int fd_ = -1;
  std::optional<LineState> state_;
};

}  // namespace bushd::serial
