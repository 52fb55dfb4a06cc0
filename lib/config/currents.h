// Private to lib/config: what a motor's `currents` says.
#pragma once

#include <optional>

#include "base/result.h"
#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Nothing without the key. `mcu` is the motor's.
Result<std::optional<Currents>> read_currents(const tables::TomlReader& motor, const Mcu& mcu);

}  // namespace bushd::config
