#include "config/home.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <string_view>

#include "config/setting.h"

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::int64_t kMostSteps = INT32_MAX;
// The most of either way: both are counted from 0.
constexpr std::int64_t kMostOfWay = (std::int64_t{1} << 30) - 1;
// A motor makes as many steps beyond where it is homed, before it stands: at most one in each tick
// in which the switch is read, and in that which is prepared then.
constexpr std::int64_t kStepsBeyond = 3;
constexpr std::int64_t kLastOrder = 1000;
// Slower than a step in BUSHD_HOME_UNIT_NS x 65535 the message cannot say; faster than a step in
// the shortest tick nobody can home.
constexpr std::int64_t kSlowest = 2;
constexpr std::int64_t kFastest = 1'000'000'000 / BUSHD_MIN_TICK_NS;

Result<bool> read_direction(const TomlReader& reader) {
  const auto direction = reader.string("direction", "negative, positive");
  if (!direction) return fail(direction.error());
  if (*direction == "positive" || *direction == "negative") return *direction == "positive";
  return fail(
      reader.error("direction", fmt::format("is \"{}\"; allowed: negative, positive", *direction)));
}

Result<void> read_numbers(const TomlReader& reader, Home* home) {
  const auto most = reader.integer("most_steps", 1, kMostOfWay, "steps");
  if (!most) return fail(most.error());
  home->most_steps = static_cast<std::uint32_t>(*most);
  if (reader.has("position_steps")) {
    const auto position = reader.integer("position_steps", -kMostSteps + kStepsBeyond,
                                         kMostSteps - kStepsBeyond, "steps");
    if (!position) return fail(position.error());
    home->position_steps = static_cast<std::int32_t>(*position);
  }
  if (reader.has("slow_steps_per_s")) {
    const auto slow = reader.integer("slow_steps_per_s", kSlowest, kFastest, "steps/s");
    if (!slow) return fail(slow.error());
    home->slow_steps_per_s = static_cast<std::uint32_t>(*slow);
  }
  if (reader.has("slow_most_steps")) {
    const auto slow_most = reader.integer("slow_most_steps", 1, kMostOfWay, "steps");
    if (!slow_most) return fail(slow_most.error());
    home->slow_most_steps = static_cast<std::uint32_t>(*slow_most);
  }
  if (reader.has("order")) {
    const auto order = reader.integer("order", 1, kLastOrder);
    if (!order) return fail(order.error());
    home->order = static_cast<std::int32_t>(*order);
  }
  return {};
}

// In the motor's unit.
Result<void> read_user_numbers(const TomlReader& reader, Home* home) {
  if (reader.has("speed")) {
    const auto speed = reader.number("speed", "a number above 0");
    if (!speed) return fail(speed.error());
    if (!(*speed > 0)) {
      return fail(reader.error("speed", fmt::format("is {}; allowed: a number above 0", *speed)));
    }
    home->speed = *speed;
  }
  if (reader.has("then")) {
    const auto then = reader.number("then", "a position");
    if (!then) return fail(then.error());
    home->then = *then;
  }
  return {};
}

}  // namespace

Result<Home> read_home(const TomlReader& motor) {
  auto reader =
      motor.section("home", "a table such as { direction = \"negative\", most_steps = 20000 }");
  if (!reader) return fail(reader.error());
  if (auto known = reader->only({"direction", "position_steps", "most_steps", "slow_steps_per_s",
                                 "slow_most_steps", "at_start", "order", "speed", "then"});
      !known) {
    return fail(known.error());
  }
  Home home;
  const auto positive = read_direction(*reader);
  if (!positive) return fail(positive.error());
  home.positive = *positive;
  if (auto read = read_numbers(*reader, &home); !read) return fail(read.error());
  if (auto read = read_user_numbers(*reader, &home); !read) return fail(read.error());
  if (reader->has("at_start")) {
    const auto at_start = reader->boolean("at_start");
    if (!at_start) return fail(at_start.error());
    home.at_start = *at_start;
  }
  return home;
}

Result<void> check_home_in_units(const TomlReader& reader, const Motor& motor) {
  if (!motor.home) return {};
  const units::Coordinates& coordinates = motor.coordinates;
  const auto refuse_key = [&](std::string_view key, const std::string& why) {
    auto home = reader.section("home", "a table");
    return fail(home ? home->error(key, why) : home.error());
  };
  if (motor.home->speed) {
    const auto good = check_user_speed(coordinates, *motor.home->speed);
    if (!good) return refuse_key("speed", good.error().message);
  }
  if (!motor.home->then) return {};
  const double then = *motor.home->then;
  const auto refuse = [&](const std::string& why) { return refuse_key("then", why); };
  if (!coordinates.has_unit() && std::trunc(then) != then) {
    return refuse(fmt::format("is {}; allowed: a whole number of steps, as it has no unit", then));
  }
  const auto steps = coordinates.steps_of_user(then);
  if (!steps) return refuse(steps.error().message);
  if (!motor.soft_limits) return {};
  const std::int64_t low = coordinates.first_step_from(motor.soft_limits->low);
  const std::int64_t high = coordinates.last_step_to(motor.soft_limits->high);
  if (*steps >= low && *steps <= high) return {};
  const bool falls = coordinates.scale().negative;
  return refuse(fmt::format("is beyond the soft limits; allowed: {} to {}",
                            coordinates.text(falls ? high : low),
                            coordinates.text(falls ? low : high)));
}

}  // namespace bushd::config
