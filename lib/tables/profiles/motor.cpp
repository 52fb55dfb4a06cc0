#include "tables/profiles/motor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "base/byte_order_mark.h"
#include "tables/toml_file.h"

namespace bushd::tables::profiles {
namespace {

constexpr std::size_t kMaxPoints = 10000;

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::optional<double> number(std::string_view text) {
  const std::string copy(text);
  char* end = nullptr;
  const double value = std::strtod(copy.c_str(), &end);
  if (copy.empty() || end != copy.c_str() + copy.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

struct Columns {
  double hz_per_speed = 0;
  double nm_per_torque = 0;
};

std::optional<Columns> header(std::string_view speed, std::string_view torque,
                              double steps_per_turn) {
  Columns columns;
  if (speed == "speed_hz" || speed == "speed_steps_per_s") columns.hz_per_speed = 1.0;
  if (speed == "speed_rpm") columns.hz_per_speed = steps_per_turn / 60.0;
  if (torque == "torque_nm") columns.nm_per_torque = 1.0;
  if (torque == "torque_ncm") columns.nm_per_torque = 0.01;
  if (torque == "torque_mnm") columns.nm_per_torque = 0.001;
  if (columns.hz_per_speed == 0 || columns.nm_per_torque == 0) return std::nullopt;
  return columns;
}

// The first point at that speed or beyond it.
TorqueCurve::const_iterator from(const TorqueCurve& curve, double speed_hz) {
  return std::lower_bound(curve.begin(), curve.end(), speed_hz,
                          [](const TorquePoint& point, double hz) { return point.speed_hz < hz; });
}

}  // namespace

Result<TorqueCurve> parse_torque_csv(std::string_view text, double steps_per_turn,
                                     const std::string& path) {
  text = without_byte_order_mark(text);
  TorqueCurve curve;
  std::optional<Columns> columns;
  int line = 0;
  const auto refuse = [&](std::string message) {
    return fail(Error{.message = std::move(message), .file = path, .line = line});
  };
  while (!text.empty()) {
    ++line;
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view row = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (row.empty() || row.front() == '#') continue;
    const std::size_t comma = std::min(row.find(','), row.size());
    const std::string_view first = trimmed(row.substr(0, comma));
    const std::string_view second = trimmed(row.substr(std::min(comma + 1, row.size())));
    if (!columns) {
      columns = header(first, second, steps_per_turn);
      if (columns) continue;
      return refuse(
          "is no header; allowed: SPEED,TORQUE with SPEED one of speed_hz, speed_steps_per_s, "
          "speed_rpm and TORQUE one of torque_nm, torque_ncm, torque_mnm. speed_hz and "
          "speed_steps_per_s count microsteps: full steps a second of a data sheet times the "
          "microsteps of a full step");
    }
    const auto speed = number(first);
    const auto torque = number(second);
    if (!speed || !torque || *speed < 0 || *torque < 0) {
      return refuse("is not a point; allowed: a speed and a torque, both numbers of 0 or more");
    }
    const TorquePoint point{*speed * columns->hz_per_speed, *torque * columns->nm_per_torque};
    if (!curve.empty() && point.speed_hz <= curve.back().speed_hz) {
      return refuse("is not faster than the line before; allowed: speeds that rise");
    }
    if (curve.size() == kMaxPoints) {
      return refuse(fmt::format("is one point too many; allowed: {}", kMaxPoints));
    }
    curve.push_back(point);
  }
  if (curve.empty()) return refuse("has no point; allowed: 1 or more below the header");
  return curve;
}

Result<TorqueCurve> load_torque_csv(const std::string& path, double steps_per_turn) {
  const auto text =
      read_text(path, "a motor's data need a hundredth of that: is it the right file?");
  if (!text) return fail(text.error());
  return parse_torque_csv(*text, steps_per_turn, path);
}

double inertia_at_motor_kgm2(const Load& load) {
  const double arm_m = load.travel_per_turn_m / (2.0 * std::numbers::pi);
  return (load.mass_kg * arm_m * arm_m + load.inertia_kgm2) / (load.gear * load.gear);
}

Result<void> check(const Motor& motor) {
  if (motor.torque.empty()) return fail("a motor needs a torque curve: --torque FILE");
  if (!(motor.inertia_kgm2 > 0)) {
    return fail("a motor needs the inertia of rotor and load, above 0: --inertia");
  }
  if (!(motor.safety >= 1)) {
    return fail(fmt::format(
        "the safety factor is {:.6g}; allowed: 1 or more, because below 1 the motor loses steps",
        motor.safety));
  }
  return {};
}

double greatest_torque(const Motor& motor, double low_hz, double high_hz) {
  double greatest_nm = std::max(torque_at(motor, low_hz), torque_at(motor, high_hz));
  for (auto point = from(motor.torque, low_hz);
       point != motor.torque.end() && point->speed_hz < high_hz; ++point) {
    greatest_nm = std::max(greatest_nm, point->torque_nm);
  }
  return greatest_nm;
}

double torque_at(const Motor& motor, double speed_hz) {
  const TorqueCurve& curve = motor.torque;
  if (speed_hz <= curve.front().speed_hz) return curve.front().torque_nm;
  if (speed_hz > curve.back().speed_hz) return 0.0;
  const auto above = from(curve, speed_hz);
  const auto below = above - 1;
  const double share = (speed_hz - below->speed_hz) / (above->speed_hz - below->speed_hz);
  return below->torque_nm + share * (above->torque_nm - below->torque_nm);
}

double acceleration_at(const Motor& motor, Side side, double speed_hz) {
  if (speed_hz > motor.torque.back().speed_hz) return -1.0;
  const double friction = side == Side::kAccel ? -motor.friction_nm : motor.brake_friction_nm;
  const double torque_nm = torque_at(motor, speed_hz) / motor.safety + friction;
  return torque_nm / motor.inertia_kgm2 * motor.steps_per_turn / (2.0 * std::numbers::pi);
}

double greatest_jump_hz(const Motor& motor, Side side, double speed_hz) {
  const double torque_nm = torque_at(motor, speed_hz);
  const double load_nm = side == Side::kAccel ? motor.friction_nm : 0.0;
  if (torque_nm <= load_nm) return 0.0;
  const double share = load_nm / torque_nm;
  const double lag = std::asin(share);
  const double depth = 1.0 + std::cos(lag) - share * (std::numbers::pi - lag);
  const double periods = std::min(motor.full_steps_per_turn, motor.steps_per_turn) / 4.0;
  const double jump_rad_per_s =
      std::sqrt(2.0 * std::max(0.0, depth) * torque_nm / (periods * motor.inertia_kgm2));
  return jump_rad_per_s * motor.steps_per_turn / (2.0 * std::numbers::pi);
}

Result<Motion> fastest(const Motor& motor, Side side, double from_hz, double to_hz) {
  std::vector<double> corners{from_hz};
  for (const TorquePoint& point : motor.torque) {
    if (point.speed_hz > from_hz && point.speed_hz < to_hz) corners.push_back(point.speed_hz);
  }
  corners.push_back(to_hz);
  Motion motion;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const double low = corners[i];
    const double high = std::min(corners[i + 1], motor.torque.back().speed_hz);
    const double from = acceleration_at(motor, side, low);
    const double to = acceleration_at(motor, side, high);
    if (from <= 0 || to <= 0 || high < corners[i + 1]) {
      if (from > 0 && to > 0) {
        return fail(
            fmt::format("the torque curve ends at {:.6g} steps/s, microsteps included; allowed: a "
                        "maximum speed up to that. If the curve's speeds are full steps, multiply "
                        "them by the microsteps of one",
                        high));
      }
      const double limit = from <= 0 ? low : low + (high - low) * from / (from - to);
      return fail(fmt::format(
          "the motor has no torque left from {:.6g} steps/s on (torque / safety factor {:.6g} "
          "against {:.6g} Nm of friction); allowed: a maximum speed below that",
          limit, motor.safety, motor.friction_nm));
    }
    motion.push_back(linear(low, high, from, to));
  }
  return motion;
}

}  // namespace bushd::tables::profiles
