// Keys as they are pressed, from a terminal that is as it was again afterwards.
#pragma once

#include <termios.h>

#include <optional>
#include <string>

namespace bushctl {

enum class Key { kLeft, kRight, kUp, kDown, kPlus, kMinus, kOther, kEnd };  // kEnd: it is gone

// Takes the keys that `bytes` begins with, and removes their bytes; of an escape sequence that is
// not complete nothing, unless `all`.
std::optional<Key> take_key(std::string& bytes, bool all);

// Standard input, one key at a time and without an echo; Ctrl-C still interrupts.
class Keys {
 public:
  Keys();
  ~Keys();
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;

  // Waits so long at most, 0: not at all.
  std::optional<Key> next(int timeout_ms);

 private:
  termios before_{};
  bool changed_ = false;
  bool ended_ = false;
  std::string bytes_;
};

}  // namespace bushctl
