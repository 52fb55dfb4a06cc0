// Text from outside, for a terminal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace bushd {

struct Utf8Character {
  std::uint32_t code = 0;
  std::size_t bytes = 0;  // 0: what stands there is not UTF-8
};

// The first character. Precondition: there is one.
inline Utf8Character first_utf8_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return {byte(0), 1};
  const std::size_t bytes = byte(0) >= 0xF0 ? 4 : byte(0) >= 0xE0 ? 3 : 2;
  if (byte(0) < 0xC2 || byte(0) > 0xF4 || text.size() < bytes) return {};
  std::uint32_t code = byte(0) & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3FU);
  }
  // Longer than need be, surrogates, beyond Unicode.
  const bool bad = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000) ||
                   (code >= 0xD800 && code <= 0xDFFF) || code > 0x10FFFF;
  return bad ? Utf8Character{} : Utf8Character{code, bytes};
}

// Whether it steers a terminal, or the order in which what stands beside it is shown.
inline bool is_steering(std::uint32_t code) {
  const auto within = [&](std::uint32_t first, std::uint32_t last) {
    return code >= first && code <= last;
  };
  return code < 0x20 || within(0x7F, 0x9F) || code == 0x61C || within(0x200E, 0x200F) ||
         within(0x2028, 0x202E) || within(0x2066, 0x2069);
}

// What comes from the network or from somebody's file must not steer the terminal: control
// characters (C0, DEL, C1), those of writing direction and what is not UTF-8 are shown as \x1b and
// \u202e.
inline std::string printable(std::string_view text) {
  std::string out;
  char escaped[16];
  while (!text.empty()) {
    const Utf8Character character = first_utf8_character(text);
    const std::size_t bytes = character.bytes == 0 ? 1 : character.bytes;
    if (character.bytes == 0 || character.code < 0x80) {
      const bool plain = character.bytes != 0 && !is_steering(character.code);
      std::snprintf(escaped, sizeof escaped, "\\x%02x",
                    static_cast<unsigned>(static_cast<unsigned char>(text.front())));
      out += plain ? std::string(1, text.front()) : std::string(escaped);
    } else if (is_steering(character.code)) {
      std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(character.code));
      out += escaped;
    } else {
      out += text.substr(0, bytes);
    }
    text.remove_prefix(bytes);
  }
  return out;
}

// The same for text of several lines.
inline std::string printable_lines(std::string_view text) {
  std::string out;
  while (true) {
    const std::size_t end = text.find('\n');
    out += printable(text.substr(0, end));
    if (end == std::string_view::npos) return out;
    out += '\n';
    text.remove_prefix(end + 1);
  }
}

}  // namespace bushd
