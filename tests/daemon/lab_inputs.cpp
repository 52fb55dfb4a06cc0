// What tests give a lab: configurations and requests.
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

std::string with_behind(std::string toml, const std::string& line, const std::string& keys) {
  const std::size_t at = toml.find(line);
  if (at == std::string::npos) throw std::logic_error("no line " + line);
  return toml.insert(at + line.size(), keys);
}

}  // namespace

std::string hall(int mcus, int motors, const std::string& manner, const std::string& table) {
  const std::string format = manner.substr(0, manner.find('_'));
  std::string toml =
      "[[bus]]\nname = \"hall\"\nport = \"/dev/null\"\nbaud = 500000\ntick_us = 2560\nformat = \"" +
      format + "\"\n" + (manner.ends_with("_table") ? "moves = \"table\"\n" : "") +
      (manner.ends_with("_ticks") ? "frames = \"ticks\"\n" : "") +
      "[[group]]\nname = \"axes\"\ntable = \"" + table + "\"\n";
  int number = 0;
  for (int m = 1; m <= mcus; ++m) {
    toml += "[[mcu]]\nbus = \"hall\"\naddress = " + std::to_string(m) + "\n";
    for (int output = 0; output < motors; ++output) {
      ++number;
      const std::string name = (number < 10 ? "m0" : "m") + std::to_string(number);
      toml += "[[motor]]\nname = \"" + name + "\"\nmcu = \"hall:" + std::to_string(m) +
              "\"\noutput = " + std::to_string(output) + "\ngroup = \"axes\"\n";
    }
  }
  return toml;
}

std::string with_keys(std::string toml, const std::string& motor, const std::string& keys) {
  return with_behind(std::move(toml), "name = \"" + motor + "\"\n", keys);
}

std::string with_mcu_keys(std::string toml, const std::string& keys, int address) {
  return with_behind(std::move(toml), "\naddress = " + std::to_string(address) + "\n", keys);
}

std::vector<api::MotorAmount> motor_steps(const std::vector<std::string>& motors,
                                          const std::vector<std::int64_t>& steps) {
  std::vector<api::MotorAmount> all;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    all.push_back({motors[i], i < steps.size() ? steps[i] : 0});
  }
  return all;
}

api::Request request_of(Ask ask, const std::vector<std::string>& motors,
                        const std::vector<std::int64_t>& steps) {
  switch (ask) {
    case Ask::kMoveBy:
      return api::Move{.kind = api::Move::Kind::kRelative, .motors = motor_steps(motors, steps)};
    case Ask::kMoveTo:
      return api::Move{.kind = api::Move::Kind::kAbsolute, .motors = motor_steps(motors, steps)};
    case Ask::kStop:
      return api::Stop{motors};
    case Ask::kEnable:
      return api::Enable{motors};
    case Ask::kDisable:
      return api::Disable{motors};
    case Ask::kSetPosition:
      return api::SetPosition{.motors = motor_steps(motors, steps)};
    case Ask::kClearFaults:
      return api::ClearFaults{motors};
    case Ask::kEmergencyStop:
      return api::EmergencyStop{};
    case Ask::kHome:
      return api::Home{motors};
    case Ask::kDisarm:
      return api::Disarm{motors};
  }
  throw std::logic_error("an unknown Ask");
}

}  // namespace bushd::test
