#include "keypad.h"

#include <fmt/core.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "descriptor.h"
#include "pty.h"
#include "waiter.h"

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;

constexpr bushd::sim::TimeNs kLookNs = 20'000'000;  // after what the other side has written
constexpr std::size_t kKeysAtOnce = 256;

// Keys are read as they are pressed, for as long as this lives.
class RawInput {
 public:
  RawInput() : is_terminal_(::tcgetattr(STDIN_FILENO, &before_) == 0) {
    if (!is_terminal_) return;
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  ~RawInput() {
    if (is_terminal_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }
  RawInput(const RawInput&) = delete;
  RawInput& operator=(const RawInput&) = delete;

 private:
  termios before_{};
  const bool is_terminal_;
};

std::optional<std::uint8_t> byte_of(char key) {
  switch (key) {
    case 'f':
      return std::uint8_t{0x00};
    case 'r':
      return std::uint8_t{0xFF};
    case 's':
      return std::uint8_t{0xFE};
    case 'x':
      return std::uint8_t{0xFD};
    default:
      return std::nullopt;
  }
}

// False: there are no more.
Result<bool> take_keys(Pty& pty) {
  std::array<char, kKeysAtOnce> keys;
  const ssize_t size = ::read(STDIN_FILENO, keys.data(), keys.size());
  if (size < 0) return fail(system_error("keys cannot be read"));
  std::vector<std::uint8_t> bytes;
  for (const char key : std::span(keys.data(), static_cast<std::size_t>(size))) {
    if (const auto byte = byte_of(key)) bytes.push_back(*byte);
  }
  if (const auto written = pty.write(bytes); !written) return fail(written.error());
  return size > 0;
}

// True: there was something.
Result<bool> show(Pty& pty) {
  std::array<std::uint8_t, kKeysAtOnce> shown;
  const auto size = pty.read(shown);
  if (!size) return fail(size.error());
  for (const std::uint8_t byte : std::span(shown.data(), *size)) {
    const bool plain = byte == '\n' || (byte >= ' ' && byte <= '~');
    if (plain) std::fputc(byte, stdout);
  }
  std::fflush(stdout);
  return *size > 0;
}

}  // namespace

Result<void> run_keypad(const std::string& link) {
  auto pty = Pty::open(link);
  if (!pty) return fail(pty.error());
  const auto waiter = Waiter::create();
  if (!waiter) return fail(waiter.error());
  const RawInput input;
  fmt::print("bushsim: ready {}\nkeys: f forward, r reverse, s slower, x stop\n", link);
  std::fflush(stdout);
  while (true) {
    const auto readable = waiter->wait({STDIN_FILENO}, kLookNs);
    if (!readable) return fail(readable.error());
    if (const auto shown = show(*pty); !shown) {
      return fail(shown.error());
    } else if (!*shown) {
      pty->lift_exclusive_use();
    }
    if (waiter->signal()) return {};
    if (*readable == 0) continue;
    const auto more = take_keys(*pty);
    if (!more) return fail(more.error());
    if (!*more) return {};
  }
}

}  // namespace bushsim
