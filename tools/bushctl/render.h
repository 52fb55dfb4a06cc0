// The state as people and programs read it.
#pragma once

#include <string>
#include <vector>

#include "bushd/reply_t.hpp"
#include "lcm/snapshot.h"

namespace bushctl {

// Lines of a table of all motors, then of all MCUs.
std::vector<std::string> table(const bushd::lcm::Snapshot& snapshot);

// One line: name, position, target, velocity, moving or at rest, trust when it is not "known".
std::string motor_line(const bushd::motor_state_t& motor);

// {"motors":[...],"mcus":[...],...}; docs/lcm.md lists the keys.
std::string json(const bushd::lcm::Snapshot& snapshot);

// What a move would be, motor by motor and as a whole.
std::string json(const bushd::move_plan_t& plan);
std::vector<std::string> lines(const bushd::move_plan_t& plan);

// A reply in one line per motor, or in one line where no motors are named.
std::vector<std::string> lines(const bushd::reply_t& reply);

}  // namespace bushctl
