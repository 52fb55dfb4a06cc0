// Motors that are held stay held over restarts of the daemon and power cuts of the PC, and say by
// whom and since when.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

struct HoldLab : Lab {
  explicit HoldLab(const std::string& toml = hall(1, 2), bool kept = true) : Lab(toml) {
    if (kept) keep_positions();
    connect();
  }
  void reconnect() {
    ASSERT_TRUE(run_until([this] { return all_ready(); }, 20));
    run_for(0.1);
  }
  std::string refusal_of(const std::string& motor) {
    const Answer answer = ask(Ask::kMoveBy, {motor}, {10});
    EXPECT_EQ(answer.result, "refused");
    return answer.reason;
  }
  void expect_moves(const std::string& motor) {
    EXPECT_EQ(ask(Ask::kMoveBy, {motor}, {10}).result, "reached");
  }
  std::vector<std::string> past(const std::string& motor) {
    const auto number = send(api::GetHistory{.motor = motor, .most = 10});
    wait(number);
    std::vector<std::string> lines;
    for (const api::PastMotion& motion : history(number)) {
      lines.push_back(motion.what + " by " + motion.who + ": " + motion.outcome);
    }
    return lines;
  }
};

TEST(KeptHolds, OutliveTheDaemonAndThePowerOfThePc) {
  HoldLab lab;
  // Wall clock and virtual time are the same here: a time of day without its seconds.
  EXPECT_EQ(lab.wait(lab.send_as("panel", api::Hold{{"m01"}})).reason, "held: 1 motor");
  const std::string why = lab.refusal_of("m01");
  EXPECT_THAT(why, AllOf(HasSubstr("m01: it is held by panel"), HasSubstr(" since 1970-01-01 00:"),
                         HasSubstr(" UTC; run 'bushctl release m01'")));
  for (const bool power_cut : {false, true}) {
    SCOPED_TRACE(power_cut);
    lab.run_for(60);
    power_cut ? lab.cut_pc_power() : lab.restart_daemon();
    lab.reconnect();
    EXPECT_TRUE(lab.motor("m01").held);
    EXPECT_FALSE(lab.motor("m02").held);
    EXPECT_EQ(lab.refusal_of("m01"), why) << "by whom and since when it was held first";
    lab.expect_moves("m02");
  }
  // A release is kept as well.
  EXPECT_EQ(lab.ask(api::Release{}).reason, "released: 1 motor");
  lab.cut_pc_power();
  lab.reconnect();
  EXPECT_FALSE(lab.motor("m01").held);
  lab.expect_moves("m01");
  EXPECT_THAT(lab.past("m01"), AllOf(Contains(AllOf(HasSubstr("hold by "), HasSubstr("panel"))),
                                     Contains(HasSubstr("release by "))));
}

TEST(KeptHolds, SomebodyElsesHoldDoesNotHideWhoWasFirst) {
  HoldLab lab;
  lab.wait(lab.send_as("panel", api::Hold{{"m01"}}));
  const std::string why = lab.refusal_of("m01");
  lab.run_for(5);
  EXPECT_EQ(lab.ask(api::Hold{{"m01", "m02"}}).reason, "held: 2 motors");
  EXPECT_EQ(lab.refusal_of("m01"), why);
  EXPECT_THAT(lab.refusal_of("m02"), HasSubstr("it is held by test"));
}

TEST(KeptHolds, AreNotKeptWithoutAStore) {
  HoldLab lab(hall(1, 2), false);
  EXPECT_EQ(lab.ask(api::Hold{{"m01"}}).reason, "held: 1 motor");
  lab.restart_daemon();
  lab.reconnect();
  EXPECT_FALSE(lab.motor("m01").held);
}

// Whoever is told that a motor is held, or is not any more, finds it so after a power cut.
TEST(KeptHolds, AreAnsweredWhenTheDiskHasThem) {
  HoldLab lab;
  lab.disk_us = 100'000;
  for (const bool hold : {true, false}) {
    SCOPED_TRACE(hold);
    const std::vector<std::string> motors{"m01"};
    const auto asked = hold ? lab.send(api::Hold{motors}) : lab.send(api::Release{motors});
    lab.run_for(0.05);
    EXPECT_FALSE(lab.has_result(asked));
    EXPECT_EQ(lab.motor("m01").held, hold) << "it counts at once";
    EXPECT_EQ(lab.wait(asked).result, "done");
    lab.cut_pc_power();
    lab.reconnect();
    EXPECT_EQ(lab.motor("m01").held, hold);
  }
}

TEST(KeptHolds, ADiskThatDoesNotTakeThemIsTold) {
  HoldLab lab;
  lab.disk_us = 10'000'000;
  const Answer answer = lab.ask(api::Hold{{"m01"}});
  EXPECT_EQ(answer.result, "fault");
  EXPECT_THAT(answer.reason, AllOf(HasSubstr("held: 1 motor"), HasSubstr("is not on the disk")));
  EXPECT_TRUE(lab.motor("m01").held);
}

// One that comes back later is another one, of which nobody has said that it is to be held.
TEST(KeptHolds, OfMotorsThatAreNotConfiguredAnyMoreAreDropped) {
  HoldLab lab;
  lab.ask(api::Hold{});
  lab.use_configuration(hall(1, 1));
  lab.reconnect();
  EXPECT_THAT(lab.warnings(), Contains(AllOf(HasSubstr("m02 is not configured any more"),
                                             HasSubstr("held by test since "))));
  EXPECT_TRUE(lab.motor("m01").held);
  lab.use_configuration(hall(1, 2));
  lab.reconnect();
  EXPECT_TRUE(lab.motor("m01").held);
  EXPECT_FALSE(lab.motor("m02").held);
}

// Nobody knows then which motors were held; homing, for one, moves motors of uncertain positions.
TEST(KeptHolds, AllMotorsAreHeldWhenTheStoreIsDamagedOrGone) {
  for (const bool damaged : {true, false}) {
    SCOPED_TRACE(damaged);
    HoldLab lab;
    lab.ask(api::Hold{{"m01"}});
    lab.restart_daemon([&] {
      if (damaged) return lab.disk().content("/state/state.db").resize(4096);
      EXPECT_TRUE(lab.disk().remove("/state/state.db"));
    });
    // After one more restart as well, when the store is a good one again.
    for (int i = 0; i < 2; ++i) {
      if (i > 0) lab.restart_daemon();
      lab.reconnect();
      for (const char* motor : {"m01", "m02"}) {
        EXPECT_TRUE(lab.motor(motor).held);
        EXPECT_THAT(lab.ask(api::Jog{.motor = motor, .per_s = 100, .in_steps = true}).reason,
                    AllOf(HasSubstr("it is held by bushd since "), HasSubstr("state.db"),
                          HasSubstr("run 'bushctl release ")));
      }
    }
    EXPECT_EQ(lab.ask(api::Release{}).reason, "released: 2 motors");
    lab.restart_daemon();
    lab.reconnect();
    EXPECT_FALSE(lab.motor("m02").held);
  }
}

TEST(KeptHolds, NobodyHoldsNewMotors) {
  HoldLab lab(hall(1, 1));
  lab.use_configuration(hall(1, 2));
  lab.reconnect();
  EXPECT_FALSE(lab.motor("m01").held);
  EXPECT_FALSE(lab.motor("m02").held);
  EXPECT_THAT(lab.errors(), IsEmpty());
  EXPECT_THAT(lab.warnings(), Not(Contains(HasSubstr("held"))));
}

// Whenever the button is pressed: the MCU gets the motor with its configuration, or not at all.
TEST(KeptHolds, LocalInputsDoNotMoveTheMotorWhileTheMcuIsConnected) {
  const std::string toml = with_keys(hall(1, 1), "m01", "local = true\n");
  for (int ms = 0; ms < 400; ms += 4) {
    SCOPED_TRACE(std::to_string(ms) + " ms");
    HoldLab lab(toml);
    lab.ask(api::Hold{{"m01"}});
    // The MCU has forgotten who may move it.
    lab.bus(0).reboot(0);
    lab.restart_daemon();
    lab.run_for(ms * 1e-3);
    lab.bus(0).mcu(0).set_inputs({0, BUSHD_INPUT_FORWARD});
    lab.run_for(1);
    EXPECT_TRUE(lab.all_ready());
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
  }
}

}  // namespace
}  // namespace bushd::test
