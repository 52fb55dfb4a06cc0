#include "client/status_json.h"

#include <nlohmann/json.hpp>

#include "base/fields_json.h"
#include "base/json_text.h"

namespace bushd::client {
namespace {

// What is known of one thing, from two snapshots.
nlohmann::ordered_json together(nlohmann::ordered_json state,
                                const nlohmann::ordered_json& description) {
  for (const auto& [name, value] : description.items()) {
    if (!state.contains(name)) state[name] = value;
  }
  state.erase("motors");
  return state;
}

}  // namespace

nlohmann::ordered_json motor_json(const std::string& mcu, const api::MotorState& state,
                                  const api::MotorDescription& description) {
  nlohmann::ordered_json motor = together(json_of(state), json_of(description));
  motor["mcu"] = mcu;
  return motor;
}

std::string json(const Status& status) {
  nlohmann::ordered_json out = {{"motors", nlohmann::json::array()},
                                {"mcus", nlohmann::json::array()},
                                {"run", status.states.front().part.run},
                                {"sequence", status.sequence()},
                                {"utime_us", status.states.front().part.utime_us},
                                {"dropped_messages", status.states.front().dropped_messages}};
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const api::StateSnapshot& mcu = status.states[i].snapshot;
    const api::Description& description = status.descriptions.at(i).snapshot;
    for (std::size_t m = 0; m < mcu.motors.size(); ++m) {
      out["motors"].push_back(
          motor_json(mcu.mcu, mcu.motors[m], description_of(description, m, mcu.motors[m].name)));
    }
    if (!description.is_mcu()) continue;
    out["mcus"].push_back(together(json_of(mcu), json_of(description)));
  }
  return json_text(out);
}

}  // namespace bushd::client
