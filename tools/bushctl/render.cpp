#include "render.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "client/answer.h"
#include "grid.h"
#include "motor_cells.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
namespace units = bushd::units;
using bushd::client::Status;

// Where LCM's datagrams get lost on this PC.
constexpr const char* kRoom =
    "give datagrams more room ('sysctl net.core.rmem_max=4194304'), or use the control socket";

std::string user_position_text(const api::MotorResult& motor) {
  return position_text(motor.position_steps, motor.user,
                       {.unit = motor.unit, .steps_per_unit = {}, .decimals = motor.precision});
}

std::string result_position_text(const api::MotorResult& motor) {
  const std::string user = user_position_text(motor);
  if (motor.unit == units::Coordinates::kSteps) return user;
  return fmt::format("{} ({} steps)", user, motor.position_steps);
}

}  // namespace

std::vector<std::string> table(const Status& status) {
  using enum Align;
  const MotorColumns columns;
  Grid motors = motor_grid(columns);
  Grid mcus({kLeft, kLeft, kRight, kLeft});
  mcus.row({"MCU", "STATE", "BOOT", "DETAIL"});
  Grid buses({kLeft, kLeft});
  buses.row({"BUS", "PORT"});
  std::set<std::string> told;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const api::StateSnapshot& mcu = status.states[i].snapshot;
    const bool is_mcu = status.descriptions.at(i).snapshot.is_mcu();
    for (std::size_t m = 0; m < mcu.motors.size(); ++m) {
      const api::MotorState& motor = mcu.motors[m];
      motors.row(motor_row(motor, description_of(status.descriptions.at(i).snapshot, m, motor.name),
                           mcu, is_mcu, columns));
    }
    if (!is_mcu) continue;
    mcus.row({bushd::printable(mcu.mcu), std::string(word(mcu.state)), fmt::to_string(mcu.boot),
              bushd::printable(about(mcu))});
    if (!told.insert(mcu.bus).second) continue;
    const std::string& port = status.descriptions.at(i).snapshot.port;
    buses.row({bushd::printable(mcu.bus), port.empty() ? "not open" : bushd::printable(port)});
  }
  std::vector<std::string> out = motors.lines();
  out.emplace_back();
  for (std::string& line : mcus.lines()) out.push_back(std::move(line));
  out.emplace_back();
  for (std::string& line : buses.lines()) out.push_back(std::move(line));
  return out;
}

std::string missing_text(bool answered, const Status::Missing& missing, const char* things) {
  if (!answered) {
    return fmt::format(
        "incomplete: bushd has not answered, and of {} of {} {} nothing has come by itself; wait "
        "longer (--timeout-s)",
        missing.count, missing.of, things);
  }
  return fmt::format("incomplete: messages were lost, nothing of {} of {} {} has arrived; {}",
                     missing.count, missing.of, things, kRoom);
}

std::string lost_text(std::uint64_t messages) {
  return fmt::format("{} messages of bushd were lost, so changes may be missing here; {}", messages,
                     kRoom);
}

std::string motor_line(const Status& status, std::size_t mcu, std::size_t index) {
  const api::MotorState& motor = status.states[mcu].snapshot.motors[index];
  const units::Scale scale =
      description_of(status.descriptions.at(mcu).snapshot, index, motor.name).scale;
  std::string line =
      fmt::format("{} position {} target {} velocity {} {}", bushd::printable(motor.name),
                  position_text(motor, motor.position_steps, motor.user, scale),
                  position_text(motor, motor.target_steps, motor.user_target, scale),
                  speed_text(motor, scale), moving_word(motor, "moving", "at rest"));
  if (motor.trust != api::Trust::kKnown) line += fmt::format(" {}", word(motor.trust));
  if (const std::string notes = notes_text(motor); !notes.empty()) line += " " + notes;
  return line;
}

std::string way_text(const Status& status, std::size_t mcu, std::size_t index) {
  const api::MotorState& motor = status.states[mcu].snapshot.motors[index];
  const units::Scale scale =
      description_of(status.descriptions.at(mcu).snapshot, index, motor.name).scale;
  if (!has_unit(scale)) {
    return fmt::format("at {} of {} steps", motor.position_steps, motor.target_steps);
  }
  return fmt::format("at {:.{}f} of {}", motor.user, scale.decimals.value_or(0),
                     position_text(motor, motor.target_steps, motor.user_target, scale));
}

std::string stand_text(const Status& status, std::size_t mcu, std::size_t index) {
  const api::MotorState& motor = status.states[mcu].snapshot.motors[index];
  const auto description = description_of(status.descriptions.at(mcu).snapshot, index, motor.name);
  std::string text = fmt::format(
      "{}, {}", position_text(motor, motor.position_steps, motor.user, description.scale),
      moving_word(motor, "", "at rest"));
  if (motor.moving && !motor.paused) text += speed_text(motor, description.scale);
  return text;
}

std::string bounds_text(const Status& status, std::size_t mcu, std::size_t index) {
  const api::MotorState& motor = status.states[mcu].snapshot.motors[index];
  const auto description = description_of(status.descriptions.at(mcu).snapshot, index, motor.name);
  const auto coordinates = units::Coordinates::make(description.scale);
  // A terminal may cut the end off.
  std::string text;
  if (motor.trust != api::Trust::kKnown) text += fmt::format("{} | ", word(motor.trust));
  if (const std::string notes = notes_text(motor); !notes.empty()) text += notes + " | ";
  if (!description.soft_limits || !coordinates) return text + "no soft limits";
  const units::SoftLimits limits = coordinates->on_user_scale(*description.soft_limits);
  return text + fmt::format("{:g} .. {:g}", limits.low, limits.high);
}

std::string json(const api::MovePlan& plan) {
  return bushd::json_text(bushd::json_of(plan));
}

std::vector<std::string> lines(const api::MovePlan& plan) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < plan.motors.size(); ++i) {
    const api::MovePlan::Motor& motor = plan.motors[i];
    const bool further_leg = i > 0 && plan.motors[i - 1].motor == motor.motor;
    out.push_back(fmt::format("{}: {}{:+} steps in {:.3f} s, up to {:.6g} steps/s",
                              bushd::printable(motor.motor), further_leg ? "then " : "",
                              motor.steps, static_cast<double>(motor.duration_us) * 1e-6,
                              motor.peak_steps_per_s));
  }
  const std::string traffic =
      plan.traffic ? fmt::format("{} frames of {} bytes", plan.traffic->frames, plan.traffic->bytes)
                   : "frames are not counted";
  out.push_back(fmt::format("{} ticks, {:.3f} s; {}", plan.ticks,
                            static_cast<double>(plan.duration_us) * 1e-6, traffic));
  if (!plan.limited_by.empty()) out.push_back("limited by " + bushd::printable(plan.limited_by));
  return out;
}

std::vector<std::string> lines(const api::Reply& reply) {
  if (std::holds_alternative<api::Accepted>(reply)) return {"accepted"};
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return {};
  std::vector<std::string> out;
  if (const auto* motors = std::get_if<std::vector<api::MotorResult>>(&completed->detail)) {
    for (const api::MotorResult& motor : *motors) {
      // A computed axis has no table, and its counts are no steps.
      const bool computed = motor.table.name.empty();
      const std::string by = computed ? ""
                                      : fmt::format(" by {} ({})", text_of(motor.table),
                                                    bushd::printable(motor.table.hash));
      out.push_back(fmt::format("{}: {}, stands at {}{}{}", bushd::printable(motor.motor),
                                word(motor.outcome),
                                computed ? user_position_text(motor) : result_position_text(motor),
                                by, motor.legs > 1 ? fmt::format(", in {} legs", motor.legs) : ""));
    }
    return out;
  }
  const std::string outcome(word(completed->outcome));
  // There may be more to tell of what was done; stderr tells what was not.
  if (completed->outcome != api::Outcome::kDone) return {outcome};
  const bool repeats = completed->reason.starts_with(outcome);
  return {bushd::printable(repeats ? completed->reason : outcome + ": " + completed->reason)};
}

std::vector<std::string> rounding_lines(const api::Request& request, const api::Reply& reply) {
  const auto* move = std::get_if<api::Move>(&request);
  const auto* line = std::get_if<api::MoveLine>(&request);
  const auto* results = bushd::client::detail_of<std::vector<api::MotorResult>>(reply);
  std::vector<std::string> out;
  if ((move == nullptr && line == nullptr) || results == nullptr) return out;
  if ((move != nullptr ? move->kind : line->kind) != api::Move::Kind::kAbsolute) return out;
  const std::vector<api::MotorAmount>& motors = move != nullptr ? move->motors : line->motors;
  for (const api::MotorResult& result : *results) {
    const auto motor = std::ranges::find(motors, result.motor, &api::MotorAmount::motor);
    if (motor == motors.end() || result.outcome != api::Outcome::kReached) continue;
    const auto* asked = std::get_if<api::UserUnits>(&motor->amount);
    if (asked == nullptr) continue;
    const std::string at = fmt::format("{:.{}f}", result.user, result.precision);
    if (std::stod(at) == asked->value) continue;
    out.push_back(fmt::format("{}: at {} {}, asked {}", bushd::printable(result.motor), at,
                              bushd::printable(result.unit), asked->value));
  }
  return out;
}

}  // namespace bushctl
