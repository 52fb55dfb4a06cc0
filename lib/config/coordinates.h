// The keys about a motor's units and soft limits; all may be left out.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

Result<void> read_coordinates(const tables::TomlReader& reader, Motor* motor);

}  // namespace bushd::config
