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

// Keys of the motor of this name.
inline std::string with_keys(std::string toml, const std::string& motor, const std::string& keys) {
  const std::string name = "name = \"" + motor + "\"\n";
  return toml.insert(toml.find(name) + name.size(), keys);
}

// How far the shafts are from the nearest point of the line from 0 to these steps.
inline double off_line(const Lab& lab, const std::vector<std::string>& motors,
                       const std::vector<std::int64_t>& steps) {
  double along = 0;
  double length = 0;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const auto n = static_cast<double>(steps[i]);
    along += n * static_cast<double>(lab.shaft_steps(motors[i]));
    length += n * n;
  }
  double most = 0;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const double there = static_cast<double>(steps[i]) * along / length;
    most = std::max(most, std::abs(static_cast<double>(lab.shaft_steps(motors[i])) - there));
  }
  return most;
}

inline const std::vector<std::string> kMotors{"m01", "m02", "m03", "m04"};
inline const std::vector<std::int64_t> kSteps{3000, -1201, 17, 0};
// Of a line that the MCUs make themselves: its table is that of the motors.
inline const std::vector<std::int64_t> kInMcus{3000, -3000, 171, 3000};

inline void expect_on_line_all_the_way(const char* manner, const std::vector<std::int64_t>& steps,
                                       double bound_steps) {
  SCOPED_TRACE(manner);
  Lab lab(hall(2, 2, manner));
  lab.connect();
  const auto move = lab.send(line_to(kMotors, steps));
  double most = 0;
  lab.run_until([&] {
    most = std::max(most, off_line(lab, kMotors, steps));
    return lab.has_result(move);
  });
  EXPECT_LT(most, bound_steps);
  const Answer result = lab.last_reply(move);
  EXPECT_EQ(result.result, "reached");
  EXPECT_EQ(result.reason, "m01: stands at its target; the line was limited by m01");
  EXPECT_EQ(result.position_steps, steps);
  for (std::size_t i = 0; i < kMotors.size(); ++i) {
    EXPECT_EQ(lab.shaft_steps(kMotors[i]), steps[i]);
  }
  for (const char* mcu : {"hall:1", "hall:2"}) {
    EXPECT_EQ(lab.mcu_health(mcu).rejected_frames, 0u);
    EXPECT_EQ(lab.mcu_health(mcu).ramp_downs, 0u);
  }
  EXPECT_THAT(lab.errors(), testing::IsEmpty());
}

}  // namespace bushd::test
