// That no other daemon serves the same LCM channels: both would take every request, and one of them
// would move motors that its client believes at rest.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "config/config.h"
#include "control/pid_lock.h"

namespace bushd::daemon {

class ChannelClaim {
 public:
  // On this PC by a lock in `folders`, the first that can be used; elsewhere by listening on the
  // network for as long as a daemon may be silent, 0.75 s. Fails if there is another daemon.
  // A URL that is not of a network has nobody else on it.
  static Result<ChannelClaim> make(const config::Lcm& lcm, const std::vector<std::string>& folders);

 private:
  explicit ChannelClaim(std::optional<control::PidLock> lock) : lock_(std::move(lock)) {}

  std::optional<control::PidLock> lock_;  // none: no folder can be used
};

// Where locks are kept: $RUNTIME_DIRECTORY, as systemd sets it, else beside the control socket's
// default places.
std::vector<std::string> lock_folders();

}  // namespace bushd::daemon
