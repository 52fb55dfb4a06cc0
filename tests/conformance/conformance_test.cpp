// Streams, table runs and methods of emission, told to an image and to its virtual twin.
#include <utility>

#include "conformance/script.h"
#include "sim/random.h"

namespace bushd::sim::conformance_test {
namespace {

class Conformance : public TargetScript {};
BUSHD_FOR_TARGETS(Conformance, targets());

TEST_P(Conformance, TellsWhoItIs) {
  const auto expected = master_.identify(kVirtual);
  const auto identity = master_.identify(kReal);
  ASSERT_TRUE(expected && identity);
  EXPECT_EQ(identity->protocol_version, BUSHD_PROTOCOL_VERSION);
  EXPECT_EQ(identity->motors, expected->motors);
  EXPECT_EQ(identity->boot_number, 7);
  EXPECT_EQ(identity->slots, expected->slots);
  EXPECT_EQ(identity->queue_ticks, expected->queue_ticks);
  EXPECT_EQ(identity->table_codes, expected->table_codes);
  EXPECT_EQ(identity->capabilities, expected->capabilities);
  EXPECT_EQ(identity->unique_id[0], 8);
  EXPECT_EQ(identity->unique_id[7], 1);
}

TEST_P(Conformance, KeepsItsNewAddressOverAReset) {
  master_.broadcast(bushd_set_address{{8, 7, 6, 5, 4, 3, 2, 1}, 77});
  EXPECT_TRUE(master_.identify(77));
  pass_ticks(40);
  bus_.reboot(1);
  pass_ticks(125);  // 0.3 s
  const auto identity = master_.identify(77);
  ASSERT_TRUE(identity);
  EXPECT_EQ(identity->boot_number, 8);
}

TEST_P(Conformance, IsSilentAndAliveAfterNoise) {
  for (int i = 0; i < 2000; ++i) {
    const auto byte = static_cast<std::uint8_t>(i * 7919 >> 3);
    bus_.master_send(Bytes{byte}, bus_.now_ns());
  }
  master_.drain();
  EXPECT_TRUE(master_.identify(kReal));
}

TEST_P(Conformance, RunsATableToTheSlot) {
  const std::uint8_t motor = own(9);
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {motor}));
  run_by_table(master_.poll(kReal).tick + 24, {{motor, 0, -1, 110, 0}});
  pass_ticks(160);
  expect_the_same_steps(motor, 110);
  expect_the_same_times(motor);
  expect_the_same_reports();
}

TEST_P(Conformance, RunsFourTablesAtOnceToTheSlot) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {0, 5, own(9), own(15)}));
  const std::uint32_t first = master_.poll(kReal).tick + 60;
  run_by_table(first, {{0, 0, 1, 200, 0}});
  run_by_table(first, {{5, 0, 1, 150, 0}});
  run_by_table(first, {{own(9), 0, -1, 110, 0}});
  run_by_table(first, {{own(15), 0, -1, 180, 0}});
  pass_ticks(300);
  for (const auto& [motor, count] : {std::pair{0, 200}, {5, 150}, {9, 110}, {15, 180}}) {
    expect_the_same_steps(own(motor), static_cast<std::size_t>(count));
    expect_the_same_times(own(motor));
  }
  expect_the_same_reports();
}

// The clock jumps by part of a tick: one tick is longer by up to a whole one.
TEST_P(Conformance, ComesIntoStepInTheLongestTicks) {
  tick_ns_ = BUSHD_MAX_TICK_NS;
  const std::uint8_t motor = own(9);
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {motor}));
  std::uint32_t tick = 0;
  std::size_t made = 0;
  for (const std::uint32_t ns : {0, 19'900'000, 1'000, 15'000'000, 7'000'000}) {
    SCOPED_TRACE(ns);
    const std::uint32_t sync_id = master_.sync({});
    pass_ticks(3);
    tick += 1000;
    master_.sync({0, 0, true, sync_id, tick, ns});
    pass_ticks(10);
    run_by_table(master_.poll(kReal).tick + 24, {{motor, 0, 1, 20, 0}});
    pass_ticks(40);
    made += 20;
    expect_the_same_steps(motor, made);
  }
  expect_the_same_times(motor);
  expect_the_same_reports();
}

// A shortest delay below the table's slowest one, one above it, and none; also in a run that is
// cut.
TEST_P(Conformance, TableRunsKeepToTheirSpeedLimits) {
  const Bytes motors = {2, 5, own(14)};
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors));
  const std::uint32_t first = master_.poll(kReal).tick + 16;
  run_by_table(first, {{2, 0, 1, 300, kCruise + 7}, {5, 0, -1, 40, 700}, {own(14), 0, 1, 300, 0}});
  pass_ticks(800);
  expect_the_same_steps(2, 300);
  expect_the_same_steps(5, 40);
  expect_the_same_steps(own(14), 300);
  for (const std::uint8_t motor : motors) expect_the_same_times(motor);
  expect_the_same_reports();
}

// Steps of 0.655 s: one that is not made within 0.5 s is not made.
TEST_P(Conformance, ARampDownWaitsForNoStepThatIsFarAway) {
  const std::uint8_t motor = own(9);
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {motor}));
  std::size_t made = 0;
  for (const auto& [ticks, steps] : {std::pair{30, 0}, {100, 1}, {300, 1}, {350, 2}}) {
    const std::uint32_t first = master_.poll(kReal).tick + 24;
    run_by_table(first, {{motor, 0, 1, 50, UINT16_MAX}});
    pass_ticks(24 + ticks);
    tell(BUSHD_MSG_EMERGENCY, {BUSHD_STOP_RAMP});
    pass_ticks(ticks == 30 || ticks == 300 ? 10 : 210);
    EXPECT_EQ(master_.poll(kReal).moving, 0);
    made += static_cast<std::size_t>(steps);
    expect_the_same_steps(motor, made);
    ASSERT_NO_FATAL_FAILURE(ask(BUSHD_MSG_CONTROL, {BUSHD_CONTROL_CLEAR_FAULTS}));
  }
  expect_the_same_reports();
}

// Inputs are told with every report, at any time of a tick.
TEST_P(Conformance, TurnsRoundWhilePollsCome) {
  const Bytes motors = {2, own(14)};
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors));
  for (int turn = 0; turn < 12; ++turn) {
    const auto direction = static_cast<std::int8_t>(turn % 2 == 0 ? 1 : -1);
    const std::uint32_t first = master_.poll(kReal).tick + 16;
    const auto back = static_cast<std::int8_t>(-direction);
    run_by_table(first, {{2, 0, direction, 5, 0}, {own(14), 0, back, 5, 0}});
    for (int poll = 0; poll < 12; ++poll) master_.poll(kReal);
  }
  for (const std::uint8_t motor : motors) expect_the_same_steps(motor, 60);
  expect_the_same_reports();
}

class ConformanceOfStreams : public Script,
                             public testing::WithParamInterface<std::tuple<Target, bushd_format>> {
 protected:
  ConformanceOfStreams() : Script(std::get<Target>(GetParam())) {}
  bushd_format format() const { return std::get<bushd_format>(GetParam()); }

  // At any speeds. Precondition: brought up.
  void move_all_motors();

  // As far as it was seen to change.
  bool level_of(std::size_t mcu, Signal signal, std::uint8_t index) const {
    bool level = false;
    for (const Edge& edge : recorder_.edges) {
      if (edge.mcu == mcu && edge.signal == signal && edge.index == index) level = edge.level;
    }
    return level;
  }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ConformanceOfStreams);
INSTANTIATE_TEST_SUITE_P(Of, ConformanceOfStreams,
                         testing::Combine(testing::ValuesIn(targets()),
                                          testing::Values(BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE)),
                         [](auto& test) {
                           const bool fine =
                               std::get<bushd_format>(test.param) == BUSHD_FORMAT_FINE;
                           return std::get<Target>(test.param).name + (fine ? "Fine" : "Coarse");
                         });

TEST_P(ConformanceOfStreams, MakesTheStepsOfTheVirtualOne) {
  ASSERT_NO_FATAL_FAILURE(make_ready(format(), {3}));
  stream(3, master_.poll(kReal).tick + 32, 120, 1, format());
  pass_ticks(80);
  stream(3, master_.poll(kReal).tick + 32, 80, -1, format());
  pass_ticks(80);
  expect_the_same_steps(3, 200);
  expect_the_same_reports();
}

void ConformanceOfStreams::move_all_motors() {
  const bool fine = format() == BUSHD_FORMAT_FINE;
  std::vector<std::uint8_t> motors;
  for (std::uint8_t m = 0; m < real_->twin().motors; ++m) motors.push_back(m);
  const auto mask = static_cast<std::uint16_t>((1u << motors.size()) - 1);
  ASSERT_NO_FATAL_FAILURE(give_tables(motors));
  Random random(7, 0);
  const std::uint32_t start = master_.poll(kReal).tick + 24;
  const TimeNs begin_ns = bus_.now_ns();
  constexpr std::uint8_t kCount = 2;
  constexpr std::uint32_t kFrames = 30;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    const std::uint16_t delay = frame + 1 < kFrames ? kCruise : 0;
    test::Ticks ticks{.flags = static_cast<std::uint8_t>((frame == 0 ? BUSHD_TICKS_START : 0) |
                                                         (fine ? BUSHD_TICKS_FINE : 0)),
                      .first = start + frame * kCount,
                      .count = kCount,
                      .mask = mask,
                      .delays = std::vector<std::uint16_t>(motors.size(), delay)};
    for (std::size_t i = 0; i < kCount * motors.size(); ++i) {
      const auto steps = static_cast<std::uint8_t>(random.below(128));
      const bool back = random.below(2) == 0;
      int displacement = steps | (back ? 0 : BUSHD_COARSE_DIRECTION);
      if (fine) {
        displacement = steps * 256;
        if (random.below(3) != 0) displacement = static_cast<int>(random.below(32'513));
        if (back) displacement = -displacement;
      }
      ticks.displacements.push_back(static_cast<std::int16_t>(displacement));
    }
    for (const std::uint8_t address : {kVirtual, kReal}) {
      master_.post(address, BUSHD_MSG_TICKS, test::ticks_payload(ticks));
    }
    bus_.advance_to(begin_ns + TimeNs{tick_ns_} * kCount * (frame + 1));
  }
  pass_ticks(60);
  for (const std::uint8_t motor : motors) {
    EXPECT_GT(steps(0, motor).size(), 1000u);
    expect_the_same_steps(motor, steps(0, motor).size());
    expect_the_same_times(motor);
  }
  expect_the_same_reports();
}

// All motors at any speeds, to and fro, up to the fastest: in the very slots.
TEST_P(ConformanceOfStreams, StepsOfAllMotorsFallIntoTheSlotsOfTheVirtualOne) {
  tick_ns_ = real_->full_tick_ns(format());
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(tick_ns_, format()));
  move_all_motors();
}

// The same with drivers whose inputs are inverted, of every second motor; EN of all.
TEST_P(ConformanceOfStreams, StepsOfInvertedOutputsFallIntoTheSameSlots) {
  tick_ns_ = real_->full_tick_ns(format());
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(tick_ns_, format()));
  levels_ = {.step_low = 0x5555, .direction_low = 0x3333, .enabled = BUSHD_ENABLED_LOW};
  ASSERT_NO_FATAL_FAILURE(ask(levels_));
  pass_ticks(4);
  for (const std::size_t mcu : {0, 1}) {
    EXPECT_TRUE(level_of(mcu, Signal::kEnable, 0)) << "disabled while they change";
    EXPECT_TRUE(level_of(mcu, Signal::kStep, 0));
    EXPECT_FALSE(level_of(mcu, Signal::kStep, 1));
  }
  ASSERT_NO_FATAL_FAILURE(ask(BUSHD_MSG_CONTROL, {BUSHD_CONTROL_ENABLE}));
  for (const std::size_t mcu : {0, 1}) EXPECT_FALSE(level_of(mcu, Signal::kEnable, 0));
  recorder_.edges.clear();
  move_all_motors();
}

struct Mode {
  std::string name;
  std::uint16_t needs;  // all of them
  bushd_emission settings;
};

using TargetAndMode = std::pair<Target, Mode>;

class ConformanceOfEmission : public Script, public testing::WithParamInterface<TargetAndMode> {
 protected:
  ConformanceOfEmission() : Script(GetParam().first), mode_(GetParam().second) {}

  void expect_both_answer(bushd_status status) {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(tick_ns_, BUSHD_FORMAT_COARSE));
    ASSERT_NO_FATAL_FAILURE(ask(mode_.settings, status));
  }

  // As the virtual one; both have this emission.
  void change_outputs_alike();

  const Mode mode_;
};
class DeniedEmission : public ConformanceOfEmission {};

std::vector<Mode> modes() {
  const auto mode = [](bushd_emission_mode of) {
    bushd_emission settings{};
    settings.mode = of;
    settings.step_us = 600;
    settings.settle_us = 60;
    settings.sequence = BUSHD_PHASES_HALF;
    settings.hold_current = true;
    return settings;
  };
  return {{"Burst", BUSHD_CAN_BURST, mode(BUSHD_EMISSION_BURST)},
          {"CommonDir", BUSHD_CAN_COMMON_DIR, mode(BUSHD_EMISSION_COMMON_DIR)},
          {"Staggered", BUSHD_CAN_STAGGERED, mode(BUSHD_EMISSION_STAGGERED)},
          {"CommonStaggered", BUSHD_CAN_COMMON_DIR | BUSHD_CAN_STAGGERED,
           mode(BUSHD_EMISSION_COMMON_STAGGERED)},
          {"Phases", BUSHD_CAN_PHASES, mode(BUSHD_EMISSION_PHASES)}};
}

void PrintTo(const Mode& mode, std::ostream* out) {
  *out << mode.name;
}

// Each mode with the targets that `those` gives for its capability.
std::vector<TargetAndMode> with_modes(std::vector<Target> (*those)(std::uint32_t)) {
  std::vector<TargetAndMode> pairs;
  for (const Mode& mode : modes()) {
    for (const Target& target : those(mode.needs)) pairs.emplace_back(target, mode);
  }
  return pairs;
}

std::string name_of(const testing::TestParamInfo<TargetAndMode>& test) {
  return test.param.first.name + test.param.second.name;
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ConformanceOfEmission);
INSTANTIATE_TEST_SUITE_P(Of, ConformanceOfEmission, testing::ValuesIn(with_modes(targets_with)),
                         name_of);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(DeniedEmission);
INSTANTIATE_TEST_SUITE_P(Of, DeniedEmission, testing::ValuesIn(with_modes(targets_without)),
                         name_of);

TEST_P(DeniedEmission, IsRefused) {
  expect_both_answer(BUSHD_E_FORMAT);
}

// Four motors, or all that have phases, to and fro, in streams, where every output changes at the
// same slots.
TEST_P(ConformanceOfEmission, ChangesOutputsInTheSlotsOfTheVirtualOne) {
  ASSERT_NO_FATAL_FAILURE(expect_both_answer(BUSHD_OK));
  ASSERT_NO_FATAL_FAILURE(change_outputs_alike());
}

// The common DIR and STEP rest high; phases know no such thing.
TEST_P(ConformanceOfEmission, ChangesInvertedOutputsInTheSlotsOfTheVirtualOne) {
  const bool phases = mode_.settings.mode == BUSHD_EMISSION_PHASES;
  ASSERT_NO_FATAL_FAILURE(expect_both_answer(BUSHD_OK));
  const bool common_dir = bushd_emission_has_common_dir(mode_.settings.mode);
  bushd_set_outputs levels{.step_low = 0xFFFF,
                           .direction_low = common_dir ? std::uint16_t{0xFFFF} : std::uint16_t{0},
                           .enabled = BUSHD_ENABLED_LOW};
  if (phases) {
    ASSERT_NO_FATAL_FAILURE(ask(levels, BUSHD_E_FORMAT));
    levels.step_low = 0;
  }
  ASSERT_NO_FATAL_FAILURE(ask(levels));
  ASSERT_NO_FATAL_FAILURE(ask(BUSHD_MSG_CONTROL, {BUSHD_CONTROL_ENABLE}));
  levels_ = levels;
  ASSERT_NO_FATAL_FAILURE(change_outputs_alike());
}

void ConformanceOfEmission::change_outputs_alike() {
  const bool phases = mode_.settings.mode == BUSHD_EMISSION_PHASES;
  const auto outputs = real_->twin().motors;
  std::vector<std::uint8_t> motors = {0, 1, 2, 3};
  if (phases) motors.resize(outputs / BUSHD_PHASE_OUTPUTS);
  ASSERT_NO_FATAL_FAILURE(give_tables(motors));
  // Windings are on by now.
  const TimeNs begin_ns = bus_.now_ns();
  const std::uint32_t first = master_.poll(kReal).tick + 40;
  constexpr std::uint8_t kCount = 8;
  for (std::uint32_t frame = 0; frame < 4; ++frame) {
    test::Ticks ticks{.flags = BUSHD_TICKS_START,
                      .first = first + 12 * frame,
                      .count = kCount,
                      .mask = static_cast<std::uint16_t>((1u << motors.size()) - 1),
                      .delays = std::vector<std::uint16_t>(motors.size(), 0)};
    for (std::uint32_t i = 0; i < kCount * motors.size(); ++i) {
      const auto motor = static_cast<std::uint32_t>(i % motors.size());
      const bool forward = (motor + frame) % 2 == 0;
      const auto steps = static_cast<int>(1 + (i + frame) % 2);
      ticks.displacements.push_back(test::displacement_of(forward ? steps : -steps, false));
    }
    tell(BUSHD_MSG_TICKS, test::ticks_payload(ticks));
  }
  pass_ticks(120);
  for (std::uint8_t output = 0; output < (phases ? outputs : 4); ++output) {
    expect_the_same_changes(output, !phases, begin_ns);
  }
  expect_the_same_reports();
}

}  // namespace
}  // namespace bushd::sim::conformance_test
