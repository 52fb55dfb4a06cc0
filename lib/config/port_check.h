// One bus a port.
#pragma once

#include <vector>

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// The same port under two names would give its bytes to whoever reads first.
Result<void> check_port(const tables::TomlReader& reader, const Bus& bus,
                        const std::vector<Bus>& others);

}  // namespace bushd::config
