#pragma once

#include <string>
#include <string_view>

namespace bushtab {

// Precondition: a code point, below 0x110000.
void append_utf8(std::string& text, char32_t character);

// Bytes that are not UTF-8 become U+FFFD.
std::u32string from_utf8(std::string_view text);

}  // namespace bushtab
