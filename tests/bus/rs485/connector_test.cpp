// From no answer to online, request by request, without a bus.
#include "bus/rs485/connector.h"

#include <gmock/gmock.h>

#include "bus/rs485/machines.h"

namespace bushd::test {
namespace {

using link::McuPhase;
using testing::ElementsAre;
using testing::HasSubstr;

class Connecting : public testing::Test,
                   protected link::Connector::Listener,
                   protected link::Transactions::Listener {
 protected:
  Connecting() {
    mcus[kFirst].view = {};
    connector.port_opened(0);
  }
  void found(std::int64_t, McuIndex) override { story += "found "; }
  void came_online(McuIndex) override { story += "online "; }
  void went_offline(McuIndex, bool was_online) override {
    story += was_online ? "offline " : "still-offline ";
  }
  void refused(McuIndex, std::uint8_t, std::uint8_t) override { story += "refused "; }
  void program_reported(McuIndex) override { story += "program "; }
  bool answered(std::int64_t, const link::Transactions::Answer&) override { return true; }
  bool unanswered(std::int64_t, McuIndex, std::uint8_t) override { return false; }
  void ended(std::int64_t, McuIndex, std::uint8_t) override {}
  void overheard(std::int64_t, const bushd_frame&) override {}

  static bushd_identity fitting() { return online_mcus(1)[kFirst].view.identity; }
  std::string detail() const { return mcus[kFirst].view.detail; }
  bushd_report& report() { return mcus[kFirst].view.report; }

  // How many windows the IDENTIFY has that is sent now; none: none is sent.
  std::optional<int> identify(std::int64_t us) {
    if (!connector.send_due_identify(us)) return std::nullopt;
    bushd_identify message{};
    const auto sent = take_sent(writer);
    bushd_decode_identify(sent[0].payload.data(), sent[0].payload.size(), &message);
    transactions.abandon();
    return message.windows;
  }
  void find(const bushd_identity& identity = fitting()) {
    identify(0);
    connector.identity(identity);
    connector.identify_ended(0, kFirst);
  }
  // Sends what the queue holds and takes it for done; the types, by the order of sending.
  std::vector<int> setup_requests() {
    std::vector<int> types;
    while (connector.send_request(0)) {
      const Sent sent = take_sent(writer).back();
      types.push_back(sent.type);
      last_payload = sent.payload;
      transactions.abandon();
      if (sent.type == BUSHD_MSG_TABLES) {
        connector.tables(kFirst, held, true);
      } else {
        connector.acknowledged(0, kFirst, sent.type, BUSHD_OK);
      }
    }
    return types;
  }

  PerMcu<McuRecord> mcus = online_mcus(1);
  link::BusSetup setup = bus_setup(mcus);
  link::FrameWriter writer{kBaud};
  link::Transactions transactions{writer, *this};
  link::Connector connector{setup, mcus, transactions, writer, *this};
  bushd_tables held{};
  Bytes last_payload;
  std::string story;
};

TEST_F(Connecting, AskedDirectlyAndInWindowsByTurns) {
  EXPECT_EQ(identify(0), 1);
  connector.not_found(0, kFirst);
  EXPECT_EQ(identify(499'999), std::nullopt);
  EXPECT_EQ(identify(500'000), 8);
  connector.not_found(500'000, kFirst);
  EXPECT_EQ(identify(1'000'000), 1);
}

TEST_F(Connecting, FittingMcuIsSetUpAndPolled) {
  find();
  EXPECT_EQ(story, "found ");
  EXPECT_EQ(mcus[kFirst].view.phase, McuPhase::kConnecting);
  EXPECT_TRUE(mcus[kFirst].poll_wanted);
  EXPECT_THAT(setup_requests(), ElementsAre()) << "not before its first report";
}

TEST_F(Connecting, MisfitStaysOfflineAndSaysWhy) {
  bushd_identity identity = fitting();
  identity.queue_ticks = 8;
  find(identity);
  EXPECT_EQ(story, "");
  EXPECT_EQ(mcus[kFirst].view.phase, McuPhase::kOffline);
  EXPECT_THAT(detail(), HasSubstr("queue of 8 ticks"));
  EXPECT_EQ(connector.retry_due_us(kFirst), 2'000'000);
}

TEST_F(Connecting, TwoAtOneAddressAreBothNamed) {
  identify(0);
  bushd_identity one = fitting();
  bushd_identity other = fitting();
  one.unique_id[0] = 0xAB;
  other.unique_id[0] = 0xCD;
  connector.identity(one);
  connector.identity(one);
  connector.identity(other);
  connector.identify_ended(0, kFirst);
  EXPECT_THAT(detail(), testing::AllOf(HasSubstr("ab00"), HasSubstr("cd00")));
  EXPECT_EQ(identify(2'000'000), 8) << "in windows again";
}

// Drivers that come on are settled by a step there and back: no daemon that ends begins that.
TEST_F(Connecting, WhoEndsEnablesNoDrivers) {
  connector.enable_no_more();
  find();
  connector.follow_report(0, kFirst, false);
  EXPECT_THAT(setup_requests(), testing::Contains(BUSHD_MSG_CONTROL));
  EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_CLEAR_FAULTS});
  report().flags = BUSHD_FLAG_CONFIGURED;
  report().state = BUSHD_STATE_BUSY;
  connector.follow_report(1000, kFirst, true);
  EXPECT_EQ(mcus[kFirst].view.phase, McuPhase::kOnline);
}

TEST_F(Connecting, SetupEndsOnlineOnceItIsInStepAndDriversAreOn) {
  find();
  connector.follow_report(0, kFirst, false);
  EXPECT_THAT(setup_requests(),
              ElementsAre(BUSHD_MSG_CONFIGURE, BUSHD_MSG_EMISSION, BUSHD_MSG_INPUTS,
                          BUSHD_MSG_TABLES, BUSHD_MSG_CONTROL, BUSHD_MSG_TABLE_BEGIN,
                          BUSHD_MSG_TABLE_DATA, BUSHD_MSG_TABLE_END, BUSHD_MSG_ASSIGN,
                          BUSHD_MSG_ASSIGN, BUSHD_MSG_ASSIGN, BUSHD_MSG_ASSIGN, BUSHD_MSG_CONTROL));
  EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_ENABLE});
  report().flags = BUSHD_FLAG_CONFIGURED | BUSHD_FLAG_ENABLED;
  report().state = BUSHD_STATE_READY;
  connector.follow_report(0, kFirst, false);
  EXPECT_EQ(story, "found ") << "not in step";
  connector.follow_report(0, kFirst, true);
  EXPECT_EQ(story, "found online ");
  EXPECT_EQ(detail(), "");
}

TEST_F(Connecting, TablesThatAreThereAreNotSentAgain) {
  held.bank[0] = {.valid = true, .crc = bushd_table_crc32(&small_table()), .revision = 1};
  find();
  connector.follow_report(0, kFirst, false);
  EXPECT_THAT(setup_requests(), testing::Not(testing::Contains(BUSHD_MSG_TABLE_BEGIN)));
}

// Who finds drivers off leaves them so: there may be hands in the mechanism.
TEST_F(Connecting, DriversFoundOffStayOff) {
  find();
  report().flags = BUSHD_FLAG_CONFIGURED;
  connector.follow_report(0, kFirst, false);
  setup_requests();
  EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_CLEAR_FAULTS});
  report().state = BUSHD_STATE_BUSY;
  connector.follow_report(0, kFirst, true);
  EXPECT_EQ(story, "found online ");
}

TEST_F(Connecting, PeoplesFaultsAreNotCleared) {
  find();
  report().faults = BUSHD_FAULT_EMERGENCY;
  connector.follow_report(0, kFirst, false);
  setup_requests();
  EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_ENABLE});
}

TEST_F(Connecting, TableRunOfAnEarlierMasterIsRampedDownBeforeTheSetup) {
  find();
  report().moving = report().running = 1;
  connector.follow_report(0, kFirst, true);
  EXPECT_FALSE(connector.send_request(0));
  ASSERT_TRUE(connector.send_stop(0));
  const Sent sent = take_sent(writer).back();
  EXPECT_EQ(sent.type, BUSHD_MSG_EMERGENCY);
  EXPECT_EQ(sent.address, McuAddress{1});
  EXPECT_FALSE(connector.send_stop(0)) << "once per report";
  report().moving = report().running = 0;
  report().faults = BUSHD_FAULT_EMERGENCY;
  connector.follow_report(0, kFirst, true);
  setup_requests();
  EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_ENABLE})
      << "that emergency stop was nobody's";
}

// It heard what people said before it was found, or before it was seen to move.
TEST_F(Connecting, PeoplesEmergencyStopIsNotTakenForThatOfTheTakingOver) {
  for (const bool found_first : {false, true}) {
    if (found_first) find();
    connector.emergency_stop(BUSHD_STOP_RAMP);
    if (!found_first) find();
    report() = {};
    report().moving = report().running = 1;
    connector.follow_report(0, kFirst, true);
    ASSERT_TRUE(connector.send_stop(0));
    report().moving = report().running = 0;
    report().faults = BUSHD_FAULT_EMERGENCY;
    connector.follow_report(0, kFirst, true);
    setup_requests();
    EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_ENABLE}) << found_first;
    report().state = BUSHD_STATE_READY;
    connector.follow_report(0, kFirst, true);
    ASSERT_EQ(mcus[kFirst].view.phase, link::McuPhase::kOnline);
    connector.give_up(kFirst, "unplugged", 0);
  }
}

TEST_F(Connecting, EmergencyStopThatWasClearedIsOver) {
  mcus[kFirst].view.phase = McuPhase::kOnline;
  connector.emergency_stop(BUSHD_STOP_RAMP);
  connector.control(kFirst, BUSHD_CONTROL_CLEAR_FAULTS);
  report().faults = BUSHD_FAULT_EMERGENCY;
  connector.follow_stop(kFirst);
  EXPECT_TRUE(mcus[kFirst].view.bound_by_stop) << "it has not carried that out yet";
  report().faults = 0;
  connector.follow_stop(kFirst);
  EXPECT_FALSE(mcus[kFirst].view.bound_by_stop);
  connector.give_up(kFirst, "unplugged", 0);
  find();
  report().moving = report().running = 1;
  connector.follow_report(0, kFirst, true);
  report().moving = report().running = 0;
  report().faults = BUSHD_FAULT_EMERGENCY;
  connector.follow_report(0, kFirst, true);
  setup_requests();
  EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_ENABLE});
}

TEST_F(Connecting, WhoIsBoundByAStopHasItBeforeAnythingElse) {
  connector.bind_to_stop(kFirst, BUSHD_STOP_IMMEDIATE);
  find();
  for (int report = 0; report < 3; ++report) {
    EXPECT_FALSE(connector.send_request(0));
    ASSERT_TRUE(connector.send_stop(0)) << "until it tells of it";
    const Sent sent = take_sent(writer).back();
    EXPECT_EQ(sent.type, BUSHD_MSG_EMERGENCY);
    EXPECT_EQ(sent.address, McuAddress{1});
    EXPECT_EQ(sent.payload, Bytes{BUSHD_STOP_IMMEDIATE});
    EXPECT_FALSE(connector.send_stop(0));
    connector.follow_stop(kFirst);
    connector.follow_report(0, kFirst, true);
  }
  report().faults = BUSHD_FAULT_EMERGENCY;
  connector.follow_stop(kFirst);
  connector.follow_report(0, kFirst, true);
  setup_requests();
  EXPECT_EQ(last_payload, Bytes{BUSHD_CONTROL_ENABLE}) << "and is not cleared";
  // A clear that it has not confirmed frees nobody.
  connector.control(kFirst, BUSHD_CONTROL_CLEAR_FAULTS);
  connector.give_up(kFirst, "unplugged", 0);
  find();
  report().faults = 0;
  connector.follow_stop(kFirst);
  EXPECT_TRUE(mcus[kFirst].view.bound_by_stop);
}

TEST_F(Connecting, AStopThatAnMcuTellsOfBindsIt) {
  find();
  report().faults = BUSHD_FAULT_EMERGENCY;
  connector.follow_stop(kFirst);
  EXPECT_TRUE(mcus[kFirst].view.bound_by_stop);
}

TEST_F(Connecting, RefusalEndsTheSetupAndOfAnOnlineMcuIsOnlyTold) {
  find();
  connector.follow_report(0, kFirst, false);
  connector.acknowledged(0, kFirst, BUSHD_MSG_CONFIGURE, BUSHD_E_CAPACITY);
  EXPECT_EQ(story, "found still-offline ");
  EXPECT_THAT(detail(), HasSubstr("CONFIGURE: capacity exceeded; use a longer tick"));
  EXPECT_TRUE(connector.queue(kFirst).empty());
  story.clear();
  mcus[kFirst].view.phase = McuPhase::kOnline;
  connector.queue(kFirst).ask(bushd_control{.actions = BUSHD_CONTROL_ENABLE, .faults = 0});
  connector.acknowledged(0, kFirst, BUSHD_MSG_CONTROL, BUSHD_E_STATE);
  EXPECT_EQ(story, "refused ");
  EXPECT_TRUE(connector.queue(kFirst).empty());
}

// What others have asked of it is not lost when it gets another setup, and comes before that.
TEST_F(Connecting, ReconfiguringKeepsWhatElseWasAsked) {
  mcus[kFirst].view.phase = McuPhase::kOnline;
  connector.queue(kFirst).ask(bushd_set_inputs{});
  connector.queue(kFirst).ask(bushd_set_position{2, -77});
  connector.queue(kFirst).ask(bushd_position_compare{});
  connector.control(kFirst, BUSHD_CONTROL_DISABLE);
  ASSERT_TRUE(connector.reconfigure(kFirst, mcus[kFirst].setup));
  connector.follow_report(0, kFirst, true);
  auto requests = setup_requests();
  requests.resize(7);
  EXPECT_THAT(requests, ElementsAre(BUSHD_MSG_SET_POSITION, BUSHD_MSG_POSITION_COMPARE,
                                    BUSHD_MSG_CONTROL, BUSHD_MSG_CONFIGURE, BUSHD_MSG_EMISSION,
                                    BUSHD_MSG_INPUTS, BUSHD_MSG_TABLES));
}

TEST_F(Connecting, ARefusalOfWhatElseWasAskedIsNoneOfTheSetup) {
  mcus[kFirst].view.phase = McuPhase::kOnline;
  connector.queue(kFirst).ask(bushd_set_position{2, -77});
  ASSERT_TRUE(connector.reconfigure(kFirst, mcus[kFirst].setup));
  connector.acknowledged(0, kFirst, BUSHD_MSG_SET_POSITION, BUSHD_E_STATE);
  EXPECT_EQ(story, "refused ");
  EXPECT_EQ(mcus[kFirst].view.phase, McuPhase::kConnecting);
}

TEST_F(Connecting, UnsentClearingIsDiscardedByAnEmergencyStop) {
  mcus[kFirst].view.phase = McuPhase::kOnline;
  connector.control(kFirst, BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_ENABLE);
  connector.emergency_stop(BUSHD_STOP_RAMP);
  EXPECT_EQ(connector.queue(kFirst).front().payload, Bytes{BUSHD_CONTROL_ENABLE});
}

TEST_F(Connecting, GivenUpMcuIsForgottenWithItsRequests) {
  mcus[kFirst].view.phase = McuPhase::kOnline;
  connector.control(kFirst, BUSHD_CONTROL_ENABLE);
  connector.give_up(kFirst, "unplugged", 700);
  EXPECT_EQ(story, "offline ");
  EXPECT_EQ(detail(), "unplugged");
  EXPECT_EQ(connector.retry_due_us(kFirst), 700);
  EXPECT_TRUE(connector.queue(kFirst).empty());
}

TEST_F(Connecting, ReconfigurationIsForThoseWhoAreThere) {
  EXPECT_FALSE(connector.reconfigure(kFirst, mcus[kFirst].setup));
  mcus[kFirst].view.phase = McuPhase::kOnline;
  EXPECT_TRUE(connector.reconfigure(kFirst, mcus[kFirst].setup));
  EXPECT_EQ(mcus[kFirst].view.phase, McuPhase::kConnecting);
  EXPECT_TRUE(mcus[kFirst].poll_wanted);
}

TEST_F(Connecting, OneThatIsLostWhileItGetsAnotherSetupHasGoneOffline) {
  mcus[kFirst].view.phase = McuPhase::kOnline;
  connector.reconfigure(kFirst, mcus[kFirst].setup);
  connector.reconfigure(kFirst, mcus[kFirst].setup);
  connector.give_up(kFirst, "does not answer", 700);
  EXPECT_EQ(story, "offline ");
  story.clear();
  find();
  connector.give_up(kFirst, "does not answer", 700);
  EXPECT_EQ(story, "found still-offline ") << "once";
}

}  // namespace
}  // namespace bushd::test
