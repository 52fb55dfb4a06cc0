// Private to lib/config: [[pseudo]], axes that are computed from motors.
#pragma once

#include "base/result.h"
#include "config/sections.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// After the motors. Errors: motors of several buses, a matrix of another shape or whose rows depend
// on each other, a calibration that cannot be read, names and limits as everywhere.
Result<Pseudo> read_pseudo(const tables::TomlReader& reader, const Config& config);

}  // namespace bushd::config
