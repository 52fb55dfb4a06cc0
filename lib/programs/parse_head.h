// What a file of a program says before its frames.
#pragma once

#include "base/result.h"
#include "programs/program.h"
#include "tables/toml_reader.h"

namespace bushd::programs {

Result<void> read_head(const tables::TomlReader& toml, Program& program);
// Nobody is heard when the power comes, and nobody knows positions then. The frames have been read.
Result<void> check_power_on(const tables::TomlReader& toml, const Program& program);

}  // namespace bushd::programs
