// A serial port whose TXD makes the pulses of a motor, and its modem lines: DTR or RTS tells the
// direction, CD, DSR, CTS and RI are switches. Nothing here waits, and nothing that was written is
// ever taken back.
//
// A pty has no modem lines: then they are at a socket beside it, PATH.lines, where bushsim listens
// (lib/bus/port/line_socket.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "bus/port/line_socket.h"
#include "bus/port/serial_port.h"

namespace bushd::serial {

struct DirectionLine {
  bool rts = false;           // else DTR
  bool positive_off = false;  // it is off in the positive direction
};

class PulsePort {
 public:
  // As SerialPort::open. Error also: no modem lines.
  static Result<PulsePort> open(const std::string& path, DirectionLine direction);

  int fd() const { return port_.fd(); }
  const std::string& path() const { return port_.path(); }

  // Any whole number, else one of Linux' fixed rates; errors mean that the port is gone.
  bool any_rate() const { return any_rate_; }
  std::uint32_t divided_base() const { return base_; }  // 0: not known
  // Precondition: no byte is under way.
  Result<void> set_baud(std::uint32_t baud);
  Result<void> set_positive(bool positive);
  // Takes all of it, or fails: what is under way is far less than a driver's buffer.
  Result<void> write(std::span<const std::uint8_t> bytes);
  // What has come on RXD is thrown away.
  Result<void> discard_input();

  struct Status {
    std::uint32_t baud = 0;          // as made last; 0: none yet
    std::size_t queued = 0;          // bytes that the driver has not sent
    std::optional<bool> empty{};     // nothing is left behind it either; none: it cannot tell
    std::uint8_t lines = 0;          // bit 0 CD, 1 DSR, 2 CTS, 3 RI: on
    std::optional<bool> positive{};  // by the direction line, as it is
  };
  Result<Status> status();

 private:
  PulsePort(SerialPort port, DirectionLine direction)
      : port_(std::move(port)), direction_(direction) {}

  SerialPort port_;
  DirectionLine direction_;
  bool any_rate_ = false;
  std::uint32_t base_ = 0;
  std::uint32_t baud_ = 0;
  std::optional<LineSocket> simulated_;  // modem lines
  std::uint64_t written_ = 0;
};

}  // namespace bushd::serial
