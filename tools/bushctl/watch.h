// Live view: in a terminal a table that is drawn anew, elsewhere a line for every motor that has
// changed.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "command_line.h"

namespace bushctl {

struct WatchOptions {
  std::vector<std::string> names{};   // of motors, or patterns; none: all
  std::chrono::milliseconds timeout;  // without a snapshot
  unsigned count = 0;                 // snapshots to show; 0: until interrupted
};

// The exit code.
int watch(const Connection& connection, const WatchOptions& options);

}  // namespace bushctl
