#include <fmt/core.h>

#include <cstdio>

#include "commands.h"
#include "open_table.h"
#include "tables/profiles/make.h"
#include "tables/table_text.h"

namespace bushtab {

namespace tables = bushd::tables;

bushd::Result<std::optional<tables::profiles::Motor>> load_motor(const MotorOptions& options) {
  if (options.torque_file.empty()) return std::nullopt;
  tables::profiles::Motor motor = options.motor;
  auto curve = tables::profiles::load_torque_csv(options.torque_file, motor.steps_per_turn);
  if (!curve) return bushd::fail(curve.error());
  motor.torque = std::move(*curve);
  if (const auto good = tables::profiles::check(motor); !good) return bushd::fail(good.error());
  return motor;
}

bushd::Result<tables::profiles::Limits> load_limits(const LimitOptions& options) {
  auto motor = load_motor(options.motor);
  if (!motor) return bushd::fail(motor.error());
  tables::profiles::Limits limits = options.limits;
  limits.motor = std::move(*motor);
  return limits;
}

int make_new(const Places& places, const New& wanted) {
  auto home = home_of(places, wanted.table);
  if (!home) return refuse(home.error());
  tables::profiles::Spec spec = wanted.spec;
  spec.name = home->name;
  auto motor = load_motor(wanted.motor);
  if (!motor) return refuse(motor.error());
  spec.motor = std::move(*motor);
  auto content = tables::profiles::make_content(spec);
  if (!content) return refuse(content.error());
  content->revision = 1;
  const std::string text = tables::to_text(*content, wanted.comments);
  if (wanted.print) {
    const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
    if (written && std::fflush(stdout) == 0) return kDone;
    return kRefused;  // main says why
  }
  const std::string note =
      fmt::format("new, profile {}", tables::profiles::name_of(spec.accel.profile));
  bushd::Result<std::uint32_t> revision{0};
  const auto old = home->store.read(home->name);
  if (old && wanted.replace) {
    revision = home->store.save(home->name, old->text, text, note);
  } else {
    revision = create_in(*home, text, note);
  }
  return saved(*home, revision, wanted.json);
}

}  // namespace bushtab
