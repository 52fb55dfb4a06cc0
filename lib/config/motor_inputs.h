// Which inputs of its MCU a motor has: `inputs`, and the older keys that mean its one input.
#pragma once

#include <optional>

#include "config/config.h"
#include "config/sections.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// `own_open`: what input_active says of the input with the number of its output, if it is there.
// Precondition: its output and `home` have been read.
Result<void> read_motor_inputs(const tables::TomlReader& reader, std::optional<bool> own_open,
                               Motor* motor);

// No input is asked for by two motors that cannot share it, or at two levels.
Result<void> check_motor_inputs(const Loading& loading);

}  // namespace bushd::config
