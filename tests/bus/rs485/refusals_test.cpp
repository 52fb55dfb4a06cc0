// MCUs that do not fit, or refuse what is configured for them: why is said, and they are asked
// again.
#include <gmock/gmock.h>

#include "bus/rs485/slave.h"

namespace bushd::test {
namespace {

using link::McuPhase;
using testing::EndsWith;
using testing::HasSubstr;

struct Misfit {
  const char* name;
  void (*change)(bushd_identity& identity);
  std::vector<std::string> said;
};

class Unfit : public testing::TestWithParam<Misfit> {};
INSTANTIATE_TEST_SUITE_P(Identities, Unfit,
                         testing::Values(Misfit{"Version",
                                                [](bushd_identity& i) { i.protocol_version = 9; },
                                                {"protocol version 9", "this program version 6",
                                                 "update"}},
                                         Misfit{"Outputs",
                                                [](bushd_identity& i) { i.motors = 3; },
                                                {"has only 3 outputs", "output 3 is configured"}},
                                         Misfit{"Memory",
                                                [](bushd_identity& i) { i.table_codes = 349; },
                                                {"memory for 349", "need 350"}},
                                         Misfit{"Queue",
                                                [](bushd_identity& i) { i.queue_ticks = 8; },
                                                {"queue of 8 ticks", "use a longer tick"}}),
                         [](const auto& misfit) { return misfit.param.name; });

TEST_P(Unfit, IsSaidAndAskedAgainWithoutHurry) {
  FakeBus bus(1, 4);
  const bushd_identity good = bus.slaves[0].identity;
  GetParam().change(bus.slaves[0].identity);
  bus.run_for(3'000'000);
  EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
  for (const std::string& text : GetParam().said) {
    EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr(text));
  }
  EXPECT_TRUE(bus.master->view(McuIndex{0}).identified);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_IDENTIFY).size(), 2u);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_CONFIGURE).size(), 0u) << "nothing is done to it";
  EXPECT_TRUE(bus.events.empty());
  // Another MCU in its place.
  bus.slaves[0].identity = good;
  bus.connect();
}

// What an MCU cannot have: inputs by number, and more than one a motor.
TEST(Connect, AnMcuWithoutTheInputsIsNamed) {
  for (const bool knows : {false, true}) {
    FakeBus bus(1, 2);
    link::McuSetup setup = bus.setup.mcus[0];
    setup.motor_inputs = {{1, 9, 14, 3}};
    setup.used_inputs = 1u << 3 | 1u << 9 | 1u << 14;
    bus.slaves[0].identity.motors = knows ? 9 : 16;
    if (knows) bus.slaves[0].identity.capabilities |= BUSHD_CAN_MOTOR_INPUTS;
    bus.master->reconfigure(McuIndex{0}, setup);
    bus.run_for(3'000'000);
    EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
    EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
                HasSubstr(knows ? "has only 9 inputs, but input 9 is configured: use inputs 0 to 8"
                                : "knows one input a motor, but motor 1 has others"));
    EXPECT_EQ(bus.heard_of(BUSHD_MSG_CONFIGURE).size(), 0u);
  }
}

TEST(Connect, AnMcuThatDisablesNoDriversIsNamedWhereAnEmergencyIsTo) {
  for (const bool by_stop : {false, true}) {
    for (const bool can : {false, true}) {
      FakeBus bus(1, 2);
      link::McuSetup setup = bus.setup.mcus[0];
      setup.disabled_by_stop = by_stop;
      if (!by_stop) setup.inputs.emergency = BUSHD_EMERGENCY_INPUT_DISABLE;
      if (can) bus.slaves[0].identity.capabilities |= BUSHD_CAN_DISABLE;
      bus.master->reconfigure(McuIndex{0}, setup);
      bus.run_for(3'000'000);
      EXPECT_EQ(bus.master->view(McuIndex{0}).phase == McuPhase::kOffline, !can);
      EXPECT_EQ(bus.heard_of(BUSHD_MSG_CONFIGURE).empty(), !can);
      if (can) continue;
      EXPECT_EQ(bus.master->view(McuIndex{0}).detail,
                std::string("does not disable its drivers in an emergency, but ") +
                    (by_stop ? "emergency_stop of its bus" : "its emergency_input") +
                    " is \"disable\": update its firmware, or use \"immediate\"");
    }
  }
}

TEST(Connect, AnMcuWithoutAChopperIsNamedWhereCurrentsAreSet) {
  FakeBus bus(1, 2);
  link::McuSetup setup = bus.setup.mcus[0];
  setup.currents = {{0, BUSHD_DECAY_SLOW, 0, 0, 0}, {1, BUSHD_DECAY_SLOW, 900, 600, 200}};
  bus.master->reconfigure(McuIndex{0}, setup);
  bus.run_for(3'000'000);
  EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
              HasSubstr("controls no currents of windings, but motor 1 has `currents`"));
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail, EndsWith("an MCU with a chopper"));
  // And where that stands, if the setup says so.
  setup.places[{link::SetupKey::kCurrents, 1}] = {
      .message = {}, .file = "b.toml", .line = 31, .key = "motor[3].currents", .column = 12};
  bus.master->reconfigure(McuIndex{0}, setup);
  bus.run_for(3'000'000);
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
              EndsWith("an MCU with a chopper (b.toml:31:12: motor[3].currents)"));
}

TEST(Connect, AnMcuWithoutTheVelocityLoopIsNamedWhereVelocityIsSet) {
  FakeBus bus(1, 2);
  link::McuSetup setup = bus.setup.mcus[0];
  setup.velocities = {{0, 0, 0, 0}, {1, 6400, 96000, 500}};
  bus.master->reconfigure(McuIndex{0}, setup);
  bus.run_for(3'000'000);
  EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
              HasSubstr("moves no motor by the velocity loop, but motor 1 has `velocity`"));
}

// Checked here as well as in the configuration: tables and velocities change in operation.
TEST(Connect, ATableThatBeginsBeforeDirMayBeStepsAfterKeepsTheMcuAway) {
  FakeBus bus(1, 2);
  static const std::array<std::uint16_t, 1> kCode = {100};
  static const bushd_table kQuick = {.accel = {kCode.data(), 1, nullptr, nullptr, 0},
                                     .decel = {kCode.data(), 1, nullptr, nullptr, 0},
                                     .cruise = 100,
                                     .time_unit_ns = 4'000};
  constexpr std::uint32_t kMostUs = 200;
  for (const bool too_long : {true, false}) {
    link::McuSetup setup = bus.setup.mcus[0];
    for (auto& table : setup.tables) table.table = &kQuick;
    setup.emission.settings.dir_setup_us = static_cast<std::uint16_t>(kMostUs + too_long);
    bus.master->reconfigure(McuIndex{0}, setup);
    bus.run_for(3'000'000);
    EXPECT_EQ(bus.master->view(McuIndex{0}).phase == McuPhase::kOffline, too_long);
    if (!too_long) continue;
    EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
                HasSubstr("but motor 0 begins by its table sooner than that allows, so steps that "
                          "wait for DIR would come too close together: use dir_setup_us = " +
                          std::to_string(kMostUs) + " or less"));
  }
}

TEST(Connect, AnMcuWhoseOutputsAreActiveHighOnlyIsNamedWithTheKey) {
  FakeBus bus(1, 2);
  link::McuSetup setup = bus.setup.mcus[0];
  setup.outputs.enabled = BUSHD_ENABLED_LOW;
  setup.outputs_at = {
      .message = "", .file = "bushd.toml", .line = 19, .key = "mcu[0].enable_active"};
  bus.master->reconfigure(McuIndex{0}, setup);
  bus.run_for(3'000'000);
  EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
  EXPECT_EQ(bus.master->view(McuIndex{0}).detail,
            "bushd.toml:19: mcu[0].enable_active: is \"low\", but outputs of this MCU are active "
            "high: update its firmware, or put inverters before the drivers and remove the key");
}

TEST(Connect, AnMcuWithoutALineForAKeypadIsNamedWhereOneIsSet) {
  FakeBus bus(1, 2);
  link::McuSetup setup = bus.setup.mcus[0];
  setup.local = {.motors = 1, .keypad = 2, .keypad_ticks = 0};
  bus.master->reconfigure(McuIndex{0}, setup);
  bus.run_for(3'000'000);
  EXPECT_EQ(bus.master->view(McuIndex{0}).phase, McuPhase::kOffline);
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
              HasSubstr("has no line for a keypad, but motor 1 has `keypad`"));
}

TEST(Connect, ExactlyEnoughMemoryIsEnough) {
  FakeBus bus(1, 4);
  bus.slaves[0].identity.table_codes = 350;
  bus.connect();
}

TEST(Connect, RefusedRequestsAreNamedAndTriedAgain) {
  for (const std::uint8_t type : {BUSHD_MSG_CONFIGURE, BUSHD_MSG_TABLE_BEGIN, BUSHD_MSG_TABLE_DATA,
                                  BUSHD_MSG_TABLE_END, BUSHD_MSG_ASSIGN, BUSHD_MSG_CONTROL}) {
    FakeBus bus;
    bus.slaves[0].refusals = {{type, BUSHD_E_TABLE_UNSORTED}};
    bus.run_for(1'000'000);
    EXPECT_EQ(bus.count<link::McuOnline>(), 0) << int{type};
    EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
                testing::AnyOf(HasSubstr(bushd_status_text(BUSHD_E_TABLE_UNSORTED)),
                               HasSubstr("being configured")));
    ASSERT_TRUE(
        bus.run_until([&] { return bus.master->view(McuIndex{0}).phase == McuPhase::kOffline; }));
    EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr("refused its configuration"));
    EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr("update the older of the two"));
    bus.slaves[0].refusals.clear();
    bus.connect();
  }
}

TEST(Connect, FaultThatVanishesByItselfKeepsNoMcuWaitingForEver) {
  FakeBus bus;
  Slave& slave = bus.slaves[0];
  slave.spoils = [&](bushd_report& report) {
    if (bus.heard_of(BUSHD_MSG_CONTROL).empty()) report.faults = BUSHD_FAULT_SELF_TEST;
  };
  bus.connect();
  EXPECT_NE(slave.flags & BUSHD_FLAG_ENABLED, 0);
}

TEST(Connect, StatusThatNobodyKnowsIsARefusalToo) {
  for (const std::uint8_t type : {BUSHD_MSG_CONFIGURE, BUSHD_MSG_EMISSION}) {
    FakeBus bus;
    bus.slaves[0].refusals = {{type, 255}};
    ASSERT_TRUE(bus.run_until([&] {
      return bus.master->view(McuIndex{0}).detail.find("unknown status") != std::string::npos;
    })) << int{type};
  }
}

TEST(Connect, WhatARefusalAsksForIsTold) {
  struct Case {
    std::uint8_t type;
    bushd_status status;
    const char* text;
  };
  for (const Case& c :
       {Case{BUSHD_MSG_CONFIGURE, BUSHD_E_CAPACITY,
             "CONFIGURE: capacity exceeded; use a longer tick"},
        Case{BUSHD_MSG_TABLE_BEGIN, BUSHD_E_CAPACITY,
             "TABLE_BEGIN: capacity exceeded; use shorter"},
        Case{BUSHD_MSG_INPUTS, BUSHD_E_STATE,
             "INPUTS: not allowed in this state; a motor of it moves"},
        Case{BUSHD_MSG_CONTROL, BUSHD_E_STATE, "CONTROL: not allowed in this state; a motor of it"},
        Case{BUSHD_MSG_EMISSION, BUSHD_E_STATE,
             "is refused: not allowed in this state; a motor of it"}}) {
    FakeBus bus;
    bus.slaves[0].refusals = {{c.type, c.status}};
    ASSERT_TRUE(bus.run_until([&] {
      return bus.master->view(McuIndex{0}).detail.starts_with("refused its configuration");
    }));
    EXPECT_THAT(bus.master->view(McuIndex{0}).detail, HasSubstr(c.text));
  }
}

TEST(Connect, EmissionThatTheMcuRefusesIsNamedWithItsPlaceInTheConfiguration) {
  FakeBus bus;
  bus.setup.mcus[0].emission.settings.pulse_us = 3;
  bus.setup.mcus[0].emission.pulse_at = {
      .message = {}, .file = "b.toml", .line = 7, .key = "mcu[0].pulse_us", .column = 12};
  bus.master = std::make_unique<link::Rs485Master>(bus.setup, bus.source);
  bus.master->port_opened(bus.now_us);
  bus.slaves[0].refusals = {{BUSHD_MSG_EMISSION, BUSHD_E_PULSE_WIDTH}};
  ASSERT_TRUE(bus.run_until([&] {
    return bus.master->view(McuIndex{0}).detail.starts_with("refused its configuration");
  }));
  EXPECT_THAT(bus.master->view(McuIndex{0}).detail,
              HasSubstr("b.toml:7:12: mcu[0].pulse_us: is 3 us"));
}

TEST(Connect, EmissionThatAnMcuDoesNotKnowIsNotAskedFor) {
  FakeBus bus;
  bus.setup.mcus[0].emission.settings.mode = BUSHD_EMISSION_BURST;
  bus.setup.mcus[0].emission.settings.step_us = 100;
  bus.setup.mcus[0].emission.mode_at = {.message = {}, .file = "b.toml", .key = "mcu[0].steps"};
  bus.master = std::make_unique<link::Rs485Master>(bus.setup, bus.source);
  bus.master->port_opened(bus.now_us);
  bus.run_for(1'000'000);
  EXPECT_THAT(
      bus.master->view(McuIndex{0}).detail,
      HasSubstr("b.toml: mcu[0].steps: asks for steps = \"burst\", which this MCU cannot do; "
                "allowed: steps = \"even\""));
  EXPECT_TRUE(bus.heard_of(BUSHD_MSG_EMISSION).empty());
}

TEST(Connect, TableThatIsTooFastForTheEmissionKeepsTheMcuAway) {
  FakeBus bus;
  bus.slaves[0].identity.capabilities |= BUSHD_CAN_BURST;
  bus.setup.mcus[0].emission.settings.mode = BUSHD_EMISSION_BURST;
  bus.setup.mcus[0].emission.settings.step_us = 2000;
  bus.master = std::make_unique<link::Rs485Master>(bus.setup, bus.source);
  bus.master->port_opened(bus.now_us);
  bus.run_for(1'000'000);
  EXPECT_THAT(
      bus.master->view(McuIndex{0}).detail,
      HasSubstr("has room for 1 steps of a motor in a tick, with its emission in 256 slots, "
                "but the table of output 0 makes up to 2"));
}

}  // namespace
}  // namespace bushd::test
