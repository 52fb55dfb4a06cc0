// One serial port, opened and set up with libserial, then read and written without blocking on a
// descriptor of its own: libserial's reads poll with sleeps, its writes spin, and its destructor
// ends the process after a hang-up (docs/decisions/0021-serial-ports.md).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

namespace bushd::serial {

class SerialPort {
 public:
  // 8 data bits, no parity, 1 stop bit, raw, no flow control; locked against other programs. `baud`
  // is one of libserial's fixed rates. Never blocks.
  static Result<SerialPort> open(const std::string& path, std::uint32_t baud);
  // The same at any rate that the driver can make, to 2 %: more than that bytes of 8N1 do not bear.
  static Result<SerialPort> open_any_rate(const std::string& path, std::uint32_t baud);

  SerialPort(SerialPort&& other) noexcept;
  SerialPort& operator=(SerialPort&& other) noexcept;
  ~SerialPort();

  int fd() const { return fd_; }
  const std::string& path() const { return path_; }

  // Appends what has arrived to `bytes`. An error means that the port is gone.
  Result<void> read(std::vector<std::uint8_t>& bytes);
  // Sends now what the driver takes and keeps the rest; wants_to_write() then asks for flush() when
  // the descriptor is writable. An error means that the port is gone or has taken nothing for very
  // long.
  Result<void> write(std::span<const std::uint8_t> bytes);
  Result<void> flush();
  bool wants_to_write() const { return !unsent_.empty(); }

 private:
  SerialPort(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}

  int fd_ = -1;
  std::string path_;
  std::vector<std::uint8_t> unsent_;
};

}  // namespace bushd::serial
