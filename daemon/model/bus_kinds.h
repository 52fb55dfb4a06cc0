// Which kind of bus is behind [[bus]] kind: the one place that knows all of them.
#pragma once

#include <memory>

#include "bus/rs485/bus_master.h"
#include "bus/rs485/tick_source.h"
#include "config/config.h"

namespace bushd::daemon {

// `source` outlives it.
std::unique_ptr<link::BusMaster> new_master(const config::Bus& bus, link::BusSetup setup,
                                            link::TickSource& source);

}  // namespace bushd::daemon
