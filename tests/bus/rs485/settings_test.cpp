// What an MCU is told of its motors, inputs and outputs while it is connected.
#include <gmock/gmock.h>

#include "bus/rs485/slave.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<Bytes> told(const std::vector<Heard>& frames, std::uint8_t type) {
  std::vector<Bytes> payloads;
  for (const Heard& heard : frames) {
    if (heard.type == type) payloads.push_back(heard.payload);
  }
  return payloads;
}

// The one MCU can do this as well, and is connected a second time with another setup.
struct Reconnected : FakeBus {
  Reconnected(std::uint32_t capabilities, const std::function<void(link::McuSetup&)>& change)
      : FakeBus(1, 2) {
    slaves[0].identity.capabilities |= capabilities;
    connect();
    first = heard;
    link::McuSetup other = setup.mcus[0];
    change(other);
    master->reconfigure(McuIndex{0}, other);
    heard.clear();
    connect();
  }
  std::vector<Heard> first;
};

bushd_set_inputs inputs_of(const Bytes& payload) {
  bushd_set_inputs inputs{};
  EXPECT_EQ(bushd_decode_set_inputs(payload.data(), payload.size(), &inputs), BUSHD_OK);
  return inputs;
}

// A switch may have gone from the configuration since the last time.
TEST(Connect, SettingsOfInputsAreToldEveryTime) {
  const Reconnected bus(0, [](link::McuSetup& setup) {
    setup.inputs.limit_positive = 0x8001;
    setup.inputs.overcurrent = 900;
  });
  const auto now = told(bus.heard, BUSHD_MSG_INPUTS);
  ASSERT_EQ(now.size(), 1u);
  EXPECT_EQ(inputs_of(now[0]).limit_positive, 0x8001);
  EXPECT_EQ(inputs_of(now[0]).overcurrent, 900);
  const auto before = told(bus.first, BUSHD_MSG_INPUTS);
  ASSERT_EQ(before.size(), 1u);
  EXPECT_EQ(inputs_of(before[0]).limit_positive, 0);
}

TEST(Connect, SwitchesAtOtherInputsAreToldAfterTheSettings) {
  const Reconnected bus(BUSHD_CAN_MOTOR_INPUTS, [](link::McuSetup& setup) {
    setup.motor_inputs = {{0, 9, 14, 3}, {1, 1, 1, 15}};
  });
  EXPECT_THAT(told(bus.heard, BUSHD_MSG_MOTOR_INPUTS),
              ElementsAre(Bytes{0, 9, 14, 3}, Bytes{1, 1, 1, 15}));
  EXPECT_THAT(told(bus.first, BUSHD_MSG_MOTOR_INPUTS), IsEmpty()) << "those of INPUTS will do";
}

TEST(Connect, CurrentsAreToldToAnMcuThatControlsThem) {
  using Currents = bushd_currents;
  const Reconnected without(0, [](link::McuSetup& setup) {
    setup.currents = {Currents{0, BUSHD_DECAY_FAST, 0, 0, 0},
                      Currents{1, BUSHD_DECAY_SLOW, 0, 0, 0}};
  });
  EXPECT_THAT(told(without.heard, BUSHD_MSG_CURRENTS), IsEmpty());
  const Reconnected bus(BUSHD_CAN_CURRENTS, [](link::McuSetup& setup) {
    setup.currents = {Currents{0, BUSHD_DECAY_FAST, 1500, 1000, 300},
                      Currents{1, BUSHD_DECAY_SLOW, 0, 0, 0}};
  });
  EXPECT_THAT(told(bus.heard, BUSHD_MSG_CURRENTS),
              ElementsAre(Bytes{0, 1, 0xDC, 5, 0xE8, 3, 0x2C, 1}, Bytes{1, 0, 0, 0, 0, 0, 0, 0}));
}

TEST(Connect, VelocitiesAreToldToAnMcuThatHasTheLoop) {
  const Reconnected without(0, [](link::McuSetup& setup) { setup.velocities = {{0, 0, 0, 0}}; });
  EXPECT_THAT(told(without.heard, BUSHD_MSG_VELOCITY), IsEmpty());
  const Reconnected bus(BUSHD_CAN_VELOCITY, [](link::McuSetup& setup) {
    setup.velocities = {{0, 0, 0, 0}, {1, 6400, 96000, 500}};
  });
  EXPECT_THAT(told(bus.heard, BUSHD_MSG_VELOCITY),
              ElementsAre(Bytes(13, 0), Bytes{1, 0, 0x19, 0, 0, 0, 0x77, 1, 0, 0xF4, 1, 0, 0}))
      << "it may have kept others";
}

// EN of drivers that are enabled by a low level must not be raised and lowered by another one
// first.
TEST(Connect, LevelsOfOutputsAreToldBeforeTheDriversAreEnabled) {
  for (const bool phases : {false, true}) {
    const Reconnected bus(BUSHD_CAN_OUTPUTS | BUSHD_CAN_PHASES, [&](link::McuSetup& setup) {
      setup.outputs = {.step_low = 0x0102, .direction_low = 0x8000, .enabled = BUSHD_ENABLED_LOW};
      if (phases) setup.emission.settings.mode = BUSHD_EMISSION_PHASES;
    });
    std::vector<int> requests;
    for (const Heard& heard : bus.heard) {
      if (heard.type == BUSHD_MSG_OUTPUTS || heard.type == BUSHD_MSG_EMISSION ||
          heard.type == BUSHD_MSG_CONTROL) {
        requests.push_back(heard.type);
      }
    }
    const std::vector<int> pulses{BUSHD_MSG_EMISSION, BUSHD_MSG_OUTPUTS, BUSHD_MSG_CONTROL};
    const std::vector<int> windings{BUSHD_MSG_OUTPUTS, BUSHD_MSG_EMISSION, BUSHD_MSG_CONTROL};
    EXPECT_EQ(requests, phases ? windings : pulses);
    EXPECT_THAT(told(bus.heard, BUSHD_MSG_OUTPUTS), ElementsAre(Bytes{2, 1, 0, 0x80, 2}));
  }
}

}  // namespace
}  // namespace bushd::test
