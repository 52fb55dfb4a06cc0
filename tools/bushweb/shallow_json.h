// JSON from outside, as deep as our messages are: what is deeper is left out while it is read, so
// that nothing recurses into it.
#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

namespace bushweb {

inline constexpr int kDeepest = 8;

// Discarded (is_object() is false, as of all that is no JSON): it is none.
inline nlohmann::json shallow_json(std::string_view text) {
  const auto keep = [](int depth, nlohmann::json::parse_event_t /*event*/,
                       nlohmann::json& /*parsed*/) { return depth <= kDeepest; };
  return nlohmann::json::parse(text, keep, false);
}

}  // namespace bushweb
