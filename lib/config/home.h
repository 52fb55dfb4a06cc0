// Private to lib/config: what a motor's `home` says.
#pragma once

#include "base/result.h"
#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Precondition: the motor's section has the key.
Result<Home> read_home(const tables::TomlReader& motor);

// Its speed, and where it is to move to once its switch was found. To be called when its units are
// known.
Result<void> check_home_in_units(const tables::TomlReader& reader, const Motor& motor);

}  // namespace bushd::config
