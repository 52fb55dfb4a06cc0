// What kind of bus a section [[bus]] is, and the keys that this kind has.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Refuses keys of other kinds. Fills `kind` and what only this kind has.
Result<void> read_bus_kind(const tables::TomlReader& reader, Bus* bus);
// How moves are told and stopped.
Result<void> read_manners(const tables::TomlReader& reader, Bus* bus);

}  // namespace bushd::config
