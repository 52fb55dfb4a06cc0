#include "heritage/camac/naf.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace bushd::camac {
namespace {

constexpr std::array<std::string_view, 4> kModes{"single", "repeat", "q-stop", "scan"};

}  // namespace

std::string_view word(BlockMode mode) {
  return kModes[static_cast<std::size_t>(mode)];
}

std::optional<BlockMode> block_mode_of(std::string_view word) {
  const auto found = std::ranges::find(kModes, word);
  if (found == kModes.end()) return std::nullopt;
  return static_cast<BlockMode>(found - kModes.begin());
}

}  // namespace bushd::camac
