#include "config/home.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <string_view>

#include "config/setting.h"
#include "config/words.h"

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
  constexpr std::int64_t kFarthest = kMostSteps - kStepsBeyond;
  const auto above_0 = [](double speed) -> Result<void> {
    if (speed > 0) return {};
    return fail(fmt::format("is {}; allowed: a number above 0", speed));
  };
  const Keys keys =
      Keys(*reader)
          .needed_whole("most_steps", &home.most_steps, 1, kMostOfWay, "steps")
          .whole("position_steps", &home.position_steps, -kFarthest, kFarthest, "steps")
          .whole("slow_steps_per_s", &home.slow_steps_per_s, kSlowest, kFastest, "steps/s")
          .whole("slow_most_steps", &home.slow_most_steps, 1, kMostOfWay, "steps")
          .whole("order", &home.order, 1, kLastOrder)
          .number("speed", &home.speed, "a number above 0", above_0)
          .number("then", &home.then, "a position")
          .flag("at_start", &home.at_start);
  if (!keys.result()) return fail(keys.result().error());
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
