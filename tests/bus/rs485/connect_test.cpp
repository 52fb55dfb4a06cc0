// From an open port to an MCU that takes moves, and everything that can be in the way.
#include <gmock/gmock.h>

#include <set>

#include "bus/rs485/slave.h"
#include "engine/payload.h"

namespace bushd::test {
namespace {

using link::McuPhase;
using testing::HasSubstr;

// The codes of the table that all motors have.
std::vector<std::uint16_t> both_sides(const FakeBus& bus) {
  std::vector<std::uint16_t> codes = bus.codes;
  codes.insert(codes.end(), bus.codes.begin() + 50, bus.codes.end());
  return codes;
}

void reopen_port(FakeBus& bus) {
  bus.master->port_lost(bus.now_us, "unplugged");
  bus.master->port_opened(bus.now_us);
}

TEST(Connect, FindsConfiguresSyncsAndEnables) {
  FakeBus bus(1, 3);
  EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
  bus.connect();
  EXPECT_EQ(bus.count<link::McuOnline>(), 1);
  std::vector<int> requests;
  for (const Heard& heard : bus.heard) {
    if (heard.type != BUSHD_MSG_POLL && heard.type != BUSHD_MSG_SYNC)
      requests.push_back(heard.type);
  }
  const std::vector<int> expected = {
      BUSHD_MSG_IDENTIFY,   BUSHD_MSG_CONFIGURE,  BUSHD_MSG_EMISSION,    BUSHD_MSG_INPUTS,
      BUSHD_MSG_TABLES,     BUSHD_MSG_CONTROL,    BUSHD_MSG_TABLE_BEGIN, BUSHD_MSG_TABLE_DATA,
      BUSHD_MSG_TABLE_DATA, BUSHD_MSG_TABLE_DATA, BUSHD_MSG_TABLE_END,   BUSHD_MSG_ASSIGN,
      BUSHD_MSG_ASSIGN,     BUSHD_MSG_ASSIGN,     BUSHD_MSG_CONTROL};
  EXPECT_EQ(requests, expected);
  const Slave& slave = bus.slaves[0];
  EXPECT_EQ(slave.tables.at(0), both_sides(bus)) << "from slow to fast";
  EXPECT_EQ(slave.flags, 15);
  const Bytes control = bus.heard_of(BUSHD_MSG_CONTROL).back().payload;
  EXPECT_EQ(control, (Bytes{BUSHD_CONTROL_ENABLE | BUSHD_CONTROL_CLEAR_FAULTS}));
  EXPECT_EQ(bus.master->view(McuIndex{0}).detail, "");
  EXPECT_TRUE(bus.master->time_known());
  EXPECT_NEAR(static_cast<double>(bus.master->tick_at(bus.now_us)), bus.tick(0), 1);
  EXPECT_EQ(bus.master->health(McuIndex{0}).timeouts, 0u);
  EXPECT_EQ(bus.master->bus_health().crc_errors, 0u);
}

TEST(Connect, WhatTheLineCarriesIsCounted) {
  FakeBus bus(2);
  bus.connect();
  bus.run_for(1'000'000);
  // An answer may be on its way.
  const auto all_counted = [&] {
    return static_cast<std::int64_t>(bus.master->bus_health().line_bytes) ==
           bus.master_bytes + bus.slave_bytes;
  };
  EXPECT_TRUE(bus.run_until(all_counted, 1'000'000));
  EXPECT_GT(bus.master_bytes, 0);
}

TEST(Connect, ClearsTheFaultsThatItHasReadOf) {
  for (const bool named : {false, true}) {
    for (const std::uint8_t faults : Bytes{0, BUSHD_FAULT_LINK | BUSHD_FAULT_SYNC}) {
      SCOPED_TRACE(testing::Message() << "faults " << int{faults} << (named ? ", named" : ", all"));
      FakeBus bus;
      Slave& slave = bus.slaves[0];
      if (named) slave.identity.capabilities |= BUSHD_CAN_CLEAR_NAMED;
      slave.faults = faults;
      bus.connect();
      Bytes expected{BUSHD_CONTROL_ENABLE | BUSHD_CONTROL_CLEAR_FAULTS};
      if (named) expected = faults == 0 ? Bytes{BUSHD_CONTROL_ENABLE} : Bytes{expected[0], faults};
      EXPECT_EQ(bus.heard_of(BUSHD_MSG_CONTROL).back().payload, expected);
      EXPECT_EQ(slave.faults, 0);
    }
  }
}

TEST(Connect, AllMcusAgreeOnTheTime) {
  FakeBus bus(5, 2);
  bus.connect();
  EXPECT_EQ(bus.count<link::McuOnline>(), 5);
  for (std::size_t i = 1; i < 5; ++i)
    EXPECT_NEAR(static_cast<double>(bus.slaves[i].zero_us),
                static_cast<double>(bus.slaves[0].zero_us), 2);
}

TEST(Connect, LatecomerTakesTheTimeOfTheBus) {
  FakeBus bus(2, 2);
  bus.slaves[1].answers = false;
  ASSERT_TRUE(bus.run_until([&] { return bus.online(0); }));
  bus.run_for(5'000'000);
  const std::int64_t zero = bus.slaves[0].zero_us;
  bus.slaves[1].answers = true;
  bus.connect();
  EXPECT_EQ(bus.slaves[0].zero_us, zero) << "time goes on";
  EXPECT_NEAR(static_cast<double>(bus.slaves[1].zero_us), static_cast<double>(zero), 2);
}

// Two MCUs may have got different times while each was alone with another master.
TEST(Connect, LatecomerWithATimeOfItsOwnIsToldThatOfTheBusFirst) {
  for (const std::size_t late : {0u, 1u}) {
    FakeBus bus(2, 2);
    bus.connect();
    const std::size_t there = 1 - late;
    bus.slaves[late].answers = false;
    ASSERT_TRUE(bus.run_until([&] { return !bus.online(late); }));
    bus.slaves[late].zero_us -= 100'000'000;
    const std::int64_t zero = bus.slaves[there].zero_us;
    bus.slaves[late].answers = true;
    for (int waits = 0; waits < 1000 && !bus.online(late); ++waits) {
      bus.run_for(5'000);
      ASSERT_NEAR(static_cast<double>(bus.master->tick_at(bus.now_us)), bus.tick(there), 1);
    }
    EXPECT_TRUE(bus.online(late)) << bus.master->view(McuIndex{late}).detail;
    EXPECT_EQ(bus.slaves[there].zero_us, zero);
    EXPECT_NEAR(static_cast<double>(bus.slaves[late].zero_us), static_cast<double>(zero), 2);
    EXPECT_TRUE(bus.online(there));
  }
}

// Ticks of moves that it was given before mean nothing any more.
TEST(Connect, TimeThatJumpsIsOfflineUntilItIsToldAgain) {
  FakeBus bus(1, 2);
  bus.connect();
  bus.slaves[0].zero_us -= 1'000'000;
  EXPECT_TRUE(bus.run_until([&] { return bus.count<link::McuOffline>() == 1; }, 200'000));
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr("other ticks"));
  ASSERT_TRUE(bus.run_until([&] { return bus.online(0); }));
  EXPECT_NEAR(static_cast<double>(bus.master->tick_at(bus.now_us)), bus.tick(0), 1);
}

// An MCU that does not answer may know the time all the same.
TEST(Connect, TimeDoesNotBeginAnewBeforeAllHaveReported) {
  FakeBus bus(1, 2);
  bus.connect();
  const std::int64_t zero = bus.slaves[0].zero_us;
  bus.slaves[0].loses = [](const Heard& heard) { return heard.type != BUSHD_MSG_SYNC; };
  ASSERT_TRUE(bus.run_until([&] { return !bus.online(0); }));
  int polls = 0;
  bus.slaves[0].loses = [&](const Heard& heard) {
    return heard.type == BUSHD_MSG_POLL && ++polls <= 2;
  };
  ASSERT_TRUE(bus.run_until([&] { return bus.online(0); }));
  EXPECT_GT(polls, 2);
  EXPECT_EQ(bus.slaves[0].zero_us, zero);
}

// An MCU that missed a SYNC and heard a repetition of it knows another instant by that sync_id.
TEST(Connect, SyncThatMcusDisagreeAboutIsNotPassedOn) {
  FakeBus bus(2, 2);
  bus.connect();
  bus.run_for(2'000'000);
  const auto syncs = [&] { return bus.heard_of(BUSHD_MSG_SYNC); };
  const auto next_sync = [&] {
    const std::size_t before = syncs().size();
    EXPECT_TRUE(bus.run_until([&] { return syncs().size() > before; }, 1'000'000));
    return syncs().back();
  };
  EXPECT_EQ(next_sync().payload[6], 1) << "follows, as a rule";
  bus.slaves[1].sync_us += 30'000;
  EXPECT_EQ(next_sync().payload[6], 0);
  EXPECT_EQ(next_sync().payload[6], 1) << "about the next SYNC they agree";
  // A clock that is off is so at every SYNC: then the first MCU's time is that of the bus.
  bus.slaves[1].zero_us -= 30'000;
  EXPECT_EQ(next_sync().payload[6], 0);
  EXPECT_EQ(next_sync().payload[6], 1);
}

TEST(Connect, SymmetricTableIsSentOnce) {
  FakeBus bus;
  bus.table.decel = bus.table.accel;
  bus.connect();
  EXPECT_EQ(bus.slaves[0].tables.at(0), bus.codes);
}

TEST(Connect, LostRequestsAndAnswersAreRepeated) {
  FakeBus bus;
  int n = 0;
  bus.slaves[0].loses = [&](const Heard&) { return ++n % 3 == 0; };
  bus.connect();
  EXPECT_GT(bus.master->health(McuIndex{0}).timeouts, 3u);
  EXPECT_EQ(bus.slaves[0].tables.at(0), both_sides(bus));
}

TEST(Connect, MissedRepliesMakeOfflineOnceAndAfterALimit) {
  FakeBus bus(2);
  bus.connect();
  bus.run_for(1'000'000);
  bus.slaves[0].answers = false;
  const std::int64_t from_us = bus.now_us;
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::McuOffline>() > 0; }));
  EXPECT_GE(bus.now_us - from_us, 100'000) << "ten answers missing, each awaited 10 ms or more";
  EXPECT_LE(bus.now_us - from_us, 1'200'000);
  EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr("does not answer"));
  bus.run_for(3'000'000);
  EXPECT_EQ(bus.count<link::McuOffline>(), 1);
  EXPECT_TRUE(bus.online(1)) << "the other is not disturbed";
  bus.slaves[0].answers = true;
  bus.connect();
}

TEST(Connect, SomeLostAnswersAreNoOffline) {
  FakeBus bus;
  bus.connect();
  int n = 0;
  bus.slaves[0].loses = [&](const Heard& heard) {
    return heard.type == BUSHD_MSG_POLL && ++n % 10 != 0;  // nine of ten
  };
  bus.run_for(10'000'000);
  EXPECT_EQ(bus.count<link::McuOffline>(), 0);
  EXPECT_GT(bus.master->health(McuIndex{0}).timeouts, 50u);
}

TEST(Connect, RestartIsSeenAndConfiguredAgain) {
  FakeBus bus;
  bus.connect();
  Slave fresh;
  fresh.address = 1;
  fresh.identity = bus.slaves[0].identity;
  ++fresh.identity.boot_number;
  fresh.zero_us = bus.now_us;
  bus.slaves[0] = fresh;
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::McuOffline>() > 0; }, 200'000));
  EXPECT_EQ(bus.master->view(McuIndex{0}).detail, "restarted");
  bus.connect();
  EXPECT_EQ(bus.slaves[0].flags, 15);
  EXPECT_EQ(bus.count<link::McuOnline>(), 2);
}

TEST(Connect, PortLostIsOfflineWithItsCauseAndSendsNothing) {
  FakeBus bus(2);
  bus.connect();
  bus.events.clear();
  bus.master->port_lost(bus.now_us, "unplugged");
  const auto frames = bus.heard.size();
  EXPECT_EQ(bus.master->next_wake_us(), INT64_MAX);
  EXPECT_TRUE(bus.master->step(bus.now_us).empty());
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.heard.size(), frames);
  EXPECT_EQ(bus.count<link::McuOffline>(), 2);
  EXPECT_EQ(bus.master->view(McuIndex{1}).detail, "unplugged");
  EXPECT_FALSE(bus.master->time_known());
  bus.master->port_opened(bus.now_us);
  EXPECT_EQ(bus.master->view(McuIndex{1}).detail, "no answer yet");
  bus.connect();
}

// A port of a pattern at which nothing answers makes way for the next match.
TEST(Connect, ABusIsHeardOnceAnMcuHasAnsweredSinceThePortWasOpened) {
  FakeBus bus(2);
  EXPECT_FALSE(bus.master->heard());
  bus.connect();
  EXPECT_TRUE(bus.master->heard());
  reopen_port(bus);
  EXPECT_FALSE(bus.master->heard());
  bus.slaves.clear();
  bus.run_for(3'000'000);
  EXPECT_FALSE(bus.master->heard()) << "what it says itself is no answer";
}

// How often each of the MCUs was asked in the frames heard.
std::map<int, int> polls_by_address(const FakeBus& bus) {
  std::map<int, int> polls;
  for (const Heard& heard : bus.heard_of(BUSHD_MSG_POLL)) {
    for (std::size_t i = 1; i < heard.payload.size(); i += 5) ++polls[heard.payload[i]];
  }
  return polls;
}

TEST(Connect, OnePollTwentyTimesASecondAsksAll) {
  FakeBus bus(3);
  bus.connect();
  bus.run_for(500'000);
  bus.heard.clear();
  bus.run_for(2'000'000);
  EXPECT_NEAR(static_cast<double>(bus.heard_of(BUSHD_MSG_POLL).size()), 40, 3);
  for (int address = 1; address <= 3; ++address) EXPECT_NEAR(polls_by_address(bus)[address], 40, 3);
  EXPECT_NEAR(static_cast<double>(bus.heard_of(BUSHD_MSG_SYNC).size()), 4, 1);
  EXPECT_EQ(bus.master->health(McuIndex{0}).timeouts, 0u) << "answers do not collide";
}

// It is asked for its report first, so the answers after it end the waiting.
TEST(Connect, McuThatDoesNotAnswerCostsItsWindowAndNotTheCycle) {
  FakeBus bus(4);
  bus.connect();
  bus.run_for(500'000);
  int n = 0;
  bus.slaves[2].loses = [&n](const Heard& h) { return h.type == BUSHD_MSG_POLL && ++n % 9 != 0; };
  bus.run_for(200'000);
  bus.heard.clear();
  bus.run_for(2'000'000);
  int first = 0;
  for (const Heard& heard : bus.heard_of(BUSHD_MSG_POLL)) first += heard.payload[1] == 3;
  EXPECT_GE(first, 30) << "of some 40, as every ninth is answered";
  EXPECT_GE(polls_by_address(bus)[1], 35);
  EXPECT_TRUE(bus.online(2));
  // A window of 116 bytes and three of 48 at 500 kbaud with their guards take 7.6 ms. Nothing is
  // waited for then, where the least patience is 10 ms.
  const auto polls = bus.heard_of(BUSHD_MSG_POLL).size();
  ASSERT_TRUE(bus.run_until([&] { return bus.heard_of(BUSHD_MSG_POLL).size() > polls; }));
  const std::int64_t from_us = bus.now_us;
  bus.master->control(McuIndex{0}, BUSHD_CONTROL_ENABLE);
  ASSERT_TRUE(bus.run_until([&] { return bus.heard.back().type == BUSHD_MSG_CONTROL; }));
  EXPECT_LE(bus.now_us - from_us, 13'000);
}

TEST(Connect, TablesThatAreThereAreNotSentAgain) {
  FakeBus bus;
  bus.connect();
  const auto sent = bus.heard_of(BUSHD_MSG_TABLE_DATA).size();
  reopen_port(bus);
  bus.connect();
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TABLE_DATA).size(), sent);
  // Another revision is another table.
  link::McuSetup changed = bus.setup.mcus[0];
  changed.tables[0].revision = 8;
  bus.master->reconfigure(McuIndex{0}, changed);
  bus.connect();
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TABLE_DATA).size(), 2 * sent);
  EXPECT_EQ(bus.slaves[0].held.at(0).revision, 8u);
}

TEST(Connect, TwoMcusWithOneAddressAreNamed) {
  FakeBus bus(2);
  bus.slaves[1].address = 1;
  bus.slaves[1].zero_us = bus.slaves[0].zero_us;
  ASSERT_TRUE(bus.run_until(
      [&] {
        return bus.master->view(McuIndex{0}).detail.find("shares its address") != std::string::npos;
      },
      10'000'000));
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr("64000000000000"));
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr("65000000000000"));
  EXPECT_EQ(bus.count<link::McuOnline>(), 0);
  bus.slaves[1].answers = false;  // unplugged
  ASSERT_TRUE(bus.run_until([&] { return bus.online(0); }));
}

void receive(FakeBus& bus, std::uint8_t address, std::uint8_t type, unsigned sequence,
             const Bytes& payload) {
  Bytes wire(BUSHD_FRAME_MAX_WIRE);
  wire.resize(bushd_frame_encode(address, type, static_cast<std::uint8_t>(sequence), payload.data(),
                                 payload.size(), wire.data()));
  bus.master->receive(bus.now_us, wire);
}

TEST(Connect, AnotherMasterOnTheLineIsNoticedForSomeSeconds) {
  FakeBus bus;
  bus.connect();
  EXPECT_FALSE(bus.master->two_masters(bus.now_us));
  bushd_sync sync{};
  sync.master = 4711;
  receive(bus, 0, BUSHD_MSG_SYNC, 1, payload_of(sync, bushd_encode_sync));
  EXPECT_TRUE(bus.master->two_masters(bus.now_us));
  bus.run_for(2'000'000);
  EXPECT_FALSE(bus.master->two_masters(bus.now_us));
  // Or an MCU hears it.
  bus.slaves[0].flags |= BUSHD_FLAG_TWO_MASTERS;
  bus.run_for(100'000);
  EXPECT_TRUE(bus.master->two_masters(bus.now_us));
}

// Another master may have taken them over meanwhile: what this one knows of them may not be true.
TEST(Connect, WhatAMasterKnowsIsOutdatedWhenItHasStoodStill) {
  FakeBus bus;
  bus.connect();
  bus.run_for(2'000'000);
  bus.now_us += 1'400'000;
  const link::McuView& view = bus.master->view(McuIndex{0});
  bus.run_for(1);
  EXPECT_EQ(view.outdated_us, 0) << "three of its SYNCs have not been missed";
  bus.run_for(500'000);
  bus.now_us += 1'700'000;
  bus.master->receive(bus.now_us, {});
  EXPECT_NEAR(static_cast<double>(view.outdated_us), 1'700'000, 50'000);
  bus.run_for(50'000);
  EXPECT_EQ(view.outdated_us, 0) << "it is asked at once";
  EXPECT_TRUE(bus.online());
}

TEST(Connect, TableRunOfAnEarlierMasterIsRampedDownFirst) {
  FakeBus bus;
  bus.slaves[0].run[1] = bushd_table_run_entry{1, 0, 1, 1000, 0};
  bus.slaves[0].known_until[1] = bus.tick(0) + 20'000;
  bus.connect();
  ASSERT_EQ(bus.heard_of(BUSHD_MSG_EMERGENCY).size(), 1u);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_EMERGENCY)[0].address, 1);
  EXPECT_EQ(bus.slaves[0].faults, 0) << "nobody's emergency";
}

TEST(Connect, AdapterLatencyIsMeasured) {
  FakeBus bus;
  bus.adapter_latency_us = 3'000;
  bus.connect();
  bus.run_for(2'000'000);
  const link::Latency& latency = bus.master->bus_health().latency;
  EXPECT_NEAR(static_cast<double>(latency.recent_us), 3'000, 600) << "a window may begin late";
  EXPECT_GT(latency.count[3], 40u) << "2 to 4 ms";
  EXPECT_EQ(latency.count[5] + latency.count[6] + latency.count[7], 0u);
  FakeBus quick;
  quick.connect();
  quick.run_for(2'000'000);
  EXPECT_LT(quick.earliest_replace() - quick.tick(0), bus.earliest_replace() - bus.tick(0))
      << "changes are planned further ahead";
}

// This report comes as the answer to a POLL, under each sequence number.
void receive_under_each_number(FakeBus& bus, const bushd_report& report) {
  const Bytes payload = payload_of(report, bushd_encode_report);
  for (unsigned sequence = 0; sequence < 256; ++sequence) {
    receive(bus, 1, BUSHD_MSG_POLL | BUSHD_TYPE_REPLY, sequence, payload);
  }
}

TEST(Connect, StrangeAnswersAreNotTaken) {
  FakeBus bus;
  bus.connect();
  const std::int32_t before = bus.master->view(McuIndex{0}).report.motor[0].position_steps;
  bushd_report forged = bus.master->view(McuIndex{0}).report;
  forged.motor[0].position_steps = 99;
  receive_under_each_number(bus, forged);  // nothing was asked
  EXPECT_EQ(bus.master->view(McuIndex{0}).report.motor[0].position_steps, before);
  bus.master->receive(bus.now_us, Bytes{1, 2, 3, 0, 9, 9, 9, 9, 9, 9, 9, 9, 0});
  EXPECT_EQ(bus.master->bus_health().crc_errors, 2u);
  bus.run_for(1'000'000);
  EXPECT_TRUE(bus.online());
}

// Two masters may have used the same sequence number. What is new to the other one is not all that
// is new to this one.
TEST(Connect, NewsForAnotherMasterAreNotTaken) {
  FakeBus bus;
  bus.connect();
  const bushd_report& told = bus.master->view(McuIndex{0}).report;
  const auto answers = [&](unsigned number) {
    bushd_report news = told;
    news.number = static_cast<std::uint8_t>(number % 255 + 1);
    news.sections = 0;
    news.motors = 1;
    news.motor[0].position_steps = 99;
    receive_under_each_number(bus, news);
  };
  bus.slaves[0].loses = [](const Heard& h) { return h.type == BUSHD_MSG_POLL; };
  const auto asked = [&] {
    bus.heard.clear();
    return bus.run_until([&] { return !bus.heard_of(BUSHD_MSG_POLL).empty(); });
  };
  const unsigned known = told.number;
  ASSERT_TRUE(asked());
  answers(known + 1);
  EXPECT_NE(told.motor[0].position_steps, 99);
  ASSERT_TRUE(asked());
  answers(known);
  EXPECT_EQ(told.motor[0].position_steps, 99) << "of one that is its own";
}

TEST(Connect, ControlAndPositionAreAskedForOnceAndSeen) {
  FakeBus bus;
  bus.connect();
  bus.heard.clear();
  bus.master->set_position(McuIndex{0}, 2, -77);
  bus.master->control(McuIndex{0}, BUSHD_CONTROL_DISABLE);
  EXPECT_TRUE(bus.master->busy(McuIndex{0}));
  ASSERT_TRUE(bus.run_until([&] { return !bus.master->busy(McuIndex{0}); }));
  EXPECT_EQ(bus.master->view(McuIndex{0}).report.motor[2].position_steps, -77);
  EXPECT_EQ(bus.master->view(McuIndex{0}).report.flags & BUSHD_FLAG_ENABLED, 0);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_SET_POSITION).size(), 1u);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_CONTROL).size(), 1u);
}

// The MCU takes the last number for the same frame again.
TEST(Connect, NoTriggerNumberIsGivenTwiceBeforeItIsReported) {
  FakeBus bus;
  bus.slaves[0].identity.capabilities |= BUSHD_CAN_TRIGGER | BUSHD_CAN_TRAVEL;
  bus.connect();
  std::set<std::uint8_t> given;
  for (int i = 0; i < 3; ++i) {
    given.insert(bus.master->arm(McuIndex{0}, BUSHD_EDGE_RISING, 50, {}));
    given.insert(bus.master->travel(McuIndex{0}, {}));
  }
  EXPECT_EQ(given.size(), 6u);
  EXPECT_EQ(given.count(0), 0u);
}

}  // namespace
}  // namespace bushd::test
