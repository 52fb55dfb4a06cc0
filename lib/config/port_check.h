// Private to lib/config: no serial port is two things.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// The port under two names would give its bytes to whoever reads first. Errors: it is, or may be,
// that of one of the others, under whatever name. `reader`: of the section.
Result<void> check_bus_port(const tables::TomlReader& reader, const std::string& port,
                            const std::vector<Bus>& others);
Result<void> check_keypad_port(const tables::TomlReader& reader, const std::string& port,
                               const Config& others);

}  // namespace bushd::config
