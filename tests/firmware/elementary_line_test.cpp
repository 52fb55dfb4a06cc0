// LINE_RUN by the elementary law: each step of the run is a step of one motor.
#include <algorithm>
#include <vector>

#include "engine/elementary.h"
#include "firmware/line_runs.h"

namespace bushd::test {
namespace {

class ElementaryLineRun : public OfLines {
 protected:
  static Frame line_of(std::uint32_t first, const std::vector<LineMotor>& motors) {
    std::uint32_t sum = 0;
    for (const LineMotor& motor : motors) sum += length(motor.steps);
    return {.first = first, .motors = motors, .longest = sum, .elementary = true};
  }
  static bushd_elementary printed(const std::vector<LineMotor>& motors) {
    bushd_elementary line;
    bushd_elementary_clear(&line);
    for (const LineMotor& motor : motors)
      bushd_elementary_add(&line, motor.number, length(motor.steps));
    return line;
  }
  // Where motors of the line are when `steps` of its run are over.
  static void expect_on_line(const Rig& of, const std::vector<LineMotor>& motors,
                             std::uint32_t steps) {
    const bushd_elementary line = printed(motors);
    for (const LineMotor& motor : motors) {
      const std::int64_t made = bushd_elementary_made(&line, motor.number, steps);
      EXPECT_EQ(of.pulses(motor.number), motor.steps < 0 ? -made : made)
          << "motor " << +motor.number;
    }
  }
};
BUSHD_IN_BOTH_FORMATS(ElementaryLineRun);

TEST_P(ElementaryLineRun, EveryStepFallsIntoItsSlot) {
  std::int64_t at[4] = {};
  for (const std::vector<LineMotor>& motors :
       {std::vector<LineMotor>{{0, 200}, {3, -133}}, std::vector<LineMotor>{{1, 90}, {2, 90}},
        std::vector<LineMotor>{{0, -70}, {1, 118}, {2, 1}, {3, -117}},
        std::vector<LineMotor>{{2, -40}}}) {
    const Frame line = line_of(rig.first_open() + 3, motors);
    ASSERT_EQ(start(rig, line), BUSHD_OK);
    expect_slots(rig, Reference::move(law, line.longest), line);
    for (const LineMotor& motor : motors) at[motor.number] += motor.steps;
  }
  for (std::size_t m = 0; m < 4; ++m) EXPECT_EQ(rig.poll().motor[m].position_steps, at[m]);
  EXPECT_EQ(rig.steps_with_dir(), 0);
  EXPECT_EQ(rig.mcu().line.motors, 0);
}

// One coordinate leads nothing: the next line is by the other law.
TEST_P(ElementaryLineRun, LeavesTheOtherLawAsItWas) {
  ASSERT_EQ(start(rig, line_of(rig.first_open() + 3, {{0, 20}, {1, 30}})), BUSHD_OK);
  rig.pass_until_rest();
  const Frame leading{.first = rig.first_open() + 3, .motors = {{0, 50}, {1, -20}}, .longest = 50};
  ASSERT_EQ(start(rig, leading), BUSHD_OK);
  expect_slots(rig, Reference::move(law, 50), leading);
}

TEST_P(ElementaryLineRun, IsOfAllMotorsOfTheLineFromItsBeginning) {
  const Frame good = line_of(rig.first_open() + 3, {{0, 20}, {1, 30}});
  Frame frame = good;
  frame.longest = 51;
  EXPECT_EQ(start(rig, frame), BUSHD_E_FORMAT) << "one is elsewhere";
  frame.longest = 49;
  EXPECT_EQ(start(rig, frame), BUSHD_E_FORMAT);
  frame = good;
  frame.from = 1;
  EXPECT_EQ(start(rig, frame), BUSHD_E_FORMAT);
  frame = good;
  frame.steps = 35;  // but it may end before
  ASSERT_EQ(start(rig, frame), BUSHD_OK);
  rig.pass_until_rest();
  expect_on_line(rig, good.motors, 35);
}

TEST_P(ElementaryLineRun, IsRefusedWhereItIsDenied) {
  EXPECT_NE(rig.identify().capabilities & BUSHD_CAN_ELEMENTARY, 0u);
  for (const std::uint32_t denied : {BUSHD_CAN_ELEMENTARY, std::uint32_t{BUSHD_CAN_LINE_RUN}}) {
    ReadyRig other(law, format, {.disabled_capabilities = denied});
    EXPECT_EQ(other.identify().capabilities & BUSHD_CAN_ELEMENTARY, 0u);
    EXPECT_EQ(start(other, line_of(other.first_open(), {{0, 5}, {1, 3}})),
              denied == BUSHD_CAN_ELEMENTARY ? BUSHD_E_FORMAT : BUSHD_E_UNKNOWN_MESSAGE);
  }
}

// The rest of the same line as displacements, from every tick on.
TEST_P(ElementaryLineRun, IsReplacedByTicksAtEveryTick) {
  const std::vector<LineMotor> motors = {{0, -70}, {1, 43}, {2, -3}};
  const bushd_elementary line = printed(motors);
  const Plan run = plan_move(law, line.sum, Rig::kTickNs, BUSHD_FORMAT_FINE);
  const auto position_at = [&](const LineMotor& motor, std::size_t tick) {
    const auto at = static_cast<std::uint32_t>(tick == 0 ? 0 : run.made[tick - 1]);
    const auto part = static_cast<std::uint8_t>(tick == 0 ? 0 : run.fraction[tick - 1]);
    const auto position =
        static_cast<std::int64_t>(bushd_elementary_position(&line, motor.number, at, part));
    return format == BUSHD_FORMAT_FINE ? position : position / 256 * 256;
  };
  for (std::size_t k = 0; k + 1 < run.ticks(); k += format == BUSHD_FORMAT_FINE ? 1 : 5) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    const std::uint32_t first = fresh.first_open();
    ASSERT_EQ(start(fresh, line_of(first, motors)), BUSHD_OK);
    fresh.pass(static_cast<int>(k) / 2);
    ASSERT_NO_FATAL_FAILURE(replace_rest(
        fresh, first, {.from = k, .ticks = run.ticks(), .motors = motors},
        [&](const LineMotor& motor, std::size_t tick) { return position_at(motor, tick); }));
  }
}

TEST_P(ElementaryLineRun, RampsDownAlongTheLine) {
  const std::vector<LineMotor> motors = {{0, 200}, {1, -118}, {2, 1}, {3, 150}};
  for (int wait = 4; wait < 60; wait += 7) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    ASSERT_EQ(start(fresh, line_of(fresh.first_open(), motors)), BUSHD_OK);
    fresh.pass(wait);
    ASSERT_EQ(fresh.take(BUSHD_MSG_EMERGENCY, {BUSHD_STOP_RAMP}), BUSHD_OK);
    fresh.pass_until_rest();
    std::int64_t sum = 0;
    for (const LineMotor& motor : motors) sum += std::abs(fresh.pulses(motor.number));
    expect_on_line(fresh, motors, static_cast<std::uint32_t>(sum));
    EXPECT_EQ(fresh.mcu().line.motors, 0);
  }
}

}  // namespace
}  // namespace bushd::test
