#include "bus/port/pulse_port.h"

#include <linux/serial.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "bus/port/any_rate.h"

namespace bushd::serial {
namespace {

constexpr std::uint32_t kFirstRate = 9600;
// No rate of a list: what a driver makes of it tells whether it has others.
constexpr std::uint32_t kOddRate = 12'345;

// The clock that an UART divides; not of adapters, which do it in their own ways.
std::uint32_t base_of(int fd) {
  serial_struct serial{};
  if (::ioctl(fd, TIOCGSERIAL, &serial) != 0 || serial.type == PORT_UNKNOWN) return 0;
  return serial.baud_base > 0 ? static_cast<std::uint32_t>(serial.baud_base) : 0;
}

tl::unexpected<Error> gone() {
  return fail(std::string(std::strerror(errno)));
}

}  // namespace

Result<PulsePort> PulsePort::open(const std::string& path, DirectionLine direction) {
  auto opened = SerialPort::open(path, kFirstRate);
  if (!opened) return fail(opened.error());
  PulsePort port(std::move(*opened), direction);
  int lines = 0;
  if (::ioctl(port.fd(), TIOCMGET, &lines) != 0) {
    auto simulated = LineSocket::connect(path);
    if (!simulated) {
      return fail(Error{.message = "has no modem lines, and there are no simulated ones at " +
                                   LineSocket::path_of(path) + ": " + simulated.error().message +
                                   "; name a serial port with DTR, RTS and inputs, or start "
                                   "bushsim first",
                        .file = path});
    }
    port.simulated_.emplace(std::move(*simulated));
    static_cast<void>(port.simulated_->order({}));
  }
  const std::uint32_t made = set_any_rate(port.fd(), kOddRate);
  port.any_rate_ = made > kOddRate - kOddRate / 50 && made < kOddRate + kOddRate / 50;
  if (set_any_rate(port.fd(), kFirstRate) == 0) {
    return fail(Error{.message = "cannot be set to a baud rate", .file = path});
  }
  port.base_ = base_of(port.fd());
  return port;
}

Result<void> PulsePort::set_baud(std::uint32_t baud) {
  baud_ = set_any_rate(fd(), baud);
  return baud_ > 0 ? Result<void>() : gone();
}

Result<void> PulsePort::set_positive(bool positive) {
  const bool on = positive != direction_.positive_off;
  if (simulated_) {
    return simulated_->order({.sets = 1, .direction_on = on ? std::uint8_t{1} : std::uint8_t{0}});
  }
  const int line = direction_.rts ? TIOCM_RTS : TIOCM_DTR;
  return ::ioctl(fd(), on ? TIOCMBIS : TIOCMBIC, &line) == 0 ? Result<void>() : gone();
}

Result<void> PulsePort::write(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return {};
  if (auto written = port_.write(bytes); !written) return written;
  written_ += bytes.size();
  if (port_.wants_to_write()) return fail("takes no more bytes");
  return {};
}

Result<void> PulsePort::discard_input() {
  std::vector<std::uint8_t> bytes;
  return port_.read(bytes);
}

Result<PulsePort::Status> PulsePort::status() {
  Status status{.baud = baud_};
  if (simulated_) {
    const auto state = simulated_->state();
    if (!state) return fail(state.error());
    if (auto asked = simulated_->order({}); !asked) return fail(asked.error());
    if (!*state) {
      status.queued = 1;  // not told yet
      return status;
    }
    status.queued = written_ - (*state)->left;
    status.empty = status.queued == 0;
    status.lines = (*state)->lines;
    status.positive = ((*state)->direction_on != 0) != direction_.positive_off;
    return status;
  }
  int lines = 0;
  int queued = 0;
  if (::ioctl(fd(), TIOCMGET, &lines) != 0 || ::ioctl(fd(), TIOCOUTQ, &queued) != 0) return gone();
  status.queued = static_cast<std::size_t>(queued);
  unsigned state = 0;
  if (::ioctl(fd(), TIOCSERGETLSR, &state) == 0) status.empty = (state & TIOCSER_TEMT) != 0;
  const auto on = [lines](int line, unsigned bit) { return (lines & line) != 0 ? 1u << bit : 0u; };
  status.lines = static_cast<std::uint8_t>(on(TIOCM_CD, 0) | on(TIOCM_DSR, 1) | on(TIOCM_CTS, 2) |
                                           on(TIOCM_RI, 3));
  const bool direction_on = (lines & (direction_.rts ? TIOCM_RTS : TIOCM_DTR)) != 0;
  status.positive = direction_on != direction_.positive_off;
  return status;
}

}  // namespace bushd::serial
