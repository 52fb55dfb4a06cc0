// The bytes of a memory as text, for a store: two hexadecimal digits each.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace bushd::camac {

std::string to_text(std::span<const std::uint8_t> bytes);
// Nothing for a text that to_text() cannot have made.
std::optional<std::vector<std::uint8_t>> bytes_of(std::string_view text);

}  // namespace bushd::camac
