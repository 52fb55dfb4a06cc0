// Staggered emission measures the supply current by a step of a motor and its way back: limits hold
// for these too.
#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr int kMeasured = 40;  // ticks, and some more

class Settle : public Streams {
 protected:
  // The switches are active when the MCU begins to measure.
  void measure(const InputSettings& inputs, std::uint16_t active) {
    ASSERT_EQ(rig.set_inputs(inputs), BUSHD_OK);
    rig.pins({active, 0});
    rig.pass(inputs.debounce_ticks + 1);
    bushd_emission staggered{};
    staggered.mode = BUSHD_EMISSION_STAGGERED;
    staggered.step_us = 320;
    ASSERT_EQ(rig.emission(staggered), BUSHD_OK);
    rig.forget_history();
    for (std::uint8_t m = 0; m < rig.options().motors; ++m) ASSERT_EQ(rig.assign(m, 0), BUSHD_OK);
    ASSERT_EQ(rig.poll().state, BUSHD_STATE_BUSY);
  }
  int steps_of(std::uint8_t motor) const {
    int steps = 0;
    for (const int n : rig.history(motor)) steps += n != 0;
    return steps;
  }
};
BUSHD_IN_BOTH_FORMATS(Settle);

TEST_P(Settle, AMotorThatMayGoBothWaysMakesTheStep) {
  measure({.limit_positive = 0b0001, .limit_negative = 0b0010}, 0b0011);
  rig.pass(kMeasured);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
  EXPECT_EQ(steps_of(0), 0);
  EXPECT_EQ(steps_of(1), 0);
  EXPECT_EQ(steps_of(2), 2);
  expect_position(2, 0);
}

TEST_P(Settle, WhereLimitsBarAllMotorsNothingMovesAndTheTimeStaysUnknown) {
  measure({.limit_positive = 0b0101, .limit_negative = 0b1010}, 0b1111);
  rig.pass(kMeasured);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY) << "they can be moved away";
  for (std::uint8_t m = 0; m < 4; ++m) EXPECT_EQ(steps_of(m), 0);
  EXPECT_EQ(rig.mcu().emission.of.settle.of.step.back_ns, 0u);
}

TEST_P(Settle, ASwitchThatIsMetMeanwhileBarsTheWayBack) {
  measure({.limit_negative = 0b0001}, 0);
  while (rig.pulses(0) == 0) rig.pass();
  rig.pins({0b0001, 0});
  rig.pass(kMeasured);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
  expect_position(0, 1);
}

}  // namespace
}  // namespace bushd::test
