#include "config/velocity.h"

#include <array>
#include <string_view>

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
  const std::array keys = {"min_steps_per_s", "max_steps_per_s", "steps_per_s2"};
  if (auto known = section->only({keys[0], keys[1], keys[2]}); !known) return fail(known.error());
  const auto least = section->integer(keys[0], 1, kMostStepsPerS, "steps/s");
  if (!least) return fail(least.error());
  const auto most = section->integer(keys[1], *least, kMostStepsPerS, "steps/s");
  if (!most) return fail(most.error());
  const auto acceleration = section->integer(keys[2], 1, BUSHD_VELOCITY_MOST, "steps/s^2");
  if (!acceleration) return fail(acceleration.error());
  return Velocity{.min_steps_per_s = static_cast<std::int32_t>(*least),
                  .max_steps_per_s = static_cast<std::int32_t>(*most),
                  .steps_per_s2 = static_cast<std::int32_t>(*acceleration)};
}

}  // namespace bushd::config
