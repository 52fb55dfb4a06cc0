// Text from outside, for a terminal.
#pragma once

#include <algorithm>
#include <string>

namespace bushd {

// What comes from the network or from somebody's file must not steer the terminal: control
// characters become '?'.
inline std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
  return text;
}

}  // namespace bushd
