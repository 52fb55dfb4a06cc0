// The simulated motor against what theory says of a rotor on a sine of torque.
#include "sim/rotor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace bushd::sim::rotor_test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr TimeNs kSecondNs = 1'000'000'000;

// 1.8 degrees, 1/64 step: the field turns as good as evenly. sqrt(p T / J) = 500 rad/s.
const RotorRules kSmooth{.pull_out = {{0, 0.4}, {1e6, 0.4}},
                         .inertia_kgm2 = 8e-5,
                         .damping_ratio = 0,
                         .steps_per_turn = 12800};

// Steps at x(t) = whole numbers, for `steps` steps.
void run(Rotor& rotor, const std::function<double(double)>& time_s_of, int steps) {
  for (int i = 1; i <= steps; ++i) rotor.step(std::llround(1e9 * time_s_of(i)), true);
}

// The field turns on with a constant acceleration that takes `share` of the pull-out torque.
Rotor accelerated(const RotorRules& rules, double share) {
  const double a = share * rules.pull_out.front().torque_nm / rules.inertia_kgm2 *
                   rules.steps_per_turn / (2 * kPi);
  Rotor rotor(rules);
  run(rotor, [a](double x) { return std::sqrt(2 * x / a); }, 20000);
  return rotor;
}

TEST(Rotor, FollowsASuddenTorqueOfUpTo72PerCentWithoutAnyDamping) {
  // Equal areas: 1 + cos d = s (pi - d) with sin d = s has the solution s = 0.7246.
  const Rotor follows = accelerated(kSmooth, 0.72);
  EXPECT_FALSE(follows.slipped_ns());
  EXPECT_EQ(follows.lost_full_steps(), 0);
  EXPECT_TRUE(accelerated(kSmooth, 0.73).slipped_ns());
}

TEST(Rotor, FrictionTakesItsShareOfTheTorque) {
  RotorRules rules = kSmooth;
  rules.friction_nm = 0.08;
  EXPECT_FALSE(accelerated(rules, 0.51).slipped_ns());
  EXPECT_TRUE(accelerated(rules, 0.54).slipped_ns());
}

TEST(Rotor, FollowsAStartWhoseEnergyItsTorqueCanGive) {
  // J w^2 / 2 = 2 T / p: 2 sqrt(T / (p J)) = 20 rad/s.
  const auto started = [](double rad_per_s) {
    Rotor rotor(kSmooth);
    const double hz = rad_per_s * kSmooth.steps_per_turn / (2 * kPi);
    run(rotor, [hz](double x) { return x / hz; }, 20000);
    return rotor;
  };
  EXPECT_FALSE(started(19.9).slipped_ns());
  EXPECT_TRUE(started(20.1).slipped_ns());
}

TEST(Rotor, SwingsWithItsNaturalFrequency) {
  Rotor rotor(kSmooth);
  rotor.step(0, true);
  const double lag = rotor.lag_full_steps();
  const auto at = [&](double periods) {
    rotor.advance_to(std::llround(periods * 2 * kPi / 500 * 1e9));
    return rotor.lag_full_steps() / lag;
  };
  EXPECT_NEAR(at(0.25), 0, 0.01);
  EXPECT_NEAR(at(0.5), -1, 0.01);
  EXPECT_NEAR(at(100), 1, 0.01);
}

TEST(Rotor, OvershootsByItsDamping) {
  RotorRules rules = kSmooth;
  rules.damping_ratio = 0.1;
  Rotor rotor(rules);
  rotor.step(0, true);
  const double lag = rotor.lag_full_steps();
  const double root = std::sqrt(1 - 0.01);
  rotor.advance_to(std::llround(kPi / (500 * root) * 1e9));
  EXPECT_NEAR(rotor.lag_full_steps() / lag, -std::exp(-0.1 * kPi / root), 0.01);
  rotor.advance_to(kSecondNs);
  EXPECT_NEAR(rotor.lag_full_steps(), 0, 1e-6);
}

// The load at a constant speed, reached slowly with twice the torque.
bool carries(double load_share, double steps_per_full_step) {
  const double m = steps_per_full_step;
  RotorRules rules{.pull_out = {{0, 0.8}, {800 * m, 0.8}, {1200 * m, 0.4}, {2000 * m, 0.4}},
                   .inertia_kgm2 = 2e-5,
                   .friction_nm = load_share * 0.4,
                   .damping_ratio = 0.2,
                   .steps_per_turn = 200 * m};
  Rotor rotor(rules);
  double t_s = 0;
  for (double hz = 100; hz < 1500; hz += 500 / (hz * m)) {
    t_s += 1 / (hz * m);
    rotor.step(std::llround(1e9 * t_s), true);
  }
  for (int i = 0; i < 3000 * m; ++i) {
    t_s += 1 / (1500 * m);
    rotor.step(std::llround(1e9 * t_s), true);
  }
  return !rotor.slipped_ns();
}

TEST(Rotor, CarriesItsPullOutTorqueInFullStepsAndInMicrosteps) {
  EXPECT_TRUE(carries(0.96, 1));
  EXPECT_FALSE(carries(1.04, 1));
  EXPECT_TRUE(carries(0.96, 8));
  EXPECT_FALSE(carries(1.04, 8));
}

TEST(Rotor, HasNoTorqueBeyondTheCurve) {
  RotorRules rules = kSmooth;
  rules.pull_out = {{0, 0.4}, {64000, 0.4}};
  rules.friction_nm = 0.01;
  rules.damping_ratio = 0.1;
  Rotor rotor(rules);
  run(rotor, [](double x) { return std::sqrt(x / 64000); }, 15000);  // to 62000 steps/s
  EXPECT_FALSE(rotor.slipped_ns());
  Rotor faster(rules);
  run(faster, [](double x) { return std::sqrt(x / 64000); }, 30000);
  EXPECT_TRUE(faster.slipped_ns());
}

TEST(Rotor, LosesWholeTurnsOfTheField) {
  RotorRules rules = kSmooth;
  rules.damping_ratio = 0.1;
  rules.friction_nm = 0.02;
  Rotor rotor = accelerated(rules, 2);
  ASSERT_TRUE(rotor.slipped_ns());
  rotor.advance_to(*rotor.slipped_ns() + 10 * kSecondNs);
  const std::int64_t lost = rotor.lost_full_steps();
  EXPECT_NE(lost, 0);
  EXPECT_EQ(lost % 4, 0);
  EXPECT_NEAR(static_cast<double>(rotor.position_full_steps() + lost), 20000 / 64., 1);
}

TEST(Rotor, FrictionHoldsItWhereItStands) {
  RotorRules rules = kSmooth;
  rules.friction_nm = 0.1;
  Rotor rotor(rules);
  rotor.step(0, true);
  const double lag = rotor.lag_full_steps();
  rotor.advance_to(kSecondNs);
  EXPECT_EQ(rotor.lag_full_steps(), lag);
}

TEST(Rotor, GoesBackAsItGoesForward) {
  RotorRules rules = kSmooth;
  rules.friction_nm = 0.02;
  rules.damping_ratio = 0.1;
  Rotor forward(rules);
  Rotor backward(rules);
  for (int i = 1; i <= 640; ++i) {
    forward.step(i * 100'000, true);
    backward.step(i * 100'000, false);
  }
  EXPECT_EQ(forward.lag_full_steps(), -backward.lag_full_steps());
  forward.advance_to(kSecondNs);
  backward.advance_to(kSecondNs);
  EXPECT_EQ(forward.position_full_steps(), 10);
  EXPECT_EQ(backward.position_full_steps(), -10);
}

}  // namespace
}  // namespace bushd::sim::rotor_test
