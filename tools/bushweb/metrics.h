// What a daemon tells as numbers for Prometheus: text of OpenMetrics 1.0.
#pragma once

#include <string>
#include <vector>

#include "client/status.h"

namespace bushweb {

struct Measured {
  std::string daemon{};
  bool connected = false;
  bushd::client::Status status{};
};

std::string open_metrics(const std::vector<Measured>& daemons);

}  // namespace bushweb
