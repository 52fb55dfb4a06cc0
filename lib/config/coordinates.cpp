#include "config/coordinates.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "config/setting.h"
#include "config/words.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::size_t kLongestDescription = 200;
constexpr std::int64_t kMostSettleMs = 60'000;

// Both end up on terminals and in logs.
Result<std::string> read_line(const TomlReader& reader, std::string_view key, std::size_t longest) {
  const std::string allowed =
      fmt::format("1..{} bytes of text without control characters", longest);
  auto text = reader.string(key, allowed);
  if (!text) return text;
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 0x7F; };
  if (text->empty() || text->size() > longest || std::ranges::any_of(*text, is_control)) {
    return fail(reader.error(key, "is not allowed; allowed: " + allowed));
  }
  return text;
}

// "" is none, as is a key that is not there.
bool says_something(const TomlReader& reader, std::string_view key) {
  if (!reader.has(key)) return false;
  if (!reader.is_string(key)) return true;  // its reader refuses it
  const auto text = reader.string(key, "");
  return !text || !text->empty();
}

Result<units::Ratio> read_steps_per_unit(const TomlReader& reader) {
  constexpr std::string_view kAllowed =
      "a number above 0, such as 400, or a ratio, such as \"400/1.25\"";
  constexpr std::string_view kKey = "steps_per_unit";
  const bool is_text = reader.is_string(kKey);
  auto ratio = [&]() -> Result<units::Ratio> {
    if (is_text) {
      const auto text = reader.string(kKey, kAllowed);
      if (!text) return fail(text.error());
      return units::parse_ratio(*text);
    }
    const auto number = reader.number(kKey, kAllowed);
    if (!number) return fail(number.error());
    return units::ratio_of(*number);
  }();
  if (ratio || !ratio.error().key.empty()) return ratio;
  return fail(reader.error(
      kKey, fmt::format("{}; allowed: {}. The direction has a key of its own, `direction`",
                        ratio.error().message, kAllowed)));
}

Result<bool> read_negative(const TomlReader& reader) {
  const auto direction = reader.string("direction", "\"negative\", \"positive\"");
  if (!direction) return fail(direction.error());
  if (*direction == "positive" || *direction == "negative") return *direction == "negative";
  return fail(reader.error(
      "direction", fmt::format("is \"{}\"; allowed: \"negative\", \"positive\"", *direction)));
}

Result<void> read_scale(const TomlReader& reader, Motor* motor) {
  units::Scale scale;
  auto unit = read_line(reader, "unit", kLongestUnit);
  if (!unit) return fail(unit.error());
  if (*unit == units::Coordinates::kSteps) {
    return fail(reader.error("unit",
                             "is \"steps\", which is said of motors without a unit; leave "
                             "the key out, or give it another name"));
  }
  scale.unit = std::move(*unit);
  const auto ratio = read_steps_per_unit(reader);
  if (!ratio) return fail(ratio.error());
  scale.steps_per_unit = *ratio;
  if (reader.has("direction")) {
    const auto negative = read_negative(reader);
    if (!negative) return fail(negative.error());
    scale.negative = *negative;
  }
  const Keys keys =
      Keys(reader)
          .number("offset", &scale.offset, "a number")
          .whole("precision", &scale.decimals, 0, units::Coordinates::kMostDecimals, "decimals");
  if (!keys.result()) return keys.result();
  auto coordinates = units::Coordinates::make(std::move(scale));
  if (!coordinates) return fail(reader.error("offset", coordinates.error().message));
  motor->coordinates = std::move(*coordinates);
  return {};
}

Result<units::SoftLimits> read_soft_limits(const TomlReader& reader, const Motor& motor) {
  constexpr std::string_view kKey = "soft_limits";
  constexpr std::string_view kAllowed = "[lowest, highest] dial position";
  const auto array = reader.array(kKey, kAllowed);
  if (!array) return fail(array.error());
  if ((*array)->size() != 2) {
    return fail(reader.error(
        kKey, fmt::format("has {} elements; allowed: {}", (*array)->size(), kAllowed)));
  }
  std::array<double, 2> ends{};
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto end = reader.number(kKey, i, *(*array)->get(i), "a number");
    if (!end) return fail(end.error());
    ends[i] = *end;
  }
  const units::SoftLimits limits{ends[0], ends[1]};
  if (const auto good = check_soft_limits(motor.coordinates, limits); !good) {
    return fail(reader.error(kKey, good.error().message));
  }
  return limits;
}

Result<void> check_max_speed(const Motor& motor, double speed) {
  if (const auto good = check_user_speed(motor.coordinates, speed); !good) return good;
  if (!motor.drive.moved_by_people()) return {};
  return fail(
      "does not hold for local motion, which the MCU makes by the table alone; leave out `local` "
      "and `keypad`, or give the group a slower table");
}

Result<void> check_backlash(const units::Coordinates& coordinates, double backlash) {
  const auto steps = coordinates.steps_of_distance(backlash);
  if (!steps) return fail(steps.error());
  if (!coordinates.has_unit() && backlash != static_cast<double>(*steps)) {
    return fail(fmt::format("is {}; allowed without `unit`: whole steps", backlash));
  }
  if (*steps != 0 || backlash == 0) return {};
  return fail(
      fmt::format("is {}, which is no step; allowed: one step or more, or 0: none", backlash));
}

}  // namespace

Result<void> read_coordinates(const TomlReader& reader, Motor* motor) {
  if (says_something(reader, "description")) {
    auto description = read_line(reader, "description", kLongestDescription);
    if (!description) return fail(description.error());
    motor->description = std::move(*description);
  }
  if (says_something(reader, "unit")) {
    if (auto read = read_scale(reader, motor); !read) return read;
  } else {
    for (const char* key : {"steps_per_unit", "direction", "offset", "precision"}) {
      if (!reader.has(key)) continue;
      return fail(reader.error(key, "needs `unit`: positions of a motor without one are steps"));
    }
  }
  const units::Coordinates& coordinates = motor->coordinates;
  const Keys keys =
      Keys(reader)
          .number("max_speed", &motor->max_speed, "a number above 0",
                  [&](double speed) { return check_max_speed(*motor, speed); })
          .number("acceleration", &motor->drive.acceleration, "a number above 0 and at most 1",
                  check_acceleration_share)
          .number("backlash", &motor->backlash, "a number; 0 is none",
                  [&](double backlash) { return check_backlash(coordinates, backlash); });
  if (!keys.result()) return keys.result();
  if (reader.has("backlash_speed") && motor->backlash == 0) {
    return fail(
        reader.error("backlash_speed", "needs `backlash`: it is the speed of its last approach"));
  }
  const Keys approach =
      Keys(reader)
          .number("backlash_speed", &motor->backlash_speed, "a number above 0",
                  [&](double speed) { return check_user_speed(coordinates, speed); })
          .whole("settle_ms", &motor->settle_ms, 0, kMostSettleMs, "milliseconds");
  if (!approach.result()) return approach.result();
  if (!reader.has("soft_limits")) return {};
  const auto limits = read_soft_limits(reader, *motor);
  if (!limits) return fail(limits.error());
  motor->soft_limits = *limits;
  return {};
}

}  // namespace bushd::config
