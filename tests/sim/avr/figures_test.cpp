// How many steps the image for ATmega2560 makes a second: sixteen motors, each at the most steps
// that a tick may have and turning round every two ticks, fed with frames as long as bushd's over a
// line of 1 Mbaud. Every step must be made, in its slot, and each pulse be as long as drivers want.
//
// simavr enters interrupts in no time, the chip takes five cycles: they are added to the tick and
// to the jitter.
#include <cmath>
#include <cstdio>

#include "sim/avr/avr_fixture.h"
#include "sim/step_slots.h"

namespace bushd::sim::figures_test {
namespace {

constexpr std::uint16_t kDelay = 100;
constexpr double kCycleNs = 62.5;
constexpr double kEntryCycles = 5;
constexpr int kTicks = 528;
constexpr double kMostJitterCycles = 35;

struct Load {
  bushd_format format;
  std::uint32_t tick_ns;
  int steps;          // of a motor in a tick
  int frames_a_poll;  // 0: nothing is asked
  double goal_steps_per_s;
  int phase = 0;  // in which the line's bytes meet the ticks
};

class AvrFigures : public AvrAlone, public testing::WithParamInterface<Load> {
 protected:
  AvrFigures() : AvrAlone(1'000'000, 0) {}
  void SetUp() override { pass(300'000'000); }

  // As long as bushd makes them.
  int ticks_per_frame() const {
    return bushd_ticks_capacity(BUSHD_MOTORS_PER_MCU, GetParam().format == BUSHD_FORMAT_FINE);
  }

  // All motors turn round every two ticks.
  static bool forward(int tick) { return tick % 4 < 2; }

  void send_frame(std::uint32_t start, int from) {
    const int count = ticks_per_frame();
    const bool is_last = from + count == kTicks;
    std::vector<int> steps;
    for (int tick = from; tick < from + count; ++tick) {
      steps.push_back(forward(tick) ? GetParam().steps : -GetParam().steps);
    }
    master_.post(
        kAddress, BUSHD_MSG_TICKS,
        ticks_of_all(GetParam().format, from == 0, start + static_cast<std::uint32_t>(from), steps,
                     is_last ? 0 : kDelay));
  }
};

TEST_P(AvrFigures, SixteenMotorsLoseNoStep) {
  const Load& load = GetParam();
  const auto tick_ns = TimeNs{load.tick_ns};
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(load.tick_ns, load.format));
  ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 1000, {400, 300, 200}, kDelay));
  ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  // Ticks are the master's: only what it sends meets them in another phase. In two of these a poll
  // is looked at just as a tick begins. Phase 0 is that of docs/performance.md.
  pass(GetParam().phase * 143'000);
  const bushd_report before = master_.poll(kAddress);
  const TimeNs begin_ns = bus_.now_ns();
  const std::uint64_t entries_before = avr_->interrupts();
  const std::uint32_t first = before.tick + 24;
  std::size_t polls = 0;
  master_.frames.clear();
  for (int tick = 0; tick < kTicks; tick += ticks_per_frame()) {
    send_frame(first, tick);
    if (load.frames_a_poll != 0 && tick / ticks_per_frame() % load.frames_a_poll == 1) {
      ++polls;
      master_.post(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, Bytes{1, kAddress, 0, 0, 0, 255});
    }
    bus_.advance_to(begin_ns + tick_ns * (tick + ticks_per_frame()));
  }
  const double ticks = kTicks;
  const double entries = static_cast<double>(avr_->interrupts() - entries_before) / ticks;
  pass(60 * tick_ns);
  EXPECT_EQ(master_.frames.size(), polls);
  EXPECT_EQ(master_.bad_frames, 0);

  PulseFigures pulses;
  ASSERT_NO_FATAL_FAILURE(expect_steps_in_slots(
      recorder_.edges,
      {load.format, kTicks, static_cast<std::size_t>(load.steps), tick_ns, tick_ns}, &pulses));
  EXPECT_GE(pulses.shortest_ns, 2500);
  const bushd_report after = master_.poll(kAddress);
  EXPECT_EQ(after.faults, 0);
  EXPECT_EQ(after.bad_frames, 0);
  EXPECT_EQ(after.rejected_frames, 0);
  for (const auto& motor : after.motor) EXPECT_EQ(motor.position_steps, 0);
  EXPECT_EQ(avr_->overruns(), 0u);

  EXPECT_LT(pulses.latest_ns - pulses.earliest_ns, tick_ns / TimeNs{kSlots} / 2);
  // What keeps a slot waiting was itself entered.
  const double jitter_cycles =
      std::round(static_cast<double>(pulses.latest_ns - pulses.earliest_ns) / kCycleNs) +
      kEntryCycles;
  EXPECT_LE(jitter_cycles, kMostJitterCycles);
  const double chip_tick_ns = static_cast<double>(tick_ns) + entries * kEntryCycles * kCycleNs;
  const double steps_per_s = BUSHD_MOTORS_PER_MCU * load.steps / chip_tick_ns * 1e9;
  EXPECT_GE(steps_per_s, load.goal_steps_per_s);
  std::printf(
      "ATmega2560 %s, %d steps a tick%s: %.0f steps/s of 16 motors; tick %.0f us (%.0f "
      "interrupts), %.0f steps in all, "
      "pulses from %.2f us, jitter %.0f cycles, %zu bytes of stack never used\n",
      load.format == BUSHD_FORMAT_FINE ? "fine" : "coarse", load.steps,
      polls != 0 ? ", answering" : "", steps_per_s, chip_tick_ns / 1000, entries,
      BUSHD_MOTORS_PER_MCU * load.steps * ticks, static_cast<double>(pulses.shortest_ns) / 1000,
      jitter_cycles, avr_->untouched_ram());
}

constexpr std::array kLoads = {Load{BUSHD_FORMAT_COARSE, 928'000, 127, 0, 2'000'000},
                               Load{BUSHD_FORMAT_COARSE, 928'000, 126, 0, 1'980'000},
                               Load{BUSHD_FORMAT_COARSE, 1'040'000, 127, 2, 1'790'000},
                               Load{BUSHD_FORMAT_FINE, 1'800'000, 127, 0, 1'000'000}};

std::vector<Load> in_other_phases() {
  std::vector<Load> loads;
  for (const Load& load : kLoads) {
    for (int phase = 1; phase <= 6; ++phase) {
      loads.push_back(load);
      loads.back().phase = phase;
    }
  }
  return loads;
}

std::string name_of(const testing::TestParamInfo<Load>& load) {
  return (load.param.format == BUSHD_FORMAT_FINE ? "Fine" : "Coarse") +
         std::to_string(load.param.steps) + (load.param.frames_a_poll != 0 ? "Answering" : "") +
         (load.param.phase != 0 ? "Phase" + std::to_string(load.param.phase) : "");
}

INSTANTIATE_TEST_SUITE_P(Formats, AvrFigures, testing::ValuesIn(kLoads), name_of);
INSTANTIATE_TEST_SUITE_P(OtherPhases, AvrFigures, testing::ValuesIn(in_other_phases()), name_of);

}  // namespace
}  // namespace bushd::sim::figures_test
