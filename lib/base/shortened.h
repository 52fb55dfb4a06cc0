// What somebody has written, for a message that has to stay readable.
#pragma once

#include <string>
#include <string_view>

namespace bushd {

// Its beginning, if it is longer than that.
inline std::string shortened(std::string_view text, std::size_t most = 40) {
  if (text.size() <= most) return std::string(text);
  return std::string(text.substr(0, most)) + "...";
}

}  // namespace bushd
