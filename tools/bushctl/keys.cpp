#include "keys.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>

namespace bushctl {
namespace {

constexpr char kEscape = '\x1b';
constexpr char kEndOfInput = '\x04';

}  // namespace

std::optional<Key> take_key(std::string& bytes, bool all) {
  if (bytes.empty()) return std::nullopt;
  const auto take = [&bytes](std::size_t count, Key key) {
    bytes.erase(0, count);
    return key;
  };
  switch (bytes[0]) {
    case '+':
      return take(1, Key::kPlus);
    case '-':
      return take(1, Key::kMinus);
    case kEndOfInput:
      return take(1, Key::kEnd);
    case kEscape:
      break;
    default:
      return take(1, Key::kOther);
  }
  if (bytes.size() < 3 && !all && (bytes.size() < 2 || bytes[1] == '[' || bytes[1] == 'O')) {
    return std::nullopt;
  }
  constexpr std::array<Key, 4> kArrows = {Key::kUp, Key::kDown, Key::kRight, Key::kLeft};
  if (bytes.size() >= 3 && (bytes[1] == '[' || bytes[1] == 'O') && bytes[2] >= 'A' &&
      bytes[2] <= 'D') {
    return take(3, kArrows[static_cast<std::size_t>(bytes[2] - 'A')]);
  }
  return take(bytes.size(), Key::kOther);
}

Keys::Keys() {
  if (tcgetattr(STDIN_FILENO, &before_) != 0) return;
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  changed_ = tcsetattr(STDIN_FILENO, TCSAFLUSH, &raw) == 0;
}

Keys::~Keys() {
  if (changed_) tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
}

std::optional<Key> Keys::next(int timeout_ms) {
  if (auto key = take_key(bytes_, false)) return key;
  if (ended_) return Key::kEnd;
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  if (poll(&input, 1, timeout_ms) <= 0) return take_key(bytes_, true);
  std::array<char, 64> read_now{};
  const auto count = read(STDIN_FILENO, read_now.data(), read_now.size());
  // A terminal that has nothing to read has hung up, for it was readable.
  ended_ = count == 0 || (count < 0 && errno != EINTR && errno != EAGAIN);
  if (count > 0) bytes_.append(read_now.data(), static_cast<std::size_t>(count));
  if (auto key = take_key(bytes_, false)) return key;
  return ended_ ? std::optional(Key::kEnd) : std::nullopt;
}

}  // namespace bushctl
