// What the check finds, and where.
#include "tables/profiles/diagnostics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "results.h"
#include "tables/edit.h"
#include "tables/profiles/random_spec.h"
#include "tables/random_table.h"

namespace bushd::test {
namespace {

using tables::scale_acceleration;
using tables::TableContent;
using tables::profiles::Diagnostic;
using tables::profiles::Limits;
using tables::profiles::Motor;
using tables::profiles::Profile;
using tables::profiles::Severity;
using tables::profiles::Spec;
using testing::HasSubstr;
using testing::IsEmpty;

// 100, 200, 400 steps/s
const TableContent kTable{.name = "t", .time_unit_ns = 100'000, .accel = {100, 50, 25}};

std::vector<Diagnostic> found(const TableContent& content, const Limits& limits) {
  return diagnostics(**tables::make(content), limits);
}

// The only one.
Diagnostic only(const TableContent& content, const Limits& limits) {
  const auto all = found(content, limits);
  EXPECT_EQ(all.size(), 1U);
  return all.at(0);
}

TEST(Diagnostics, GoodTableHasNone) {
  EXPECT_THAT(found(kTable, {.start_hz = 100,
                             .max_hz = 400,
                             .acceleration = 53'000,
                             .mcu_codes = 3,
                             .tick_ns = 20'000'000,
                             .slots = 128}),
              IsEmpty());
}

TEST(Diagnostics, StartAndMaximumSpeed) {
  const Diagnostic start = only(kTable, {.start_hz = 99});
  EXPECT_EQ(start.rule, "start_speed");
  EXPECT_EQ(start.index, 0U);
  EXPECT_DOUBLE_EQ(start.value, 100);
  EXPECT_EQ(start.severity, Severity::kError);
  const Diagnostic max = only(kTable, {.max_hz = 399});
  EXPECT_EQ(max.rule, "max_speed");
  EXPECT_THAT(max.message, HasSubstr("Set cruise = 26 or more"));
}

TEST(Diagnostics, BothSidesAreLookedAtInTheOrderOfTheFile) {
  TableContent content = kTable;
  content.decel = {{25, 30, 90}};
  const auto stop = found(content, {.start_hz = 105});
  ASSERT_EQ(stop.size(), 2U);
  EXPECT_EQ(stop[0].rule, "start_speed");
  EXPECT_EQ(stop[0].side, "decel");
  EXPECT_EQ(stop[0].index, 2U);
  EXPECT_EQ(stop[1].rule, "speed_ratio");
  EXPECT_EQ(stop[1].index, 1U);
  EXPECT_DOUBLE_EQ(stop[1].value, 3);
}

TEST(Diagnostics, JumpFromASideToItsCruiseIsOneToo) {
  TableContent content = kTable;
  content.cruise = 12;
  const Diagnostic jump = only(content, {});
  EXPECT_EQ(jump.rule, "speed_ratio");
  EXPECT_EQ(jump.index, 2U);
}

TEST(Diagnostics, AccelerationCountsWithoutWhatRoundingMayMake) {
  // From 10 ms to 5 ms: 100 steps/s within 7.5 ms; the first code may stand for 9.9 ms.
  EXPECT_THAT(found(kTable, {.acceleration = 26'500}), testing::SizeIs(1));
  const Diagnostic steep = only(kTable, {.acceleration = 12'000});
  EXPECT_EQ(steep.rule, "acceleration");
  EXPECT_EQ(steep.index, 2U);
}

TEST(Diagnostics, TablesOfAProfileKeepItsBound) {
  EXPECT_TRUE(rc::check("no false alarm", [] {
    const Spec spec = random_spec(*rc::gen::element(Profile::kConstant, Profile::kScurve));
    const auto content = good(make_content(spec));
    RC_ASSERT(found(content, {.speed_ratio = 0, .acceleration = *spec.accel.acceleration}).empty());
  }));
}

TEST(Diagnostics, AdvisedScalingIsEnough) {
  EXPECT_TRUE(rc::check("of any table", [] {
    const TableContent content = random_case(1000).content;
    Limits limits{.speed_ratio = 0, .resolution = 1, .acceleration = 1};
    const auto steep = found(content, limits);
    if (steep.empty()) return;
    // Below that, what is left of a code by the noise of its rounding would count.
    const double least = 1e-5 / std::pow(content.time_unit_ns * 1e-9, 2);
    limits.acceleration = std::max(least, steep[0].value * random_in(5, 99) / 100.0);
    // No advice is right only where scaling makes more codes than a side may have. The factor is
    // looked for from limit / greatest down; a tenth of that is far enough for any table.
    const double greatest = std::ranges::max(steep, std::less{}, [](const Diagnostic& diagnostic) {
                              return diagnostic.value;
                            }).value;
    const auto far = scale_acceleration(content, *limits.acceleration / greatest / 10);
    for (const Diagnostic& diagnostic : found(content, limits)) {
      const std::string advice = "scale --acceleration ";
      const std::size_t at = diagnostic.message.find(advice);
      if (at == std::string::npos && !far) continue;
      RC_ASSERT(at != std::string::npos);
      const double factor = std::stod(diagnostic.message.substr(at + advice.size()));
      const auto scaled = scale_acceleration(content, factor);
      RC_ASSERT(scaled.has_value());
      RC_ASSERT(found(*scaled, limits).empty());
    }
  }));
}

TEST(Diagnostics, NoScalingIsAdvisedThatWouldMakeTooManyCodes) {
  // From 1000 to 3000 steps/s within 2/3 ms: for 1 step/s^2 four million steps would be needed.
  const TableContent content{.name = "t", .time_unit_ns = 1000, .accel = {1000}, .cruise = 333};
  const Diagnostic steep = only(content, {.speed_ratio = 0, .resolution = 1, .acceleration = 1});
  EXPECT_EQ(steep.rule, "acceleration");
  EXPECT_THAT(steep.message, testing::Not(testing::HasSubstr("scale")));
}

TEST(Diagnostics, CodesThatAreNotThoseOfBushd) {
  TableContent content{.name = "t", .time_unit_ns = 40'000, .accel = {251, 100, 9}};
  const auto wide = found(content, {.speed_ratio = 0, .code_bits = 8});
  ASSERT_EQ(wide.size(), 3U);
  EXPECT_EQ(wide[0].rule, "code_width");
  EXPECT_EQ(wide[0].side, "accel");
  EXPECT_EQ(wide[2].side, "cruise");
}

TEST(Diagnostics, McuAndBus) {
  EXPECT_EQ(found(kTable, {.mcu_codes = 2}).at(0).rule, "mcu_memory");
  TableContent fast{.name = "t", .time_unit_ns = 100, .accel = {1000, 500}};
  EXPECT_EQ(found(fast, {.tick_ns = 10'000'000}).at(0).rule, "tick");
  const Diagnostic slots = only(fast, {.tick_ns = 6'000'000, .slots = 128});
  EXPECT_EQ(slots.rule, "slots");
  EXPECT_EQ(slots.severity, Severity::kWarning);
}

TEST(Diagnostics, TooFastForTheMotorByThirtyPerCent) {
  Spec spec{.name = "t", .start_hz = 200, .max_hz = 3000};
  spec.accel.profile = Profile::kTorque;
  spec.motor = Motor{.torque = {{0, 0.4}, {2000, 0.3}, {6000, 0.1}},
                     .inertia_kgm2 = 2e-5,
                     .friction_nm = 0.02,
                     .safety = 1.2};
  TableContent content = *make_content(spec);
  EXPECT_THAT(found(content, {.motor = spec.motor}), IsEmpty());
  content.time_unit_ns = static_cast<std::uint32_t>(content.time_unit_ns / 1.3);
  const auto fast = found(content, {.motor = spec.motor});
  ASSERT_FALSE(fast.empty());
  EXPECT_EQ(fast[0].rule, "torque");
  EXPECT_EQ(fast[0].severity, Severity::kError);
  EXPECT_THAT(fast[0].message, HasSubstr("it will lose steps"));
}

TEST(Diagnostics, TorqueIsToldInNewtonMetres) {
  // 200 and 400 steps/s, 3.75 ms apart: 53333 steps/s^2 or 1675.5 rad/s^2, if the first code stands
  // for a delay of 1 ns less at least.
  const TableContent content{.name = "t", .time_unit_ns = 1000, .accel = {5000, 2500}};
  const Motor motor{
      .torque = {{0, 0.1}, {1000, 0.1}}, .inertia_kgm2 = 5e-5, .friction_nm = 0.01, .safety = 1.5};
  const Diagnostic weak = only(content, {.motor = motor});
  EXPECT_EQ(weak.rule, "torque");
  EXPECT_EQ(weak.index, 1U);
  EXPECT_EQ(weak.severity, Severity::kWarning);
  EXPECT_NEAR(weak.value, 5e-5 * 1675.5 + 0.01, 1e-4);
  EXPECT_DOUBLE_EQ(weak.limit, 0.1 / 1.5);
}

// 4 T / (p J) is the square of the greatest jump without friction, in rad/s: 1006.6 steps/s.
const Motor kLight{.torque = {{0, 0.4}, {9000, 0.4}}, .inertia_kgm2 = 3.2e-5, .safety = 1.5};

TEST(Diagnostics, StartThatTheRotorCannotFollow) {
  const auto at_start = [](std::uint16_t code) {
    return found({.name = "t", .time_unit_ns = 1000, .accel = {code}}, {.motor = kLight});
  };
  EXPECT_THAT(at_start(1500), IsEmpty());
  const auto risky = at_start(1000);
  ASSERT_EQ(risky.size(), 1U);
  EXPECT_EQ(risky[0].rule, "jump");
  EXPECT_EQ(risky[0].index, 0U);
  EXPECT_EQ(risky[0].severity, Severity::kWarning);
  EXPECT_DOUBLE_EQ(risky[0].value, 1000);
  EXPECT_NEAR(risky[0].limit, 1006.6 / 1.5, 0.1);
  const auto hopeless = at_start(990);
  ASSERT_EQ(hopeless.size(), 1U);
  EXPECT_EQ(hopeless[0].severity, Severity::kError);
  EXPECT_THAT(hopeless[0].message, HasSubstr("Put slower codes before it"));
}

TEST(Diagnostics, MicrostepsStartAsTheirFullSteps) {
  Motor motor = kLight;
  motor.steps_per_turn = 3200;
  motor.torque = {{0, 0.4}, {90000, 0.4}};
  const Diagnostic risky =
      only({.name = "t", .time_unit_ns = 500, .accel = {125}}, {.motor = motor});
  EXPECT_NEAR(risky.limit, 16 * 1006.6 / 1.5, 2);
}

TEST(Diagnostics, JumpOfACoarseCodeThatTheRotorCannotFollow) {
  // Rounding up may have made the code of 11, so it is no acceleration for sure; but 2273 to 2500
  // steps/s come within a step all the same.
  const TableContent content{.name = "t",
                             .time_unit_ns = 40'000,
                             .accel = {250, 100, 60, 40, 30, 24, 20, 17, 15, 14, 13, 12, 11, 10}};
  Motor motor{.torque = {{0, 3}, {2000, 3}, {2500, 0.1}, {2600, 0.1}}, .inertia_kgm2 = 1e-4};
  const Diagnostic jump = only(content, {.motor = motor});
  EXPECT_EQ(jump.rule, "jump");
  EXPECT_EQ(jump.index, 13U);
  EXPECT_NEAR(jump.value, 2500 - 25000 / 11., 1e-6);
  EXPECT_THAT(jump.message, HasSubstr("shorter time unit"));
}

TEST(Diagnostics, CruiseThatFrictionDoesNotLetThrough) {
  const TableContent content{.name = "t", .time_unit_ns = 1000, .accel = {5000}};
  Motor motor{.torque = {{0, 0.1}, {1000, 0.1}}, .inertia_kgm2 = 1e-6, .friction_nm = 0.045};
  EXPECT_THAT(found(content, {.motor = motor}), IsEmpty());
  motor.friction_nm = 0.08;
  const Diagnostic risky = only(content, {.motor = motor});
  EXPECT_EQ(risky.rule, "torque");
  EXPECT_EQ(risky.side, "cruise");
  EXPECT_EQ(risky.severity, Severity::kWarning);
  motor.friction_nm = 0.11;
  EXPECT_EQ(found(content, {.motor = motor}).at(0).severity, Severity::kError);
}

}  // namespace
}  // namespace bushd::test
