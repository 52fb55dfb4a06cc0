// The supply current of four drivers, simultaneous and staggered, with the figures of RU 2704486:
// T_step 2.048 ms, dt_p 0.518 ms. And what the firmware measures of it.
#include "sim/supply_current.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/emission_bus.h"

namespace bushd::sim::supply_current_test {
namespace {

// The largest deviation from the mean of quiet times, of a move of four motors in full swing.
double peak_deviation(const bushd_emission& settings, const SupplyRules& rules) {
  EmissionBus lab(kEightStepsNs, {.supply = rules});
  lab.use(settings, 4);
  lab.settle();
  const SupplyCurrent& supply = lab.bus.mcu(0).supply();
  double sum = 0;
  const TimeNs quiet_ns = lab.bus.now_ns() - 12 * kStepNs;
  constexpr int kCount = 10'000;
  for (int i = 0; i < kCount; ++i) sum += supply.current_a(quiet_ns + i * (10 * kStepNs / kCount));
  const double mean = sum / kCount;
  lab.run({{8, 8, -8, 8}, {8, 8, -8, 8}, {8, 8, -8, 8}});
  double peak = 0;
  // The memory of the model reaches back so far.
  for (TimeNs t = lab.start_ns; t < lab.start_ns + 3 * TimeNs{kEightStepsNs}; t += 2'000) {
    peak = std::max(peak, std::abs(supply.current_a(t) - mean));
  }
  return peak;
}

TEST(SupplyCurrent, OneStepDropsOvershootsAndSettles) {
  SupplyRules rules;
  rules.drivers = 1;
  rules.fluctuation_a = 0;
  SupplyCurrent supply(rules);
  supply.edge({0, 0, Signal::kEnable, 0, true});
  EXPECT_DOUBLE_EQ(supply.current_a(900'000), rules.rest_a);
  supply.edge({1'000'000, 0, Signal::kStep, 0, true});
  double lowest = 1;
  double highest = 0;
  TimeNs last_away_ns = 0;
  for (TimeNs t = 0; t < 2'000'000; t += 1000) {
    const double current = supply.current_a(1'000'000 + t);
    lowest = std::min(lowest, current);
    highest = std::max(highest, current);
    if (std::abs(current - rules.rest_a) > (highest - rules.rest_a) / 16) last_away_ns = t;
  }
  EXPECT_LT(lowest, 0.02) << "gives back for a moment";
  EXPECT_GT(highest, 2 * 0.34);
  // The supply's softness takes a little more of the peak than of the tail.
  EXPECT_NEAR(static_cast<double>(last_away_ns), 518'000, 518'000 * 0.06);
  supply.edge({5'000'000, 0, Signal::kEnable, 0, false});
  EXPECT_EQ(supply.reading(5'000'001), 512);
}

// A regression: the model's amplitudes were chosen so that the ratio is that of the document, so
// this says where the pulses are, and not what a supply would feel.
TEST(SupplyCurrent, StaggeredStepsHaveTheRatioThatTheModelWasChosenFor) {
  const double together = peak_deviation(of_mode(BUSHD_EMISSION_BURST), {});
  bushd_emission staggered = of_mode(BUSHD_EMISSION_STAGGERED);
  staggered.settle_us = 518;
  const double apart = peak_deviation(staggered, {});
  EXPECT_GE(together / apart, 2.5) << together << " A and " << apart << " A";
  EXPECT_LE(together / apart, 3.0) << together << " A and " << apart << " A";
  // The same with what the firmware measures for itself.
  EXPECT_NEAR(peak_deviation(of_mode(BUSHD_EMISSION_STAGGERED), {}), apart, 0.01);
}

// Figures 16 and 17: three motors go right and one goes left, by one DIR.
TEST(SupplyCurrent, StaggeredStepsMoveItAsLittleWithACommonDir) {
  const double together = peak_deviation(of_mode(BUSHD_EMISSION_COMMON_DIR), {});
  bushd_emission staggered = of_mode(BUSHD_EMISSION_COMMON_STAGGERED);
  staggered.settle_us = 518;
  const double apart = peak_deviation(staggered, {});
  const double burst = peak_deviation(of_mode(BUSHD_EMISSION_BURST), {});
  EXPECT_GE(burst / apart, 2.5) << burst << " A and " << apart << " A";
  EXPECT_GT(together, 1.5 * apart) << together << " A and " << apart << " A";
  EXPECT_NEAR(peak_deviation(of_mode(BUSHD_EMISSION_COMMON_STAGGERED), {}), apart, 0.01);
}

TEST(SupplyCurrent, FirmwareMeasuresItsSettlingTimeBeforeWork) {
  for (const TimeNs settle_ns : {200'000, 518'000, 1'500'000}) {
    SupplyRules rules;
    rules.settle_ns = settle_ns;
    EmissionBus lab(kEightStepsNs, {.supply = rules});
    lab.use(of_mode(BUSHD_EMISSION_STAGGERED), 4);
    EXPECT_EQ(lab.master.poll(1).state, BUSHD_STATE_BUSY);
    lab.settle();
    const bushd_report report = lab.master.poll(1);
    EXPECT_EQ(report.state, BUSHD_STATE_READY);
    EXPECT_EQ(report.motor[0].position_steps, 0) << "a step and its way back";
    EXPECT_EQ(lab.bus.mcu(0).shaft(0).travel_steps, 2u);
    EXPECT_EQ(lab.bus.mcu(0).shaft(1).travel_steps, 0u);
    // Late by a sample at most. Early because "back" means 1/16 of the peak and what the current
    // fluctuates anyway, with a count for rounding on both; the tail falls by 16 in 0.7 of the
    // time.
    const double peak_counts =
        rules.counts_per_a * rules.overshoot_a / (1 + rules.overshoot_a / rules.soft_a);
    const double extra_counts = rules.counts_per_a * rules.fluctuation_a * 2 + 2.5;
    const double early = 0.7 * std::log2(1 + 16 * extra_counts / peak_counts) / 4;
    const auto settle = static_cast<double>(settle_ns);
    EXPECT_GE(lab.settle_ns(), settle * (1 - early)) << settle_ns;
    EXPECT_LE(lab.settle_ns(), settle * 1.06 + BUSHD_VIRTUAL_SAMPLE_NS) << settle_ns;
  }
}

TEST(SupplyCurrent, StepThatNobodyFeelsLeavesTheTimeUnknown) {
  SupplyRules rules;
  rules.drop_a = rules.overshoot_a = 0.01;
  EmissionBus lab(kEightStepsNs, {.supply = rules});
  lab.use(of_mode(BUSHD_EMISSION_STAGGERED), 4);
  lab.settle();
  const bushd_report report = lab.master.poll(1);
  EXPECT_EQ(report.state, BUSHD_STATE_READY);
  EXPECT_EQ(lab.settle_ns(), 0);
  lab.recorder.edges.clear();
  lab.run({{1, 1, 1, 0}});
  for (std::uint8_t m = 0; m < 3; ++m) {
    EXPECT_EQ(lab.recorder.times(0, Signal::kStep, m, true).at(0) - lab.start_ns,
              kEightStepsNs / 256 * (m * 32 / 3))
        << "spread over the whole T_step";
  }
}

TEST(SupplyCurrent, NothingIsMeasuredWithoutEnOrWithATimeThatIsGiven) {
  EmissionBus lab(kEightStepsNs, {.supply = SupplyRules{}});
  bushd_emission settings = of_mode(BUSHD_EMISSION_STAGGERED);
  settings.settle_us = 518;
  lab.use(settings, 4);
  EXPECT_EQ(lab.master.poll(1).state, BUSHD_STATE_READY);
  lab.bus.advance_to(lab.bus.now_ns() + 40 * TimeNs{kEightStepsNs});
  EXPECT_EQ(lab.bus.mcu(0).shaft(0).travel_steps, 0u);

  ASSERT_EQ(lab.master.acknowledged(1, bushd_control{BUSHD_CONTROL_DISABLE, 0}), BUSHD_OK);
  lab.use(of_mode(BUSHD_EMISSION_STAGGERED), 4);
  lab.bus.advance_to(lab.bus.now_ns() + 40 * TimeNs{kEightStepsNs});
  EXPECT_EQ(lab.bus.mcu(0).shaft(0).travel_steps, 0u);
  ASSERT_EQ(lab.master.acknowledged(1, bushd_control{BUSHD_CONTROL_ENABLE, 0}), BUSHD_OK);
  lab.settle();
  EXPECT_EQ(lab.bus.mcu(0).shaft(0).travel_steps, 2u);
  EXPECT_NE(lab.settle_ns(), 0);
}

}  // namespace
}  // namespace bushd::sim::supply_current_test
