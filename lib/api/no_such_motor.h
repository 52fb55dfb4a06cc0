// What is told of a name, or of a pattern, that stands for no motor.
#pragma once

#include <string>
#include <vector>

#include "api/name_pattern.h"
#include "base/nearest_name.h"
#include "base/shortened.h"

namespace bushd::api {

// Without what lists those that there are.
inline std::string no_such_motor(const std::string& name, const auto& motors,
                                 std::vector<std::string> groups) {
  const std::string written = "\"" + shortened(name, 64) + "\"";
  if (name.starts_with('@')) {
    for (std::string& group : groups) group.insert(0, 1, '@');
    return "there is no group with a motor for " + written + did_you_mean(name, groups);
  }
  if (is_name_pattern(name)) return "there is no motor with a name like " + written;
  return "there is no motor " + written + did_you_mean(name, motors);
}

}  // namespace bushd::api
