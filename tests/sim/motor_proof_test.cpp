// Shipped tables on the motors that they are for, and tables made by the torque profile on any
// motor: the rotor keeps up, and where it does not, the check has said so.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/shipped_motors.h"
#include "tables/profiles/diagnostics.h"
#include "tables/profiles/random_spec.h"

namespace bushd::test {
namespace {

using tables::profiles::diagnostics;
using tables::profiles::Motor;
using tables::profiles::Profile;
using tables::profiles::Severity;
using tables::profiles::Spec;

// From little to much for a motor without a damper. With half of that little, swings of the start,
// of the turn and of the end can add up in moves of an unlucky length.
constexpr std::array kDampingRatios{0.1, 0.3};

// The same codes in a shorter time unit: `factor` times the speed, its square the acceleration.
tables::TablePtr faster(const tables::Table& table, double factor) {
  const bushd_table& view = table.view();
  tables::TableContent content{
      .name = table.name(),
      .time_unit_ns = static_cast<std::uint32_t>(view.time_unit_ns / factor),
      .accel = {view.accel.code, view.accel.code + view.accel.count},
      .decel = {{view.decel.code, view.decel.code + view.decel.count}},
      .cruise = view.cruise};
  std::reverse(content.decel->begin(), content.decel->end());
  return tables::make(std::move(content)).value();
}

// A move by the rule of docs/tables.md and some rest, or as much of it as goes well.
sim::Rotor moved(const tables::Table& table, std::uint32_t steps, const sim::RotorRules& rules) {
  const bushd_table& view = table.view();
  const auto delay = [&](const bushd_ramp& side, std::uint32_t i) {
    return i < side.count ? std::max(side.code[i], view.cruise) : view.cruise;
  };
  sim::Rotor rotor(rules);
  sim::TimeNs t_ns = 0;
  for (std::uint32_t j = 1; j <= steps && !rotor.slipped_ns(); ++j) {
    t_ns += sim::TimeNs{std::max(delay(view.accel, j - 1), delay(view.decel, steps - j))} *
            view.time_unit_ns;
    rotor.step(t_ns, true);
  }
  rotor.advance_to(t_ns + 200'000'000);
  return rotor;
}

// Short ones, ones that just turn round, and at last one that cruises for a while.
std::array<std::uint32_t, 6> moves(const tables::Table& table) {
  const std::uint32_t both = table.view().accel.count + table.view().decel.count;
  return {7, both / 16, both / 4, both / 2, both, both + 500};
}

bool follows(const tables::Table& table, std::uint32_t steps, const sim::RotorRules& rules) {
  const sim::Rotor rotor = moved(table, steps, rules);
  return !rotor.slipped_ns() && rotor.lost_full_steps() == 0;
}

bool follows_all(const tables::Table& table, const sim::RotorRules& rules) {
  const auto all = moves(table);
  return std::all_of(all.begin(), all.end(),
                     [&](std::uint32_t steps) { return follows(table, steps, rules); });
}

// Friction as in the data, and as little of it as is there for sure.
std::vector<sim::RotorRules> rotors(const Motor& motor) {
  std::vector<sim::RotorRules> all;
  for (const double damping_ratio : kDampingRatios) {
    for (const double friction_nm : {motor.friction_nm, motor.brake_friction_nm}) {
      all.push_back(rotor_rules(motor, friction_nm, damping_ratio));
    }
  }
  return all;
}

bool warned(const tables::Table& table, const Motor& motor) {
  return !diagnostics(table, {.motor = motor}).empty();
}

bool has_error(const tables::Table& table, const Motor& motor) {
  const auto found = diagnostics(table, {.motor = motor});
  return std::any_of(
      found.begin(), found.end(), [](const tables::profiles::Diagnostic& diagnostic) {
        return diagnostic.rule == "torque" && diagnostic.severity == Severity::kError;
      });
}

class ShippedMotor : public testing::TestWithParam<std::string> {
 protected:
  const tables::TablePtr table = tables::load(kShippedTables / (GetParam() + ".toml")).value();
  const Motor motor = shipped_motor(GetParam());
};

TEST_P(ShippedMotor, ReachesTargetsWithoutLosingSteps) {
  EXPECT_FALSE(warned(*table, motor));
  for (const sim::RotorRules& rules : rotors(motor)) {
    for (const std::uint32_t steps : moves(*table)) {
      const sim::Rotor rotor = moved(*table, steps, rules);
      SCOPED_TRACE(testing::Message() << steps << " steps, damping " << rules.damping_ratio
                                      << ", friction " << rules.friction_nm);
      EXPECT_FALSE(rotor.slipped_ns()) << "at " << *rotor.slipped_ns() << " ns";
      EXPECT_EQ(rotor.lost_full_steps(), 0);
      // Friction may hold it half a full step beside its place.
      EXPECT_NEAR(static_cast<double>(rotor.position_full_steps()),
                  steps * motor.full_steps_per_turn / motor.steps_per_turn, 1);
    }
  }
}

// Whatever the reason for which it stalls at last: torque, friction, start or a coarse code.
TEST_P(ShippedMotor, IsWarnedOfBeforeItStallsHoweverFastItIsMade) {
  for (const sim::RotorRules& rules : rotors(motor)) {
    double factor = 1;
    tables::TablePtr fast = table;
    while (follows_all(*fast, rules)) {
      factor *= 1.25;
      ASSERT_LT(factor, 20) << "it never stalls";
      fast = faster(*table, factor);
    }
    EXPECT_TRUE(warned(*fast, motor)) << "stalls when " << factor << " times as fast, damping "
                                      << rules.damping_ratio << ", friction " << rules.friction_nm;
  }
}

INSTANTIATE_TEST_SUITE_P(, ShippedMotor, testing::ValuesIn(shipped_tables()), [](const auto& test) {
  std::string name = test.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// These use half of the torque T: T/2 with friction F. At 1.3 times the speed the acceleration is
// 1.69 times as much, which takes 1.69 (T/2 - F) + F = 0.85 T - 0.69 F, and T is less there. That
// is more than what a rotor follows without damping: 0.72 T at the start, 0.54 T where a short move
// turns (tables/profiles/motor.h). The other tables ask less of their motors, and some follow.
class ShippedAtItsLimit : public ShippedMotor {};

TEST_P(ShippedAtItsLimit, ThirtyPerCentTooFastItIsWarnedOfAndStalls) {
  const tables::TablePtr fast = faster(*table, 1.3);
  EXPECT_TRUE(warned(*fast, motor));
  for (const double friction_nm : {motor.friction_nm, motor.brake_friction_nm}) {
    EXPECT_FALSE(follows_all(*fast, rotor_rules(motor, friction_nm, kDampingRatios.front())));
  }
}

INSTANTIATE_TEST_SUITE_P(, ShippedAtItsLimit, testing::Values("nema17-torque", "nema23-stage"),
                         [](const auto& test) { return test.param.substr(0, 6); });

// A motor of natural frequency w = sqrt(p T / J), whose torque falls to a part of T.
Spec random_torque_spec() {
  Motor motor{.steps_per_turn = 200.0 * *rc::gen::element(2, 4, 8, 16, 32)};
  const double torque_nm = random_scale(0.05, 5);
  const double rad_per_s = random_scale(150, 1000);
  motor.inertia_kgm2 = 50 * torque_nm / (rad_per_s * rad_per_s);
  motor.friction_nm = torque_nm * random_between(0, 0.08);
  const double micro = motor.steps_per_turn / 200;
  const double max_hz = micro * random_between(1500, 3000);
  motor.torque = {{0, torque_nm},
                  {max_hz * random_between(0.2, 0.5), torque_nm * random_between(0.75, 1)},
                  {max_hz * 1.4, torque_nm * random_between(0.25, 0.5)}};
  Spec spec{.name = "random", .start_hz = micro * random_between(40, 100), .max_hz = max_hz};
  spec.accel.profile = Profile::kTorque;
  spec.motor = motor;
  return spec;
}

tables::TablePtr made(const Spec& spec) {
  return tables::make(tables::profiles::make_content(spec).value()).value();
}

TEST(TorqueProfile, IsFollowedByAnyMotor) {
  EXPECT_TRUE(rc::check("with half of its torque", [] {
    const Spec spec = random_torque_spec();
    const tables::TablePtr table = made(spec);
    RC_PRE(!warned(*table, *spec.motor));  // of its start
    const std::uint32_t steps = *rc::gen::inRange(2U, 2 * moves(*table).back());
    RC_ASSERT(follows(*table, steps, *rc::gen::elementOf(rotors(*spec.motor))));
  }));
}

TEST(TorqueProfile, ThirtyPerCentMoreThanTheMotorHasStallsAnyMotor) {
  EXPECT_TRUE(rc::check("and is an error", [] {
    Spec spec = random_torque_spec();
    const Motor motor = *spec.motor;
    spec.motor->safety = 1;
    const tables::TablePtr fast = faster(*made(spec), 1.3);
    RC_ASSERT(has_error(*fast, motor));
    RC_ASSERT(!follows(*fast, moves(*fast).back(), *rc::gen::elementOf(rotors(motor))));
  }));
}

}  // namespace
}  // namespace bushd::test
