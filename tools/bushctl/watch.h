// Live view: in a terminal a table that is drawn anew, elsewhere a line for every motor that has
// changed.
#pragma once

#include <chrono>

#include "client/client.h"

namespace bushctl {

struct WatchOptions {
  std::chrono::milliseconds timeout;  // without a snapshot
  unsigned count = 0;                 // snapshots to show; 0: until interrupted
};

// The exit code.
int watch(bushd::client::Client& client, const WatchOptions& options);

}  // namespace bushctl
