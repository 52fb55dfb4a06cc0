// What a SYNC says of the one before, from what reports say of it.
#include "bus/rs485/synchroniser.h"

#include "bus/rs485/machines.h"

namespace bushd::test {
namespace {

using Agreement = link::Synchroniser::Agreement;

class Syncing : public testing::Test {
 protected:
  Syncing() { setup.master = 77; }

  bushd_sync sync_at(std::int64_t us) {
    EXPECT_TRUE(synchroniser.send_due(us));
    const auto sent = take_sent(writer);
    bushd_sync sync{};
    EXPECT_EQ(sent.size(), 1u);
    EXPECT_EQ(bushd_decode_sync(sent[0].payload.data(), sent[0].payload.size(), &sync), BUSHD_OK);
    return sync;
  }
  bushd_sync next_sync() { return sync_at(synchroniser.due_us()); }

  // A report of an MCU that knows the time: bus time is host time less `ahead_us`.
  Agreement report(McuIndex mcu, std::int64_t us, std::uint32_t sync_id, std::int64_t sync_us,
                   std::int64_t ahead_us = 0, bool in_time = true) {
    bushd_report& r = mcus[mcu].view.report;
    mcus[mcu].view.reported = true;
    r.flags = BUSHD_FLAG_SYNCED | BUSHD_FLAG_SYNC_HEARD;
    const std::int64_t ns = (us + ahead_us) * 1000;
    r.tick = static_cast<std::uint32_t>(ns / kTickNs);
    r.tick_ns = static_cast<std::uint32_t>(ns % kTickNs);
    r.sync_id = sync_id;
    r.sync_tick = static_cast<std::uint32_t>((sync_us + ahead_us) * 1000 / kTickNs);
    r.sync_ns = static_cast<std::uint32_t>((sync_us + ahead_us) * 1000 % kTickNs);
    return synchroniser.follow_report(us, mcu, 0, in_time);
  }

  PerMcu<McuRecord> mcus = online_mcus(2);
  link::BusSetup setup = bus_setup(mcus);
  link::FrameWriter writer{kBaud};
  link::Synchroniser synchroniser{setup, mcus, writer};
};

TEST_F(Syncing, NobodyListensNothingIsSaid) {
  for (McuRecord& mcu : mcus) mcu.view.phase = link::McuPhase::kOffline;
  EXPECT_FALSE(synchroniser.send_due(1'000'000));
  EXPECT_FALSE(synchroniser.send_due(1'500'000));
}

TEST_F(Syncing, SyncIdsNeverRepeatAndFollowUpNamesTheLast) {
  const bushd_sync first = sync_at(1'000'000);
  const bushd_sync second = sync_at(1'500'000);
  EXPECT_NE(first.sync_id, second.sync_id);
  EXPECT_EQ(second.follow_up_id, first.sync_id);
  EXPECT_EQ(first.master, 77);
}

TEST_F(Syncing, TimeBeginsAtASyncOnceAllSayThatTheyDoNotKnowIt) {
  for (McuRecord& mcu : mcus) mcu.view.phase = link::McuPhase::kConnecting;
  EXPECT_FALSE(sync_at(1'000'000).follows) << "there was none before";
  mcus[kFirst].view.reported = true;
  synchroniser.follow_report(1'010'000, kFirst, 0, true);
  EXPECT_FALSE(next_sync().follows) << "the second may know it";
  mcus[kSecond].view.reported = true;
  const bushd_sync begun = next_sync();
  EXPECT_TRUE(begun.follows);
  EXPECT_EQ(begun.sync_tick, 0u);
  EXPECT_TRUE(mcus[kFirst].poll_wanted) << "asked at once, so that the next can follow";
}

TEST_F(Syncing, InstantOfTheLastSyncIsPassedOnOnceAllHaveReportedSince) {
  report(kSecond, 990'000, 0, 980'000);
  const bushd_sync first = sync_at(1'000'000);
  report(kFirst, 1'020'000, first.sync_id, 1'000'400);
  EXPECT_FALSE(sync_at(1'500'000).follows) << "the second has not reported since";
  const bushd_sync before = sync_at(2'000'000);
  report(kFirst, 2'020'000, before.sync_id, 2'000'400);
  report(kSecond, 2'020'000, before.sync_id, 2'000'400);
  const bushd_sync told = next_sync();
  ASSERT_TRUE(told.follows);
  EXPECT_EQ(told.sync_tick, 2'000'400'000u / kTickNs);
  EXPECT_EQ(told.sync_ns, 2'000'400'000u % kTickNs);
}

// 1: one has heard a repetition. 2: their clocks differ, so the first one's time counts.
TEST_F(Syncing, DisagreementIsNotPassedOnOnceAndThenIs) {
  const auto disagree = [this](const bushd_sync& sync, std::int64_t us) {
    report(kFirst, us, sync.sync_id, us - 1'000);
    report(kSecond, us, sync.sync_id, us - 800);
  };
  disagree(sync_at(1'000'000), 1'010'000);
  const std::int64_t due_us = synchroniser.due_us();
  const bushd_sync doubtful = next_sync();
  EXPECT_FALSE(doubtful.follows);
  EXPECT_EQ(synchroniser.due_us() - due_us, 60'000) << "the next one comes soon";
  disagree(doubtful, due_us + 10'000);
  const bushd_sync told = next_sync();
  EXPECT_TRUE(told.follows);
  EXPECT_EQ(told.sync_tick, mcus[kFirst].view.report.sync_tick);
  EXPECT_NEAR(mcus[kSecond].health.clock_offset_us, 200, 1);
}

TEST_F(Syncing, MovingMcusTimeGoesBeforeThatOfOneThatConnects) {
  mcus[kFirst].view.phase = link::McuPhase::kConnecting;
  bushd_sync sync = sync_at(1'000'000);
  for (int i = 0; i < 2; ++i) {
    const std::int64_t us = synchroniser.due_us() - 10'000;
    report(kSecond, us, sync.sync_id, us - 1'000);
    report(kFirst, us, sync.sync_id, us - 1'000, 100'000);
    sync = next_sync();
  }
  ASSERT_TRUE(sync.follows);
  EXPECT_EQ(sync.sync_tick, mcus[kSecond].view.report.sync_tick);
}

TEST_F(Syncing, ReportsSetTheClock) {
  EXPECT_FALSE(synchroniser.clock().valid());
  EXPECT_EQ(report(kFirst, 1'000'000, 0, 990'000, 0, false), Agreement::kUnsynced) << "too old";
  EXPECT_FALSE(synchroniser.clock().valid());
  EXPECT_EQ(report(kFirst, 1'000'000, 0, 990'000), Agreement::kInStep);
  EXPECT_EQ(synchroniser.clock().tick_at(2'000'000), 2'000'000'000 / kTickNs);
  EXPECT_EQ(mcus[kFirst].view.tick, 1'000'000'000 / kTickNs);
}

TEST_F(Syncing, OtherTimeIsOnlyTakenWhileNobodyHasMoves) {
  report(kFirst, 1'000'000, 0, 990'000);
  EXPECT_EQ(report(kSecond, 1'010'000, 0, 990'000, 500'000), Agreement::kOtherTime);
  EXPECT_EQ(synchroniser.clock().tick_at(1'010'000), 1'010'000'000 / kTickNs) << "unmoved";
  for (McuRecord& mcu : mcus) mcu.view.phase = link::McuPhase::kConnecting;
  EXPECT_EQ(report(kSecond, 1'010'000, 0, 990'000, 500'000), Agreement::kInStep);
  EXPECT_EQ(synchroniser.clock().tick_at(1'010'000), 1'510'000'000 / kTickNs);
}

TEST_F(Syncing, AnotherMasterIsRememberedForThreeSyncs) {
  const bushd_sync sync = sync_at(1'000'000);
  bushd_frame frame{};
  frame.type = BUSHD_MSG_SYNC;
  frame.sequence = 1;
  std::array<std::uint8_t, 24> payload{};
  frame.payload = payload.data();
  frame.payload_size = static_cast<std::uint8_t>(bushd_encode_sync(&sync, payload.data()));
  synchroniser.overheard(1'000'000, frame);
  EXPECT_FALSE(synchroniser.two_masters(1'000'000)) << "an echo of its own";
  payload[0] ^= 1;  // of its number
  synchroniser.overheard(1'000'000, frame);
  EXPECT_TRUE(synchroniser.two_masters(2'499'999));
  EXPECT_FALSE(synchroniser.two_masters(2'500'000));
  mcus[kFirst].view.reported = true;
  mcus[kFirst].view.report.flags = BUSHD_FLAG_TWO_MASTERS;
  EXPECT_TRUE(synchroniser.two_masters(9'000'000)) << "an MCU has heard it";
}

// Two that do not listen before they talk destroy many of each other's frames. SYNCs come twice a
// second, and three of them in a row may be lost; others come far more often.
TEST_F(Syncing, AnyRequestThatItHasNotSentTellsOfAnotherMaster) {
  const std::array<std::uint8_t, 1> payload = {BUSHD_CONTROL_ENABLE};
  writer.send(1'000'000, link::McuAddress{3}, BUSHD_MSG_CONTROL, payload);
  bushd_frame frame{.address = 3,
                    .type = BUSHD_MSG_CONTROL,
                    .sequence = 1,
                    .payload_size = 1,
                    .payload = payload.data()};
  synchroniser.overheard(1'000'000, frame);
  EXPECT_FALSE(synchroniser.two_masters(1'000'000)) << "an echo of its own";
  frame.sequence = 2;
  synchroniser.overheard(1'000'000, frame);
  EXPECT_TRUE(synchroniser.two_masters(1'000'000));
}

// It may live, and say SYNC again within half a second: who moves motors until then moves motors
// that another one believes at rest.
TEST_F(Syncing, MasterThatAnMcuHasHeardLatelyMayStillBeThere) {
  mcus[kFirst].view.phase = link::McuPhase::kConnecting;
  synchroniser.port_opened(1'000'000);
  EXPECT_FALSE(synchroniser.perhaps_another(1'000'000)) << "nobody has told of one";
  report(kFirst, 1'010'000, 4711, 600'000);
  EXPECT_TRUE(synchroniser.perhaps_another(1'010'000));
  EXPECT_TRUE(synchroniser.perhaps_another(2'090'000));
  EXPECT_FALSE(synchroniser.perhaps_another(2'110'000)) << "three of its SYNCs have not come";
  EXPECT_FALSE(synchroniser.two_masters(1'010'000)) << "nor has one come beside those of this one";
}

TEST_F(Syncing, OwnSyncsAndThoseOfLongAgoTellOfNobody) {
  for (int i = 0; i < 10; ++i) {
    const std::int64_t us = synchroniser.due_us();
    const bushd_sync sync = sync_at(us);
    report(kFirst, us + 20'000, sync.sync_id, us);
    EXPECT_FALSE(synchroniser.perhaps_another(us + 20'000));
  }
  const std::int64_t us = synchroniser.due_us();
  report(kSecond, us, 4711, us - 1'600'000);
  EXPECT_FALSE(synchroniser.perhaps_another(us));
}

TEST_F(Syncing, HurryBringsTheNextSyncForward) {
  sync_at(1'000'000);
  synchroniser.hurry(1'100'000);
  EXPECT_EQ(synchroniser.due_us(), 1'100'000);
  synchroniser.hurry(1'200'000);
  EXPECT_EQ(synchroniser.due_us(), 1'100'000);
}

}  // namespace
}  // namespace bushd::test
