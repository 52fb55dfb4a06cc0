// Which motors of a status a user means.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "client/status.h"

namespace bushctl {

// The status of these alone, by name or pattern, and of the MCUs that have them; none named: as it
// is. Error: a name that stands for none.
bushd::Result<bushd::client::Status> only(bushd::client::Status status,
                                          const std::vector<std::string>& names);

// That there is none.
std::string no_such_motor(const bushd::client::Status& status, const std::string& name);

}  // namespace bushctl
