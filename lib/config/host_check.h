// What a configuration needs of the PC that it is for, besides what is plugged in and out.
#pragma once

#include "base/result.h"
#include "config/config.h"

namespace bushd::config {

// Errors: a group of users that there is none of; a port that is a console or a virtual terminal.
// A port that is not there is none: its adapter may be unplugged.
Result<void> check_host(const Config& config);

}  // namespace bushd::config
