#include "utf8.h"

#include <cstddef>

namespace bushtab {
namespace {

constexpr char32_t kReplacement = 0xFFFD;

bool is_tail(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0) == 0x80;
}

// How many bytes follow a first one; 4: none is begun by it.
std::size_t tail_bytes(unsigned char first) {
  if (first < 0x80) return 0;
  if (first >= 0xC2 && first < 0xE0) return 1;
  if (first >= 0xE0 && first < 0xF0) return 2;
  return first >= 0xF0 && first < 0xF5 ? 3 : 4;
}

}  // namespace

void append_utf8(std::string& text, char32_t c) {
  const auto tail = [&](int shift) { text += static_cast<char>(0x80 | ((c >> shift) & 0x3F)); };
  if (c < 0x80) {
    text += static_cast<char>(c);
  } else if (c < 0x800) {
    text += static_cast<char>(0xC0 | (c >> 6));
    tail(0);
  } else if (c < 0x10000) {
    text += static_cast<char>(0xE0 | (c >> 12));
    tail(6);
    tail(0);
  } else {
    text += static_cast<char>(0xF0 | (c >> 18));
    tail(12);
    tail(6);
    tail(0);
  }
}

std::u32string from_utf8(std::string_view text) {
  std::u32string out;
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i++]);
    const std::size_t tail = tail_bytes(first);
    char32_t character = tail == 0 ? first : first & (0x3FU >> tail);
    std::size_t read = 0;
    while (read < tail && i < text.size() && is_tail(text[i])) {
      character = (character << 6) | (static_cast<unsigned char>(text[i++]) & 0x3FU);
      ++read;
    }
    out += read == tail ? character : kReplacement;
  }
  return out;
}

}  // namespace bushtab
