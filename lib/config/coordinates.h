// The keys about a motor's units and soft limits; all may be left out.
#pragma once

#include <cstddef>

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

inline constexpr std::size_t kLongestUnit = 16;  // bytes

Result<void> read_coordinates(const tables::TomlReader& reader, Motor* motor);

}  // namespace bushd::config
