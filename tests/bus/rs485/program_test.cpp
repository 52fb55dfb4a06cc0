// Programs of MCUs: how they are brought there and begun, and what becomes of one that goes on
// while its master was away.
#include "engine/program.h"

#include <gmock/gmock.h>

#include <numeric>

#include "bus/rs485/slave.h"

namespace bushd::test {
namespace {

using link::ProgramView;
using testing::HasSubstr;

constexpr McuIndex kMcu{0};

Bytes some_program(std::size_t size = 600) {
  Bytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

struct ProgramBus : FakeBus {
  explicit ProgramBus(int count = 1) : FakeBus(count) {
    for (Slave& slave : slaves) {
      slave.identity.capabilities |= BUSHD_CAN_PROGRAM | BUSHD_CAN_CLEAR_NAMED;
    }
  }
  const ProgramView& view(std::size_t mcu = 0) const { return master->program(McuIndex{mcu}); }
  void put(const Bytes& bytes) {
    master->put_program(kMcu, bytes);
    ASSERT_TRUE(run_until([this] { return !view().uploading && view().state.crc != 0; }));
  }
  link::Tick begin(std::uint8_t number = 1) {
    const link::Tick start = master->earliest_program_start(now_us, {&kMcu, 1});
    master->run_program(kMcu, number, start);
    return start;
  }
  bushd_program_action last_action() const {
    return static_cast<bushd_program_action>(heard_of(BUSHD_MSG_PROGRAM).back().payload[0]);
  }
  // A master that begins where another one has left.
  void come_back() {
    master = std::make_unique<link::Rs485Master>(setup, source);
    master->port_opened(now_us);
    heard.clear();
    events.clear();
  }
};

// As an MCU is that a master has left alone with a program of its motors 0 and 1.
void leave_running(ProgramBus& bus) {
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  bus.slaves[0].program_state.motors = 0b11;
  bus.slaves[0].program_state.stage = BUSHD_PROGRAM_RUNS;
  bus.slaves[0].program_state.number = 9;
}

TEST(Program, IsAskedForBeforeTheMcuGoesOnline) {
  ProgramBus bus;
  ASSERT_FALSE(bus.view().known);
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  EXPECT_TRUE(bus.view().known);
  EXPECT_EQ(bus.view().state.memory, 8192);
  ASSERT_EQ(bus.heard_of(BUSHD_MSG_PROGRAM_STATE).size(), 1u);
  EXPECT_LT(bus.heard_of(BUSHD_MSG_PROGRAM_STATE)[0].at_us,
            bus.heard_of(BUSHD_MSG_CONFIGURE)[0].at_us);
  EXPECT_EQ(bus.count<link::ProgramReported>(), 1);
  bus.run_for(2'000'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_PROGRAM_STATE).size(), 1u) << "nothing is under way";
}

TEST(Program, IsNotAskedForOfAnMcuThatHasNone) {
  FakeBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_PROGRAM_STATE).empty());
  EXPECT_FALSE(bus.master->program(kMcu).known);
}

TEST(Program, AnMcuThatRefusesToTellIsSetUpAllTheSame) {
  ProgramBus bus;
  bus.slaves[0].refusals = {{BUSHD_MSG_PROGRAM_STATE, BUSHD_E_UNKNOWN_MESSAGE}};
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  EXPECT_FALSE(bus.view().known);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_PROGRAM_STATE).size(), 1u);
}

TEST(Program, IsPutInPartsThenRun) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  ASSERT_NO_FATAL_FAILURE(bus.put(some_program()));
  EXPECT_EQ(bus.slaves[0].program, some_program());
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_PROGRAM_PUT).size(), 3u);
  EXPECT_EQ(bus.view().put, 600u);
  ASSERT_TRUE(
      bus.run_until([&] { return bus.view().state.stage == BUSHD_PROGRAM_LOADED; }, 100'000));
  const link::Tick start = bus.begin();
  EXPECT_TRUE(bus.master->busy(kMcu));
  ASSERT_TRUE(bus.run_until([&] { return bus.view().state.number == 1; }, 100'000));
  EXPECT_EQ(bus.view().state.start_tick, static_cast<std::uint32_t>(start));
  EXPECT_GT(start, bus.master->tick_at(bus.now_us)) << "known before it begins";
  EXPECT_EQ(bus.count<link::RequestRefused>(), 0);
  bus.master->pause_program(kMcu);
  ASSERT_TRUE(
      bus.run_until([&] { return bus.view().state.stage == BUSHD_PROGRAM_PAUSED; }, 50'000));
  bus.master->resume_program(kMcu);
  ASSERT_TRUE(bus.run_until([&] { return bus.view().state.stage == BUSHD_PROGRAM_RUNS; }, 50'000));
  bus.master->stop_program(kMcu, BUSHD_STOP_RAMP);
  ASSERT_TRUE(bus.run_until([&] { return bus.view().state.stage == BUSHD_PROGRAM_ENDED; }, 50'000));
  bus.master->erase_program(kMcu);
  ASSERT_TRUE(bus.run_until([&] { return bus.view().state.stage == BUSHD_PROGRAM_NONE; }, 50'000));
}

TEST(Program, WhatIsLostIsSaidAgain) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  int frames = 0;
  bus.slaves[0].loses = [&](const Heard& frame) {
    const bool of_program = frame.type >= BUSHD_MSG_PROGRAM_PUT;
    return of_program && ++frames % 3 != 0;
  };
  ASSERT_NO_FATAL_FAILURE(bus.put(some_program(1000)));
  EXPECT_EQ(bus.slaves[0].program, some_program(1000));
  EXPECT_EQ(bus.view().refused, BUSHD_OK);
  EXPECT_TRUE(bus.online());
}

TEST(Program, ThatIsTooLargeIsRefused) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  bus.master->put_program(kMcu, some_program(8193));
  ASSERT_TRUE(bus.run_until([&] { return !bus.view().uploading; }, 1'000'000));
  EXPECT_EQ(bus.view().refused, BUSHD_E_CAPACITY);
  EXPECT_EQ(bus.view().put, 0u);
  EXPECT_EQ(bus.count<link::RequestRefused>(), 0) << "its view tells";
}

TEST(Program, ARestartEndsTheUpload) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  bus.master->put_program(kMcu, some_program(5000));
  ASSERT_TRUE(bus.run_until([&] { return bus.view().put > 1000; }));
  bus.slaves[0].identity.boot_number = 501;
  bus.slaves[0].flags = 0;
  bus.slaves[0].program_state.stage = BUSHD_PROGRAM_NONE;
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::McuOffline>() == 1; }));
  EXPECT_EQ(bus.view().total, 0u);
  EXPECT_FALSE(bus.view().uploading || bus.view().known);
  const std::size_t parts = bus.heard_of(BUSHD_MSG_PROGRAM_PUT).size();
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  bus.run_for(500'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_PROGRAM_PUT).size(), parts);
}

TEST(Program, AnUploadKeepsNoTicksWaiting) {
  ProgramBus bus(2);
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  for (std::uint8_t m = 0; m < 4; ++m) {
    bus.master->begin(McuIndex{1}, m, bus.master->earliest_start(bus.now_us, McuIndex{1}, m));
  }
  bus.run_for(500'000);
  bus.slaves[1].low_water = UINT16_MAX;
  bus.master->put_program(kMcu, some_program(8000));
  std::int64_t least_ticks = INT64_MAX;
  ASSERT_TRUE(bus.run_until([&] {
    least_ticks = std::min<std::int64_t>(
        least_ticks, static_cast<std::int32_t>(bus.slaves[1].known_until[0] - bus.tick(1)));
    return !bus.view().uploading;
  }));
  EXPECT_EQ(bus.view().refused, BUSHD_OK);
  EXPECT_GE(least_ticks, 100'000'000 / FakeBus::kTickNs);
}

TEST(Program, IsAskedForFiveTimesASecondWhileOneIsUnderWay) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(leave_running(bus));
  bus.come_back();
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  bus.heard.clear();
  bus.run_for(2'000'000);
  EXPECT_NEAR(static_cast<double>(bus.heard_of(BUSHD_MSG_PROGRAM_STATE).size()), 10, 1);
}

// Its lines end when they are not told the time for a second.
TEST(Program, OneThatNeedsItsHostIsToldTheTimeMoreOften) {
  for (const std::uint8_t flags : {std::uint8_t{BUSHD_PROGRAM_WITHOUT_HOST}, std::uint8_t{0}}) {
    ProgramBus bus;
    ASSERT_NO_FATAL_FAILURE(leave_running(bus));
    bus.slaves[0].program_state.flags = flags;
    bus.come_back();
    ASSERT_NO_FATAL_FAILURE(bus.connect());
    bus.run_for(1'000'000);
    bus.heard.clear();
    bus.run_for(4'000'000);
    const std::size_t syncs = bus.heard_of(BUSHD_MSG_SYNC).size();
    EXPECT_NEAR(static_cast<double>(syncs), flags == 0 ? 20 : 8, 1);
  }
}

TEST(Program, AStopComesBeforeAllElseThatWaits) {
  ProgramBus bus(2);
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  ASSERT_NO_FATAL_FAILURE(bus.put(some_program()));
  bus.master->put_program(McuIndex{1}, some_program(8000));
  bus.begin();
  ASSERT_TRUE(bus.run_until([&] { return bus.view().state.number == 1; }));
  for (int i = 0; i < 20; ++i) bus.master->set_position(kMcu, 3, i);
  bus.heard.clear();
  bus.master->stop_program(kMcu, BUSHD_STOP_RAMP);
  ASSERT_TRUE(bus.run_until([&] { return !bus.heard_of(BUSHD_MSG_PROGRAM).empty(); }, 30'000));
  EXPECT_LE(bus.heard_of(BUSHD_MSG_SET_POSITION).size(), 1u);
  EXPECT_LE(bus.heard_of(BUSHD_MSG_PROGRAM_PUT).size(), 1u);
  EXPECT_EQ(bus.last_action(), BUSHD_PROGRAM_STOP);
}

TEST(Program, OneThatIsNotTakenInTimeDoesNotBegin) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  ASSERT_NO_FATAL_FAILURE(bus.put(some_program()));
  // It comes; what is lost is the answer.
  bus.slaves[0].refusals = {};
  bool silent = true;
  bus.slaves[0].loses = [&](const Heard& frame) {
    return silent && frame.type == BUSHD_MSG_PROGRAM && frame.payload[0] == BUSHD_PROGRAM_RUN;
  };
  const link::Tick start = bus.begin();
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::RequestRefused>() == 1; }));
  const auto refused = *bus.last<link::RequestRefused>();
  EXPECT_EQ(refused.type, BUSHD_MSG_PROGRAM);
  EXPECT_EQ(refused.status, BUSHD_E_LATE);
  silent = false;
  ASSERT_TRUE(bus.run_until([&] { return bus.last_action() == BUSHD_PROGRAM_STOP; }, 200'000));
  EXPECT_LT(bus.tick(0), start) << "so that it cannot begin";
  bus.run_for(500'000);
  EXPECT_EQ(bus.slaves[0].program_state.number, 0);
  EXPECT_EQ(bus.count<link::RequestRefused>(), 1);
}

TEST(Program, OneThatTheMcuRefusesIsToldOf) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  bus.begin();
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::RequestRefused>() == 1; }, 100'000));
  EXPECT_EQ(bus.last<link::RequestRefused>()->status, BUSHD_E_STATE) << "there is none";
  EXPECT_TRUE(bus.online());
}

TEST(Program, AnEmergencyStopDiscardsARunThatWaits) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  ASSERT_NO_FATAL_FAILURE(bus.put(some_program()));
  bus.heard.clear();
  bus.begin();
  bus.master->emergency_stop(BUSHD_STOP_RAMP);
  bus.run_for(500'000);
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_PROGRAM).empty());
  EXPECT_EQ(bus.slaves[0].program_state.number, 0);
}

TEST(Program, OneThatRunsIsAdoptedWithItsMcu) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(leave_running(bus));
  bus.slaves[0].faults = BUSHD_FAULT_LINK;  // of another motor
  bus.come_back();
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  EXPECT_EQ(bus.view().state.stage, BUSHD_PROGRAM_RUNS);
  EXPECT_EQ(bus.view().state.number, 9);
  EXPECT_EQ(bus.slaves[0].faults, 0);
  for (const int type : {BUSHD_MSG_EMERGENCY, BUSHD_MSG_INPUTS, BUSHD_MSG_TABLE_BEGIN}) {
    EXPECT_TRUE(bus.heard_of(static_cast<std::uint8_t>(type)).empty()) << type;
  }
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_CONFIGURE).size(), 1u) << "the same, or it would refuse it";
  for (const Heard& assign : bus.heard_of(BUSHD_MSG_ASSIGN)) EXPECT_GE(assign.payload[0], 2);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_ASSIGN).size(), 2u);
  // The rest of its setup follows when the program has ended.
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.count<link::McuOnline>(), 1);
  EXPECT_EQ(bus.count<link::McuOffline>(), 0);
  bus.slaves[0].program_state.stage = BUSHD_PROGRAM_ENDED;
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::McuOnline>() == 2; }, 1'000'000));
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_INPUTS).size(), 1u);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_ASSIGN).size(), 6u);
  EXPECT_EQ(bus.count<link::McuOffline>(), 0);
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.count<link::McuOnline>(), 2) << "once";
}

TEST(Program, OneWithOtherTablesIsLeftAloneUntilItIsStopped) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(leave_running(bus));
  bus.slaves[0].held[0].crc ^= 1;
  bus.come_back();
  bus.run_for(3'000'000);
  EXPECT_FALSE(bus.online());
  EXPECT_THAT(bus.master->view(kMcu).detail, HasSubstr("runs a program of another configuration"));
  EXPECT_TRUE(bus.view().known);
  for (const int type : {BUSHD_MSG_EMERGENCY, BUSHD_MSG_INPUTS, BUSHD_MSG_TABLE_BEGIN,
                         BUSHD_MSG_ASSIGN, BUSHD_MSG_CONTROL, BUSHD_MSG_PROGRAM}) {
    EXPECT_TRUE(bus.heard_of(static_cast<std::uint8_t>(type)).empty()) << type;
  }
  EXPECT_EQ(bus.slaves[0].program_state.stage, BUSHD_PROGRAM_RUNS);
  bus.master->stop_program(kMcu, BUSHD_STOP_RAMP);
  ASSERT_TRUE(bus.run_until([&] { return bus.online(); }, 1'000'000));
  EXPECT_EQ(bus.slaves[0].program_state.stage, BUSHD_PROGRAM_ENDED);
  EXPECT_FALSE(bus.heard_of(BUSHD_MSG_TABLE_BEGIN).empty());
}

TEST(Program, OneWithAnotherTickOrEmissionIsLeftAloneUntilItHasEnded) {
  for (const bushd_type type : {BUSHD_MSG_CONFIGURE, BUSHD_MSG_EMISSION}) {
    ProgramBus bus;
    ASSERT_NO_FATAL_FAILURE(leave_running(bus));
    bus.slaves[0].refusals = {{type, BUSHD_E_STATE}};
    bus.come_back();
    bus.run_for(2'000'000);
    EXPECT_FALSE(bus.online());
    EXPECT_THAT(bus.master->view(kMcu).detail,
                HasSubstr("runs a program of another configuration"));
    bus.slaves[0].refusals = {};
    bus.slaves[0].program_state.stage = BUSHD_PROGRAM_ENDED;
    ASSERT_TRUE(bus.run_until([&] { return bus.online(); }, 1'000'000));
    EXPECT_EQ(bus.heard_of(BUSHD_MSG_INPUTS).size(), 1u);
  }
}

TEST(Program, OneThatIsBeingEndedIsWaitedFor) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(leave_running(bus));
  bus.slaves[0].program_state.stage = BUSHD_PROGRAM_ENDS;
  bus.come_back();
  bus.run_for(1'000'000);
  EXPECT_FALSE(bus.online());
  EXPECT_THAT(bus.master->view(kMcu).detail, HasSubstr("is being ended"));
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_CONFIGURE).empty());
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_EMERGENCY).empty());
  bus.slaves[0].program_state.stage = BUSHD_PROGRAM_ENDED;
  EXPECT_TRUE(bus.run_until([&] { return bus.online(); }, 1'000'000));
}

TEST(Program, AStopThatBindsItsMcuEndsItFirst) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(leave_running(bus));
  bus.come_back();
  bus.master->bind_to_stop(kMcu, BUSHD_STOP_RAMP);
  ASSERT_TRUE(bus.run_until([&] { return (bus.slaves[0].faults & BUSHD_FAULT_EMERGENCY) != 0; }));
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_CONFIGURE).empty());
}

TEST(Program, OneOutlivesOtherTablesForItsMcu) {
  ProgramBus bus;
  ASSERT_NO_FATAL_FAILURE(leave_running(bus));
  bus.come_back();
  ASSERT_NO_FATAL_FAILURE(bus.connect());
  bus.heard.clear();
  link::McuSetup other = bus.setup.mcus[0];
  other.tables[0].revision = 8;
  bus.master->reconfigure(kMcu, other);
  bus.run_for(1'000'000);
  EXPECT_FALSE(bus.online());
  EXPECT_THAT(bus.master->view(kMcu).detail, HasSubstr("runs a program of another configuration"));
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_EMERGENCY).empty());
  bus.slaves[0].program_state.stage = BUSHD_PROGRAM_ENDED;
  ASSERT_TRUE(bus.run_until([&] { return bus.online(); }, 1'000'000));
  EXPECT_EQ(bus.slaves[0].held[0].revision, 8u);
}

}  // namespace
}  // namespace bushd::test
