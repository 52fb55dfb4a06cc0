// The serial port of a bus.
#pragma once

#include "base/result.h"
#include "config/config.h"
#include "serial/serial_port.h"

namespace bushd::daemon {

// Of the ports that the configuration may mean, the first that opens; else why the first does not.
Result<serial::SerialPort> open_first_port(const config::Bus& bus);

}  // namespace bushd::daemon
