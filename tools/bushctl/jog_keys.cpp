#include "jog_keys.h"

#include <algorithm>

namespace bushctl {
namespace {

constexpr char kEscapeByte = '\x1b';
constexpr char kEndOfInput = '\x04';   // Ctrl-D
constexpr char kSuspendByte = '\x1a';  // Ctrl-Z
constexpr std::size_t kLongestSequence = 16;

// The length of the sequence that `bytes` begin with, an escape byte first: ESC, ESC O x, ESC [ ...
// x, where x is the first letter or the like. 0: it is not complete.
std::size_t sequence_length(std::string_view bytes) {
  if (bytes.size() == 1) return 0;
  if (bytes[1] == 'O') return bytes.size() < 3 ? 0 : 3;
  if (bytes[1] != '[') return 1;
  const auto ends = [](char byte) { return byte < ' ' || byte > '?'; };
  const auto last = std::find_if(bytes.begin() + 2, bytes.end(), ends);
  const auto length = static_cast<std::size_t>(last - bytes.begin()) + 1;
  if (length > kLongestSequence) return kLongestSequence;
  return last == bytes.end() ? 0 : length;
}

}  // namespace

std::optional<JogKeys::Key> JogKeys::take_key() {
  if (bytes_.empty()) return std::nullopt;
  const auto take = [this](std::size_t count, Key key) {
    bytes_.erase(0, count);
    return key;
  };
  switch (bytes_[0]) {
    case '+':
      return take(1, Key::kFaster);
    case '-':
      return take(1, Key::kSlower);
    case '*':
      return take(1, Key::kLonger);
    case '/':
      return take(1, Key::kShorter);
    case 'q':
    case 'Q':
    case kEndOfInput:
      return take(1, Key::kQuit);
    case kSuspendByte:
      return take(1, Key::kSuspend);
    case kEscapeByte:
      break;
    default:
      return take(1, Key::kOther);
  }
  const std::size_t length = sequence_length(bytes_);
  if (length == 0) return std::nullopt;
  constexpr std::array<Key, 4> kArrows = {Key::kUp, Key::kDown, Key::kRight, Key::kLeft};
  const char last = bytes_[length - 1];
  if (length == 3 && last >= 'A' && last <= 'D') {
    return take(length, kArrows[static_cast<std::size_t>(last - 'A')]);
  }
  return take(length, Key::kOther);
}

void JogKeys::read(Time now, std::string_view bytes) {
  Pressed pressed;
  if (!bytes_.empty() && now - bytes_at_ >= kEscape) {
    bytes_.clear();
    pressed.add(Key::kOther);
  }
  if (!bytes.empty()) {
    bytes_ += bytes;
    bytes_at_ = now;
  }
  while (const auto key = take_key()) pressed.add(*key);
  if (pressed.times(Key::kQuit) > 0) quits_ = true;
  if (pressed.times(Key::kSuspend) > 0) suspends_ = true;
  if (quits_ || suspends_ || pressed.times(Key::kOther) > 0) {
    stop();
  } else {
    take_amounts(now, pressed);
    take_arrows(now, pressed);
  }
  const bool jogs = course_ == Course::kLeft || course_ == Course::kRight;
  if (jogs && held_ && now - arrow_at_ >= kLetGo) stop();
}

void JogKeys::quit() {
  quits_ = true;
  stop();
}

void JogKeys::stop() {
  if (course_ != Course::kRest) course_ = Course::kStopping;
}

void JogKeys::rests(Time now, bool as_asked) {
  barred_ = !as_asked && course_ != Course::kStopping;
  if (barred_) arrow_at_ = now;
  course_ = Course::kRest;
}

void JogKeys::take_amounts(Time now, const Pressed& pressed) {
  const auto take = [&](Key key, int& changes, int by) {
    if (pressed.times(key) == 0) return;
    const bool repeated = amount_ == key && now - amount_at_ < kRepeat;
    amount_ = key;
    amount_at_ = now;
    if (!repeated) changes += by;
  };
  take(Key::kFaster, speed_, 1);
  take(Key::kSlower, speed_, -1);
  take(Key::kLonger, step_, 1);
  take(Key::kShorter, step_, -1);
}

void JogKeys::take_arrows(Time now, const Pressed& pressed) {
  constexpr std::array<std::pair<Key, Course>, 4> kArrows{{{Key::kLeft, Course::kLeft},
                                                           {Key::kRight, Course::kRight},
                                                           {Key::kUp, Course::kUp},
                                                           {Key::kDown, Course::kDown}}};
  std::optional<Course> arrow;
  bool several = false;
  bool repeated = false;
  for (const auto& [key, course] : kArrows) {
    if (pressed.times(key) == 0) continue;
    several = arrow.has_value();
    repeated = pressed.times(key) > 1;
    arrow = course;
  }
  if (several) return stop();
  if (arrow) take_arrow(now, *arrow, repeated);
}

void JogKeys::take_arrow(Time now, Course arrow, bool repeated) {
  if (course_ == Course::kStopping) return;
  if (course_ != Course::kRest && course_ != arrow) return stop();
  if (course_ == arrow) {
    held_ = true;
    arrow_at_ = now;
    return;
  }
  const bool still_held = barred_ && arrow == begun_ && now - arrow_at_ < kLetGo;
  arrow_at_ = now;
  if (still_held) return;
  barred_ = false;
  course_ = begun_ = arrow;
  held_ = repeated;
}

JogKeys::Time JogKeys::wake() const {
  Time at = Time::max();
  if (!bytes_.empty()) at = bytes_at_ + kEscape;
  const bool jogs = course_ == Course::kLeft || course_ == Course::kRight;
  if (jogs && held_) at = std::min(at, arrow_at_ + kLetGo);
  return at;
}

}  // namespace bushctl
