// What may be changed of motors in operation: what `bushctl config` is told, shows and writes.
#pragma once

#include <string>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "base/result.h"

namespace bushctl {

// "theta", "offset=12.5", "soft_limits=-5,30". Without an assignment: to be shown; without a motor:
// of all.
bushd::Result<bushd::api::Configure> parse_settings(const std::vector<std::string>& words);

// Those that are not as bushd.toml has them.
bushd::api::Configuration differences(bushd::api::Configuration configuration);

std::vector<std::string> table(const bushd::api::Configuration& configuration);
// {"path","settings":[{"motor","key","value","in_file"}]}; values as JSON, null: no soft limits.
std::string json(const bushd::api::Configuration& configuration);

// Writes these values into bushd.toml, whose comments, order and rights stay as they are. Returns
// what the daemon is to be told. Errors: the file is not as the daemon knows it, or not on this PC;
// it cannot be read, changed in place or written.
bushd::Result<bushd::api::Configure> save(const bushd::api::Configuration& configuration);

}  // namespace bushctl
