// The trigger input, the position compare output and the current sensor, by pins alone: of the
// image and of its virtual twin.
#include <random>

#include "conformance/script.h"
#include "sim/supply_current.h"

namespace bushd::sim::trigger_test {
namespace {

constexpr TimeNs kSlotNs = kTickNs / 128;

class Triggers : public TargetScript {
 protected:
  void SetUp() override { ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {2, 3, 5})); }

  void arm(std::uint8_t number, bushd_edge edge, std::uint32_t delay_us,
           const std::vector<bushd_table_run_entry>& entries) {
    ask(BUSHD_MSG_TRIGGER, payload_of([&](std::uint8_t* to) {
          return bushd_encode_trigger(number, edge, delay_us, entries.data(),
                                      static_cast<std::uint8_t>(entries.size()), to);
        }));
  }
  // The input becomes active or inactive; returns when.
  TimeNs turn(bool active) {
    set_inputs({0, static_cast<std::uint8_t>(active ? BUSHD_INPUT_TRIGGER : 0)});
    return bus_.now_ns();
  }
  void pass(TimeNs ns) { bus_.advance_to(bus_.now_ns() + ns); }
};
BUSHD_FOR_TARGETS(Triggers, targets());

// By the sums of the table's delays, from the edge and the three ticks on; the clocks are the
// bus's.
TEST_P(Triggers, EveryStepIsWithinASlotOfItsTime) {
  std::mt19937 random(3);
  constexpr std::uint32_t kSteps = 6;
  const std::array<std::int64_t, kSteps> delays = {codes_[0], codes_[1], codes_[2],
                                                   codes_[2], codes_[1], codes_[0]};
  std::int32_t position = 0;
  for (std::uint8_t number = 1; number <= 12; ++number) {
    SCOPED_TRACE("edge " + std::to_string(number));
    const bool rising = number % 2 != 0;
    const auto delay_us = static_cast<std::uint32_t>(50 + random() % 20'000);
    ASSERT_NO_FATAL_FAILURE(arm(number, rising ? BUSHD_EDGE_RISING : BUSHD_EDGE_FALLING, delay_us,
                                {{3, 0, 1, kSteps, 0}, {5, 0, -1, kSteps, 0}}));
    EXPECT_EQ(master_.poll(kReal).armed, 1 << 3 | 1 << 5);
    pass(static_cast<TimeNs>(random() % (2 * kTickNs)));
    const TimeNs edge_ns = turn(rising);
    pass(200'000'000);
    position += static_cast<std::int32_t>(kSteps);
    for (const std::size_t mcu : {0, 1}) {
      SCOPED_TRACE(mcu == 0 ? "virtual" : "real");
      TimeNs expected_ns = edge_ns + 3 * TimeNs{kTickNs} + TimeNs{delay_us} * 1000;
      const auto made = steps_since(mcu, 3, edge_ns);
      ASSERT_EQ(made.size(), kSteps);
      for (std::size_t i = 0; i < kSteps; ++i) {
        expected_ns += delays[i] * kUnitNs;
        EXPECT_LE(std::abs(made[i] - expected_ns), kSlotNs + 5'000) << "step " << i;
      }
      const auto beside = steps_since(mcu, 5, edge_ns);
      ASSERT_EQ(beside.size(), kSteps);
      for (std::size_t i = 0; i < kSteps; ++i) {
        EXPECT_LE(std::abs(beside[i] - made[i]), kSlotNs / 2) << "in the same slot";
      }
    }
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(report.trigger_state, BUSHD_TRIGGER_STARTED);
    EXPECT_EQ(report.motor[3].position_steps, position);
    EXPECT_EQ(report.motor[5].position_steps, -position);
    expect_the_same_reports();
  }
}

TEST_P(Triggers, OnlyTheAwaitedEdgeCountsAndOnce) {
  turn(true);
  ASSERT_NO_FATAL_FAILURE(arm(1, BUSHD_EDGE_RISING, 50, {{2, 0, 1, 6, 0}}));
  pass(50'000'000);
  turn(false);
  pass(50'000'000);
  EXPECT_EQ(master_.poll(kReal).trigger_state, BUSHD_TRIGGER_ARMED);
  for (int i = 0; i < 5; ++i) {
    turn(true);
    pass(100'000);
    turn(false);
    pass(100'000);
  }
  pass(200'000'000);
  expect_the_same_steps(2, 6);
  ASSERT_NO_FATAL_FAILURE(arm(2, BUSHD_EDGE_RISING, 50, {{2, 0, 1, 6, 0}}));
  ASSERT_NO_FATAL_FAILURE(arm(0, BUSHD_EDGE_NONE, 0, {}));
  turn(true);
  pass(200'000'000);
  expect_the_same_steps(2, 6);
  EXPECT_EQ(master_.poll(kReal).trigger_state, BUSHD_TRIGGER_DISARMED);
  expect_the_same_reports();
}

TEST_P(Triggers, TheComparePulseFollowsItsStep) {
  std::int32_t position = 0;
  std::size_t pulses = 0;
  for (const std::uint32_t delay_us : {0u, 30u, 777u, 5'000u, 123'456u}) {
    for (const std::uint32_t width_us : {20u, 3'000u, 50'000u}) {
      SCOPED_TRACE(std::to_string(delay_us) + " us, " + std::to_string(width_us) + " us");
      ASSERT_NO_FATAL_FAILURE(
          ask(bushd_position_compare{2, BUSHD_ARRIVES_POSITIVE, position + 4, delay_us, width_us}));
      const TimeNs begin_ns = bus_.now_ns();
      run_by_table(master_.poll(kReal).tick + 24, {{2, 0, 1, 6, 0}});
      pass(400'000'000);
      position += 6;
      ++pulses;
      for (const std::size_t mcu : {0, 1}) {
        SCOPED_TRACE(mcu == 0 ? "virtual" : "real");
        const auto made = steps_since(mcu, 2, begin_ns);
        ASSERT_EQ(made.size(), 6u);
        const auto rises = recorder_.times(mcu, Signal::kPositionCompare, 0, true);
        const auto falls = recorder_.times(mcu, Signal::kPositionCompare, 0, false);
        ASSERT_EQ(rises.size(), pulses);
        ASSERT_EQ(falls.size(), pulses);
        EXPECT_LE(std::abs(rises.back() - made[3] - TimeNs{delay_us} * 1000), kSlotNs);
        EXPECT_LE(std::abs(falls.back() - rises.back() - TimeNs{width_us} * 1000), kSlotNs);
      }
    }
  }
}

// What the drivers take follows the pins.
class Supply final : public EdgeSink {
 public:
  void edge(const Edge& edge) override {
    current.edge(edge);
    recorder.edge(edge);
  }
  void settled(TimeNs until_ns) override { recorder.settled(until_ns); }

  SupplyCurrent current{SupplyRules{}};
  Recorder recorder;
};

class Current : public testing::TestWithParam<Target> {};
BUSHD_FOR_TARGETS(Current, targets());

TEST_P(Current, IsMeasuredAndPulsesAreAsFarApart) {
  constexpr std::uint32_t kLongTickNs = 16'384'000;  // 128 slots of 128 us
  Supply supply;
  Bus bus(kBaud, &supply);
  const auto real = GetParam().make();
  real->on_conversion = [&](TimeNs now_ns) { return supply.current.reading(now_ns); };
  bus.add_mcu([&](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
    return real->make(kBirth, index, driver, sink);
  });
  FrameMaster master(bus);
  master.patience_ns = 6'000'000;
  bus.advance_to(300'000'000);
  ASSERT_NO_FATAL_FAILURE(master.bring_up(kLongTickNs, BUSHD_FORMAT_COARSE));
  ASSERT_NO_FATAL_FAILURE(master.upload_table(kReal, 0, 10'000, {4000, 3000}, 2500));
  bushd_emission settings{};
  settings.mode = BUSHD_EMISSION_STAGGERED;
  settings.step_us = 2048;
  ASSERT_EQ(master.acknowledged(kReal, settings), BUSHD_OK);
  for (std::uint8_t m = 0; m < 2; ++m) ASSERT_NO_FATAL_FAILURE(master.assign(kReal, m, 0));
  EXPECT_EQ(master.poll(kReal).state, BUSHD_STATE_BUSY);
  bus.advance_to(bus.now_ns() + 40 * TimeNs{kLongTickNs});
  const bushd_report report = master.poll(kReal);
  EXPECT_EQ(report.state, BUSHD_STATE_READY);
  EXPECT_EQ(report.motor[0].position_steps, 0);
  EXPECT_EQ(supply.recorder.times(0, Signal::kStep, 0, true).size(), 2u)
      << "a step and its way back";

  // One step of both motors, a tick after another.
  supply.recorder.edges.clear();
  master.send(kReal, BUSHD_MSG_TICKS,
              test::ticks_payload({.flags = BUSHD_TICKS_START,
                                   .first = report.tick + 20,
                                   .mask = 3,
                                   .displacements = {0x81, 0x81},
                                   .delays = {0, 0}}));
  bus.advance_to(bus.now_ns() + 30 * TimeNs{kLongTickNs});
  const auto first = supply.recorder.times(0, Signal::kStep, 0, true);
  const auto second = supply.recorder.times(0, Signal::kStep, 1, true);
  ASSERT_EQ(first.size(), 1u);
  ASSERT_EQ(second.size(), 1u);
  // dt_p is 518 us. A fifth of it earlier the current is within 1/16 of its peak and two counts of
  // the converter; a conversion begins at most 104 us later and is seen when it has ended, as much
  // later still, and the next slot of 128 us is used.
  EXPECT_GE(second[0] - first[0], 518'000 * 4 / 5);
  EXPECT_LE(second[0] - first[0], 518'000 + 2 * 104'000 + 128'000);
}

}  // namespace
}  // namespace bushd::sim::trigger_test
