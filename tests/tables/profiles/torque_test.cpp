// Tables made from a motor's torque curve, against a fine integration that shares no code with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "results.h"
#include "tables/move_time.h"
#include "tables/profiles/diagnostics.h"
#include "tables/profiles/random_spec.h"

namespace bushd::test {
namespace {

using tables::profiles::make_content;
using tables::profiles::Motor;
using tables::profiles::parse_torque_csv;
using tables::profiles::Profile;
using tables::profiles::Side;
using tables::profiles::Spec;
using testing::HasSubstr;

constexpr double kPi = 3.14159265358979323846;

Motor random_motor(double start_hz, double max_hz) {
  Motor motor;
  motor.inertia_kgm2 = random_scale(1e-6, 1e-3);
  motor.safety = random_between(1, 2);
  motor.steps_per_turn = *rc::gen::element(48.0, 200.0, 400.0, 3200.0);
  // Torque such that the ramp takes 5..5000 steps at its start.
  const double a = max_hz * max_hz / random_scale(10, 10000);
  const double torque_nm = a * 2 * kPi / motor.steps_per_turn * motor.inertia_kgm2 * motor.safety;
  motor.friction_nm = torque_nm / motor.safety * random_between(0, 0.15);
  motor.brake_friction_nm = motor.friction_nm * random_between(0, 1);
  double share = 1;
  const int points = *rc::gen::inRange(1, 6);
  for (int i = 0; i < points; ++i) {
    motor.torque.push_back({start_hz + (max_hz - start_hz) * i / points, share * torque_nm});
    share = std::max(0.2, share * random_between(0.6, 1.1));
  }
  motor.torque.push_back({max_hz * random_between(1, 1.5), share * torque_nm});
  return motor;
}

// By looking for the stretch of the curve from the top.
double acceleration(const Motor& motor, double hz, Side side = Side::kAccel) {
  double torque_nm = motor.torque.front().torque_nm;
  for (std::size_t i = motor.torque.size() - 1; i-- > 0;) {
    const auto& low = motor.torque[i];
    const auto& high = motor.torque[i + 1];
    if (hz < low.speed_hz) continue;
    torque_nm = low.torque_nm + (high.torque_nm - low.torque_nm) * (hz - low.speed_hz) /
                                    (high.speed_hz - low.speed_hz);
    break;
  }
  const double friction_nm = side == Side::kAccel ? motor.friction_nm : -motor.brake_friction_nm;
  return (torque_nm / motor.safety - friction_nm) / motor.inertia_kgm2 * motor.steps_per_turn /
         (2 * kPi);
}

Spec random_torque_spec() {
  Spec spec{.name = "t"};
  spec.start_hz = random_scale(20, 2000);
  spec.max_hz = spec.start_hz * random_scale(1.5, 40);
  spec.accel.profile = Profile::kTorque;
  spec.motor = random_motor(spec.start_hz, spec.max_hz);
  return spec;
}

constexpr double kStretches = 50'000;

// The optimum: always all the torque there is, up to the maximum speed. Integrated over the way,
// d(v^2) = 2 a dx by the midpoint rule. From the slow end of a side on: the speeds at every `dx`.
std::vector<double> optimal_speeds(const Spec& spec, Side side, double steps, double dx) {
  std::vector<double> speeds{spec.start_hz};
  while (static_cast<double>(speeds.size() - 1) * dx < steps) {
    const double v = speeds.back();
    const double middle = std::sqrt(v * v + acceleration(*spec.motor, v, side) * dx);
    const double next = std::sqrt(v * v + 2 * acceleration(*spec.motor, middle, side) * dx);
    speeds.push_back(std::min(spec.max_hz, next));
  }
  return speeds;
}

double time_s(const std::vector<double>& speeds, double dx) {
  double time_s = 0;
  for (std::size_t i = 0; i + 1 < speeds.size(); ++i) {
    time_s += 2 * dx / (speeds[i] + speeds[i + 1]);
  }
  return time_s;
}

void check_ramp(const Spec& spec, Side side, const std::vector<std::uint16_t>& codes,
                std::uint32_t time_unit_ns) {
  if (codes.size() < 3) return;
  const auto delays = delays_of(codes, time_unit_ns);
  const double made_s = std::accumulate(delays.begin() + 1, delays.end(), 0.0);
  const auto steps = static_cast<double>(delays.size() - 1);
  const double dx = steps / kStretches;
  const double optimal_s = time_s(optimal_speeds(spec, side, steps, dx), dx);
  RC_ASSERT(made_s <= 1.02 * optimal_s);
  RC_ASSERT(made_s >= (1 - 1e-4) * optimal_s);
}

TEST(Torque, RampsAreWithinTwoPerCentOfTheOptimum) {
  EXPECT_TRUE(rc::check("time of either ramp, and never below the optimum", [] {
    const Spec spec = random_torque_spec();
    const auto content = good(make_content(spec));
    check_ramp(spec, Side::kAccel, content.accel, content.time_unit_ns);
    std::vector<std::uint16_t> braking = content.decel.value_or(content.accel);
    if (content.decel) std::reverse(braking.begin(), braking.end());
    check_ramp(spec, Side::kDecel, braking, content.time_unit_ns);
  }));
}

// The first and the last step are made at the start speed, by the optimum as by the table; what is
// between them goes up along one curve and down along the other.
TEST(Torque, WholeMovesAreWithinTwoPerCentOfTheOptimum) {
  EXPECT_TRUE(rc::check("of any length from 50 steps on", [] {
    const Spec spec = random_torque_spec();
    const auto content = good(make_content(spec));
    const auto longest = static_cast<std::uint32_t>(4 * content.accel.size());
    const std::uint32_t steps = *rc::gen::inRange(50U, 51U + longest);
    const double way = steps - 2;
    const double dx = way / kStretches;
    std::vector<double> speeds = optimal_speeds(spec, Side::kAccel, way, dx);
    const std::vector<double> braking = optimal_speeds(spec, Side::kDecel, way, dx);
    for (std::size_t i = 0; i < speeds.size(); ++i) {
      speeds[i] = std::min(speeds[i], braking[braking.size() - 1 - i]);
    }
    const double optimal_s = 2 / spec.start_hz + time_s(speeds, dx);
    const auto table = tables::make(content);
    RC_ASSERT(table.has_value());
    const double made_s =
        1e-9 * static_cast<double>(tables::move_time((*table)->view(), steps).time_ns);
    RC_ASSERT(made_s <= 1.02 * optimal_s);
    RC_ASSERT(made_s >= 0.98 * optimal_s);
  }));
}

TEST(Torque, NeverAsksForMoreThanThereIs) {
  EXPECT_TRUE(rc::check("acceleration within the curve, up to rounding", [] {
    const Spec spec = random_torque_spec();
    const auto content = good(make_content(spec));
    const double unit_s = content.time_unit_ns * 1e-9;
    const auto delays = delays_of(content.accel, content.time_unit_ns);
    for (std::size_t i = 0; i + 1 < delays.size(); ++i) {
      // The motion during two delays has speeds between the means of their neighbours.
      const double low = i == 0 ? spec.start_hz : 1 / (delays[i - 1]);
      const double high = i + 2 < delays.size() ? 1 / (delays[i + 2] - unit_s) : spec.max_hz;
      double bound = std::max(acceleration(*spec.motor, low), acceleration(*spec.motor, high));
      for (const auto& point : spec.motor->torque) {
        if (point.speed_hz > low && point.speed_hz < high) {
          bound = std::max(bound, acceleration(*spec.motor, point.speed_hz));
        }
      }
      bound = rounded_bound(bound, delays[i], delays[i + 1], unit_s * (1 + 1e-6));
      RC_ASSERT(acceleration_between(delays[i], delays[i + 1]) <= bound * (1 + 1e-6));
    }
  }));
}

TEST(Torque, NeverSlowerThanTheBestConstantAcceleration) {
  EXPECT_TRUE(rc::check("to any number of steps, up to rounding", [] {
    const Spec spec = random_torque_spec();
    double least = acceleration(*spec.motor, spec.start_hz);
    least = std::min(least, acceleration(*spec.motor, spec.max_hz));
    for (const auto& point : spec.motor->torque) {
      if (point.speed_hz > spec.start_hz && point.speed_hz < spec.max_hz) {
        least = std::min(least, acceleration(*spec.motor, point.speed_hz));
      }
    }
    Spec constant = spec;
    constant.accel = {.profile = Profile::kConstant, .acceleration = least};
    const auto fast = good(make_content(spec));
    constant.time_unit_ns = fast.time_unit_ns;
    const auto plain = make_content(constant);
    RC_PRE(plain.has_value());
    std::uint64_t fast_units = 0;
    std::uint64_t plain_units = 0;
    for (std::size_t i = 0; i < plain->accel.size(); ++i) {
      fast_units += i < fast.accel.size() ? fast.accel[i] : fast.accel.back();
      plain_units += plain->accel[i];
      RC_ASSERT(fast_units <= plain_units + i);
    }
  }));
}

TEST(Torque, TheCheckAgrees) {
  EXPECT_TRUE(rc::check("no step takes more than there is", [] {
    const Spec spec = random_torque_spec();
    const auto content = good(make_content(spec));
    for (const auto& diagnostic :
         tables::profiles::diagnostics(**tables::make(content), {.motor = spec.motor})) {
      RC_LOG() << diagnostic.message << "\n";
      RC_ASSERT(diagnostic.rule != "torque");
    }
  }));
}

// A step begins slower and ends faster than its delay says. Where the torque falls steeply just
// below a step's mean speed, the profile has used what is there, wherever the corner of the curve
// lies.
TEST(Torque, TheCheckKnowsAllSpeedsOfAStep) {
  for (int corner_hz = 150; corner_hz < 3000; corner_hz += 10) {
    Spec spec{.name = "t", .start_hz = 100, .max_hz = 3000};
    spec.accel.profile = Profile::kTorque;
    spec.motor = Motor{.torque = {{100, 0.6}, {1.0 * corner_hz, 0.4}, {3000, 0.4}},
                       .inertia_kgm2 = 1e-4,
                       .safety = 1};
    const auto content = good(make_content(spec));
    for (const auto& diagnostic :
         tables::profiles::diagnostics(**tables::make(content), {.motor = spec.motor})) {
      EXPECT_NE(diagnostic.rule, "torque") << corner_hz << " Hz: " << diagnostic.message;
    }
  }
}

TEST(Torque, BrakingDoesNotCountOnFrictionUnlessTold) {
  Spec spec{.name = "t", .start_hz = 100, .max_hz = 1000};
  spec.accel.profile = Profile::kTorque;
  spec.motor = Motor{.torque = {{0, 0.3}, {2000, 0.3}}, .inertia_kgm2 = 1e-4, .safety = 1.5};
  EXPECT_FALSE(make_content(spec)->decel);
  spec.motor->friction_nm = 0.1;
  const auto hindered = make_content(spec);
  ASSERT_TRUE(hindered->decel);
  EXPECT_EQ(hindered->accel.size(), 18U);  // 990000 / (2 * 31831) = 15.6 steps
  EXPECT_EQ(hindered->decel->size(), 10U);
  spec.motor->brake_friction_nm = 0.1;
  EXPECT_EQ(make_content(spec)->decel->size(), 8U);
}

TEST(Torque, WithoutTorqueLeftTheLimitIsNamed) {
  Spec spec{.name = "t", .start_hz = 100, .max_hz = 1900};
  spec.accel.profile = Profile::kTorque;
  spec.motor = Motor{.torque = {{0, 0.4}, {2000, 0}}, .inertia_kgm2 = 1e-4, .safety = 2};
  spec.motor->friction_nm = 0.1;
  EXPECT_THAT(make_content(spec).error().message, HasSubstr("no torque left from 1000 steps/s on"));
  spec.max_hz = 2100;
  spec.motor->friction_nm = 0;
  spec.motor->torque.back().torque_nm = 0.1;
  EXPECT_THAT(make_content(spec).error().message, HasSubstr("curve ends at 2000 steps/s"));
}

TEST(Torque, BandIsPassedWithAllTheTorqueThereIs) {
  Spec spec{.name = "t", .start_hz = 100, .max_hz = 2000};
  spec.accel = {.profile = Profile::kConstant, .acceleration = 1000};
  spec.motor = Motor{.torque = {{0, 0.3}, {3000, 0.3}}, .inertia_kgm2 = 1e-4, .safety = 1};
  spec.skip = {.low_hz = 500, .high_hz = 1000};
  const double a = 0.3 / 1e-4 * 200 / (2 * kPi);
  const double steps = (500. * 500 - 100 * 100) / 2000 + (1000. * 1000 - 500 * 500) / (2 * a) +
                       (2000. * 2000 - 1000 * 1000) / 2000;
  EXPECT_EQ(make_content(spec)->accel.size(), std::ceil(steps) + 2);
}

TEST(TorqueCsv, UnitsAreThoseOfTheHeader) {
  const auto curve = good(
      parse_torque_csv("# a motor\nspeed_rpm, torque_ncm\r\n0,50\n\n600,20.5\n", 400, "m.csv"));
  ASSERT_EQ(curve.size(), 2U);
  EXPECT_DOUBLE_EQ(curve[1].speed_hz, 4000);
  EXPECT_DOUBLE_EQ(curve[1].torque_nm, 0.205);
}

TEST(TorqueCsv, AsSpreadsheetsOfWindowsWriteIt) {
  const auto curve =
      good(parse_torque_csv("\xEF\xBB\xBFspeed_hz,torque_nm\r\n0,0.5\r\n", 200, "m.csv"));
  EXPECT_EQ(curve.size(), 1U);
}

TEST(TorqueCsv, EveryBadLineIsNamed) {
  const auto message = [](const char* text) {
    return error_of(parse_torque_csv(text, 200, "m.csv"));
  };
  EXPECT_THAT(message(""), HasSubstr("has no point"));
  EXPECT_THAT(message("0,5\n"), HasSubstr("m.csv:1: is no header"));
  EXPECT_THAT(message("speed_hz,torque_nm\n1,nan\n"), HasSubstr("m.csv:2: is not a point"));
  EXPECT_THAT(message("speed_hz,torque_nm\n1,-2\n"), HasSubstr("m.csv:2: is not a point"));
  EXPECT_THAT(message("speed_hz,torque_nm\n1,2,3\n"), HasSubstr("m.csv:2: is not a point"));
  EXPECT_THAT(message("speed_hz,torque_nm\n5,2\n5,1\n"), HasSubstr("m.csv:3: is not faster"));
}

// By hand: a screw of 5 mm lead has an arm of 5 mm / 2 pi = 0.795775 mm; 2 kg at it are
// 2 x 6.33257e-7 kg m2. A pulley of 20 teeth of 2 mm has an arm of 6.36620 mm, which makes
// 0.5 x 4.05285e-5, a ninth of it behind a gear of 3. Tolerances are one in the last digit.
TEST(Load, InertiaAtTheMotorIsThatOfItsMassAtItsArmOverTheGearSquared) {
  using tables::profiles::inertia_at_motor_kgm2;
  EXPECT_NEAR(inertia_at_motor_kgm2({.mass_kg = 2, .travel_per_turn_m = 0.005}), 1.266515e-6,
              1e-12);
  EXPECT_NEAR(inertia_at_motor_kgm2({.mass_kg = 0.5, .travel_per_turn_m = 0.04}), 2.026424e-5,
              1e-11);
  EXPECT_NEAR(inertia_at_motor_kgm2({.mass_kg = 0.5, .travel_per_turn_m = 0.04, .gear = 3}),
              2.251582e-6, 1e-12);
  EXPECT_NEAR(inertia_at_motor_kgm2({.inertia_kgm2 = 9e-4, .gear = 3}), 1e-4, 1e-15);
  EXPECT_EQ(inertia_at_motor_kgm2({}), 0.0);
}

TEST(TorqueCsv, SpeedInHzIsOfTheTablesStepsWhateverTheMicrosteps) {
  for (const double steps_per_turn : {200.0, 1600.0}) {
    EXPECT_EQ(parse_torque_csv("speed_hz,torque_nm\n4000,1\n", steps_per_turn, "m")->at(0).speed_hz,
              4000);
  }
  EXPECT_EQ(parse_torque_csv("speed_rpm,torque_nm\n60,1\n", 1600, "m")->at(0).speed_hz, 1600);
  EXPECT_THAT(parse_torque_csv("speed,torque_nm\n1,1\n", 200, "m").error().text(),
              HasSubstr("full steps a second of a data sheet times the microsteps of a full step"));
}

}  // namespace
}  // namespace bushd::test
