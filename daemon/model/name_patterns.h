// What is asked of a pattern is asked of the motors that it stands for (api/name_pattern.h), before
// anything else sees the request.
#pragma once

#include <optional>

#include "api/request.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

// The same with motors in place of patterns, in the order of the configuration; nothing if it has
// none. A pattern that stands for no motor stays, as the name of a motor that there is not. Of a
// path and a trajectory names are those of columns, and stay.
std::optional<api::Request> with_motors_of_patterns(const Installation& installation,
                                                    const api::Request& request);

}  // namespace bushd::daemon
