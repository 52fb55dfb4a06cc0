// Who has asked for what, for the log of moves.
#pragma once

#include <cstdint>
#include <string>

#include "api/session.h"

namespace bushd::daemon {

// Not what moves and changes nothing.
bool is_logged(const api::Request& request);

// One JSON object: {"event":"request",...}; docs/design.md has its keys.
std::string request_line(std::int64_t unix_us, const api::Asker& asker,
                         const api::Request& request);

}  // namespace bushd::daemon
