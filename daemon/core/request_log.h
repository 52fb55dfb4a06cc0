// Who has asked for what, for the log of moves.
#pragma once

#include "api/session.h"
#include "daemon/model/outputs.h"

namespace bushd::daemon {

// Wraps the asker: when its request is accepted, the log of moves gets a line that says whose it
// was:
// {"event":"request",...}, docs/design.md has its keys. Not of what moves and changes nothing.
// `outputs` outlives the request.
api::Asker logged(const api::Asker& asker, const api::Request& request, Outputs& outputs);

}  // namespace bushd::daemon
