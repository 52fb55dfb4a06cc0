// Waiting for a daemon that has just been started, and for its MCUs.
#pragma once

#include <chrono>

#include "command_line.h"

namespace bushctl {

// Until a daemon answers and all its MCUs are READY, or move their motors. An exit code: stderr
// says what was still missing when the time was over.
int wait_until_ready(const Connection& connection, std::chrono::milliseconds within);

}  // namespace bushctl
