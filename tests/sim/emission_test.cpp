// What comes out of the pins in each way of emission, edge by edge: checked by what drivers want
// (pulse width, DIR setup, sequences of phases) and by where the documents put the pulses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <set>

#include "sim/emission_bus.h"

namespace bushd::sim::emission_test {
namespace {

struct Step {
  TimeNs rise_ns;
  TimeNs width_ns;
  bool right;
  TimeNs dir_since_ns;
};

// Steps of all outputs as drivers see them. A STEP that is high at the end is not counted.
std::map<int, std::vector<Step>> steps_of(const Recorder& recorder, bool common_dir) {
  std::map<int, std::vector<Step>> steps;
  std::map<int, std::pair<bool, TimeNs>> dir;
  std::map<int, TimeNs> rise;
  for (const Edge& edge : recorder.edges) {
    const int place = edge.index;
    if (edge.signal == (common_dir ? Signal::kCommonDir : Signal::kDir)) {
      dir[place] = {edge.level, edge.time_ns};
    } else if (edge.signal == Signal::kStep && edge.level) {
      rise[place] = edge.time_ns;
      const auto [right, since] = dir[common_dir ? 0 : place];
      steps[place].push_back({edge.time_ns, 0, right, edge.time_ns - since});
    } else if (edge.signal == Signal::kStep) {
      steps[place].back().width_ns = edge.time_ns - rise[place];
    }
  }
  return steps;
}

std::int64_t sum(const std::vector<Step>& steps) {
  std::int64_t position = 0;
  for (const Step& step : steps) position += step.right ? 1 : -1;
  return position;
}

std::vector<TimeNs> rises(const std::vector<Step>& steps, TimeNs from_ns) {
  std::vector<TimeNs> out;
  for (const Step& step : steps) out.push_back(step.rise_ns - from_ns);
  return out;
}

TEST(EmissionOnPins, BurstPulsesTogetherEachStepPeriod) {
  EmissionBus lab(kEightStepsNs);
  lab.use(of_mode(BUSHD_EMISSION_BURST), 4);
  lab.run({{3, 0, -1, 8}, {1, 2, 0, 0}});
  const auto steps = steps_of(lab.recorder, false);
  using Times = std::vector<TimeNs>;
  EXPECT_EQ(rises(steps.at(0), lab.start_ns), (Times{0, kStepNs, 2 * kStepNs, kEightStepsNs}));
  EXPECT_EQ(rises(steps.at(1), lab.start_ns), (Times{kEightStepsNs, kEightStepsNs + kStepNs}));
  EXPECT_EQ(rises(steps.at(2), lab.start_ns), (Times{0}));
  EXPECT_EQ(steps.at(3).size(), 8u);
  EXPECT_EQ(sum(steps.at(0)), 4);
  EXPECT_EQ(sum(steps.at(2)), -1);
}

TEST(EmissionOnPins, CommonDirIsLowForLeftMoversAndHighForRightMovers) {
  EmissionBus lab(kEightStepsNs);
  bushd_emission settings = of_mode(BUSHD_EMISSION_COMMON_DIR);
  settings.dir_setup_us = 20;
  lab.use(settings, 3);
  lab.run({{2, -3, 1}, {-1, 0, 8}});
  const auto steps = steps_of(lab.recorder, true);
  using Times = std::vector<TimeNs>;
  constexpr TimeNs kSlot = kEightStepsNs / 256;
  EXPECT_EQ(rises(steps.at(1), lab.start_ns), (Times{0, kStepNs, 2 * kStepNs}));
  EXPECT_EQ(rises(steps.at(0), lab.start_ns), (Times{kSlot, kSlot + kStepNs, kEightStepsNs}));
  EXPECT_EQ(sum(steps.at(0)), 1);
  EXPECT_EQ(sum(steps.at(1)), -3);
  EXPECT_EQ(sum(steps.at(2)), 9);
  for (const auto& [output, of_motor] : steps) {
    for (const Step& step : of_motor) EXPECT_GE(step.dir_since_ns, 20'000);
  }
  EXPECT_TRUE(lab.recorder.times(0, Signal::kDir, 0, true).empty()) << "one line is enough";
  const auto ups = lab.recorder.times(0, Signal::kCommonDir, 0, true);
  EXPECT_EQ(ups.size(), lab.recorder.times(0, Signal::kCommonDir, 0, false).size())
      << "low at rest";
}

TEST(EmissionOnPins, StaggeredPulsesFollowEachOther) {
  EmissionBus lab(kEightStepsNs);
  bushd_emission settings = of_mode(BUSHD_EMISSION_STAGGERED);
  settings.settle_us = 518;
  lab.use(settings, 4);
  lab.run({{1, 1, -1, 2}});
  const auto steps = steps_of(lab.recorder, false);
  // T_step / 4 = 0.512 ms is less than 0.518 ms; the one motor of the second T_step need not wait.
  for (int m = 0; m < 4; ++m) EXPECT_EQ(steps.at(m)[0].rise_ns - lab.start_ns, m * 512'000) << m;
  EXPECT_EQ(steps.at(3)[1].rise_ns - lab.start_ns, kStepNs);
}

// Figures 16 and 17 of the document: one DIR and a current sensor. Those to the left come first, in
// pairs of slots; DIR is low for them and high for those to the right.
TEST(EmissionOnPins, StaggeredPulsesWithACommonDirGoLeftThenRight) {
  EmissionBus lab(kEightStepsNs);
  bushd_emission settings = of_mode(BUSHD_EMISSION_COMMON_STAGGERED);
  settings.settle_us = 518;
  settings.dir_setup_us = 30;
  lab.use(settings, 4);
  lab.run({{1, -1, 2, -1}, {0, 1, 0, -1}});
  const auto steps = steps_of(lab.recorder, true);
  using Times = std::vector<TimeNs>;
  constexpr TimeNs kSlot = kEightStepsNs / 256;
  constexpr TimeNs kApart = 512'000;
  EXPECT_EQ(rises(steps.at(1), lab.start_ns), (Times{0, kEightStepsNs + 640'000 + kSlot}));
  EXPECT_EQ(rises(steps.at(3), lab.start_ns), (Times{kApart, kEightStepsNs}));
  EXPECT_EQ(rises(steps.at(0), lab.start_ns), (Times{2 * kApart + kSlot}));
  EXPECT_EQ(rises(steps.at(2), lab.start_ns), (Times{3 * kApart + kSlot, kStepNs + kSlot}));
  EXPECT_EQ(sum(steps.at(0)), 1);
  EXPECT_EQ(sum(steps.at(1)), 0);
  EXPECT_EQ(sum(steps.at(2)), 2);
  EXPECT_EQ(sum(steps.at(3)), -2);
  for (const auto& [output, of_motor] : steps) {
    for (const Step& step : of_motor) EXPECT_GE(step.dir_since_ns, 30'000);
  }
  EXPECT_TRUE(lab.recorder.times(0, Signal::kDir, 0, true).empty()) << "one line is enough";
}

// Whatever the counts: in each T_step nobody goes left after one that goes right, nobody pulses
// together with another, and the current has settled where there is time for it.
TEST(EmissionOnPins, StaggeredPulsesWithACommonDirNeverTurnBackWithinAStep) {
  std::mt19937 random(11);
  EmissionBus lab(kEightStepsNs);
  bushd_emission settings = of_mode(BUSHD_EMISSION_COMMON_STAGGERED);
  settings.settle_us = 200;
  lab.use(settings, 6);
  for (int part = 0; part < 20; ++part) {
    std::vector<int> row(6);
    for (int& count : row) count = static_cast<int>(random() % 17) - 8;
    lab.recorder.edges.clear();
    lab.run({row});
    std::map<TimeNs, bool> all;  // which way, by when
    std::size_t pulses = 0;
    for (const auto& [output, of_motor] : steps_of(lab.recorder, true)) {
      for (const Step& step : of_motor) {
        all[step.rise_ns - lab.start_ns] = step.right;
        ++pulses;
        EXPECT_EQ(step.right, row[static_cast<std::size_t>(output)] > 0);
      }
    }
    EXPECT_EQ(all.size(), pulses) << "one at a time";
    for (auto it = all.begin(); it != all.end() && std::next(it) != all.end(); ++it) {
      const auto next = std::next(it);
      if (it->first / kStepNs != next->first / kStepNs) continue;
      EXPECT_FALSE(it->second && !next->second) << "back to the left at " << next->first;
      // Six times 0.256 ms, two pairs, is less than T_step.
      EXPECT_EQ(next->first - it->first - (next->second != it->second ? kEightStepsNs / 256 : 0),
                256'000);
    }
  }
}

// The least time between two steps of a motor with delays of 0.2 ms, to the left and then back.
TimeNs closest_steps(std::uint16_t dir_setup_us) {
  EmissionBus lab(2'000'000, {}, BUSHD_FORMAT_FINE);
  bushd_emission settings = of_mode(BUSHD_EMISSION_EVEN);
  settings.dir_setup_us = dir_setup_us;
  lab.use(settings, 1);
  lab.run({{-10}, {-10}, {-10}});
  lab.run({{10}, {10}, {10}});
  const auto steps = steps_of(lab.recorder, false);
  EXPECT_EQ(steps.at(0).size(), 60U);
  EXPECT_EQ(sum(steps.at(0)), 0);
  TimeNs closest = lab.bus.now_ns();
  for (std::size_t i = 1; i < steps.at(0).size(); ++i) {
    closest = std::min(closest, steps.at(0)[i].rise_ns - steps.at(0)[i - 1].rise_ns);
  }
  return closest;
}

TEST(EmissionOnPins, StepsKeepTheirDistanceWhereDirIsEarlyEnough) {
  constexpr TimeNs kSlotNs = 2'000'000 / 256 + 1;
  for (const std::uint16_t us : {std::uint16_t{0}, std::uint16_t{50}, std::uint16_t{100}}) {
    EXPECT_GE(closest_steps(us), 200'000 - 2 * kSlotNs) << us;
  }
  // Which is why no configuration has it (longest_dir_setup_us).
  EXPECT_LE(closest_steps(1000), kSlotNs);
}

// The rules of drivers, whatever is asked for: random counts that turn as often as they like.
TEST(EmissionOnPins, PulseWidthAndDirSetupAreKeptInEveryModeAndNoStepIsLost) {
  std::mt19937 random(1);
  for (const bushd_format format : {BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE}) {
    for (const bushd_emission_mode mode :
         {BUSHD_EMISSION_EVEN, BUSHD_EMISSION_BURST, BUSHD_EMISSION_COMMON_DIR,
          BUSHD_EMISSION_STAGGERED, BUSHD_EMISSION_COMMON_STAGGERED}) {
      for (const std::uint16_t slots : {std::uint16_t{128}, std::uint16_t{201}}) {
        EmissionBus lab(2'560'000, {.slots = slots}, format);
        bushd_emission settings = of_mode(mode, 100);
        settings.settle_us = 30;
        settings.dir_setup_us = bushd_emission_has_common_dir(mode) ? 6 : 50;
        settings.pulse_us = 6;
        lab.use(settings, 6);
        const int most = bushd_emission_grid(lab.bus.mcu(0).core().emission.grid).max_steps;
        std::array<std::int64_t, 6> asked{};
        for (int part = 0; part < 8; ++part) {
          // The bus's time moves, too: ticks get shorter and longer.
          const bushd_report report = lab.master.poll(1);
          lab.master.sync({0, 0, true, report.sync_id, report.sync_tick,
                           report.sync_ns + (part % 2 ? 50'000u : 0u)});
          std::vector<std::vector<int>> rows(15);
          for (auto& row : rows) {
            for (std::size_t m = 0; m < 6; ++m) {
              const int size =
                  static_cast<int>(random() % 3 == 0 ? random() % (most + 1u) : random() % 3);
              row.push_back(random() % 2 ? size : -size);
              // Fine ticks that turn before a whole step is made would make none.
              asked[m] += row.back();
            }
          }
          lab.run(rows);
        }
        const auto steps = steps_of(lab.recorder, bushd_emission_has_common_dir(mode));
        const bushd_report report = lab.master.poll(1);
        for (int m = 0; m < 6; ++m) {
          EXPECT_EQ(sum(steps.at(m)), asked[static_cast<std::size_t>(m)]);
          EXPECT_EQ(report.motor[m].position_steps, asked[static_cast<std::size_t>(m)]);
          for (const Step& step : steps.at(m)) {
            ASSERT_GE(step.width_ns, settings.pulse_us * 1000);
            ASSERT_GE(step.dir_since_ns, settings.dir_setup_us * 1000)
                << "mode " << mode << " at " << step.rise_ns;
          }
        }
      }
    }
  }
}

// The position that a sequence of levels leads to, from windings alone: each change must be to a
// neighbour in the sequence; off is no change.
class Windings {
 public:
  explicit Windings(std::vector<int> sequence) : sequence_(std::move(sequence)) {}
  void see(int levels) {
    if (levels == 0 || levels == sequence_[static_cast<std::size_t>(at_)]) return;
    const int count = static_cast<int>(sequence_.size());
    const int next = (at_ + 1) % count;
    const int before = (at_ + count - 1) % count;
    if (levels == sequence_[static_cast<std::size_t>(next)]) {
      at_ = next;
      ++position;
    } else if (levels == sequence_[static_cast<std::size_t>(before)]) {
      at_ = before;
      --position;
    } else {
      ADD_FAILURE() << "levels " << levels << " are no neighbour";
    }
  }
  std::int64_t position = 0;

 private:
  std::vector<int> sequence_;
  int at_ = 0;
};

// Levels of a motor's four outputs at all times when one of them changed.
std::vector<std::pair<TimeNs, int>> levels_of(const Recorder& recorder, int motor) {
  std::vector<std::pair<TimeNs, int>> out;
  int levels = 0;
  for (const Edge& edge : recorder.edges) {
    if (edge.signal != Signal::kStep || edge.index / 4 != motor) continue;
    const int bit = 1 << edge.index % 4;
    levels = edge.level ? levels | bit : levels & ~bit;
    if (!out.empty() && out.back().first == edge.time_ns) {
      out.back().second = levels;
    } else {
      out.emplace_back(edge.time_ns, levels);
    }
  }
  return out;
}

const std::map<bushd_phase_sequence, std::vector<int>> kSequences = {
    {BUSHD_PHASES_WAVE, {1, 2, 4, 8}},
    {BUSHD_PHASES_FULL, {3, 6, 12, 9}},
    {BUSHD_PHASES_HALF, {1, 3, 2, 6, 4, 12, 8, 9}},
    {BUSHD_PHASES_THREE, {1, 3, 2, 6, 4, 5}}};

TEST(EmissionOnPins, PhasesFollowThePositionInEverySequenceAndBothWays) {
  for (const auto& [kind, sequence] : kSequences) {
    for (const bool hold : {true, false}) {
      EmissionBus lab(2'560'000);
      bushd_emission settings = of_mode(BUSHD_EMISSION_PHASES);
      settings.sequence = kind;
      settings.hold_current = hold;
      lab.use(settings, 4);
      lab.run({{3, -1, 0, 1}, {9, -7, 0, 0}, {-2, 5, 0, 0}, {-30, 1, 1, 0}});
      // Another value of the counter is not another place of the rotor.
      ASSERT_EQ(lab.master.acknowledged(1, bushd_set_position{0, 1'000'001}), BUSHD_OK);
      lab.run({{-3, 0, 0, 0}, {0, 0, 0, 0}, {4, 0, 0, 0}});
      const std::array<std::int64_t, 4> expected = {-20 + 1, -2, 1, 1};
      for (int m = 0; m < 4; ++m) {
        Windings windings(sequence);
        for (const auto& [time_ns, levels] : levels_of(lab.recorder, m)) windings.see(levels);
        EXPECT_EQ(windings.position, expected[static_cast<std::size_t>(m)]) << "motor " << m;
      }
      EXPECT_EQ(lab.master.poll(1).motor[0].position_steps, 1'000'002);
      EXPECT_EQ(lab.bus.mcu(0).shaft(0).position_steps, -19);
    }
  }
}

TEST(EmissionOnPins, HoldCurrentIsOnOrOffAtRest) {
  for (const bool hold : {true, false}) {
    EmissionBus lab(2'560'000);
    bushd_emission settings = of_mode(BUSHD_EMISSION_PHASES);
    settings.hold_current = hold;
    lab.use(settings, 2);
    lab.run({{1, 0}, {1, 0}});
    lab.bus.advance_to(lab.bus.now_ns() + 60'000'000);
    EXPECT_EQ(levels_of(lab.recorder, 0).back().second, 4) << "until the rotor stands";
    lab.bus.advance_to(lab.bus.now_ns() + 100'000'000);
    EXPECT_EQ(levels_of(lab.recorder, 0).back().second, hold ? 4 : 0);
    EXPECT_EQ(levels_of(lab.recorder, 1).back().second, hold ? 1 : 0);
    // Without EN nothing holds.
    ASSERT_EQ(lab.master.acknowledged(1, bushd_control{BUSHD_CONTROL_DISABLE, 0}), BUSHD_OK);
    lab.bus.advance_to(lab.bus.now_ns() + 10'000'000);
    if (hold) {
      EXPECT_EQ(levels_of(lab.recorder, 1).back().second, 0);
    }
    EXPECT_EQ(levels_of(lab.recorder, 0).back().second, 0);
  }
}

TEST(EmissionOnPins, AnotherModeTakesTheLevelsAway) {
  EmissionBus lab(2'560'000);
  bushd_emission settings = of_mode(BUSHD_EMISSION_PHASES);
  settings.hold_current = true;
  lab.use(settings, 1);
  lab.run({{1}});
  EXPECT_EQ(levels_of(lab.recorder, 0).back().second, 2);
  ASSERT_EQ(lab.master.acknowledged(1, of_mode(BUSHD_EMISSION_EVEN)), BUSHD_OK);
  lab.bus.advance_to(lab.bus.now_ns() + 10'000'000);
  EXPECT_EQ(levels_of(lab.recorder, 0).back().second, 0);
}

TEST(EmissionOnPins, StepsOfATickThatAResetCutsAreThoseThatWereMade) {
  for (const bushd_emission_mode mode : {BUSHD_EMISSION_BURST, BUSHD_EMISSION_PHASES}) {
    EmissionBus lab(kEightStepsNs);
    lab.use(of_mode(mode), 1);
    lab.begin({{8}});
    lab.bus.advance_to(lab.bus.now_ns() + kEightStepsNs / 2);
    lab.bus.reboot(0, 1'000'000);
    EXPECT_EQ(lab.bus.mcu(0).shaft(0).position_steps, mode == BUSHD_EMISSION_BURST ? 5 : 4);
  }
}

}  // namespace
}  // namespace bushd::sim::emission_test
