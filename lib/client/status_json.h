// A status as JSON: what `bushctl status --json` prints, and bushd-web tells at /api/state.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "api/snapshot.h"
#include "client/status.h"

namespace bushd::client {

// What the state and the description of a motor say, by the names of motor_t and
// motor_description_t; "mcu" beside.
nlohmann::ordered_json motor_json(const std::string& mcu, const api::MotorState& state,
                                  const api::MotorDescription& description);

// {"motors":[...],"mcus":[...],...}; docs/lcm.md says more. Precondition: it has the states and the
// descriptions of all MCUs, of one at least.
std::string json(const Status& status);

}  // namespace bushd::client
