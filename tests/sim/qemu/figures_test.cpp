// How many steps the image for LM3S6965 makes a second, by instructions: sixteen motors, each at
// the most steps that a tick may have and turning round after every frame, fed over a line of 1
// Mbaud. Every step must be made, in its slot.
//
// QEMU's instructions take 16 ns, the chip's CPU at 50 MHz takes 20 ns for a cycle. So a tick here
// holds as many instructions as a longer one of the chip would if each took one cycle: it is the
// latter that counts for the steps a second.
#include <cstdio>

#include "sim/qemu/qemu_fixture.h"
#include "sim/step_slots.h"

namespace bushd::sim {
namespace {

constexpr std::uint16_t kDelay = 100;
constexpr std::uint32_t kFrames = 400;
constexpr int kSteps = 127;
constexpr double kInstructionNs = 16;
constexpr double kCycleNs = 20;

struct Load {
  const char* name;
  bushd_format format;
  std::uint32_t tick_ns;
  std::uint8_t ticks_per_frame;
  double goal_steps_per_s;
};

// The length of a tick's slots, each two half slots of whole cycles; they leave a margin in it:
// firmware/ports/lm3s6965/emission.h.
constexpr TimeNs slots_ns(TimeNs tick_ns) {
  constexpr TimeNs kTimerCycleNs = 20;
  constexpr TimeNs kMarginCycles = 250;
  constexpr TimeNs kHalfSlots = 2 * kSlots;
  return (tick_ns / kTimerCycleNs - kMarginCycles) / kHalfSlots * kHalfSlots * kTimerCycleNs;
}

class LmFigures : public QemuAlone, public testing::WithParamInterface<Load> {
 protected:
  LmFigures() : QemuAlone(1'000'000) {}
  // How short pulses get depends on the phase in which work meets ticks: this is that of
  // docs/performance.md.
  void SetUp() override { pass(250'000'000); }

  Bytes frame(std::uint32_t number, std::uint32_t first_tick) const {
    const bool forward = number % 2 == 0;
    return ticks_of_all(GetParam().format, number == 0, first_tick,
                        std::vector<int>(GetParam().ticks_per_frame, forward ? kSteps : -kSteps),
                        number + 1 == kFrames ? 0 : kDelay);
  }
};

TEST_P(LmFigures, SixteenMotorsLoseNoStep) {
  const Load& load = GetParam();
  const TimeNs frame_ns = TimeNs{load.tick_ns} * load.ticks_per_frame;
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(load.tick_ns, load.format));
  ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 1000, {400, 300, 200}, kDelay));
  ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  const std::uint32_t first =
      master_.poll(kAddress).tick + 20 + static_cast<std::uint32_t>(10'000'000 / load.tick_ns);
  const TimeNs begin_ns = bus_.now_ns();
  for (std::uint32_t number = 0; number < kFrames; ++number) {
    master_.post(kAddress, BUSHD_MSG_TICKS, frame(number, first + number * load.ticks_per_frame));
    bus_.advance_to(begin_ns + frame_ns * (number + 1));
  }
  pass(200 * TimeNs{load.tick_ns});

  const double ticks = kFrames * load.ticks_per_frame;
  PulseFigures pulses;
  ASSERT_NO_FATAL_FAILURE(
      expect_steps_in_slots(recorder_.edges,
                            {load.format, kFrames * std::size_t{load.ticks_per_frame}, kSteps,
                             load.tick_ns, slots_ns(load.tick_ns)},
                            &pulses));
  const bushd_report after = master_.poll(kAddress);
  EXPECT_EQ(after.faults, 0);
  EXPECT_EQ(after.bad_frames, 0);
  EXPECT_EQ(after.rejected_frames, 0);
  for (const auto& motor : after.motor) EXPECT_EQ(motor.position_steps, 0);
  EXPECT_EQ(qemu_->overruns(), 0u);

  const double instructions = load.tick_ns / kInstructionNs;
  const double steps_per_s = BUSHD_MOTORS_PER_MCU * kSteps / (instructions * kCycleNs) * 1e9;
  EXPECT_GE(steps_per_s, load.goal_steps_per_s);
  std::printf(
      "LM3S6965 %s: %.0f steps/s of 16 motors; %.0f instructions a tick, %.0f us of cycles; frames "
      "of %d ticks, %.0f steps in all, pulses from %.2f us\n",
      load.name, steps_per_s, instructions, instructions * kCycleNs / 1000, load.ticks_per_frame,
      BUSHD_MOTORS_PER_MCU * kSteps * ticks, static_cast<double>(pulses.shortest_ns) / 1000);
}

INSTANTIATE_TEST_SUITE_P(Formats, LmFigures,
                         testing::Values(Load{"coarse", BUSHD_FORMAT_COARSE, 270'000, 6, 6e6},
                                         Load{"fine", BUSHD_FORMAT_FINE, 420'000, 6, 3.8e6}),
                         [](auto& load) { return load.param.name; });

}  // namespace
}  // namespace bushd::sim
