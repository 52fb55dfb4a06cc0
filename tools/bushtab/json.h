#pragma once

#include <fmt/core.h>

#include <nlohmann/json.hpp>

namespace bushtab {

// To standard output, in ASCII: what would steer a terminal is escaped like all else. Paths and
// names need not be UTF-8; what is not is replaced.
inline void print_json(const nlohmann::ordered_json& json) {
  fmt::print("{}\n", json.dump(2, ' ', true, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace bushtab
