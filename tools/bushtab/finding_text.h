#pragma once

#include <string>

#include "tables/laws/findings.h"

namespace bushtab {

// "error: torque: accel[97]: takes 1.11 Nm at .."
std::string text_of(const bushd::tables::laws::Finding& finding);

}  // namespace bushtab
