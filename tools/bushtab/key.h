// Keys of the full-screen editor, and the line of text that they write.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace bushtab {

// A character is its code point; keys without one come after Unicode.
using Key = char32_t;
namespace key {
inline constexpr Key kBackspace = 0x08;
inline constexpr Key kTab = 0x09;
inline constexpr Key kEnter = 0x0A;
inline constexpr Key kCtrlR = 0x12;
inline constexpr Key kCtrlS = 0x13;
inline constexpr Key kEscape = 0x1B;
inline constexpr Key kLeft = 0x110000;
inline constexpr Key kRight = 0x110001;
inline constexpr Key kUp = 0x110002;
inline constexpr Key kDown = 0x110003;
inline constexpr Key kPageUp = 0x110004;
inline constexpr Key kPageDown = 0x110005;
inline constexpr Key kHome = 0x110006;
inline constexpr Key kEnd = 0x110007;
inline constexpr Key kDelete = 0x110008;
}  // namespace key

// Takes a character to the text or the last one away.
void type_key(std::string& text, Key key, std::size_t max_bytes);

// Keys and what they do, for a page of help.
struct KeyHelp {
  const char* keys;
  const char* what;
};
const std::vector<KeyHelp>& key_help();

}  // namespace bushtab
