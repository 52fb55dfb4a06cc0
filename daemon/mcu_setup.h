// How an MCU is to be set up, from the configuration and the tables in service.
#pragma once

#include "base/by_id.h"
#include "config/config.h"
#include "link/bus_setup.h"

namespace bushd::daemon {

using Tables = ById<GroupId, tables::TablePtr>;

// The tables outlive the setup.
link::McuSetup setup_of(const config::Config& config, McuId mcu, const Tables& tables);

}  // namespace bushd::daemon
