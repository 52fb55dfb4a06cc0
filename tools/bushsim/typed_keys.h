// Keys that are typed at standard input, as they are pressed.
#pragma once

#include <termios.h>

#include <cstdint>
#include <optional>
#include <string>

#include "base/result.h"

namespace bushsim {

class TypedKeys {
 public:
  // A terminal hands keys out at once and does not echo them, for as long as this lives.
  TypedKeys();
  ~TypedKeys();
  TypedKeys(const TypedKeys&) = delete;
  TypedKeys& operator=(const TypedKeys&) = delete;

  // Readable when there are some.
  int fd() const;
  // Those that there are; "": no more will come. Precondition: it is readable.
  bushd::Result<std::string> read();

 private:
  termios before_{};
  const bool is_terminal_;
};

// The byte of a keypad: f forward, r reverse, s slower, x stop. Nothing: no key of it.
std::optional<std::uint8_t> keypad_byte_of(char key);

}  // namespace bushsim
