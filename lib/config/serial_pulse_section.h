// A bus of kind "serial-pulse": a serial port that is the controller of one motor.
#pragma once

#include "config/config.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// The keys of such a bus that others have not, and which it may have at all.
Result<void> read_serial_pulse(const tables::TomlReader& reader, Bus* bus);

// What the bus says of its motor, and what such a motor may not say itself.
// Precondition: its `home` has been read.
Result<void> take_serial_pulse(const tables::TomlReader& reader, const Bus& bus, Motor* motor);

}  // namespace bushd::config
