// Drivers that are disabled after a rest, and enabled again before motors move.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bus/bus_times.h"
#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr sim::TimeNs kMs = 1'000'000;
// What a pin does, the daemon hears at the next poll, and what it does about that is at the pins
// within another poll's time: an exchange, and the few ticks by which frames are ahead.
constexpr sim::TimeNs kAnswered = 2 * fieldbus::kPollPeriodUs * 1000;

// When EN of the first MCU changed, and when its motors made steps.
class Pins final : public sim::EdgeSink {
 public:
  void edge(const sim::Edge& edge) override {
    if (edge.mcu != 0) return;
    if (edge.signal == sim::Signal::kEnable) enabled = edge.level;
    if (edge.signal == sim::Signal::kEnable) (edge.level ? on_ns : off_ns) = edge.time_ns;
    if (edge.signal != sim::Signal::kStep || !edge.level) return;
    if (first_step_ns < on_ns) first_step_ns = edge.time_ns;
    last_step_ns = edge.time_ns;
    if (!enabled) ++steps_without;
  }
  void settled(sim::TimeNs) override {}

  bool enabled = false;
  sim::TimeNs on_ns = 0;
  sim::TimeNs off_ns = 0;
  sim::TimeNs first_step_ns = 0;  // since it was enabled
  sim::TimeNs last_step_ns = 0;
  int steps_without = 0;
};

const std::string kIdle = "idle_disable_s = 0.5\nenable_settle_ms = 250\n";

// It has to be there before the lab is made.
struct WithPins {
  Pins pins;
};

struct IdleLab : WithPins, Lab {
  explicit IdleLab(bool kept, const std::string& toml = with_mcu_keys(hall(1, 2), kIdle))
      : Lab(toml, {}, &pins) {
    if (kept) keep_positions();
    connect();
  }
  ~IdleLab() override { EXPECT_EQ(pins.steps_without, 0); }
  void fall_asleep() {
    ASSERT_TRUE(run_until([this] { return !pins.enabled; }, 2));
    run_for(0.1);
    EXPECT_FALSE(motor("m01").enabled);
  }
  Answer move(const std::string& motor, std::int64_t steps) {
    return ask(Ask::kMoveBy, {motor}, {steps});
  }
};

// With a store, and without.
class IdleDrivers : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Store, IdleDrivers, testing::Bool());

TEST_P(IdleDrivers, AreDisabledAfterARestAndEnabledBeforeTheNextStep) {
  IdleLab lab(GetParam());
  EXPECT_EQ(lab.move("m01", 100).result, "reached");
  lab.fall_asleep();
  const sim::TimeNs rest_ns = lab.pins.off_ns - lab.pins.last_step_ns;
  EXPECT_GE(rest_ns, 500 * kMs);
  EXPECT_LE(rest_ns, 500 * kMs + kAnswered);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown) << "disabling alone loses no steps";
  EXPECT_EQ(lab.state_of("hall:1").detail, "drivers disabled at rest");
  EXPECT_THAT(lab.move("m02", -60), Ends("reached"));
  EXPECT_GE(lab.pins.first_step_ns - lab.pins.on_ns, 250 * kMs);
  // First frames are sent two polls' time ahead (link::Horizon), and the first step takes 10 ms.
  EXPECT_LE(lab.pins.first_step_ns - lab.pins.on_ns, 250 * kMs + kAnswered + 100 * kMs + 10 * kMs);
  EXPECT_EQ(lab.shaft_steps("m02"), -60);
  lab.fall_asleep();
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST_P(IdleDrivers, AreDisabledAtOnceAfterTheLastMotionIfAskedFor) {
  IdleLab lab(GetParam(),
              with_mcu_keys(hall(1, 2), "idle_disable_s = 0\nenable_settle_ms = 250\n"));
  lab.fall_asleep();
  const auto first = lab.send(Ask::kMoveBy, {"m01"}, {400});
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {-40}).result, "reached");
  EXPECT_TRUE(lab.pins.enabled) << "the other one moves";
  EXPECT_THAT(lab.wait(first), Ends("reached"));
  lab.fall_asleep();
  EXPECT_LE(lab.pins.off_ns - lab.pins.last_step_ns, kAnswered);
  EXPECT_EQ(lab.shaft_steps("m01"), 400);
  EXPECT_EQ(lab.shaft_steps("m02"), -40);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  // Again and again, each time from drivers that are off.
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(lab.move("m02", 5).result, "reached");
    EXPECT_GE(lab.pins.first_step_ns - lab.pins.on_ns, 250 * kMs);
    lab.fall_asleep();
  }
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(IdleDriversAtOnce, LetTheMcuMeasureItsSupplyCurrentFirst) {
  ReadyLab lab(with_mcu_keys(hall(1, 2),
                             "idle_disable_s = 0\nsteps = \"staggered\"\nstep_us = 320\n"
                             "settle_us = \"measured\"\n"));
  lab.run_for(1);
  EXPECT_EQ(lab.bus(0).mcu(0).shaft(0).travel_steps, 2u) << "a step and its way back";
  EXPECT_FALSE(lab.motor("m01").enabled);
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m01"}, {30}), Ends("reached"));
}

TEST_P(IdleDrivers, StayEnabledWhileAMotorMovesOrWaits) {
  IdleLab lab(GetParam());
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {4000});
  lab.run_for(2);
  EXPECT_TRUE(lab.pins.enabled);
  EXPECT_FALSE(lab.has_result(move));
  EXPECT_EQ(lab.wait(move).result, "reached");
  for (int i = 0; i < 4; ++i) {
    lab.run_for(0.4);
    EXPECT_EQ(lab.move("m02", 5).result, "reached");
  }
  EXPECT_EQ(lab.pins.off_ns, 0);
  const auto arm = lab.send(api::Arm{.delay_us = 100, .motors = {{"m01", 10}}});
  lab.run_for(2);
  EXPECT_TRUE(lab.pins.enabled);
  EXPECT_EQ(lab.ask(Ask::kDisarm, {}).result, "done");
  EXPECT_EQ(lab.wait(arm).result, "stopped");
}

TEST_P(IdleDrivers, AreEnabledForHomingAndForMovesThatWaitForTheTrigger) {
  IdleLab lab(GetParam(),
              with_keys(with_mcu_keys(hall(1, 2), kIdle), "m01",
                        "home = { direction = \"negative\", most_steps = 900, then = 5 }\n"));
  lab.bus(0).mcu(0).attach_switch(0, {.at_steps = -100});
  lab.fall_asleep();
  EXPECT_THAT(lab.ask(Ask::kHome, {"m01"}), Ends("reached"));
  EXPECT_GE(lab.pins.first_step_ns - lab.pins.on_ns, 250 * kMs);
  lab.fall_asleep();
  const auto arm = lab.send(api::Arm{.delay_us = 100, .motors = {{"m02", 10}}});
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m02").activity == api::Activity::kArmed; }, 2));
  EXPECT_TRUE(lab.pins.enabled);
  lab.bus(0).mcu(0).set_inputs({0, BUSHD_INPUT_TRIGGER});
  EXPECT_EQ(lab.wait(arm).result, "reached");
}

TEST_P(IdleDrivers, ThatPeopleDisableStayDisabled) {
  IdleLab lab(GetParam());
  for (const bool asleep : {false, true}) {
    if (asleep) lab.fall_asleep();
    EXPECT_EQ(lab.ask(Ask::kDisable, {"m01"}).result, "done");
    EXPECT_THAT(lab.move("m01", 5), Ends("refused", "are disabled; run 'bushctl enable m0"));
    EXPECT_EQ(lab.ask(Ask::kEnable, {"m01"}).result, "done");
    EXPECT_TRUE(lab.pins.enabled);
    EXPECT_EQ(lab.move("m01", 5).result, "reached");
    EXPECT_GE(lab.pins.first_step_ns - lab.pins.on_ns, 250 * kMs) << "they settle in any case";
  }
  lab.fall_asleep();
  EXPECT_EQ(lab.ask(Ask::kEnable, {"m01"}).result, "done");
  lab.run_for(0.4);
  EXPECT_TRUE(lab.pins.enabled);
  lab.fall_asleep();
}

TEST_P(IdleDrivers, AreDisabledWhileBeingEnabledAndStoppedMeanwhile) {
  IdleLab lab(GetParam());
  lab.fall_asleep();
  auto move = lab.send(Ask::kMoveBy, {"m01"}, {50});
  lab.run_for(0.1);
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
  EXPECT_THAT(lab.last_reply(move).reason, HasSubstr("nothing has moved"));
  lab.fall_asleep();
  move = lab.send(Ask::kMoveBy, {"m01"}, {50});
  lab.run_for(0.1);
  EXPECT_EQ(lab.ask(Ask::kDisable, {"m01"}).result, "done");
  EXPECT_THAT(lab.wait(move).reason, HasSubstr("disabled; run 'bushctl enable m0"));
  EXPECT_EQ(lab.replies(move).size(), 1u);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST_P(IdleDrivers, AtAnyMomentEachMoveIsMade) {
  for (int ms = 480; ms < 620; ms += 7) {
    IdleLab lab(GetParam());
    EXPECT_EQ(lab.move("m01", 1).result, "reached");
    lab.run_for(0.001 * ms);
    const Answer answer = lab.move("m01", 20);
    EXPECT_EQ(answer.result, "reached") << ms << ": " << answer.reason;
    EXPECT_EQ(lab.shaft_steps("m01"), 21) << ms;
    EXPECT_THAT(lab.errors(), IsEmpty());
    EXPECT_EQ(lab.pins.steps_without, 0);
  }
}

TEST_P(IdleDrivers, OfAnMcuThatRestartsAreEnabledWhenItsMotorsMove) {
  IdleLab lab(GetParam());
  lab.fall_asleep();
  lab.bus(0).reboot(0);
  lab.run_for(3);
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "done");
  EXPECT_EQ(lab.move("m01", 20).result, "reached");
}

TEST_P(IdleDrivers, ADryRunLeavesThemAsTheyAre) {
  IdleLab lab(GetParam());
  lab.fall_asleep();
  api::Move move{.motors = {{"m01", 100}}};
  move.dry_run = true;
  EXPECT_EQ(lab.ask(move).result, "done");
  EXPECT_FALSE(lab.pins.enabled);
}

TEST_P(IdleDrivers, StayEnabledForAMotorThatSaysSo) {
  IdleLab lab(GetParam(),
              with_keys(with_mcu_keys(hall(1, 2), kIdle), "m01", "never_disable = true\n"));
  lab.run_for(3);
  EXPECT_TRUE(lab.pins.enabled);
  EXPECT_EQ(lab.pins.off_ns, 0);
}

}  // namespace
}  // namespace bushd::test
