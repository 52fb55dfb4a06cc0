// How an MCU is to be set up, from the configuration and the tables in service.
#pragma once

#include <functional>

#include "base/by_id.h"
#include "bus/rs485/bus_setup.h"
#include "config/config.h"

namespace bushd::daemon {

using Tables = ById<GroupId, tables::TablePtr>;
// As they are now: they may be changed in operation.
using Drives = ById<MotorId, config::Drive>;

// By which table a motor goes. The same object for motors that share one.
using TableOf = std::function<tables::TablePtr(MotorId)>;

// The tables outlive the setup.
link::McuSetup setup_of(const config::Config& config, McuId mcu, const TableOf& table_of,
                        const Drives& drives);

}  // namespace bushd::daemon
