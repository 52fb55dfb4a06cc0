// What is kept over power cuts; all of it may be left out.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// `reader`: of [state].
Result<void> read_state(const tables::TomlReader& reader, Config* config);
// `restored` of a motor.
Result<void> read_restored(const tables::TomlReader& reader, Motor* motor);

}  // namespace bushd::config
