// An emergency stop is said until everybody has heard it, and no longer.
#include "bus/rs485/emergency_stop.h"

#include "bus/rs485/machines.h"

namespace bushd::test {
namespace {

class Emergency : public testing::Test {
 protected:
  void latch(McuIndex mcu) { mcus[mcu].view.report.faults |= BUSHD_FAULT_EMERGENCY; }
  PerMcu<McuRecord> mcus = online_mcus(2);
  link::FrameWriter writer{kBaud};
  link::EmergencyStop stop{mcus, writer};
};

TEST_F(Emergency, ThreeFramesToAllAndPollsToSee) {
  EXPECT_FALSE(stop.send_due(1'000));
  stop.begin(BUSHD_STOP_IMMEDIATE);
  ASSERT_TRUE(stop.send_due(1'000));
  const auto sent = take_sent(writer);
  ASSERT_EQ(sent.size(), 3u);
  for (const Sent& frame : sent) {
    EXPECT_EQ(frame.address, link::kBroadcast);
    EXPECT_EQ(frame.type, BUSHD_MSG_EMERGENCY);
    EXPECT_EQ(frame.payload, Bytes{BUSHD_STOP_IMMEDIATE});
  }
  EXPECT_TRUE(mcus[kFirst].poll_wanted && mcus[kSecond].poll_wanted);
  EXPECT_FALSE(stop.send_due(stop.due_us() - 1));
}

// One of older firmware, which may be on the line without being configured, refuses the mode.
TEST_F(Emergency, TheLastFrameOfOneThatDisablesIsForMcusThatDoNotKnowIt) {
  stop.begin(BUSHD_STOP_DISABLE);
  ASSERT_TRUE(stop.send_due(1'000));
  const auto sent = take_sent(writer);
  ASSERT_EQ(sent.size(), 3u);
  EXPECT_EQ(sent[0].payload, Bytes{BUSHD_STOP_DISABLE});
  EXPECT_EQ(sent[1].payload, Bytes{BUSHD_STOP_DISABLE});
  EXPECT_EQ(sent[2].payload, Bytes{BUSHD_STOP_IMMEDIATE});
}

// It has heard the last one only, and its drivers are on.
TEST_F(Emergency, OneThatDisablesIsSaidUntilDriversAreDisabled) {
  for (McuRecord& mcu : mcus) mcu.view.identity.capabilities = BUSHD_CAN_DISABLE;
  stop.begin(BUSHD_STOP_DISABLE);
  ASSERT_TRUE(stop.send_due(1'000));
  latch(kFirst);
  latch(kSecond);
  EXPECT_TRUE(stop.send_due(stop.due_us()));
  for (McuRecord& mcu : mcus) mcu.view.report.faults |= BUSHD_FAULT_DISABLED;
  EXPECT_FALSE(stop.send_due(stop.due_us()));
  EXPECT_FALSE(stop.active());
}

TEST_F(Emergency, RepeatedUntilTheLastMcuHasLatchedIt) {
  stop.begin(BUSHD_STOP_RAMP);
  ASSERT_TRUE(stop.send_due(1'000));
  latch(kFirst);
  EXPECT_TRUE(stop.send_due(stop.due_us()));
  latch(kSecond);
  EXPECT_FALSE(stop.send_due(stop.due_us()));
  EXPECT_FALSE(stop.active());
}

TEST_F(Emergency, OneThatWasLatchedBeforeSaysNothingOfThisOne) {
  latch(kFirst);
  latch(kSecond);
  stop.begin(BUSHD_STOP_RAMP);
  EXPECT_TRUE(stop.send_due(1'000));
  EXPECT_TRUE(stop.send_due(stop.due_us()));
}

TEST_F(Emergency, SaidAtLeastOnceEvenIfNobodyIsThere) {
  for (McuRecord& mcu : mcus) mcu.view.phase = link::McuPhase::kOffline;
  stop.begin(BUSHD_STOP_RAMP);
  EXPECT_TRUE(stop.send_due(1'000));
  EXPECT_FALSE(mcus[kFirst].poll_wanted);
  EXPECT_FALSE(stop.send_due(stop.due_us()));
}

TEST_F(Emergency, McuThatNeverAnswersIsLeftAloneAfterTwoSeconds) {
  stop.begin(BUSHD_STOP_RAMP);
  ASSERT_TRUE(stop.send_due(0));
  std::int64_t last_us = 0;
  while (stop.active()) {
    last_us = stop.due_us();
    stop.send_due(last_us);
  }
  EXPECT_EQ(last_us, 2'000'000);
}

}  // namespace
}  // namespace bushd::test
