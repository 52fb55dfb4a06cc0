// The words after `bushctl move` and `bushctl set`.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "bushd/command_t.hpp"

namespace bushctl {

// "theta 400 chi -20" moves by so many steps, "theta --to 400 chi --to -20" to these positions; in
// any case all motors as one group. A mixture is refused: one command is relative or absolute.
bushd::Result<bushd::command_t> parse_move(const std::vector<std::string>& words);

// "theta", "400": theta stands at 400.
bushd::Result<bushd::command_t> parse_set(const std::string& motor, const std::string& steps);

}  // namespace bushctl
