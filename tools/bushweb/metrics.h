// What a daemon tells as numbers for Prometheus: text of OpenMetrics 1.0.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/status.h"

namespace bushweb {

struct Measured {
  std::string daemon{};
  bool connected = false;
  std::optional<double> cpu_s{};  // of the daemon
  bushd::client::Status status{};
};

std::string open_metrics(const std::vector<Measured>& daemons);

}  // namespace bushweb
