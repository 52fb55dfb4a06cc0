// How an MCU is to be set up, from the configuration and the tables in service.
#pragma once

#include "base/by_id.h"
#include "config/config.h"
#include "link/bus_setup.h"

namespace bushd::daemon {

using Tables = ById<GroupId, tables::TablePtr>;
// As they are now: they may be changed in operation.
using Drives = ById<MotorId, config::Drive>;

// The tables outlive the setup.
link::McuSetup setup_of(const config::Config& config, McuId mcu, const Tables& tables,
                        const Drives& drives);

}  // namespace bushd::daemon
