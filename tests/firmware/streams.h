// A READY MCU in either format, and frames of single steps for it.
#pragma once

#include <string>
#include <vector>

#include "firmware/rig.h"

namespace bushd::test {

constexpr std::uint8_t kStart = BUSHD_TICKS_START;
constexpr std::uint8_t kReplace = BUSHD_TICKS_REPLACE;

class Streams : public testing::TestWithParam<bushd_format> {
 protected:
  explicit Streams(RigOptions options = {}) : rig(options) { rig.make_ready(law, format, 1000); }
  Plan plan(std::int64_t steps) const { return plan_move(law, steps, Rig::kTickNs, format); }
  // `count` ticks of one step each in the positive direction, moving on at the end.
  Ticks ones(std::uint8_t flags, std::uint32_t first, std::uint8_t count,
             std::uint16_t delay = 64) {
    return {.flags = flags,
            .first = first,
            .count = count,
            .mask = 1,
            .displacements = std::vector<std::int16_t>(count, one()),
            .delays = {delay},
            .epoch = rig.mcu().stream.epoch};
  }
  std::int16_t one() const { return format == BUSHD_FORMAT_FINE ? 256 : 0x81; }
  std::int16_t two_back() const { return format == BUSHD_FORMAT_FINE ? -512 : 0x02; }
  void expect_position(std::uint8_t motor, std::int64_t steps) {
    rig.pass_until_rest();
    EXPECT_EQ(rig.pulses(motor), steps);
    EXPECT_EQ(rig.poll().motor[motor].position_steps, steps);
    EXPECT_EQ(rig.poll().faults, 0);
  }
  // By tick; behind the ticks that are expected nothing has moved.
  static void expect_steps(const std::vector<int>& seen, std::vector<int> expected,
                           int direction = 1) {
    for (int& n : expected) n *= direction;
    ASSERT_LE(expected.size(), seen.size());
    expected.resize(seen.size());
    EXPECT_EQ(seen, expected);
  }
  void expect_rest_as_counted() {
    rig.pass_until_rest();
    const bushd_report report = rig.poll();
    EXPECT_EQ(report.autonomous, 0);
    for (std::uint8_t m = 0; m < report.motor_count; ++m) {
      EXPECT_EQ(report.motor[m].position_steps, rig.pulses(m));
    }
    EXPECT_EQ(rig.steps_with_dir(), 0);
    EXPECT_EQ(rig.steps_while_disabled(), 0);
  }

  const bushd_format format = GetParam();
  const Law law = ramp_law();
  Rig rig;
};
inline std::string format_name(const testing::TestParamInfo<bushd_format>& format) {
  return format.param == BUSHD_FORMAT_FINE ? "Fine" : "Coarse";
}
#define BUSHD_IN_BOTH_FORMATS(suite)       \
  INSTANTIATE_TEST_SUITE_P(Formats, suite, \
                           testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE), format_name)

}  // namespace bushd::test
