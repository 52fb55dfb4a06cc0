#include "config/velocity.h"

#include <string_view>

#include "config/words.h"
#include "engine/velocity.h"

namespace bushd::config {

Result<std::optional<Velocity>> read_velocity(const tables::TomlReader& reader,
                                              const Motor& motor) {
  constexpr std::string_view kKey = "velocity";
  if (!reader.has(kKey)) return std::nullopt;
  if (!motor.drive.moved_by_people()) {
    return fail(reader.error(kKey,
                             "is how local inputs move a motor; allowed: only with `local = true` "
                             "or `keypad = true`"));
  }
  auto section = reader.section(
      kKey,
      "a table such as { min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = 500 }");
  if (!section) return fail(section.error());
  Velocity velocity;
  Keys keys(*section);
  keys.only({"min_steps_per_s", "max_steps_per_s", "steps_per_s2"})
      .needed_whole("min_steps_per_s", &velocity.min_steps_per_s, 1, kMostStepsPerS, "steps/s");
  keys.needed_whole("max_steps_per_s", &velocity.max_steps_per_s, velocity.min_steps_per_s,
                    kMostStepsPerS, "steps/s")
      .needed_whole("steps_per_s2", &velocity.steps_per_s2, 1, BUSHD_VELOCITY_MOST, "steps/s^2");
  if (!keys.result()) return fail(keys.result().error());
  return velocity;
}

}  // namespace bushd::config
