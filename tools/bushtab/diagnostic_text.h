#pragma once

#include <string>

#include "tables/profiles/diagnostics.h"

namespace bushtab {

// "error: torque: accel[97]: takes 1.11 Nm at .."
std::string text_of(const bushd::tables::profiles::Diagnostic& diagnostic);

}  // namespace bushtab
