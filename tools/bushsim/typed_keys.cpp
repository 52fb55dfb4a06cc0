#include "typed_keys.h"

#include <unistd.h>

#include <array>

#include "descriptor.h"

namespace bushsim {
namespace {

constexpr std::size_t kKeysAtOnce = 256;

}  // namespace

TypedKeys::TypedKeys() : is_terminal_(::tcgetattr(STDIN_FILENO, &before_) == 0) {
  if (!is_terminal_) return;
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
}

TypedKeys::~TypedKeys() {
  if (is_terminal_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

int TypedKeys::fd() const {
  return STDIN_FILENO;
}

bushd::Result<std::string> TypedKeys::read() {
  std::array<char, kKeysAtOnce> keys;
  const ssize_t size = ::read(STDIN_FILENO, keys.data(), keys.size());
  if (size < 0) return bushd::fail(system_error("keys cannot be read"));
  return std::string(keys.data(), static_cast<std::size_t>(size));
}

std::optional<std::uint8_t> keypad_byte_of(char key) {
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

}  // namespace bushsim
