// Private to lib/config: what a motor's `velocity` says.
#pragma once

#include <optional>

#include "base/result.h"
#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Nothing without the key. `motor` has been given `local` and `keypad`.
Result<std::optional<Velocity>> read_velocity(const tables::TomlReader& reader, const Motor& motor);

}  // namespace bushd::config
