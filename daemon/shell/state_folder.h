// Where positions are kept (docs/positions.md).
#pragma once

#include <filesystem>
#include <string>

#include "config/config.h"
#include "state/store.h"

namespace bushd::daemon {

struct StateFolder {
  std::filesystem::path path{};
  bool wanted = true;
  std::string why_not{};   // where none is wanted
  bool configured = true;  // somebody counts on it: by bushd.toml, or by the service's unit
};

// `[state] path`, else $STATE_DIRECTORY, else /var/lib/bushd if it is there: a package makes that
// one, a daemon that somebody tries out does not.
StateFolder state_folder(const config::State& config);

Result<state::Store> open_store(const config::Config& config, const std::filesystem::path& folder);

}  // namespace bushd::daemon
