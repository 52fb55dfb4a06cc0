#include "named_motors.h"

#include <utility>

#include "api/name_pattern.h"
#include "api/no_such_motor.h"
#include "motor_cells.h"

namespace bushctl {

namespace api = bushd::api;
using bushd::client::Status;

namespace {

bool is_any(const Status& status, const std::string& name) {
  for (const auto& mcu : status.descriptions) {
    for (const api::MotorDescription& motor : mcu.snapshot.motors) {
      if (api::names_motor(name, motor.name, motor.group)) return true;
    }
  }
  return false;
}

}  // namespace

std::string no_such_motor(const Status& status, const std::string& name) {
  std::vector<std::string> names;
  std::vector<std::string> groups;
  for (const auto& mcu : status.descriptions) {
    for (const api::MotorDescription& motor : mcu.snapshot.motors) {
      names.push_back(motor.name);
      groups.push_back(motor.group);
    }
  }
  return api::no_such_motor(name, names, std::move(groups)) + "; 'bushctl where' lists them";
}

bushd::Result<Status> only(Status status, const std::vector<std::string>& names) {
  if (names.empty()) return status;
  for (const std::string& name : names) {
    if (!is_any(status, name)) return bushd::fail(no_such_motor(status, name));
  }
  for (std::size_t i = status.states.size(); i-- > 0;) {
    api::StateSnapshot& state = status.states[i].snapshot;
    const api::Description& description = status.descriptions.at(i).snapshot;
    std::size_t place = 0;
    std::vector<api::MotorState> kept;
    std::vector<api::MotorDescription> descriptions;
    for (api::MotorState& motor : state.motors) {
      api::MotorDescription of = description_of(description, place++, motor.name);
      if (!api::names_motor(names, motor.name, of.group)) continue;
      kept.push_back(std::move(motor));
      descriptions.push_back(std::move(of));
    }
    const auto at = static_cast<std::ptrdiff_t>(i);
    if (kept.empty()) {
      status.states.erase(status.states.begin() + at);
      status.descriptions.erase(status.descriptions.begin() + at);
    } else {
      state.motors = std::move(kept);
      status.descriptions[i].snapshot.motors = std::move(descriptions);
    }
  }
  return status;
}

}  // namespace bushctl
