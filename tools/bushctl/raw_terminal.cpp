#include "raw_terminal.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>

namespace bushctl {
namespace {

// So much is read at a time of what comes without an end.
constexpr std::size_t kMostAtOnce = 1 << 20;

}  // namespace

int RawTerminal::fd() {
  return STDIN_FILENO;
}

RawTerminal::RawTerminal() {
  if (tcgetattr(fd(), &before_) != 0) return;
  raw_ = before_;
  raw_.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | IEXTEN);
  // Ctrl-S must not keep this program from writing, and so from stopping a motor.
  raw_.c_iflag &= ~static_cast<tcflag_t>(IXON);
  raw_.c_cc[VMIN] = 0;
  raw_.c_cc[VTIME] = 0;
  // Keys like all others. Ctrl-C interrupts.
  raw_.c_cc[VSUSP] = _POSIX_VDISABLE;
  raw_.c_cc[VQUIT] = _POSIX_VDISABLE;
  changed_ = tcsetattr(fd(), TCSAFLUSH, &raw_) == 0;
}

RawTerminal::~RawTerminal() {
  if (changed_) tcsetattr(fd(), TCSAFLUSH, &before_);
}

std::optional<std::string> RawTerminal::read_all() {
  take_again();
  std::string bytes;
  pollfd input{.fd = fd(), .events = POLLIN, .revents = 0};
  while (bytes.size() < kMostAtOnce && poll(&input, 1, 0) > 0) {
    std::array<char, 4096> some{};
    const auto count = read(fd(), some.data(), some.size());
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) break;
    // A terminal that is readable and has nothing to read has hung up.
    if (count <= 0) return std::nullopt;
    bytes.append(some.data(), static_cast<std::size_t>(count));
  }
  return bytes;
}

void RawTerminal::suspend() {
  if (changed_) tcsetattr(fd(), TCSAFLUSH, &before_);
  std::raise(SIGTSTP);
  take_again();
}

// A shell that had it while this program was stopped has set it otherwise.
void RawTerminal::take_again() {
  termios now{};
  if (!changed_ || tcgetattr(fd(), &now) != 0) return;
  if ((now.c_lflag & (ICANON | ECHO)) != 0) tcsetattr(fd(), TCSAFLUSH, &raw_);
}

}  // namespace bushctl
