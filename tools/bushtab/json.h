#pragma once

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "base/json_text.h"

namespace bushtab {

// To standard output, in ASCII: what would steer a terminal is escaped like all else. Paths and
// names need not be UTF-8; what is not is replaced.
inline void print_json(const nlohmann::ordered_json& json) {
  fmt::print("{}\n", bushd::json_text(json, {.indent = 2, .ascii = true}));
}

}  // namespace bushtab
