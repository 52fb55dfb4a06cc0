// CAMAC crates and their modules; there may be none.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Precondition: motors and groups have been read.
Result<void> read_crates(const tables::TomlReader& root, Config* config);

}  // namespace bushd::config
