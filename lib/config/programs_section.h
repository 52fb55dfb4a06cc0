// What programs of an MCU may do (docs/programs.md).
#pragma once

#include "base/result.h"
#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Reads `programs_without_host` and `programs_at_power_on` of an `[[mcu]]`.
Result<void> read_programs(const tables::TomlReader& reader, Mcu* mcu);

}  // namespace bushd::config
