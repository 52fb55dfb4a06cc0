// Windings against the closed form of L di/dt = v - R i, and what the comparators see of them.
#include "sim/power_stage.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bushd::sim::power_stage_test {
namespace {

constexpr PowerStageRules kRules{};
constexpr double kOnOhm = kRules.resistance_ohm + kRules.switch_ohm + kRules.sense_ohm;

double rise_a(TimeNs ns) {
  return kRules.supply_v / kOnOhm *
         (1 - std::exp(-static_cast<double>(ns) * 1e-9 * kOnOhm / kRules.inductance_h));
}

TEST(PowerStage, CurrentRisesAsOfACoilAndStopsAtOhm) {
  PowerStage stage(kRules);
  stage.set_outputs(0, 1);
  for (const TimeNs ns : {1'000, 25'000, 333'333, 2'000'000, 50'000'000}) {
    stage.advance(ns);
    EXPECT_NEAR(stage.current_a(0), rise_a(ns), 1e-9) << ns;
  }
  EXPECT_NEAR(stage.current_a(0), kRules.supply_v / kOnOhm, 1e-3);
  EXPECT_EQ(stage.current_a(1), 0);
}

TEST(PowerStage, DecaysByItsDiodeOrAgainstTheSupply) {
  for (const bool fast : {false, true}) {
    PowerStage stage(kRules);
    stage.set_fast_decay(0, fast);
    stage.set_outputs(0, 1);
    stage.set_outputs(400'000, 0);
    const double begin_a = stage.current_a(0);
    stage.advance(420'000);
    const double volt = fast ? kRules.supply_v + 2 * kRules.diode_v : kRules.diode_v;
    const double end_a = -volt / kRules.resistance_ohm;
    const double share = std::exp(-20e-6 * kRules.resistance_ohm / kRules.inductance_h);
    EXPECT_NEAR(stage.current_a(0), end_a + (begin_a - end_a) * share, 1e-9);
    stage.advance(60'000'000);
    EXPECT_EQ(stage.current_a(0), 0) << "a diode lets none back";
  }
}

TEST(PowerStage, TripsWhenItSaysAndOnlyWhileOn) {
  PowerStage stage(kRules);
  stage.set_reference(0, 0.5);
  stage.set_outputs(0, 1 << 3);
  EXPECT_FALSE(stage.next_trip_ns(0, 1'000'000)) << "its other pair";
  EXPECT_FALSE(stage.next_trip_ns(1, 10'000)) << "not so soon";
  const auto trip_ns = stage.next_trip_ns(1, 1'000'000);
  ASSERT_TRUE(trip_ns);
  stage.advance(*trip_ns - 5);
  EXPECT_FALSE(stage.trips(1));
  stage.advance(*trip_ns + 5);
  EXPECT_TRUE(stage.trips(1));
  EXPECT_NEAR(rise_a(*trip_ns), 0.5, 1e-4);
  stage.set_outputs(*trip_ns + 5, 0);
  EXPECT_FALSE(stage.trips(1)) << "the sense resistor sees none of it";
}

// In cruise a winding that draws the rotor has the back EMF against it: the rise is slower, by the
// mean of the sine over a step, sin(pi/4) / (pi/4) = 0.9.
TEST(PowerStage, BackEmfOfARotorThatTurns) {
  constexpr TimeNs kStepNs = 1'000'000;
  PowerStage stage(kRules);
  TimeNs now_ns = 0;
  for (int step = 0; step < 20; ++step) {
    stage.set_outputs(now_ns, static_cast<std::uint8_t>(1 << step % 4));
    now_ns += kStepNs;
    stage.advance(now_ns);
  }
  stage.set_outputs(now_ns, 1);
  const double from_a = stage.current_a(0);
  stage.advance(now_ns + kStepNs);
  const double mean_v = kRules.supply_v - kRules.back_emf_v_per_hz * 1000 * 0.9;
  const double end_a = mean_v / kOnOhm;
  const double share = std::exp(-1e-3 * kOnOhm / kRules.inductance_h);
  EXPECT_NEAR(stage.current_a(0), end_a + (from_a - end_a) * share, 0.05);
}

}  // namespace
}  // namespace bushd::sim::power_stage_test
