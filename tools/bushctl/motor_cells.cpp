#include "motor_cells.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "base/printable.h"

namespace bushctl {

namespace api = bushd::api;
namespace units = bushd::units;

namespace {

std::string limit_text(const api::MotorState& motor) {
  return motor.inhibited.any() ? fmt::format("limit {}", word(motor.inhibited)) : "";
}

// "heard 2026-01-31 14:03:22": old numbers are shown with their time.
std::string heard_text(const api::MotorState& motor) {
  if (!motor.heard_utime_us) return {};
  const std::chrono::sys_seconds heard(std::chrono::seconds(*motor.heard_utime_us / 1'000'000));
  return fmt::format("heard {:%F %T}", fmt::localtime(std::chrono::system_clock::to_time_t(heard)));
}

// In the motor's unit per second, with the sign of the user's scale.
double user_speed(const api::MotorState& motor, const units::Coordinates& coordinates) {
  const double per_s = motor.velocity_steps_per_s * coordinates.dial_of(1);
  return coordinates.scale().negative ? -per_s : per_s;
}

// By itself, or as a move says.
const char* moves_text(const api::MotorState& motor) {
  if (motor.activity == api::Activity::kHoming) return "home";
  return motor.activity == api::Activity::kLocal ? "local" : "yes";
}

// Where a motor stands between its soft limits: "-5 |----x---------| 25"; outside of them an arrow
// points to where it is. "": it has none.
std::string range_text(const api::MotorState& motor, const api::MotorDescription& description,
                       std::size_t columns) {
  const auto coordinates = units::Coordinates::make(description.scale);
  if (!description.soft_limits || !coordinates) return {};
  const units::SoftLimits limits = coordinates->on_user_scale(*description.soft_limits);
  std::string bar(columns, '-');
  const double place = (motor.user - limits.low) / (limits.high - limits.low);
  if (has_position(motor) && place < 0) bar.front() = '<';
  if (has_position(motor) && place > 1) bar.back() = '>';
  if (has_position(motor) && place >= 0 && place <= 1) {
    bar[static_cast<std::size_t>(std::lround(place * static_cast<double>(columns - 1)))] = 'x';
  }
  return fmt::format("{:g} |{}| {:g}", limits.low, bar, limits.high);
}

}  // namespace

std::string text_of(const api::TableRef& table) {
  const std::string revision = table.revision > 0 ? fmt::format("@{}", table.revision) : "";
  return bushd::printable(table.name) + revision;
}

const char* moving_word(const api::MotorState& motor, const char* moves, const char* rests) {
  if (motor.activity == api::Activity::kArming) return "arming";
  if (motor.activity == api::Activity::kArmed) return "armed";
  if (motor.paused) return "paused";
  if (motor.held && !motor.moving) return "held";
  return motor.moving ? moves : rests;
}

bool has_position(const api::MotorState& motor) {
  return motor.trust != api::Trust::kUnknown;
}

std::string notes_text(const api::MotorState& motor) {
  const std::string heard = heard_text(motor);
  const std::string limit = limit_text(motor);
  const std::string armed =
      motor.armed_by.empty() ? "" : "armed by " + bushd::printable(motor.armed_by);
  std::string all;
  for (const std::string& note : {heard, limit, armed}) {
    all += (all.empty() || note.empty() ? "" : ", ") + note;
  }
  return all;
}

std::string about(const api::StateSnapshot& mcu) {
  if (mcu.program.empty()) return mcu.detail;
  return (mcu.detail.empty() ? "" : mcu.detail + "; ") + "program " + mcu.program;
}

bool has_unit(const units::Scale& scale) {
  return scale.unit != units::Coordinates::kSteps;
}

std::string position_text(std::int64_t steps, double user, const units::Scale& scale) {
  if (!has_unit(scale)) return fmt::to_string(steps);
  return fmt::format("{:.{}f} {}", user, scale.decimals.value_or(0), bushd::printable(scale.unit));
}

std::string position_text(const api::MotorState& motor, std::int64_t steps, double user,
                          const units::Scale& scale) {
  return has_position(motor) ? position_text(steps, user, scale) : "-";
}

std::string speed_text(const api::MotorState& motor, const units::Scale& scale) {
  const auto coordinates = units::Coordinates::make(scale);
  if (!has_unit(scale) || !coordinates) return fmt::format("{:.1f}", motor.velocity_steps_per_s);
  return fmt::format("{:.{}f} {}/s", user_speed(motor, *coordinates),
                     scale.decimals.value_or(coordinates->precision()),
                     bushd::printable(scale.unit));
}

Grid motor_grid(const MotorColumns& columns) {
  using enum Align;
  std::vector<Align> align{kLeft};
  std::vector<std::string> heading{"MOTOR"};
  if (columns.place) {
    align.insert(align.end(), {kLeft, kRight, kLeft, kLeft});
    heading.insert(heading.end(), {"MCU", "OUTPUT", "GROUP", "TABLE"});
  }
  align.push_back(kRight);
  heading.push_back("POSITION");
  if (columns.target) {
    align.push_back(kRight);
    heading.push_back("TARGET");
  }
  align.insert(align.end(), {kRight, kLeft, kRight, kLeft, kLeft});
  heading.insert(heading.end(), {"SPEED", "MOVING", "LIMITS", "TRUST", ""});
  Grid grid(std::move(align));
  grid.row(std::move(heading));
  return grid;
}

std::vector<std::string> motor_row(const api::MotorState& motor,
                                   const api::MotorDescription& description,
                                   const api::StateSnapshot& mcu, bool of_mcu,
                                   const MotorColumns& columns) {
  const units::Scale& scale = description.scale;
  std::vector<std::string> out{bushd::printable(motor.name)};
  if (columns.place) {
    out.insert(out.end(), {bushd::printable(mcu.mcu),
                           of_mcu ? fmt::to_string(description.output) : std::string("-"),
                           bushd::printable(description.group), text_of(description.table)});
  }
  out.push_back(position_text(motor, motor.position_steps, motor.user, scale));
  if (columns.target) {
    out.push_back(position_text(motor, motor.target_steps, motor.user_target, scale));
  }
  // Where there is no room for notes a limit stands in place of what a motor does.
  const bool at_limit = motor.inhibited.any() && !columns.place;
  out.insert(out.end(), {speed_text(motor, scale),
                         moving_word(motor, moves_text(motor), at_limit ? "limit" : "-"),
                         range_text(motor, description, columns.bar),
                         std::string(word(motor.trust)), notes_text(motor)});
  return out;
}

}  // namespace bushctl
