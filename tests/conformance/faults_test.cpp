// What goes wrong on a line, told to a real MCU and to its virtual twin: both must make the same of
// it. And the golden frames of tests/vectors, which every MCU must answer in the same way.
#include <fstream>
#include <string>

#include "conformance/script.h"
#include "source_path.h"

namespace bushd::sim::faults_test {
namespace {

constexpr TimeNs kBootNs = 300'000'000;
constexpr std::uint8_t kMotor = 3;
constexpr std::uint16_t kDelay = 150;
constexpr std::uint8_t kTicksPerFrame = 8;  // the smallest queue holds them all
constexpr std::size_t kFrames = 5;

class Faults : public TargetScript {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_COARSE));
    for (const std::uint8_t address : {kVirtual, kReal}) {
      ASSERT_NO_FATAL_FAILURE(master_.upload_table(address, 0, 10'000, {400, 300, 200}, kDelay));
      ASSERT_NO_FATAL_FAILURE(master_.assign(address, kMotor, 0));
    }
  }

  void tell(bushd_type type, const Bytes& payload) {
    master_.post(kVirtual, static_cast<std::uint8_t>(type), payload);
    master_.post(kReal, static_cast<std::uint8_t>(type), payload);
    bus_.advance_to(bus_.wire_busy_until_ns());
  }
  void tell_damaged(bushd_type type, const Bytes& payload) {
    for (const std::uint8_t address : {kVirtual, kReal}) {
      Bytes wire = FrameMaster::wire(address, static_cast<std::uint8_t>(type), 0, payload);
      wire[wire.size() / 2] ^= 0x40;
      bus_.master_send(wire, bus_.now_ns());
    }
    bus_.advance_to(bus_.wire_busy_until_ns());
  }
  // To both in one frame.
  void broadcast(bushd_type type, const Bytes& payload) {
    master_.post(BUSHD_ADDRESS_BROADCAST, static_cast<std::uint8_t>(type), payload);
    bus_.advance_to(bus_.wire_busy_until_ns());
  }

  // One of kFrames of a move that makes a step a tick.
  Bytes frame(std::size_t index) const {
    const std::uint16_t delay = index + 1 < kFrames ? 256 : 0;
    return test::ticks_payload(
        {.flags = static_cast<std::uint8_t>(index == 0 ? BUSHD_TICKS_START : 0),
         .first = first_tick_ + static_cast<std::uint32_t>(index) * kTicksPerFrame,
         .count = kTicksPerFrame,
         .mask = 1u << kMotor,
         .displacements = std::vector<std::int16_t>(kTicksPerFrame, 1 | BUSHD_COARSE_DIRECTION),
         .delays = {delay}});
  }

  // A run of more steps than a test waits for.
  void start_run() {
    const bushd_table_run_entry entry{kMotor, 0, 1, 5000, 0};
    tell(BUSHD_MSG_TABLE_RUN, test::table_run_payload(0, master_.poll(kReal).tick + 24, entry));
  }

  void expect_alike(std::uint8_t faults, std::size_t at_least_steps, std::size_t at_most_steps) {
    const bushd_report expected = master_.poll(kVirtual);
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(expected.faults, faults);
    EXPECT_EQ(report.faults, faults);
    EXPECT_EQ(report.state, expected.state);
    EXPECT_EQ(report.moving, 0);
    EXPECT_EQ(report.bad_frames, expected.bad_frames);
    EXPECT_EQ(report.rejected_frames, expected.rejected_frames);
    EXPECT_EQ(report.last_rejection, expected.last_rejection);
    EXPECT_EQ(report.ramp_downs, expected.ramp_downs);
    const auto steps = recorder_.times(1, Signal::kStep, kMotor, true).size();
    EXPECT_EQ(steps, recorder_.times(0, Signal::kStep, kMotor, true).size());
    EXPECT_GE(steps, at_least_steps);
    EXPECT_LE(steps, at_most_steps);
    EXPECT_EQ(report.motor[kMotor].position_steps, static_cast<std::int32_t>(steps));
    EXPECT_EQ(expected.motor[kMotor].position_steps, static_cast<std::int32_t>(steps));
  }

  static constexpr std::size_t kAllSteps = kFrames * kTicksPerFrame;
  std::uint32_t first_tick_ = 0;
};
BUSHD_FOR_TARGETS(Faults, targets());

TEST_P(Faults, ADamagedFrameCountsForNothingAndIsRepaired) {
  first_tick_ = master_.poll(kReal).tick + 16;
  for (std::size_t i = 0; i < kFrames; ++i) {
    if (i == 2) tell_damaged(BUSHD_MSG_TICKS, frame(i));
    tell(BUSHD_MSG_TICKS, frame(i));
  }
  pass_ticks(140);
  expect_alike(0, kAllSteps, kAllSteps);
  EXPECT_EQ(master_.poll(kReal).bad_frames, 2) << "its own and its neighbour's";
}

TEST_P(Faults, AFrameThatComesLateFillsItsHole) {
  first_tick_ = master_.poll(kReal).tick + 16;
  for (const std::size_t i : {0, 2, 3}) tell(BUSHD_MSG_TICKS, frame(i));
  for (const std::uint8_t address : {kVirtual, kReal}) {
    const bushd_report report = master_.poll(address);
    EXPECT_EQ(report.out_of_order, 1 << kMotor);
    EXPECT_EQ(report.out_of_order_from,
              static_cast<std::uint16_t>(first_tick_ + 2 * kTicksPerFrame));
    EXPECT_EQ(report.out_of_order_until,
              static_cast<std::uint16_t>(first_tick_ + 4 * kTicksPerFrame));
  }
  for (const std::size_t i : {1, 4}) tell(BUSHD_MSG_TICKS, frame(i));
  pass_ticks(140);
  expect_alike(0, kAllSteps, kAllSteps);
}

TEST_P(Faults, AHoleThatStaysEndsInARampDown) {
  first_tick_ = master_.poll(kReal).tick + 16;
  for (const std::size_t i : {0, 1, 3}) tell(BUSHD_MSG_TICKS, frame(i));
  pass_ticks(140);
  expect_alike(BUSHD_FAULT_LINK, 2 * kTicksPerFrame, 3 * kTicksPerFrame);
  EXPECT_EQ(master_.poll(kReal).ramp_downs, 1);
}

TEST_P(Faults, ATableRunEndsWhenNobodyIsHeard) {
  ASSERT_NO_FATAL_FAILURE(ask(bushd_configure{kTickNs, BUSHD_FORMAT_COARSE, 50}));
  start_run();
  pass_ticks(30);
  broadcast(BUSHD_MSG_POLL, {1, 99, 0, 0, 0, 255});
  pass_ticks(100);
  expect_alike(BUSHD_FAULT_LINK, 60, 200);
}

TEST_P(Faults, AnEmergencyStopIsTheSame) {
  for (const bushd_stop_mode how : {BUSHD_STOP_RAMP, BUSHD_STOP_IMMEDIATE}) {
    first_tick_ = master_.poll(kReal).tick + 16;
    for (std::size_t i = 0; i < kFrames; ++i) tell(BUSHD_MSG_TICKS, frame(i));
    bus_.advance_to(bus_.now_ns() +
                    TimeNs{kTickNs} *
                        static_cast<std::int32_t>(first_tick_ + 15 - master_.poll(kReal).tick));
    const std::size_t before = recorder_.times(1, Signal::kStep, kMotor, true).size();
    EXPECT_GT(before, 10u);
    broadcast(BUSHD_MSG_EMERGENCY, {static_cast<std::uint8_t>(how)});
    pass_ticks(60);
    expect_alike(BUSHD_FAULT_EMERGENCY, before, before + (how == BUSHD_STOP_IMMEDIATE ? 2 : 8));
    ASSERT_NO_FATAL_FAILURE(ask(bushd_control{BUSHD_CONTROL_CLEAR_FAULTS, 0}));
  }
}

class Inputs : public Faults {
 protected:
  void change_inputs(bushd_inputs inputs) {
    to_inputs_time();
    set_inputs(inputs);
  }
};
BUSHD_FOR_TARGETS(Inputs, targets());

TEST_P(Inputs, ALimitStopsItsMotorAndForbidsTheDirection) {
  bushd_set_inputs settings{};
  settings.limit_positive = 1 << kMotor;
  ASSERT_NO_FATAL_FAILURE(ask(settings));
  start_run();
  pass_ticks(60);
  change_inputs({1 << kMotor, 0});
  pass_ticks(40);
  expect_alike(0, 20, 120);
  for (const std::uint8_t address : {kVirtual, kReal}) {
    EXPECT_EQ(master_.poll(address).forbidden_positive, 1 << kMotor);
    EXPECT_EQ(master_.poll(address).forbidden_negative, 0);
  }
}

TEST_P(Inputs, TheEmergencyInputCuts) {
  bushd_set_inputs settings{};
  settings.emergency = BUSHD_EMERGENCY_INPUT_IMMEDIATE;
  ASSERT_NO_FATAL_FAILURE(ask(settings));
  start_run();
  pass_ticks(60);
  change_inputs({0, BUSHD_INPUT_EMERGENCY});
  pass_ticks(40);
  expect_alike(BUSHD_FAULT_EMERGENCY_INPUT, 20, 120);
}

TEST_P(Inputs, TooMuchCurrentTakesThePowerAway) {
  bushd_set_inputs settings{};
  settings.overcurrent = 600;
  ASSERT_NO_FATAL_FAILURE(ask(settings));
  start_run();
  pass_ticks(60);
  bus_.advance_to(bus_.node(0).next_event_ns() + TimeNs{kTickNs} / 2);
  for (const std::size_t mcu : {0, 1}) bus_.node(mcu).set_current(601);
  pass_ticks(40);
  expect_alike(BUSHD_FAULT_OVERCURRENT, 20, 120);
  for (const std::size_t mcu : {0, 1}) {
    EXPECT_EQ(recorder_.times(mcu, Signal::kEnable, 0, false).size(), 1u);
  }
}

// Its edge at once takes EN away, in the middle of a tick, and however short it is.
class DisablingInput : public Inputs {
 protected:
  void control(std::uint8_t action, bushd_status answer = BUSHD_OK) {
    ASSERT_NO_FATAL_FAILURE(ask(bushd_control{action, 0}, answer));
  }
  void expect_en_fell_within_a_slot_of(TimeNs time_ns) {
    const TimeNs slot_ns = kTickNs / 128;
    for (const std::size_t mcu : {0, 1}) {
      const auto falls = recorder_.times(mcu, Signal::kEnable, 0, false);
      ASSERT_EQ(falls.size(), 1u);
      EXPECT_GE(falls[0], time_ns);
      EXPECT_LE(falls[0], time_ns + slot_ns);
    }
  }
};
BUSHD_FOR_TARGETS(DisablingInput, targets());

TEST_P(DisablingInput, TakesEnAwayWithinASlotOfAPressThatIsShorterThanATick) {
  for (const bool open : {false, true}) {
    SCOPED_TRACE(open ? "active when open" : "active when closed");
    bushd_set_inputs settings{};
    settings.emergency = BUSHD_EMERGENCY_INPUT_DISABLE;
    if (open) settings.system_inverted = BUSHD_INPUT_EMERGENCY;
    const std::uint8_t rests = open ? BUSHD_INPUT_EMERGENCY : 0;
    const std::uint8_t pressed = open ? 0 : BUSHD_INPUT_EMERGENCY;
    ASSERT_NO_FATAL_FAILURE(ask(bushd_set_inputs{}));
    change_inputs({0, rests});
    ASSERT_NO_FATAL_FAILURE(ask(settings));
    recorder_.edges.clear();
    const auto before = master_.poll(kReal).motor[kMotor].position_steps;
    start_run();
    pass_ticks(60);
    change_inputs({0, pressed});
    const TimeNs pressed_ns = bus_.now_ns();
    bus_.advance_to(pressed_ns + TimeNs{kTickNs} / 16);
    set_inputs({0, rests});
    pass_ticks(40);
    expect_en_fell_within_a_slot_of(pressed_ns);
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(report.faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
    EXPECT_EQ(report.moving, 0);
    const auto steps = recorder_.times(1, Signal::kStep, kMotor, true).size();
    EXPECT_GT(steps, 20u);
    EXPECT_EQ(steps, recorder_.times(0, Signal::kStep, kMotor, true).size());
    EXPECT_EQ(report.motor[kMotor].position_steps, before + static_cast<std::int32_t>(steps));
    ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_ENABLE, BUSHD_E_STATE));
    ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_CLEAR_FAULTS));
    ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_ENABLE));
    for (const std::uint8_t address : {kVirtual, kReal}) {
      EXPECT_EQ(master_.poll(address).state, BUSHD_STATE_READY);
    }
    for (const std::size_t mcu : {0, 1}) {
      EXPECT_EQ(recorder_.times(mcu, Signal::kEnable, 0, false).size(), 1u);
      EXPECT_EQ(recorder_.times(mcu, Signal::kEnable, 0, true).size(), 1u);
    }
  }
}

TEST_P(DisablingInput, ThatIsActiveWhenDriversAreEnabledLeavesThemOff) {
  bushd_set_inputs settings{};
  settings.emergency = BUSHD_EMERGENCY_INPUT_DISABLE;
  ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_DISABLE));
  ASSERT_NO_FATAL_FAILURE(ask(settings));
  change_inputs({0, BUSHD_INPUT_EMERGENCY});
  pass_ticks(3);
  recorder_.edges.clear();
  ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_ENABLE, BUSHD_E_STATE));
  for (const std::uint8_t address : {kVirtual, kReal}) {
    EXPECT_EQ(master_.poll(address).faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
  }
  for (const std::size_t mcu : {0, 1}) {
    EXPECT_EQ(recorder_.times(mcu, Signal::kEnable, 0, true).size(), 0u);
  }
}

// The port looks at the level when it begins to watch: there is no edge to come.
TEST_P(DisablingInput, ThatIsActiveWhenItsSettingsComeTakesEnAwayWithThem) {
  for (const bool open : {false, true}) {
    SCOPED_TRACE(open ? "active when open" : "active when closed");
    bushd_set_inputs settings{};
    if (open) settings.system_inverted = BUSHD_INPUT_EMERGENCY;
    change_inputs({0, static_cast<std::uint8_t>(open ? BUSHD_INPUT_EMERGENCY : 0)});
    settings.emergency = BUSHD_EMERGENCY_INPUT_RAMP;
    ASSERT_NO_FATAL_FAILURE(ask(settings));
    ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_CLEAR_FAULTS));
    ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_ENABLE));
    change_inputs({0, static_cast<std::uint8_t>(open ? 0 : BUSHD_INPUT_EMERGENCY)});
    pass_ticks(3);
    for (const std::uint8_t address : {kVirtual, kReal}) {
      ASSERT_EQ(master_.poll(address).faults, BUSHD_FAULT_EMERGENCY_INPUT);
      ASSERT_NE(master_.poll(address).flags & BUSHD_FLAG_ENABLED, 0);
    }
    settings.emergency = BUSHD_EMERGENCY_INPUT_DISABLE;
    recorder_.edges.clear();
    for (const std::size_t mcu : {0, 1}) {
      bus_.advance_to(bus_.node(0).next_event_ns());
      const TimeNs begun_ns = bus_.now_ns();
      ASSERT_EQ(master_.acknowledged(mcu == 0 ? kVirtual : kReal, settings), BUSHD_OK);
      pass_ticks(3);
      const auto falls = recorder_.times(mcu, Signal::kEnable, 0, false);
      ASSERT_EQ(falls.size(), 1u);
      EXPECT_LT(falls[0], begun_ns + TimeNs{kTickNs} * 7 / 8) << "the core looks in the next tick";
      EXPECT_EQ(recorder_.times(mcu, Signal::kEnable, 0, true).size(), 0u);
    }
    for (const std::uint8_t address : {kVirtual, kReal}) {
      EXPECT_EQ(master_.poll(address).faults, BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_DISABLED);
    }
  }
}

// In the second half of a tick the next one is prepared, and the main loop is free. What is left
// when the last bit has come are the last byte, the CRC and the first lines of the stop: some 1000
// cycles. Slots of a motion take half of the time from them, so these are some 6 slots of 20 us
// each at 16 MHz; 12 is that twice, and a tenth of a tick.
TEST_P(DisablingInput, IsAsFastAsTheFrameOfACommandedStop) {
  const TimeNs slot_ns = kTickNs / 128;
  start_run();
  pass_ticks(60);
  recorder_.edges.clear();
  bus_.advance_to(bus_.node(0).next_event_ns() + TimeNs{kTickNs} / 2);
  broadcast(BUSHD_MSG_EMERGENCY, {BUSHD_STOP_DISABLE});
  const TimeNs heard_ns = bus_.now_ns();
  pass_ticks(40);
  for (const std::size_t mcu : {0, 1}) {
    const auto falls = recorder_.times(mcu, Signal::kEnable, 0, false);
    ASSERT_EQ(falls.size(), 1u);
    EXPECT_LE(falls[0], heard_ns + 12 * slot_ns);
  }
  for (const std::uint8_t address : {kVirtual, kReal}) {
    EXPECT_EQ(master_.poll(address).faults, BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_DISABLED);
  }
  ASSERT_NO_FATAL_FAILURE(control(BUSHD_CONTROL_ENABLE, BUSHD_E_STATE));
}

// Everything that is said of a line in tests/vectors, to one MCU: its answers.
class GoldenFrames : public testing::TestWithParam<Target> {
 protected:
  struct Answer {
    std::uint8_t type;
    std::uint8_t sequence;
    Bytes payload;
  };

  static std::vector<Bytes> wires() {
    std::ifstream file(test::source_path("tests/vectors/frames.csv"));
    std::vector<Bytes> out;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
      const std::string hex = line.substr(line.rfind(',') + 1);
      Bytes wire;
      for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
        wire.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
      }
      out.push_back(wire);
    }
    return out;
  }

  template <class Add>
  static std::vector<Answer> answers_of(Add add) {
    Bus bus(kBaud);
    add(bus);
    FrameMaster master(bus);
    bus.advance_to(kBootNs);
    // A second time all of them are out of date.
    for (int round = 0; round < 2; ++round) {
      for (const Bytes& wire : wires()) {
        bus.master_send(wire, bus.now_ns());
        bus.advance_to(bus.wire_busy_until_ns() + 40'000'000);
      }
    }
    std::vector<Answer> answers;
    for (const Frame& frame : master.frames) {
      answers.push_back({frame.type, frame.sequence, frame.payload});
    }
    EXPECT_EQ(master.bad_frames, 0);
    return answers;
  }
};
BUSHD_FOR_TARGETS(GoldenFrames, targets());

TEST_P(GoldenFrames, AreAnsweredLikeTheVirtualMcuDoes) {
  const auto real = GetParam().make();
  for (const std::uint8_t address : Bytes{1, 2, 3, 9}) {
    SCOPED_TRACE("address " + std::to_string(address));
    McuOptions twin = real->twin();
    twin.address = address;
    twin.unique_id = 0x0102030405060708;
    const auto expected = answers_of([&](Bus& bus) { bus.add_mcu(twin); });
    const auto answers = answers_of([&](Bus& bus) {
      bus.add_mcu([&](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
        return real->make({address, twin.unique_id, 0}, index, driver, sink);
      });
    });
    ASSERT_EQ(answers.size(), expected.size());
    EXPECT_GT(answers.size(), 2u);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      EXPECT_EQ(answers[i].type, expected[i].type);
      EXPECT_EQ(answers[i].sequence, expected[i].sequence);
      EXPECT_EQ(answers[i].payload.size(), expected[i].payload.size());
      const bool acknowledges = expected[i].payload.size() == 1;
      if (acknowledges) {
        EXPECT_EQ(answers[i].payload, expected[i].payload) << "type " << int{answers[i].type};
      }
    }
  }
}

}  // namespace
}  // namespace bushd::sim::faults_test
