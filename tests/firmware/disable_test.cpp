// Emergencies that disable the drivers: by command, and by the input, whose edge the port follows.
#include <memory>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr bushd_inputs kReleased{0, 0};
constexpr bushd_inputs kPressed{0, BUSHD_INPUT_EMERGENCY};

class Disabling : public Streams {
 protected:
  std::unique_ptr<Rig> ready(const InputSettings& settings = {}) const {
    auto made = std::make_unique<ReadyRig>(law, format, RigOptions{.queue_ticks = 256});
    EXPECT_EQ(made->set_inputs(settings), BUSHD_OK);
    return made;
  }
  std::unique_ptr<Rig> watching() const {
    return ready({.emergency = BUSHD_EMERGENCY_INPUT_DISABLE});
  }
  void start(Rig& on, int steps) const { ASSERT_EQ(on.start(law, steps), BUSHD_OK); }
  static void expect_cut(Rig& on, std::size_t prepared, std::uint8_t fault) {
    on.pass_until_rest();
    on.pass(3);
    for (std::size_t i = prepared; i < on.history(0).size(); ++i) EXPECT_EQ(on.history(0)[i], 0);
    const bushd_report report = on.poll();
    EXPECT_EQ(report.faults, fault | BUSHD_FAULT_DISABLED);
    EXPECT_EQ(report.flags & BUSHD_FLAG_ENABLED, 0);
    EXPECT_EQ(report.motor[0].position_steps, on.pulses(0));
    EXPECT_FALSE(on.enabled());
  }
  // Nothing enables them before the fault is cleared, and then somebody has to.
  void expect_off_until_cleared_and_enabled(Rig& on) const {
    EXPECT_EQ(on.control(BUSHD_CONTROL_ENABLE), BUSHD_E_STATE);
    EXPECT_FALSE(on.enabled());
    ASSERT_EQ(on.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
    EXPECT_EQ(on.poll().faults, 0);
    EXPECT_EQ(on.poll().state, BUSHD_STATE_BUSY);
    EXPECT_FALSE(on.enabled());
    ASSERT_EQ(on.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
    EXPECT_TRUE(on.enabled());
    const std::int64_t stands = on.pulses(0);
    start(on, 7);
    on.pass_until_rest();
    on.pass(3);
    EXPECT_EQ(on.pulses(0), stands + 7);
  }
};
BUSHD_IN_BOTH_FORMATS(Disabling);

TEST_P(Disabling, ACommandedStopTakesEnAwayWithItsFrame) {
  for (const int ticks : {0, 25}) {
    const auto on = ready();
    start(*on, 50);
    on->pass(ticks);
    ASSERT_TRUE(on->enabled());
    on->emergency(BUSHD_STOP_DISABLE);
    EXPECT_FALSE(on->enabled()) << "in the tick in which it came";
    expect_cut(*on, on->history(0).size() + 2, BUSHD_FAULT_EMERGENCY);
    expect_off_until_cleared_and_enabled(*on);
  }
}

TEST_P(Disabling, ACommandedStopAtRestTakesEnAwayToo) {
  const auto on = ready();
  on->emergency(BUSHD_STOP_DISABLE);
  expect_cut(*on, 0, BUSHD_FAULT_EMERGENCY);
  expect_off_until_cleared_and_enabled(*on);
}

TEST_P(Disabling, AModeThatIsNoneIsRefused) {
  const auto on = ready();
  EXPECT_EQ(on->take(BUSHD_MSG_EMERGENCY, {BUSHD_STOP_DISABLE + 1}), BUSHD_E_FORMAT);
  EXPECT_TRUE(on->enabled());
  EXPECT_EQ(on->poll().faults, 0);
}

TEST_P(Disabling, AFaultThatIsNotNamedKeepsThemOff) {
  const auto on = ready();
  on->emergency(BUSHD_STOP_DISABLE);
  ASSERT_EQ(on->clear(BUSHD_FAULT_EMERGENCY), BUSHD_OK);
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_DISABLED);
  EXPECT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_E_STATE);
  ASSERT_EQ(on->clear(BUSHD_FAULT_DISABLED), BUSHD_OK);
  EXPECT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
}

TEST_P(Disabling, TheInputStopsAllAndIsClearedWhenItIsReleased) {
  const auto on = watching();
  start(*on, 50);
  on->pass(25);
  on->pins(kPressed);
  on->pass();
  EXPECT_FALSE(on->enabled());
  expect_cut(*on, on->history(0).size() + 1, BUSHD_FAULT_EMERGENCY_INPUT);
  ASSERT_EQ(on->control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED)
      << "it is still pressed";
  on->pins(kReleased);
  expect_off_until_cleared_and_enabled(*on);
}

TEST_P(Disabling, ThePortFollowsTheEdgeWhileDriversAreEnabledForIt) {
  const auto on = watching();
  EXPECT_EQ(on->off_at(), BUSHD_EDGE_RISING);
  ASSERT_EQ(on->control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_EQ(on->off_at(), BUSHD_EDGE_NONE);
  ASSERT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(on->off_at(), BUSHD_EDGE_RISING);
  on->pins(kPressed);
  ASSERT_EQ(on->set_inputs({.system_inverted = BUSHD_INPUT_EMERGENCY,
                            .emergency = BUSHD_EMERGENCY_INPUT_DISABLE}),
            BUSHD_OK);
  EXPECT_EQ(on->off_at(), BUSHD_EDGE_NONE) << "what was pressed before the settings came counts";
  ASSERT_EQ(on->control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(on->off_at(), BUSHD_EDGE_FALLING);
  ASSERT_EQ(on->set_inputs({.emergency = BUSHD_EMERGENCY_INPUT_IGNORED}), BUSHD_OK);
  EXPECT_EQ(on->off_at(), BUSHD_EDGE_NONE);
  EXPECT_TRUE(on->enabled());
}

// The port says so until EN is written anew: a press must have been seen by then.
TEST_P(Disabling, APressOfThisTickIsNotLostToARequest) {
  for (const std::uint8_t action : {BUSHD_CONTROL_ENABLE, BUSHD_CONTROL_DISABLE}) {
    const auto on = watching();
    on->pins(kPressed);
    on->control(action);
    on->pins(kReleased);
    on->pass(2);
    EXPECT_FALSE(on->enabled());
    EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
  }
}

// Between the core's look and what it writes: the port does not raise EN, and goes on saying so.
TEST_P(Disabling, APressBehindTheLookIsSeenByTheNextOne) {
  for (const int looks : {1, 2}) {
    SCOPED_TRACE(looks);
    const auto on = watching();
    int left = looks;
    on->sense = [&] {
      if (--left == 0) on->press_shortly();
      return kReleased;
    };
    if (looks == 1) {
      EXPECT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_OK) << "it has not seen it";
    } else {
      on->pass(2);
    }
    EXPECT_FALSE(on->enabled());
    on->pass();
    EXPECT_FALSE(on->enabled());
    EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
    on->sense = nullptr;
    expect_off_until_cleared_and_enabled(*on);
  }
}

// Also one that ended before the frame came which writes EN.
TEST_P(Disabling, APressBeforeOutputsAreSetIsNotLost) {
  const auto on = watching();
  on->press_shortly();
  ASSERT_EQ(on->outputs({.step_low = 1, .direction_low = 0, .enabled = BUSHD_ENABLED_LOW}),
            BUSHD_OK);
  EXPECT_FALSE(on->enabled());
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
  EXPECT_EQ(on->control(BUSHD_CONTROL_ENABLE), BUSHD_E_STATE);
}

// What the port has latched is judged by the settings that it was for, whatever the next ones are.
TEST_P(Disabling, APressBeforeOtherSettingsCameIsNotLost) {
  for (const InputSettings& next : {InputSettings{.emergency = BUSHD_EMERGENCY_INPUT_IGNORED},
                                    InputSettings{.system_inverted = BUSHD_INPUT_EMERGENCY,
                                                  .emergency = BUSHD_EMERGENCY_INPUT_DISABLE}}) {
    const auto on = watching();
    // What the last read of the old settings is followed by: the port watches no more.
    on->sense = [&] {
      on->press_shortly();
      return kReleased;
    };
    on->press_shortly();
    ASSERT_EQ(on->set_inputs(next), BUSHD_OK);
    EXPECT_FALSE(on->enabled());
    EXPECT_EQ(on->off_at(), BUSHD_EDGE_NONE);
    on->sense = nullptr;
    EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
    EXPECT_EQ(on->poll().flags & BUSHD_FLAG_ENABLED, 0);
  }
}

TEST_P(Disabling, WithSettingsThatChangeThePortWatchesNoMoreWhenTheCoreLooks) {
  const auto on = watching();
  std::vector<bushd_edge> edges;
  on->sense = [&] {
    edges.push_back(on->off_at());
    return kReleased;
  };
  ASSERT_EQ(on->set_inputs({.emergency = BUSHD_EMERGENCY_INPUT_IGNORED}), BUSHD_OK);
  ASSERT_GE(edges.size(), 2u);
  EXPECT_EQ(edges.front(), BUSHD_EDGE_NONE) << "or a press behind this look would leave EN off";
  EXPECT_TRUE(on->enabled());
}

TEST_P(Disabling, WithAnInputThatRampedBeforeTheSettingsCameItTakesEnAway) {
  const auto on = ready({.emergency = BUSHD_EMERGENCY_INPUT_RAMP});
  on->pins(kPressed);
  on->pass(2);
  ASSERT_TRUE(on->enabled());
  ASSERT_EQ(on->set_inputs({.emergency = BUSHD_EMERGENCY_INPUT_DISABLE}), BUSHD_OK);
  on->pass();
  EXPECT_FALSE(on->enabled());
  EXPECT_EQ(on->poll().faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
}

}  // namespace
}  // namespace bushd::test
