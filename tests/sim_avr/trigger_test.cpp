// The trigger input and the reference output of the ATmega2560, by its pins alone. Both motors are
// on one port: its pins change in the same cycle.
#include <cstdlib>
#include <random>

#include "sim_avr/avr_fixture.h"

namespace bushd::sim {
namespace {

constexpr TimeNs kSlotNs = 20'000;

class AvrTrigger : public AvrAlone {
 protected:
  bushd_status arm(std::uint8_t number, bushd_edge edge, std::uint32_t delay_us,
                   const std::vector<bushd_table_run_entry>& entries) {
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(bushd_encode_trigger(number, edge, delay_us, entries.data(),
                                        static_cast<std::uint8_t>(entries.size()), payload.data()));
    return master_.acknowledged(kAddress, BUSHD_MSG_TRIGGER, payload);
  }
  // The input becomes active or inactive; returns when.
  TimeNs turn(bool active) {
    avr_->set_inputs({0, static_cast<std::uint8_t>(active ? BUSHD_INPUT_TRIGGER : 0)});
    return bus_.now_ns();
  }
  // The pulses of a motor from a time on.
  std::vector<TimeNs> steps_since(std::uint8_t motor, TimeNs begin_ns) const {
    std::vector<TimeNs> found;
    for (const TimeNs at_ns : recorder_.times(0, Signal::kStep, motor, true)) {
      if (at_ns >= begin_ns) found.push_back(at_ns);
    }
    return found;
  }
};

// By the sums of the table's delays, from the edge and the three ticks on; the clock of the image
// is the bus's.
TEST_F(AvrTrigger, EveryStepIsWithinASlotOfItsTime) {
  pass(kBootNs);
  ASSERT_NO_FATAL_FAILURE(make_ready());
  std::mt19937 random(3);
  constexpr std::uint32_t kSteps = 6;
  constexpr std::array<std::int64_t, kSteps> kDelays = {400, 300, 200, 200, 300, 400};
  std::int32_t position = 0;
  for (std::uint8_t number = 1; number <= 12; ++number) {
    const bool rising = number % 2 != 0;
    const auto delay_us = static_cast<std::uint32_t>(50 + random() % 20'000);
    ASSERT_EQ(arm(number, rising ? BUSHD_EDGE_RISING : BUSHD_EDGE_FALLING, delay_us,
                  {{3, 0, 1, kSteps}, {5, 0, -1, kSteps}}),
              BUSHD_OK);
    EXPECT_EQ(master_.poll(kAddress).armed, 1 << 3 | 1 << 5);
    pass(static_cast<TimeNs>(random() % (2 * kTickNs)));
    const TimeNs edge_ns = turn(rising);
    pass(200'000'000);
    const bushd_report report = master_.poll(kAddress);
    ASSERT_EQ(report.trigger_state, BUSHD_TRIGGER_STARTED);
    TimeNs expected_ns = edge_ns + 3 * TimeNs{kTickNs} + TimeNs{delay_us} * 1000;
    const auto made = steps_since(3, edge_ns);
    ASSERT_EQ(made.size(), kSteps);
    for (std::size_t i = 0; i < kSteps; ++i) {
      expected_ns += kDelays[i] * 10'000;
      EXPECT_LE(std::abs(made[i] - expected_ns), kSlotNs + 5'000) << int{number} << ", step " << i;
    }
    EXPECT_EQ(steps_since(5, edge_ns), made) << "in the same slots";
    position += static_cast<std::int32_t>(kSteps);
    EXPECT_EQ(report.motor[3].position_steps, position);
    EXPECT_EQ(report.motor[5].position_steps, -position);
    EXPECT_EQ(report.faults, 0);
  }
  EXPECT_EQ(avr_->overruns(), 0u);
}

TEST_F(AvrTrigger, OnlyTheAwaitedEdgeCountsAndOnce) {
  pass(kBootNs);
  ASSERT_NO_FATAL_FAILURE(make_ready());
  turn(true);
  ASSERT_EQ(arm(1, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 6}}), BUSHD_OK);
  pass(50'000'000);
  turn(false);
  pass(50'000'000);
  EXPECT_EQ(master_.poll(kAddress).trigger_state, BUSHD_TRIGGER_ARMED);
  for (int i = 0; i < 5; ++i) {
    turn(true);
    pass(100'000);
    turn(false);
    pass(100'000);
  }
  pass(200'000'000);
  EXPECT_EQ(steps_made(0), 6u);
  ASSERT_EQ(arm(2, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 6}}), BUSHD_OK);
  ASSERT_EQ(arm(0, BUSHD_EDGE_NONE, 0, {}), BUSHD_OK);
  turn(true);
  pass(200'000'000);
  EXPECT_EQ(steps_made(0), 6u);
  EXPECT_EQ(master_.poll(kAddress).trigger_state, BUSHD_TRIGGER_DISARMED);
}

TEST_F(AvrTrigger, TheReferencePulseFollowsItsStep) {
  pass(kBootNs);
  ASSERT_NO_FATAL_FAILURE(make_ready());
  std::int32_t position = 0;
  std::size_t pulses = 0;
  for (const std::uint32_t delay_us : {0u, 30u, 777u, 5'000u, 123'456u}) {
    for (const std::uint32_t width_us : {20u, 3'000u, 50'000u}) {
      const bushd_reference reference = {2, BUSHD_ARRIVES_POSITIVE, position + 4, delay_us,
                                         width_us};
      ASSERT_EQ(
          master_.acknowledged(kAddress, BUSHD_MSG_REFERENCE, bushd_encode_reference, reference),
          BUSHD_OK);
      const TimeNs begin_ns = bus_.now_ns();
      run(2, 6);
      pass(500'000'000);
      position += 6;
      const auto made = steps_since(2, begin_ns);
      ASSERT_EQ(made.size(), 6u);
      const auto rises = recorder_.times(0, Signal::kReference, 0, true);
      const auto falls = recorder_.times(0, Signal::kReference, 0, false);
      ASSERT_EQ(rises.size(), ++pulses) << delay_us << ", " << width_us;
      ASSERT_EQ(falls.size(), pulses);
      EXPECT_LE(std::abs(rises.back() - made[3] - TimeNs{delay_us} * 1000), kSlotNs) << delay_us;
      EXPECT_LE(std::abs(falls.back() - rises.back() - TimeNs{width_us} * 1000), kSlotNs)
          << width_us;
    }
  }
  EXPECT_EQ(avr_->overruns(), 0u);
}

}  // namespace
}  // namespace bushd::sim
