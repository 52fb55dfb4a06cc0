// Emergency stops: every motor stops within two ticks, nothing moves until people say so, and what
// is not known any more is not claimed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

std::string emergency_hall(int mcus, int motors, const std::string& manner, bool immediate) {
  std::string toml = hall(mcus, motors, manner);
  return toml.insert(toml.find("[[group]]"), immediate ? "emergency_stop = \"immediate\"\n" : "");
}

class Emergency : public testing::TestWithParam<std::tuple<const char*, bool>> {
 protected:
  const std::string manner = std::get<0>(GetParam());
  const bool immediate = std::get<1>(GetParam());
  Lab lab{emergency_hall(2, 2, manner,
                         immediate)};  // m01, m02 on the first MCU, m03, m04 on the second
};
INSTANTIATE_TEST_SUITE_P(Manners, Emergency,
                         testing::Combine(testing::Values("fine", "fine_table", "coarse_table"),
                                          testing::Bool()),
                         [](const auto& p) {
                           return std::string(std::get<0>(p.param)) +
                                  (std::get<1>(p.param) ? "_immediate" : "_ramp");
                         });

TEST_P(Emergency, AllMotorsStopAndStayUntilCleared) {
  lab.connect();
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m03"}, {20000, -20000});
  lab.run_for(1.5);
  const std::int64_t at = lab.shaft_steps("m01");
  const auto stop = lab.send(Ask::kEmergencyStop, {});
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kMoveBy, {"m02"}, {5})).result, "refused");
  const Answer done = lab.wait(stop);
  EXPECT_EQ(done.result, "done") << done.reason;
  const Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("stopped", "emergency stop"));
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_EQ(lab.shaft_steps("m03"), result.position_steps.at(1));
  if (immediate) {
    EXPECT_LE(lab.shaft_steps("m01") - at, 60) << "a few ticks at 2500 steps/s";
  } else {
    EXPECT_GT(lab.shaft_steps("m01") - at, 100) << "the table's ramp";
  }
  EXPECT_EQ(lab.motor("m01").trust, immediate ? api::Trust::kUncertain : api::Trust::kKnown);
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kKnown) << "it did not move";
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kFault);
  EXPECT_THAT(lab.state_of("hall:2").detail, HasSubstr("emergency stop"));

  // Neither time nor a lost link nor a new daemon lifts it.
  lab.run_for(3);
  lab.unplug(0, 1);
  lab.run_for(2);
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kFault);
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m02"}, {5})).reason,
              HasSubstr("bushctl clear"));
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {5}).result, "reached");
  const auto again = lab.send(Ask::kMoveBy, {"m01"}, {5});
  if (immediate) {
    EXPECT_THAT(lab.last_reply(again).reason, HasSubstr("may have overrun"));
    EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "done");
  } else {
    EXPECT_EQ(lab.wait(again).result, "reached");
  }
}

TEST_P(Emergency, BeforeTheStartNoStepIsMade) {
  lab.connect();
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {500});
  lab.run_for(0.002);
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  EXPECT_EQ(lab.wait(move).result, "stopped");
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

TEST_P(Emergency, IsHeardThoughTheFirstWritesAreLost) {
  lab.connect();
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m03"}, {20000, 20000});
  lab.run_for(1.5);
  int writes = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) { return ++writes > 3; };
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_LT(lab.shaft_steps("m01"), 6000);
}

TEST_P(Emergency, IsNotLiftedByAClearThatWasUnderWay) {
  lab.connect();
  for (int ms = 0; ms < 60; ms += 7) {
    SCOPED_TRACE(ms);
    ASSERT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
    const auto clear = lab.send(Ask::kClearFaults, {});
    lab.run_for(ms * 1e-3);
    ASSERT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
    lab.wait(clear);
    lab.run_for(0.5);
    ASSERT_EQ(lab.state_of("hall:1").state, api::McuState::kFault);
    ASSERT_EQ(lab.state_of("hall:2").state, api::McuState::kFault);
  }
}

TEST_P(Emergency, HeardByAnMcuThatIsBeingConfiguredStaysLatched) {
  int seen = 0;
  for (int ms = 0; ms < 400; ms += 9) {
    Lab fresh{emergency_hall(1, 2, manner, immediate)};
    fresh.run_for(ms * 1e-3);
    if (!fresh.has_state("hall:1")) continue;
    if (fresh.state_of("hall:1").detail != "being configured") continue;
    SCOPED_TRACE(ms);
    ++seen;
    ASSERT_EQ(fresh.ask(Ask::kEmergencyStop, {}).result, "done");
    fresh.run_for(2);
    ASSERT_EQ(fresh.state_of("hall:1").state, api::McuState::kFault);
  }
  EXPECT_GT(seen, 5);
}

TEST_P(Emergency, IsTakenWhateverElseIsWrong) {
  // Nobody is online yet, and a motor is named that is none.
  EXPECT_THAT(lab.ask(Ask::kEmergencyStop, {"nobody"}), Ends("done", "hall:1 hall:2"));
}

TEST_P(Emergency, AnMcuThatIsLostEndsItsMovesWithLink) {
  lab.connect();
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(1.5);
  lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
  const auto stop = lab.send(Ask::kEmergencyStop, {});
  EXPECT_EQ(lab.wait(move).result, "link");
  EXPECT_THAT(lab.wait(stop).reason, HasSubstr("hall:"));
}

std::string disabling_hall(const std::string& keys_of_mcu = "") {
  std::string toml = with_mcu_keys(hall(1, 2), keys_of_mcu);
  return toml.insert(toml.find("[[group]]"), "emergency_stop = \"disable\"\n");
}

void expect_disabled_until_cleared_and_enabled(Lab& lab) {
  EXPECT_FALSE(lab.motor("m02").enabled);
  const Answer still = lab.ask(Ask::kEnable, {});
  EXPECT_THAT(still, Ends("fault", "emergency stop, its drivers are disabled"));
  EXPECT_THAT(still.reason, HasSubstr("run 'bushctl clear', then 'bushctl enable'"));
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  lab.run_for(0.1);
  EXPECT_FALSE(lab.motor("m02").enabled);
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m02"}, {5})).reason, HasSubstr("enable"));
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m02"), 0);
  EXPECT_EQ(lab.ask(Ask::kEnable, {}).result, "done");
  // A daemon that has just begun does not know whether it moved.
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m02"}, {0}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {5}).result, "reached");
}

TEST(EmergencyThatDisables, TakesThePowerAndSaysSo) {
  for (const bool restarts : {false, true}) {
    SCOPED_TRACE(restarts);
    ReadyLab lab(disabling_hall());
    const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
    lab.run_for(1.5);
    EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
    const Answer result = lab.wait(move);
    EXPECT_THAT(result, Ends("stopped", "by an emergency stop, which disabled its drivers"));
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
    EXPECT_EQ(lab.motor("m01").uncertain_reason,
              "its drivers were disabled by an emergency stop while it moved");
    EXPECT_EQ(lab.motor("m02").trust, api::Trust::kKnown) << "it did not move";
    lab.unplug(0, 1);
    lab.run_for(3);
    if (restarts) lab.restart_daemon();
    ASSERT_TRUE(lab.mcu_comes_to("hall:1", api::McuState::kFault));
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
    EXPECT_THAT(lab.state_of("hall:1").detail, HasSubstr("its drivers are disabled"));
    expect_disabled_until_cleared_and_enabled(lab);
  }
}

// Drivers that are disabled at rest are enabled before the next move: not any more.
TEST(EmergencyThatDisables, EndsTheSleepOfDriversAtRest) {
  ReadyLab lab(disabling_hall("idle_disable_s = 0\n"));
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m02").enabled; }));
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  lab.run_for(0.1);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  expect_disabled_until_cleared_and_enabled(lab);
}

}  // namespace
}  // namespace bushd::test
