// Drivers at rest: when they are disabled, and how long they take to hold when enabled.
#pragma once

#include "base/result.h"
#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Reads `idle_disable_s` and `enable_settle_ms` of an `[[mcu]]`.
Result<void> read_idle(const tables::TomlReader& reader, Mcu* mcu);

}  // namespace bushd::config
