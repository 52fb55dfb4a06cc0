// Motors of a hall on a line: where their shafts are.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {

inline api::MoveLine line_to(const std::vector<std::string>& motors,
                             const std::vector<std::int64_t>& steps) {
  return {.kind = api::Move::Kind::kAbsolute, .motors = motor_steps(motors, steps)};
}

// None of its MCUs takes tables for lines: a line that goes by one of its own is streamed.
struct StreamedLab : ReadyLab {
  explicit StreamedLab(const std::string& toml, const std::string& glacier = {})
      : ReadyLab(toml, glacier, nullptr, BUSHD_CAN_SCRATCH) {}
};

// How far the shafts are from a polyline from 0 through these points, a row of them each: at its
// nearest point, the farthest motor.
inline double off_polyline(const Lab& lab, const std::vector<std::string>& motors,
                           const std::vector<double>& points) {
  std::vector<double> at;
  for (const std::string& motor : motors) at.push_back(static_cast<double>(lab.shaft_steps(motor)));
  double least = HUGE_VAL;
  std::vector<double> from(at.size(), 0);
  for (std::size_t row = 0; row < points.size(); row += at.size()) {
    const auto off = [&](double share) {
      double most = 0;
      for (std::size_t i = 0; i < at.size(); ++i) {
        most = std::max(most, std::abs(at[i] - from[i] - share * (points[row + i] - from[i])));
      }
      return most;
    };
    // It falls, then rises: the greatest of distances from a straight line.
    double low = 0;
    double high = 1;
    for (int half = 0; half < 100; ++half) {
      const double third = (high - low) / 3;
      if (off(low + third) > off(high - third)) {
        low += third;
      } else {
        high -= third;
      }
    }
    least = std::min(least, off(low));
    for (std::size_t i = 0; i < at.size(); ++i) from[i] = points[row + i];
  }
  return least;
}
inline double off_line(const Lab& lab, const std::vector<std::string>& motors,
                       const std::vector<std::int64_t>& steps) {
  return off_polyline(lab, motors, {steps.begin(), steps.end()});
}

// Where motors on a line or a path rest: half a step off it, by its law. The rest is what the
// search and doubles leave.
inline constexpr double kOffAtRest = 0.5 + 1e-6;
// Made by the MCUs, exact to a slot, of which a tick of 2.56 ms has 128 at least; their clocks
// differ by up to 20 us (decision 2). At 2500 steps/s, which is the most of bushd2-constant.
inline constexpr double kOffByMcus = kOffAtRest + 2500 * (2.56e-3 / 128 + 20e-6);
// Streamed: displacements are in 1/256 step, so two motors are off by 2/256. Within a tick the MCU
// knows one speed. Where a run changes it by up to 45 steps/s (codes 250, 172) an even tick is off
// by a quarter of what that is in a tick. In its first and last tick, where it begins or ends, it
// may be off by all that is made at 100 steps/s.
inline constexpr double kOffFine = kOffByMcus + 2 / 256.0 + (45 / 4.0 + 100) * 2.56e-3;
// Whole steps are spread evenly over a tick: off by up to half a step more.
inline constexpr double kOffCoarse = kOffFine + 0.5;
inline double off_in_motion(const std::string& manner) {
  return manner.starts_with("fine") ? kOffFine : kOffCoarse;
}

// Nothing was refused by the MCUs of a hall, or ramped down by them, and nothing went wrong.
inline void expect_clean(Lab& lab, const std::vector<std::string>& mcus = {"hall:1", "hall:2"}) {
  for (const std::string& mcu : mcus) {
    EXPECT_EQ(lab.mcu_health(mcu).rejected_frames, 0u) << mcu;
    EXPECT_EQ(lab.mcu_health(mcu).ramp_downs, 0u) << mcu;
  }
  EXPECT_THAT(lab.errors(), testing::IsEmpty());
}

inline const std::vector<std::string> kMotors{"m01", "m02", "m03", "m04"};
inline const std::vector<std::int64_t> kSteps{3000, -1201, 17, 0};
// Steps of a line that the MCUs make themselves: its table is that of the motors.
inline const std::vector<std::int64_t> kInMcus{3000, -3000, 171, 3000};

inline void expect_on_line_all_the_way(const char* manner, const std::vector<std::int64_t>& steps,
                                       double bound_steps) {
  SCOPED_TRACE(manner);
  StreamedLab lab(hall(2, 2, manner));
  const auto move = lab.send(line_to(kMotors, steps));
  double most = 0;
  lab.run_until([&] {
    most = std::max(most, off_line(lab, kMotors, steps));
    return lab.has_result(move);
  });
  EXPECT_LE(most, bound_steps);
  const Answer result = lab.last_reply(move);
  EXPECT_EQ(result.result, "reached");
  EXPECT_EQ(result.reason, "m01: stands at its target; the line was limited by m01");
  EXPECT_EQ(result.position_steps, steps);
  for (std::size_t i = 0; i < kMotors.size(); ++i) {
    EXPECT_EQ(lab.shaft_steps(kMotors[i]), steps[i]);
  }
  expect_clean(lab);
}

}  // namespace bushd::test
