#include "where.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "api/name_pattern.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "client/status_json.h"
#include "grid.h"
#include "named_motors.h"
#include "render.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
namespace units = bushd::units;
using bushd::fail;
using bushd::Result;

std::string number(double value, const units::Scale& scale) {
  return fmt::format("{:.{}f}", value, scale.decimals.value_or(0));
}

std::optional<units::SoftLimits> user_limits(const api::MotorDescription& description) {
  const auto coordinates = units::Coordinates::make(description.scale);
  if (!description.soft_limits || !coordinates) return std::nullopt;
  return coordinates->on_user_scale(*description.soft_limits);
}

std::string limits_text(const api::MotorDescription& description) {
  const auto limits = user_limits(description);
  if (!limits) return "-";
  return number(limits->low, description.scale) + " .. " + number(limits->high, description.scale);
}

}  // namespace

Result<std::vector<Whereabouts>> where(const bushd::client::Status& status,
                                       const std::vector<std::string>& names, std::int64_t now_us) {
  std::vector<Whereabouts> all;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const auto age_us = std::max<std::int64_t>(now_us - status.states[i].part.utime_us, 0);
    for (const api::MotorState& state : status.states[i].snapshot.motors) {
      Whereabouts motor{.mcu = status.states[i].snapshot.mcu,
                        .state = state,
                        .description = {},
                        .age_s = 1e-6 * static_cast<double>(age_us)};
      for (const auto& description : status.descriptions.at(i).snapshot.motors) {
        if (description.name == state.name) motor.description = description;
      }
      all.push_back(std::move(motor));
    }
  }
  if (names.empty()) return all;
  std::vector<Whereabouts> chosen;
  for (const std::string& name : names) {
    bool found = false;
    for (const Whereabouts& motor : all) {
      if (!bushd::api::names_motor(name, motor.state.name, motor.description.group)) continue;
      found = true;
      chosen.push_back(motor);
    }
    if (!found) return fail(no_such_motor(status, name));
  }
  return chosen;
}

std::vector<std::string> table(const std::vector<Whereabouts>& motors) {
  using enum Align;
  Grid grid({kLeft, kRight, kLeft, kRight, kRight, kLeft, kLeft, kRight, kLeft});
  grid.row({"MOTOR", "USER", "UNIT", "DIAL", "STEPS", "LIMITS", "TRUST", "AGE", ""});
  for (const auto& [mcu, state, description, age_s] : motors) {
    grid.row({bushd::printable(state.name), number(state.user, description.scale),
              bushd::printable(description.scale.unit), number(state.dial, description.scale),
              fmt::to_string(state.position_steps), limits_text(description),
              std::string(word(state.trust)), fmt::format("{:.1f} s", age_s),
              bushd::printable(state.uncertain_reason)});
  }
  return grid.lines();
}

std::string json(const std::vector<Whereabouts>& motors) {
  nlohmann::ordered_json out = {{"motors", nlohmann::json::array()}};
  for (const auto& [mcu, state, description, age_s] : motors) {
    out["motors"].push_back(bushd::client::motor_json(mcu, state, description));
  }
  return bushd::json_text(out);
}

}  // namespace bushctl
