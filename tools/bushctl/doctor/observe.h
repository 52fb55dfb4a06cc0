// Reads what doctor looks at: files of the system, the control socket, the daemon. Changes nothing.
#pragma once

#include <string>

#include "client/client.h"
#include "observations.h"

namespace bushctl::doctor {

struct Scope {
  std::string config_path{};  // "": that of the daemon that runs, else that of the service
  bushd::client::ClientOptions client{};
  double watch_s = 2;  // how long errors on lines are counted
};

Observations observe(const Scope& scope);

}  // namespace bushctl::doctor
