// Table runs on the image for ATmega2560: sixteen at once, asked for their reports meanwhile. Every
// step must be in its slot, and no tick late.
#include <algorithm>
#include <array>

#include "sim/avr/avr_fixture.h"
#include "sim/avr/ramps.h"

namespace bushd::sim::table_runs_test {
namespace {

constexpr std::size_t kSlots = 128;
constexpr std::uint32_t kSteps = 3000;

struct Load {
  bushd_format format;
  std::uint32_t tick_ns;
  std::uint32_t unit_ns;
  std::uint16_t cruise;   // in units
  std::uint32_t poll_ms;  // 0: nothing is asked meanwhile
  int phase = 0;          // in which polls meet the ticks
};

class AvrTableRuns : public AvrAlone, public testing::WithParamInterface<Load> {
 protected:
  static std::vector<std::uint16_t> codes() { return ramp_to(GetParam().cruise); }

  // Where each step of the run falls, in slots from its start: the time is the sum of the delays; a
  // step exactly at a tick's end falls into its last slot.
  static std::vector<std::size_t> slots_of_steps() {
    std::vector<std::size_t> slots;
    std::uint64_t time_ns = 0;
    for (const std::uint16_t units : delays_of_run(GetParam().cruise, kSteps)) {
      time_ns += std::uint64_t{units} * GetParam().unit_ns;
      const std::uint64_t tick = (time_ns - 1) / GetParam().tick_ns;
      const std::uint64_t slot =
          (time_ns - tick * GetParam().tick_ns) * kSlots / GetParam().tick_ns;
      slots.push_back(static_cast<std::size_t>(tick * kSlots + std::min(slot, kSlots - 1)));
    }
    return slots;
  }

  void begin_runs(std::uint32_t first) {
    std::vector<bushd_table_run_entry> entries;
    for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      entries.push_back({m, 0, static_cast<std::int8_t>(m % 2 == 0 ? 1 : -1), kSteps, 0});
    }
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(
        bushd_encode_table_run(0, first, entries.data(), BUSHD_MOTORS_PER_MCU, payload.data()));
    master_.post(kAddress, BUSHD_MSG_TABLE_RUN, payload);
  }

  // All pulses begin within the time of one slot, counted from where theirs does.
  void expect_steps_in_slots() const {
    const TimeNs slot_ns = TimeNs{GetParam().tick_ns} / TimeNs{kSlots};
    const std::vector<std::size_t> slots = slots_of_steps();
    TimeNs earliest_ns = 0;
    TimeNs latest_ns = 0;
    for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      SCOPED_TRACE("motor " + std::to_string(m));
      const std::vector<TimeNs> made = recorder_.times(0, Signal::kStep, m, true);
      ASSERT_EQ(made.size(), slots.size());
      const TimeNs begin_ns =
          recorder_.times(0, Signal::kStep, 0, true)[0] - static_cast<TimeNs>(slots[0]) * slot_ns;
      for (std::size_t i = 0; i < slots.size(); ++i) {
        const TimeNs late_ns = made[i] - begin_ns - static_cast<TimeNs>(slots[i]) * slot_ns;
        earliest_ns = std::min(earliest_ns, late_ns);
        latest_ns = std::max(latest_ns, late_ns);
        ASSERT_LT(latest_ns - earliest_ns, slot_ns) << "step " << i;
      }
    }
  }
};

TEST_P(AvrTableRuns, SixteenKeepTheirSlots) {
  const Load& load = GetParam();
  pass(kBootNs);
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(load.tick_ns, load.format));
  ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, load.unit_ns, codes(), load.cruise));
  ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  begin_runs(master_.poll(kAddress).tick + 24);
  // Making sixteen runs takes some ticks, well before they begin; so those come late. Ticks are the
  // master's: only what it sends meets them in another phase.
  pass(8 * TimeNs{load.tick_ns} + load.phase * 61'000);
  const bushd_report before = master_.poll(kAddress);
  const TimeNs before_ns = bus_.now_ns();
  EXPECT_EQ(before.moving, 0xFFFF);
  const std::size_t ticks = slots_of_steps().back() / kSlots + 1;
  const TimeNs end_ns = bus_.now_ns() + static_cast<TimeNs>(ticks + 40) * load.tick_ns;
  const bushd_report after = answer_until(end_ns, load.poll_ms);
  expect_no_late_tick(before, after, bus_.now_ns() - before_ns, load.tick_ns);
  ASSERT_NO_FATAL_FAILURE(expect_steps_in_slots());
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    const int steps = static_cast<int>(kSteps);
    EXPECT_EQ(after.motor[m].position_steps, m % 2 == 0 ? steps : -steps);
  }
}

// The step that is running is a part of its own: before the ramp down, wherever the run is.
class AvrStoppedRun : public AvrAlone, public testing::WithParamInterface<std::uint32_t> {};

TEST_P(AvrStoppedRun, RampsDownFromTheStepThatRuns) {
  constexpr std::uint32_t kLong = 20'000;
  pass(kBootNs);
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
std::vector<Load> loads() {
  std::vector<Load> loads;
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

std::string name_of(const testing::TestParamInfo<Load>& load) {
  return (load.param.format == BUSHD_FORMAT_FINE ? "Fine" : "Coarse") +
         std::to_string(load.param.tick_ns / 1000) + "us" +
         (load.param.poll_ms != 0 ? "Answering" : "") +
         (load.param.phase != 0 ? "Phase" + std::to_string(load.param.phase) : "");
}

INSTANTIATE_TEST_SUITE_P(Loads, AvrTableRuns, testing::ValuesIn(loads()), name_of);

}  // namespace
}  // namespace bushd::sim::table_runs_test
