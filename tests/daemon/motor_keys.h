// More keys of a motor, in the configuration of a lab.
#pragma once

#include <string>

namespace bushd::test {

inline std::string with_m01(std::string toml, const std::string& keys) {
  const std::string motor = "name = \"m01\"\n";
  return toml.replace(toml.find(motor), motor.size(), motor + keys);
}

}  // namespace bushd::test
