// Private to lib/config: the keys of [[mcu]] that say how steps get to the pins.
#pragma once

#include "base/result.h"
#include "bus/emission_setup.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// The keys `steps` and `direction` have taken its place.
Result<void> refuse_emission_key(const tables::TomlReader& reader);

Result<fieldbus::EmissionSetup> read_emission(const tables::TomlReader& reader);

}  // namespace bushd::config
