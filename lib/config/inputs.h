// The keys about inputs of an MCU and of a motor; all may be left out.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

Result<void> read_inputs(const tables::TomlReader& reader, Mcu* mcu);
// `has_limits`: beside those of these keys. Precondition: its output and `home` have been read.
Result<void> read_inputs(const tables::TomlReader& reader, bool has_limits, Motor* motor);

// The key `limit_action`. `has_limits`: beside `inputs`. Precondition: those have been read.
Result<void> read_limit_action(const tables::TomlReader& reader, bool has_limits, Motor* motor);

}  // namespace bushd::config
