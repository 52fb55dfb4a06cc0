#include "daemon/services/state_publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "daemon/bench.h"
#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::Bench;

TEST(StatePublisher, PublishesOnChangeButNotMoreOftenThanItMay) {
  Bench bench;
  const PseudoAxes none(bench.installation);
  const OpenMoves nobody(bench.installation);
  StatePublisher publisher(
      bench.installation, none, nobody, [](McuId) { return "scan runs"; }, bench);
  publisher.step(0);
  EXPECT_EQ(bench.states.size(), 2u) << "one for each MCU";
  EXPECT_EQ(bench.descriptions.size(), 2u);
  publisher.step(1000);
  EXPECT_EQ(bench.states.size(), 2u);
  bench.installation.changed = true;
  EXPECT_EQ(publisher.next_wake_us(), StatePublisher::kMinPeriodUs);
  publisher.step(1000);
  EXPECT_EQ(bench.states.size(), 2u);
  publisher.step(StatePublisher::kMinPeriodUs);
  EXPECT_EQ(bench.states.size(), 4u);
  publisher.step(StatePublisher::kMinPeriodUs + StatePublisher::kPeriodUs);
  EXPECT_EQ(bench.states.size(), 6u);
  EXPECT_EQ(bench.descriptions.size(), 2u) << "they have not changed";
  publisher.step(StatePublisher::kDescriptionPeriodUs);
  EXPECT_EQ(bench.descriptions.size(), 4u);
  EXPECT_EQ(bench.states.back().state, api::McuState::kOffline);
  EXPECT_EQ(bench.states.back().motors.at(0).name, "m03");
  EXPECT_EQ(bench.states.back().program, "scan runs");
}

// Three MCUs that move, of which two are told of each time: those that were left out first.
TEST(StatePublisher, TellsOfVeryManyThatMoveInTurns) {
  Bench bench(test::hall(3, 1));
  const PseudoAxes none(bench.installation);
  const OpenMoves nobody(bench.installation);
  StatePublisher publisher(bench.installation, none, nobody, [](McuId) { return ""; }, bench, 2);
  publisher.step(0);
  ASSERT_EQ(bench.states.size(), 3u);
  const std::vector<MotorId> all = *bench.installation.find_or_all({});
  for (const MotorId motor : all) {
    bench.installation[motor].give_to_mcu(motion::InProgram{});
  }
  std::map<std::string, int> told;
  for (int turn = 1; turn <= 30; ++turn) {
    bench.states.clear();
    publisher.step(turn * StatePublisher::kPeriodUs);
    EXPECT_EQ(bench.states.size(), 2u);
    for (const api::StateSnapshot& state : bench.states) ++told[state.mcu];
  }
  ASSERT_EQ(told.size(), 3u);
  for (const auto& [mcu, times] : told) EXPECT_EQ(times, 20) << mcu << ", of 30 * 2 / 3";
  bench.installation.changed = true;
  bench.states.clear();
  publisher.step(31 * StatePublisher::kPeriodUs);
  EXPECT_EQ(bench.states.size(), 3u) << "what a request has changed is told of all at once";
}

// Eight MCUs that move, one each time: a turn comes every 400 ms.
TEST(StatePublisher, TellsOfThoseThatMoveOutOfTurnWhenMoreThanPositionsChanges) {
  test::LiveBench bench(test::hall(8, 1));
  Service service;
  bench.connect(service);
  const PseudoAxes none(bench.installation);
  StatePublisher publisher(
      bench.installation, none, bench.open_moves, [](McuId) { return ""; }, bench, 1);
  for (int m = 1; m <= 8; ++m) bench.move(m, "m0" + std::to_string(m), 20'000);
  bench.run_for(1);
  const auto turn = [&] {
    bench.installation.changed = false;
    bench.states.clear();
    bench.run_for(0.05);
    publisher.step(bench.now_us());
  };
  turn();  // all, the first time
  turn();
  ASSERT_EQ(bench.states.size(), 1u);
  bench.installation[test::LiveBench::kBus].master.emergency_stop(BUSHD_STOP_RAMP);
  int turns = 0;
  do {
    turn();
    ++turns;
  } while (turns < 8 && bench.states.size() == 1);
  EXPECT_LE(turns, 3) << "a poll, its answers, and a time to tell";
  EXPECT_EQ(bench.states.size(), 8u);
}

class RestingMcu : public testing::Test {
 protected:
  RestingMcu() {
    bench.connect(service);
    publisher.publish_all(bench.now_us());
    bench.states.clear();
  }
  // For so long, as the core does it.
  std::size_t publish_for(std::int64_t us) {
    bench.states.clear();
    const std::int64_t until_us = bench.now_us() + us;
    while (bench.now_us() < until_us) {
      bench.run_for(0.005);
      publisher.step(bench.now_us());
    }
    return bench.states.size();
  }

  test::LiveBench bench;
  Service service;
  PseudoAxes none{bench.installation};
  OpenMoves nobody{bench.installation};
  std::string program;
  StatePublisher publisher{bench.installation, none, nobody, [this](McuId) { return program; },
                           bench};
};

TEST_F(RestingMcu, IsPublishedFiveTimesASecond) {
  const std::size_t mcus = bench.installation.mcus().size();
  publish_for(1'000'000);
  const std::size_t states = publish_for(10'000'000);
  EXPECT_GE(states, 40 * mcus);
  EXPECT_LE(states, 50 * mcus) << "a state takes many times as long as a look at its report";
}

TEST_F(RestingMcu, IsPublishedAtOnceWhenItsReportIsAnotherOne) {
  publish_for(1'000'000);
  bench.installation[McuId{0}].bus().control(bench.installation[McuId{0}].on_bus(),
                                             BUSHD_CONTROL_DISABLE);
  bench.installation.changed = false;
  const std::int64_t before_us = bench.now_us();
  const auto told = [&] {
    return std::ranges::any_of(bench.states, [](const api::StateSnapshot& state) {
      return state.detail == "drivers disabled";
    });
  };
  bench.states.clear();
  while (!told() && bench.now_us() < before_us + 1'000'000) {
    bench.run_for(0.005);
    publisher.step(bench.now_us());
  }
  EXPECT_LE(bench.now_us() - before_us, 150'000);
}

TEST_F(RestingMcu, IsPublishedWhenAnythingElseMayHaveChanged) {
  publish_for(1'000'000);
  publisher.look_anew();
  EXPECT_EQ(publish_for(StatePublisher::kPeriodUs + 5'000), bench.installation.mcus().size());
  EXPECT_LE(publisher.next_wake_us() - bench.now_us(),
            StatePublisher::kPeriodUs + StatePublisher::kSlackUs);
  program = "scan runs, frame 3";
  EXPECT_GE(publish_for(5 * StatePublisher::kPeriodUs), 4 * bench.installation.mcus().size())
      << "a program goes on without a report that tells of it";
}

}  // namespace
}  // namespace bushd::daemon
