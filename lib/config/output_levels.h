// Private to lib/config: at which levels drivers do what they are to do (enable_active,
// step_active, direction_active).
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// The keys of an [[mcu]], for all of its outputs. Precondition: its emission has been read.
Result<void> read_output_levels(const tables::TomlReader& reader, Mcu* mcu);

// Those of a motor at one of its outputs, which count before them.
Result<void> read_output_levels(const tables::TomlReader& reader, Output output, Mcu* mcu);

}  // namespace bushd::config
