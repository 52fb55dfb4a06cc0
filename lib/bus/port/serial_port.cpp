#include "bus/port/serial_port.h"

#include <fcntl.h>
#include <libserial/SerialPort.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "base/console.h"
#include "bus/port/any_rate.h"

namespace bushd::serial {
namespace {

constexpr std::size_t kMaxUnsent =
    65536;  // over a second at any rate in use: nobody reads at the other end

struct Rate {
  std::uint32_t baud;
  LibSerial::BaudRate rate;
};
#define BUSHD_RATE(n) {n, LibSerial::BaudRate::BAUD_##n}
constexpr Rate kRates[] = {
    BUSHD_RATE(50),      BUSHD_RATE(75),      BUSHD_RATE(110),     BUSHD_RATE(134),
    BUSHD_RATE(150),     BUSHD_RATE(200),     BUSHD_RATE(300),     BUSHD_RATE(600),
    BUSHD_RATE(1200),    BUSHD_RATE(1800),    BUSHD_RATE(2400),    BUSHD_RATE(4800),
    BUSHD_RATE(9600),    BUSHD_RATE(19200),   BUSHD_RATE(38400),   BUSHD_RATE(57600),
    BUSHD_RATE(115200),  BUSHD_RATE(230400),  BUSHD_RATE(460800),  BUSHD_RATE(500000),
    BUSHD_RATE(576000),  BUSHD_RATE(921600),  BUSHD_RATE(1000000), BUSHD_RATE(1152000),
    BUSHD_RATE(1500000), BUSHD_RATE(2000000), BUSHD_RATE(2500000), BUSHD_RATE(3000000),
    BUSHD_RATE(3500000), BUSHD_RATE(4000000)};
#undef BUSHD_RATE

Error port_error(const std::string& path, const std::string& what, int error) {
  return {.message = what + ": " + std::strerror(error), .file = path};
}

// Locked before anything is changed: a second program must not disturb the line of the first. And
// only a tty that can be opened reaches libserial: a SerialPort whose Open failed half-way cannot
// be destroyed.
Result<int> open_and_lock(const std::string& path) {
  if (is_console(path)) {
    return fail(Error{.message = "is a console, not a serial port; name the port that the bus is "
                                 "connected to",
                      .file = path});
  }
  const int fd = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    const int error = errno;
    const char* what =
        error == EACCES ? "may not be opened (is the user in group dialout?)" : "cannot be opened";
    return fail(port_error(path, what, error));
  }
  const char* why_not = nullptr;
  if (::isatty(fd) != 1) {
    why_not = "is no serial port";
  } else if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    why_not = "is in use by another program";
  }
  if (why_not == nullptr) return fd;
  ::close(fd);
  return fail(Error{.message = why_not, .file = path});
}

// The set-up that libserial does well, kept on a descriptor that does not depend on it.
Result<void> set_up_with_libserial(const std::string& path, int fd, LibSerial::BaudRate rate) {
  auto port = std::make_unique<LibSerial::SerialPort>();
  try {
    port->Open(path);
    port->SetBaudRate(rate);
    port->SetCharacterSize(LibSerial::CharacterSize::CHAR_SIZE_8);
    port->SetParity(LibSerial::Parity::PARITY_NONE);
    port->SetStopBits(LibSerial::StopBits::STOP_BITS_1);
    port->SetFlowControl(LibSerial::FlowControl::FLOW_CONTROL_NONE);
    // Close() puts the old settings back: keep ours over it.
    termios settings{};
    const bool kept = ::tcgetattr(fd, &settings) == 0;
    port->Close();
    // With VMIN 0 a read of an empty line would give 0, as after a hang-up.
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    if (!kept || ::tcsetattr(fd, TCSANOW, &settings) != 0 || ::tcflush(fd, TCIOFLUSH) != 0) {
      return fail(port_error(path, "cannot be set up", errno));
    }
    return {};
  } catch (const std::exception& e) {
    // Its destructor would call std::terminate; some hundred bytes are the lesser loss.
    static_cast<void>(port.release());
    return fail(Error{.message = std::string("cannot be set up: ") + e.what(), .file = path});
  }
}

void ask_for_low_latency(int fd) {
  // USB adapters hold bytes back for up to 16 ms otherwise. A pty and many drivers do not know it:
  // then it stays.
  serial_struct serial{};
  if (::ioctl(fd, TIOCGSERIAL, &serial) != 0) return;
  serial.flags |= ASYNC_LOW_LATENCY;
  static_cast<void>(::ioctl(fd, TIOCSSERIAL, &serial));
}

}  // namespace

Result<SerialPort> SerialPort::open(const std::string& path, std::uint32_t baud) {
  const Rate* rate = nullptr;
  for (const Rate& candidate : kRates) {
    if (candidate.baud == baud) rate = &candidate;
  }
  if (rate == nullptr) {
    return fail(Error{.message = "has no rate of " + std::to_string(baud) + " baud", .file = path});
  }
  const auto fd = open_and_lock(path);
  if (!fd) return fail(fd.error());
  SerialPort port(*fd, path);
  if (const auto ready = set_up_with_libserial(path, *fd, rate->rate); !ready) {
    return fail(ready.error());
  }
  ask_for_low_latency(*fd);
  return port;
}

Result<SerialPort> SerialPort::open_any_rate(const std::string& path, std::uint32_t baud) {
  constexpr std::uint32_t kOpened = 9600;  // every driver has it
  auto port = open(path, kOpened);
  if (!port) return port;
  const std::uint32_t made = set_any_rate(port->fd(), baud);
  const std::uint64_t off = made > baud ? made - baud : baud - made;
  if (made != 0 && off * 50 <= baud) return port;
  return fail(
      Error{.message = "cannot be set to " + std::to_string(baud) + " baud; its driver makes " +
                       (made == 0 ? std::string("fixed rates only") : std::to_string(made)) +
                       ". Use another adapter, or another rate at both ends",
            .file = path});
}

SerialPort::SerialPort(SerialPort&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      path_(std::move(other.path_)),
      unsent_(std::move(other.unsent_)) {}

SerialPort& SerialPort::operator=(SerialPort&& other) noexcept {
  if (this != &other) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = std::exchange(other.fd_, -1);
    path_ = std::move(other.path_);
    unsent_ = std::move(other.unsent_);
  }
  return *this;
}

SerialPort::~SerialPort() {
  if (fd_ >= 0) ::close(fd_);
}

Result<void> SerialPort::read(std::vector<std::uint8_t>& bytes) {
  std::uint8_t buffer[4096];
  const ssize_t n = ::read(fd_, buffer, sizeof buffer);
  if (n > 0) {
    bytes.insert(bytes.end(), buffer, buffer + n);
    return {};
  }
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  return fail(n == 0 ? std::string("hung up") : std::string(std::strerror(errno)));
}

Result<void> SerialPort::write(std::span<const std::uint8_t> bytes) {
  if (unsent_.size() + bytes.size() > kMaxUnsent) return fail("takes no more bytes");
  unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
  return flush();
}

Result<void> SerialPort::flush() {
  while (!unsent_.empty()) {
    const ssize_t n = ::write(fd_, unsent_.data(), unsent_.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EAGAIN) return {};
    if (n < 0) return fail(std::string(std::strerror(errno)));
    unsent_.erase(unsent_.begin(), unsent_.begin() + n);
  }
  return {};
}

}  // namespace bushd::serial
