#include "key.h"

#include "utf8.h"

namespace bushtab {
namespace {

bool is_text(Key key) {
  return key >= U' ' && key != 0x7F && key < key::kLeft;
}

bool starts_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0) != 0x80;
}

}  // namespace

void type_key(std::string& text, Key key, std::size_t max_bytes) {
  if (key == key::kBackspace) {
    while (!text.empty() && !starts_character(text.back())) text.pop_back();
    if (!text.empty()) text.pop_back();
  } else if (is_text(key) && text.size() < max_bytes) {
    append_utf8(text, key);
  }
}

const std::vector<KeyHelp>& key_help() {
  static const std::vector<KeyHelp> kHelp{
      {"Left Right", "one step"},
      {"PgUp PgDn", "a twentieth of the table"},
      {"Home End Tab", "first step, last step, cruise and the end"},
      {"g", "go to an index"},
      {"Space", "mark: the steps from here to the cursor; Esc unmarks"},
      {"Up Down - +", "codes one less (faster) or more (slower)"},
      {"> <", "speed 1 % up or down"},
      {"%", "speed up or down by a number of percent"},
      {"0..9", "type a code"},
      {"i d", "insert a copy of the code, delete codes"},
      {"m", "decel a mirror of accel, or a side by itself"},
      {"u r", "undo, redo"},
      {"z", "the curve near the cursor, or all of it"},
      {"s w", "save, save as another table"},
      {"q", "quit"},
  };
  return kHelp;
}

}  // namespace bushtab
