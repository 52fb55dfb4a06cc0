// The buses' health as people and programs read it.
#pragma once

#include <string>
#include <vector>

#include "client/status.h"

namespace bushctl {

// Tables of the buses, of their adapters' latencies and of the MCUs.
std::vector<std::string> health_table(const bushd::client::Status& status);

// {"buses":[...],...}; docs/lcm.md lists the keys.
std::string health_json(const bushd::client::Status& status);

}  // namespace bushctl
