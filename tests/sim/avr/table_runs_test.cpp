// Table runs on the image for ATmega2560: sixteen at once, asked for their reports meanwhile. Every
// step must be in its slot, and no tick late.
#include <algorithm>

#include "sim/avr/ramps.h"

namespace bushd::sim::table_runs_test {
namespace {

constexpr std::uint32_t kSteps = 3000;

class AvrTableRuns : public AvrRamps, public testing::WithParamInterface<RampLoad> {
 protected:
  // Where each step of the run falls, in slots from its start: the time is the sum of the delays; a
  // step exactly at a tick's end falls into its last slot.
  static std::vector<Place> places_of_steps() {
    std::vector<Place> places;
    std::int64_t time_ns = 0;
    for (const std::uint16_t units : delays_of_run(GetParam().cruise, kSteps)) {
      time_ns += std::int64_t{units} * GetParam().unit_ns;
      const std::int64_t tick = (time_ns - 1) / GetParam().tick_ns;
      const std::int64_t slot = (time_ns - tick * GetParam().tick_ns) * kSlots / GetParam().tick_ns;
      places.push_back({tick * kSlots + std::min(slot, kSlots - 1)});
    }
    return places;
  }

  void begin_runs(std::uint32_t first) {
    std::vector<bushd_table_run_entry> entries;
    for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      entries.push_back({m, 0, static_cast<std::int8_t>(m % 2 == 0 ? 1 : -1), kSteps, 0});
    }
    master_.post(kAddress, BUSHD_MSG_TABLE_RUN, payload_of([&](std::uint8_t* to) {
                   return bushd_encode_table_run(0, first, entries.data(), BUSHD_MOTORS_PER_MCU,
                                                 to);
                 }));
  }
};

TEST_P(AvrTableRuns, SixteenKeepTheirSlots) {
  const RampLoad& load = GetParam();
  ASSERT_NO_FATAL_FAILURE(make_ready(load));
  begin_runs(master_.poll(kAddress).tick + 24);
  // The ticks in which they are made come late.
  pass_until_made(load);
  const bushd_report before = master_.poll(kAddress);
  const TimeNs before_ns = bus_.now_ns();
  EXPECT_EQ(before.moving, 0xFFFF);
  const std::vector<Place> places = places_of_steps();
  const bushd_report after = answer_until(end_of_run_ns(load, places.back()), load.poll_ms);
  expect_no_late_tick(before, after, bus_.now_ns() - before_ns, load.tick_ns);
  ASSERT_NO_FATAL_FAILURE(
      expect_steps_in_slots(std::vector(BUSHD_MOTORS_PER_MCU, places), load.tick_ns));
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    const int steps = static_cast<int>(kSteps);
    EXPECT_EQ(after.motor[m].position_steps, m % 2 == 0 ? steps : -steps);
  }
}

// The step that is running is a part of its own: before the ramp down, wherever the run is.
class AvrStoppedRun : public AvrAlone, public testing::WithParamInterface<std::uint32_t> {};

TEST_P(AvrStoppedRun, RampsDownFromTheStepThatRuns) {
  constexpr std::uint32_t kLong = 20'000;
  ASSERT_NO_FATAL_FAILURE(make_ready());
  run(0, kLong);
  pass(GetParam() * TimeNs{kTickNs});
  master_.send(kAddress, BUSHD_MSG_EMERGENCY, Bytes{BUSHD_STOP_RAMP});
  pass(20 * TimeNs{kTickNs});
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.moving, 0);
  EXPECT_GT(steps_made(0), 0u);
  EXPECT_LT(steps_made(0), kLong);
  EXPECT_EQ(report.motor[0].position_steps, static_cast<int>(steps_made(0)));
}

// In ticks. The run begins after 24, and takes four to its cruise.
INSTANTIATE_TEST_SUITE_P(Ticks, AvrStoppedRun, testing::Values(26, 27, 100),
                         testing::PrintToStringParamName());

// At least 9 steps a tick, by ramps of 238 codes; polled as by bushd. simavr enters interrupts in
// no time, the chip takes five cycles: ticks are shorter by the 1500 cycles of a tick than those
// that docs/performance.md tells.
std::vector<RampLoad> loads() {
  std::vector<RampLoad> loads;
  for (int phase = 0; phase < 4; ++phase) {
    loads.push_back({BUSHD_FORMAT_COARSE, 2'464'000, 1'000, 270, 50, phase});
  }
  // In some a poll comes just before the tick in which all runs begin to ramp down, the longest to
  // prepare.
  for (int phase = 0; phase < 10; ++phase) {
    loads.push_back({BUSHD_FORMAT_FINE, 2'464'000, 1'000, 270, 50, phase});
  }
  loads.push_back({BUSHD_FORMAT_FINE, 2'464'000, 1'000, 270, 0});
  // A tick that is no whole number of time units.
  loads.push_back({BUSHD_FORMAT_COARSE, 4'000'000, 7'000, 60, 50});
  return loads;
}

INSTANTIATE_TEST_SUITE_P(Loads, AvrTableRuns, testing::ValuesIn(loads()),
                         [](auto& load) { return name_of(load.param); });

}  // namespace
}  // namespace bushd::sim::table_runs_test
