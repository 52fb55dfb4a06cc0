// The keys about inputs of an MCU and of a motor; all may be left out.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

Result<void> read_inputs(const tables::TomlReader& reader, Mcu* mcu);
Result<void> read_inputs(const tables::TomlReader& reader, Motor* motor);

}  // namespace bushd::config
