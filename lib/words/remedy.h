// Commands that a refusal or a result tells as its remedy: whole ones, with the motor's name, so
// that they can be pasted. A test runs each of them where it is told (tests/documents/remedies).
#pragma once

#include <string>
#include <string_view>

namespace bushd::words {

// "'bushctl set theta --dial POSITION'"; words in capitals are for the user to fill in.
inline std::string remedy(std::string_view verb, std::string_view motor,
                          std::string_view more = {}) {
  std::string command = "'bushctl ";
  command.append(verb).append(" ").append(motor);
  if (!more.empty()) command.append(" ").append(more);
  return command + "'";
}

// Says where a motor stands, whatever its unit is and however its position is trusted.
inline std::string set_remedy(std::string_view motor) {
  return remedy("set", motor, "--dial POSITION");
}

}  // namespace bushd::words
