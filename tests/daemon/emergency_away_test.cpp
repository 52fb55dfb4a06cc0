// An emergency stop binds also MCUs that are away when it is commanded: they are stopped before
// anything else when they come, until people have cleared it in them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "daemon/lab.h"
#include "daemon/pulse_ports.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kOffNs = 3'000'000'000;

// m01 and m02 on the first MCU, m03 and m04 on the second; m03 is homed whenever that comes.
std::string hall_with_homing() {
  return with_keys(hall(2, 2), "m03",
                   "home = { direction = \"negative\", most_steps = 6000, at_start = true }\n");
}

class EmergencyAway : public testing::Test {
 protected:
  explicit EmergencyAway(const std::string& toml = hall_with_homing()) : lab(toml) {}

  // Both are there, and the second one has been homed.
  void connect() {
    lab.bus(0).mcu(1).attach_switch(0, {.at_steps = -100, .hysteresis_steps = 4});
    lab.connect();
    ASSERT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }, 30));
    before = lab.shaft_steps("m03");
  }
  // The second one has no power for a while.
  void cut_power() {
    lab.bus(0).reboot(1, kOffNs);
    ASSERT_TRUE(lab.run_until([&] { return state() == api::McuState::kOffline; }));
  }
  api::McuState state() const {
    return lab.has_state("hall:2") ? lab.state_of("hall:2").state : api::McuState::kOffline;
  }
  void expect_bound() {
    ASSERT_TRUE(lab.run_until([&] { return state() == api::McuState::kFault; }, 10));
    EXPECT_THAT(lab.state_of("hall:2").detail, HasSubstr("emergency stop"));
    lab.run_for(3);
    EXPECT_EQ(lab.shaft_steps("m03"), before) << "it is not homed";
    const Answer refused = lab.last_reply(lab.send(Ask::kMoveBy, {"m04"}, {5}));
    EXPECT_THAT(refused, Ends("refused", "bushctl clear"));
  }
  void expect_free() {
    ASSERT_TRUE(lab.run_until([&] { return state() == api::McuState::kReady; }, 10));
    EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m04"}, {0}).result, "done");
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m04"}, {5}).result, "reached");
  }

  Lab lab;
  std::int64_t before = 0;
};

TEST_F(EmergencyAway, BindsAnMcuWithoutPower) {
  connect();
  cut_power();
  EXPECT_THAT(lab.ask(Ask::kEmergencyStop, {}).reason, HasSubstr("hall:2"));
  EXPECT_THAT(lab.state_of("hall:2").detail, HasSubstr("emergency stop"));
  expect_bound();
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  expect_free();
  // It is over: one that comes now is free.
  cut_power();
  ASSERT_TRUE(lab.run_until([&] { return state() == api::McuState::kReady; }, 10));
}

// A clear tells whom it has not reached; these are cleared when they are there.
TEST_F(EmergencyAway, IsNotClearedWhereNobodyHasHeardTheClear) {
  connect();
  cut_power();
  lab.ask(Ask::kEmergencyStop, {});
  EXPECT_THAT(lab.ask(Ask::kClearFaults, {}).reason, HasSubstr("not done there: hall:2"));
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kReady);
  expect_bound();
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {"m04"}).result, "done");
  expect_free();
}

TEST_F(EmergencyAway, ARebootClearsNothing) {
  connect();
  ASSERT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  cut_power();
  expect_bound();
}

// By what the first MCU, which has latched it, tells.
TEST_F(EmergencyAway, OutlivesTheDaemonWithoutAStore) {
  connect();
  cut_power();
  lab.ask(Ask::kEmergencyStop, {});
  lab.restart_daemon();
  expect_bound();
}

// Nobody else tells of it.
TEST_F(EmergencyAway, OutlivesTheDaemonInTheStore) {
  lab.keep_positions();
  connect();
  cut_power();
  lab.ask(Ask::kEmergencyStop, {});
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {"m01"}).result, "done");
  lab.run_for(0.1);
  lab.cut_pc_power();
  expect_bound();
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  lab.run_for(0.1);
  lab.restart_daemon();
  expect_free();
}

// An MCU whose table run nobody has ended: the daemon ends it by a stop that is nobody's.
TEST(EmergencyAwayRuns, TheEndOfAnEarlierRunBindsNobody) {
  ReadyLab lab(hall(2, 1, "fine_table"));
  lab.bus(0).reboot(1, kOffNs);
  lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(0.5);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.has_state("hall:2") && lab.all_ready(); }, 20));
  EXPECT_TRUE(lab.state_of("hall:1").detail.empty()) << lab.state_of("hall:1").detail;
  EXPECT_TRUE(lab.state_of("hall:2").detail.empty()) << lab.state_of("hall:2").detail;
}

// What stands in for an MCU is in the daemon: a port that is not there, and a daemon that is new.
TEST(EmergencyAwayPorts, APortThatIsUnpluggedAndANewDaemonAreBound) {
  PulseLab lab(pulse_group() + pulse_port("p0", 0, "m0") + pulse_port("p1", 1, "m1"));
  lab.keep_positions();
  lab.connect();
  lab.unplug(1);
  lab.ask(Ask::kEmergencyStop, {});
  EXPECT_THAT(lab.state_of("p1").detail, HasSubstr("emergency stop"));
  lab.plug(1);
  const auto bound = [&lab](const char* mcu) {
    return lab.has_state(mcu) && lab.state_of(mcu).state == api::McuState::kFault;
  };
  ASSERT_TRUE(lab.run_until([&] { return bound("p1"); }, 10));
  lab.run_for(0.1);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return bound("p0") && bound("p1"); }, 10));
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {"m1"}).result, "done");
  lab.run_for(0.1);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until(
      [&] { return bound("p0") && lab.has_state("p1") && lab.motor("m1").enabled; }, 10));
  lab.run_for(1);
  EXPECT_FALSE(bound("p1"));
}

TEST(EmergencyAwayBoards, ABoardThatIsUnpluggedIsBound) {
  ReadyLab lab(
      "[[bus]]\nname = \"board\"\nkind = \"commutator\"\nport = \"/dev/null\"\nbaud = 115200\n"
      "start_hz = 100\n[[group]]\nname = \"axes\"\ntable = \"bushd2-constant\"\n"
      "[[motor]]\nname = \"m0\"\nmcu = \"board\"\noutput = 0\ngroup = \"axes\"\n");
  lab.unplug(0);
  lab.ask(Ask::kEmergencyStop, {});
  lab.plug(0);
  const auto state = [&lab] { return lab.state_of("board").state; };
  ASSERT_TRUE(lab.run_until([&] { return state() == api::McuState::kFault; }, 10));
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kMoveBy, {"m0"}, {5})).result, "refused");
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  ASSERT_TRUE(lab.run_until([&] { return state() == api::McuState::kReady; }, 10));
}

}  // namespace
}  // namespace bushd::test
