// [[keypad]]: boxes with keys on serial lines of their own; there may be none.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Precondition: buses and motors have been read.
Result<Keypad> read_keypad(const tables::TomlReader& reader, const Config& config);

}  // namespace bushd::config
