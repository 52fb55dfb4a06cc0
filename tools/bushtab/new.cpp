#include <fmt/core.h>

#include <cstdio>

#include "commands.h"
#include "open_table.h"
#include "tables/profiles/make.h"
#include "tables/table_text.h"

namespace bushtab {

namespace tables = bushd::tables;

bushd::Result<tables::profiles::Load> load_of(const LoadOptions& options) {
  constexpr double kMetresPerMillimetre = 1e-3;
  if (options.lead_mm && options.belt_mm) {
    return bushd::fail("--lead-mm is of a screw, --belt-mm of a belt; allowed: one of them");
  }
  const auto travel_mm = options.lead_mm ? options.lead_mm : options.belt_mm;
  if (options.mass_kg && !travel_mm) {
    return bushd::fail("--mass-kg needs how far a turn moves the mass: --lead-mm or --belt-mm");
  }
  if (travel_mm && !options.mass_kg) {
    return bushd::fail(fmt::format("{} needs the mass that is moved: --mass-kg",
                                   options.lead_mm ? "--lead-mm" : "--belt-mm"));
  }
  if (options.gear && !options.mass_kg && !options.inertia_kgm2) {
    return bushd::fail("--gear needs the load behind it: --mass-kg or --load-inertia");
  }
  if (options.inertia_kgm2 && !(*options.inertia_kgm2 > 0)) {
    return bushd::fail("--load-inertia of 0 or less; allowed: above 0");
  }
  return tables::profiles::Load{
      .mass_kg = options.mass_kg.value_or(0),
      .travel_per_turn_m = travel_mm.value_or(0) * kMetresPerMillimetre,
      .inertia_kgm2 = options.inertia_kgm2.value_or(0),
      .gear = options.gear.value_or(1),
  };
}

bushd::Result<std::optional<tables::profiles::Motor>> load_motor(const MotorOptions& options) {
  const auto load = load_of(options.load);
  if (!load) return bushd::fail(load.error());
  const double load_kgm2 = tables::profiles::inertia_at_motor_kgm2(*load);
  if (options.torque_file.empty()) {
    if (load_kgm2 == 0) return std::nullopt;
    return bushd::fail("a load counts with the motor's torque only: --torque FILE");
  }
  tables::profiles::Motor motor = options.motor;
  // Often the rotor is the greater part: without it the table would be too fast.
  if (load_kgm2 > 0 && !(motor.inertia_kgm2 > 0)) {
    return bushd::fail(
        fmt::format("the load is {:.3g} kg m2 at the motor, and the rotor adds to that: --inertia, "
                    "with screw, pulley and coupling",
                    load_kgm2));
  }
  motor.inertia_kgm2 += load_kgm2;
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
  if (spec.motor && spec.motor->inertia_kgm2 > wanted.motor.motor.inertia_kgm2) {
    fmt::print(stderr, "inertia at the motor: {:.3g} kg m2, {:.3g} of it by the load\n",
               spec.motor->inertia_kgm2,
               spec.motor->inertia_kgm2 - wanted.motor.motor.inertia_kgm2);
  }
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
