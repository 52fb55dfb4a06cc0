// Names that stand for several motors, as people write them: slit*, m0[1-4], @goniometer. Names of
// motors and groups have none of these characters.
#pragma once

#include <fnmatch.h>

#include <algorithm>
#include <string>
#include <vector>

namespace bushd::api {

// Whether this names motors by a pattern of their names or, with @ in front, groups by theirs.
inline bool is_name_pattern(const std::string& name) {
  return name.starts_with('@') || name.find_first_of("*?[") != std::string::npos;
}

// Whether this name, or pattern, stands for that motor of that group.
inline bool names_motor(const std::string& name, const std::string& motor,
                        const std::string& group) {
  if (!is_name_pattern(name)) return name == motor;
  const bool of_group = name.starts_with('@');
  const std::string& whole = of_group ? group : motor;
  return !whole.empty() && fnmatch(name.c_str() + (of_group ? 1 : 0), whole.c_str(), 0) == 0;
}

// Whether one of them does; none: all motors are meant.
inline bool names_motor(const std::vector<std::string>& names, const std::string& motor,
                        const std::string& group) {
  return names.empty() || std::ranges::any_of(names, [&](const std::string& name) {
           return names_motor(name, motor, group);
         });
}

}  // namespace bushd::api
