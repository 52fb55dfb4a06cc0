// The bytes of a keypad, as its keys send them (docs/protocol.md, LOCAL). They are stated here once
// more, so that tests do not take them from what they test.
#pragma once

#include <cstdint>

namespace bushd::test {

enum KeypadByte : std::uint8_t {
  kKeyForward = 0x00,
  kKeyReverse = 0xFF,
  kKeySlower = 0xFE,
  kKeyStop = 0xFD
};

}  // namespace bushd::test
