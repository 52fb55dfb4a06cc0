#include "bus/rs485/unique_id.h"

#include <cstdint>

namespace bushd::link {

std::string unique_id_text(const bushd_identity& identity) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : identity.unique_id) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

}  // namespace bushd::link
