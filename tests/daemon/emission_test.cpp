// Ways of emission, from bushd.toml to the pins.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

// Counts steps at the pins as drivers with the wiring of the mode would.
class Drivers final : public sim::EdgeSink {
 public:
  explicit Drivers(bool common_dir) : common_dir_(common_dir) {}
  void edge(const sim::Edge& edge) override {
    using sim::Signal;
    if (edge.signal == (common_dir_ ? Signal::kCommonDir : Signal::kDir)) {
      right_[edge.index] = edge.level;
    } else if (edge.signal == Signal::kStep && edge.level) {
      position[edge.index] += right_[common_dir_ ? 0 : edge.index] ? 1 : -1;
      ++together[edge.time_ns];
    }
  }
  void settled(sim::TimeNs) override {}

  std::map<int, std::int64_t> position;
  std::map<sim::TimeNs, int> together;  // pulses that begin at once

 private:
  bool common_dir_;
  std::map<int, bool> right_;
};

// An MCU of four motors with these keys.
std::string four_with(const std::string& manner, const std::string& keys) {
  return with_mcu_keys(hall(1, 4, manner), keys);
}

struct Mode {
  const char* name;
  const char* keys;
  int most_together;
};

class EmissionModes : public testing::TestWithParam<Mode> {};
INSTANTIATE_TEST_SUITE_P(
    All, EmissionModes,
    testing::Values(Mode{"even", "pulse_us = 4\ndir_setup_us = 20\n", 4},
                    Mode{"burst", "steps = \"burst\"\nstep_us = 320\n", 4},
                    Mode{"common", "direction = \"common\"\nsteps = \"burst\"\nstep_us = 320\n", 2},
                    Mode{"staggered", "steps = \"staggered\"\nstep_us = 320\nsettle_us = 100\n", 1},
                    Mode{"both",
                         "direction = \"common\"\nsteps = \"staggered\"\nstep_us = 320\n"
                         "settle_us = 100\n",
                         1}),
    [](const auto& p) { return std::string(p.param.name); });

TEST_P(EmissionModes, MovesReachTheirTargetsAndNoStepIsLost) {
  for (const char* manner : {"coarse", "fine", "fine_table"}) {
    Drivers drivers(std::string_view(GetParam().keys).find("common") != std::string_view::npos);
    ReadyLab lab(four_with(manner, GetParam().keys), {}, &drivers);
    const std::map<std::string, std::int64_t> moves = {
        {"m01", 700}, {"m02", -700}, {"m03", 90}, {"m04", -1}};
    std::vector<std::string> names;
    std::vector<std::int64_t> steps;
    for (const auto& [name, distance] : moves) {
      names.push_back(name);
      steps.push_back(distance);
    }
    EXPECT_THAT(lab.ask(Ask::kMoveBy, names, steps), Ends("reached"));
    int most = 0;
    for (const auto& [time, count] : drivers.together) most = std::max(most, count);
    EXPECT_LE(most, GetParam().most_together) << manner;
    const auto number = lab.send(Ask::kMoveBy, {"m01", "m02"}, {-5000, 5000});
    lab.run_for(1.5);
    lab.send(Ask::kStop, {"m01", "m02"});
    EXPECT_EQ(lab.wait(number).result, "stopped");
    for (int m = 0; m < 4; ++m) {
      const std::int64_t reported = lab.motor(names[static_cast<std::size_t>(m)]).position_steps;
      EXPECT_EQ(drivers.position[m], reported) << names[static_cast<std::size_t>(m)];
      EXPECT_EQ(lab.shaft_steps(names[static_cast<std::size_t>(m)]), reported);
    }
    EXPECT_EQ(drivers.position[2], 90);
    const bool told = lab.move_lines().front().find("\"emission\":") != std::string::npos;
    EXPECT_EQ(told, std::string_view(GetParam().name) != "even") << lab.move_lines().front();
  }
}

class EmissionStaggered : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Direction, EmissionStaggered, testing::Values("own", "common"),
                         [](const auto& p) { return std::string(p.param); });

TEST_P(EmissionStaggered, SupplyCurrentIsMeasuredBeforeTheMcuIsReady) {
  const std::string direction = "direction = \"" + std::string(GetParam()) + "\"\n";
  Drivers drivers(std::string_view(GetParam()) == "common");
  ReadyLab lab(four_with("fine", direction + "steps = \"staggered\"\nstep_us = 320\n"
                                             "settle_us = \"measured\"\n"),
               {}, &drivers);
  EXPECT_EQ(drivers.position[0], 0) << "to and fro, as drivers see it";
  EXPECT_NEAR(lab.bus(0).mcu(0).core().emission.of.settle.of.step.back_ns, 518'000, 60'000);
  EXPECT_EQ(lab.motor("m01").position_steps, 0);
  EXPECT_EQ(lab.bus(0).mcu(0).shaft(0).travel_steps, 2u) << "a step and its way back";
  const Answer result = lab.ask(Ask::kMoveBy, {"m01", "m02"}, {300, -300});
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 300);
}

TEST_P(EmissionStaggered, NothingMovesToBeMeasuredUnlessThatIsAskedFor) {
  const std::string direction = "direction = \"" + std::string(GetParam()) + "\"\n";
  ReadyLab lab(four_with("fine", direction + "steps = \"staggered\"\nstep_us = 320\n"));
  lab.run_for(0.5);
  for (int m = 0; m < 4; ++m) EXPECT_EQ(lab.bus(0).mcu(0).shaft(m).travel_steps, 0u) << m;
  const Answer result = lab.ask(Ask::kMoveBy, {"m01", "m02"}, {300, -300});
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.bus(0).mcu(0).shaft(0).travel_steps, 300u);
  EXPECT_EQ(lab.bus(0).mcu(0).shaft(1).travel_steps, 300u);
}

TEST(EmissionPhases, MovesTurnTheWindings) {
  class Windings final : public sim::EdgeSink {
   public:
    void edge(const sim::Edge& edge) override {
      if (edge.signal != sim::Signal::kStep) return;
      levels_[edge.index] = edge.level;
      // Half steps switch one winding at a time.
      static const std::vector<int> kSequence = {1, 3, 2, 6, 4, 12, 8, 9};
      const int motor = edge.index / 4;
      int now = 0;
      for (int i = 0; i < 4; ++i) now |= levels_[4 * motor + i] ? 1 << i : 0;
      const auto found = std::find(kSequence.begin(), kSequence.end(), now);
      if (found == kSequence.end()) return;  // off
      const auto index = static_cast<int>(found - kSequence.begin());
      const int turned = (index - index_[motor] + 12) % 8 - 4;
      EXPECT_LE(std::abs(turned), 1);
      position[motor] += turned;
      index_[motor] = index;
    }
    void settled(sim::TimeNs) override {}
    std::map<int, std::int64_t> position;

   private:
    std::map<int, bool> levels_;
    std::map<int, int> index_;
  };
  for (const char* manner : {"coarse", "fine", "fine_table"}) {
    Windings windings;
    ReadyLab lab(four_with(manner, "steps = \"phases\"\nphase_sequence = \"half\"\n"), {},
                 &windings);
    for (const std::int64_t steps : {500, -37, -600}) {
      const Answer result = lab.ask(Ask::kMoveBy, {"m01", "m04"}, {steps, -steps});
      EXPECT_EQ(result.result, "reached") << result.reason;
    }
    EXPECT_EQ(windings.position[0], -137);
    EXPECT_EQ(windings.position[3], 137);
  }
}

// What the windings of the first motor are when all edges of a moment have been made.
class Levels final : public sim::EdgeSink {
 public:
  void edge(const sim::Edge& edge) override {
    if (edge.signal != sim::Signal::kStep || edge.index >= 4) return;
    const int winding = 1 << edge.index;
    now_ = edge.level ? now_ | winding : now_ & ~winding;
  }
  void settled(sim::TimeNs) override {
    if (seen.empty() || seen.back() != now_) seen.push_back(now_);
  }
  std::vector<int> seen;

 private:
  int now_ = 0;
};

TEST(EmissionPhases, AnotherSequenceInOperationIsThatOfTheNextMoves) {
  Levels levels;
  ReadyLab lab(four_with("fine", "steps = \"phases\"\n"), {}, &levels);
  const auto move = [&](std::int64_t steps) {
    levels.seen.clear();
    const Answer result = lab.ask(Ask::kMoveBy, {"m01"}, {steps});
    EXPECT_EQ(result.result, "reached") << result.reason;
    return levels.seen;
  };
  EXPECT_THAT(move(5), testing::IsSupersetOf({3, 6, 12, 9}));
  const auto change = [&](const char* sequence) {
    EXPECT_THAT(lab.ask(api::Configure{.kind = api::Configure::Kind::kChange,
                                       .changes = {{"m04", "phase_sequence", sequence}}}),
                Ends("done"));
    EXPECT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
    EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "done");
  };
  change("half");
  EXPECT_EQ(move(8), (std::vector<int>{1, 3, 2, 6, 4, 12, 8, 9, 1}));
  change("wave");
  EXPECT_EQ(move(4), (std::vector<int>{1, 2, 4, 8, 1}));
}

TEST(EmissionSettings, WhatTheMcuCannotKeepIsNamedWithKeyAndLine) {
  Lab lab(four_with("fine", "dir_setup_us = 5\npulse_us = 5\n"));
  lab.run_for(3);
  EXPECT_THAT(lab.state_of("hall:1").detail,
              testing::HasSubstr("bushd.toml:14:12: mcu[0].pulse_us: is 5 us, longer than the STEP "
                                 "pulses of this MCU; allowed: 4.9 us, half a slot of this MCU"));
}

TEST(EmissionSettings, ADaemonWithOtherSettingsChangesThem) {
  ReadyLab lab(four_with("coarse", "steps = \"burst\"\nstep_us = 320\n"));
  EXPECT_EQ(lab.bus(0).mcu(0).core().emission.settings.mode, BUSHD_EMISSION_BURST);
  lab.restart_daemon();
  lab.connect();
  EXPECT_EQ(lab.bus(0).mcu(0).core().emission.settings.step_us, 320);
}

}  // namespace
}  // namespace bushd::test
