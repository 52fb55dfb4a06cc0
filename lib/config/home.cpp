#include "config/home.h"

#include <fmt/format.h>

namespace bushd::config {
namespace {

using tables::TomlReader;

constexpr std::int64_t kMostSteps = INT32_MAX;
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
  const auto most = reader.integer("most_steps", 1, kMostSteps, "steps");
  if (!most) return fail(most.error());
  home->most_steps = static_cast<std::uint32_t>(*most);
  if (reader.has("position_steps")) {
    const auto position = reader.integer("position_steps", -kMostSteps, kMostSteps, "steps");
    if (!position) return fail(position.error());
    home->position_steps = static_cast<std::int32_t>(*position);
  }
  if (reader.has("slow_steps_per_s")) {
    const auto slow = reader.integer("slow_steps_per_s", kSlowest, kFastest, "steps/s");
    if (!slow) return fail(slow.error());
    home->slow_steps_per_s = static_cast<std::uint32_t>(*slow);
  }
  if (reader.has("slow_most_steps")) {
    const auto slow_most = reader.integer("slow_most_steps", 1, kMostSteps, "steps");
    if (!slow_most) return fail(slow_most.error());
    home->slow_most_steps = static_cast<std::uint32_t>(*slow_most);
  }
  return {};
}

}  // namespace

Result<Home> read_home(const TomlReader& motor) {
  auto reader =
      motor.section("home", "a table such as { direction = \"negative\", most_steps = 20000 }");
  if (!reader) return fail(reader.error());
  if (auto known = reader->only({"direction", "position_steps", "most_steps", "slow_steps_per_s",
                                 "slow_most_steps", "at_start"});
      !known) {
    return fail(known.error());
  }
  Home home;
  const auto positive = read_direction(*reader);
  if (!positive) return fail(positive.error());
  home.positive = *positive;
  if (auto read = read_numbers(*reader, &home); !read) return fail(read.error());
  if (reader->has("at_start")) {
    const auto at_start = reader->boolean("at_start");
    if (!at_start) return fail(at_start.error());
    home.at_start = *at_start;
  }
  return home;
}

}  // namespace bushd::config
