#include "daemon/services/state_publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/bench.h"

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

}  // namespace
}  // namespace bushd::daemon
