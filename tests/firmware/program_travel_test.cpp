// TRAVEL as a frame of a program: from one limit to the other and back, also when nobody is heard.
#include "firmware/programs.h"

namespace bushd::test {
namespace {

constexpr std::uint8_t kProgrammed = 1;
constexpr std::uint16_t kProgrammedBit = 1 << kProgrammed;
constexpr std::uint16_t kProgrammedLeft = 1 << 2;
constexpr std::int64_t kProgrammedWay = 60;
constexpr std::uint32_t kProgrammedReturnUs = 20'000;

class ProgramTravel : public Programs {
 protected:
  ProgramTravel() {
    EXPECT_EQ(rig.set_inputs({.limit_positive = kProgrammedBit, .limit_negative = kProgrammedBit}),
              BUSHD_OK);
    EXPECT_EQ(rig.motor_inputs({kProgrammed, 1, 2, 1}), BUSHD_OK);
    rig.sense = [this] {
      unsigned active = 0;
      if (rig.pulses(kProgrammed) >= right_) active |= kProgrammedBit;
      if (rig.pulses(kProgrammed) <= 0) active |= kProgrammedLeft;
      return bushd_inputs{static_cast<std::uint16_t>(active), 0};
    };
    rig.pass(2);
  }
  static ProgramFrame travel(std::int32_t steps = kProgrammedWay) {
    return {
        .kind = Kind::kTravel, .motors = {kProgrammed}, .to = {{steps}}, .us = kProgrammedReturnUs};
  }
  static ProgramFrame at_edges(std::uint32_t delay_us) {
    ProgramFrame frame = travel();
    frame.edge = BUSHD_EDGE_RISING;
    frame.delay_us = delay_us;
    return frame;
  }
  static ProgramText alone(std::vector<ProgramFrame> frames) {
    return {
        .flags = BUSHD_PROGRAM_WITHOUT_HOST, .motors = kProgrammedBit, .frames = std::move(frames)};
  }
  // By the sums of the table's delays.
  void expect_run(std::int64_t begin_ns, bool positive) {
    const auto reference = Reference::move(law, kProgrammedWay);
    for (std::size_t i = 0; i < kProgrammedWay; ++i) {
      end_ns = begin_ns + static_cast<std::int64_t>(reference.step(i).end / 256);
      const std::int64_t slot =
          end_ns % kTick == 0 ? end_ns / kTick * kSlots - 1 : end_ns * kSlots / kTick;
      expected.insert({static_cast<std::uint32_t>(slot / kSlots),
                       static_cast<std::uint16_t>(slot % kSlots), kProgrammed, positive});
    }
  }

  std::int64_t right_ = kProgrammedWay;
  std::set<MadeStep> expected;
  std::int64_t end_ns = 0;
};
BUSHD_IN_BOTH_FORMATS(ProgramTravel);

TEST_P(ProgramTravel, EveryEdgeThereAndBackIsWhereItBelongs) {
  ASSERT_EQ(
      load(alone(
          {travel(), {.kind = Kind::kMoveBy, .motors = {kProgrammed}, .to = {{5}}}, kProgramEnd})),
      BUSHD_OK);
  const std::uint32_t first = rig.first_open() + 3;
  ASSERT_EQ(start(first), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_DONE);
  expect_run(std::int64_t{first} * kTick, true);
  expect_run(end_ns + kProgrammedReturnUs * 1000, false);
  ASSERT_EQ(made.size(), expected.size() + 5);
  EXPECT_EQ(rig.pulses(kProgrammed), 5);
  for (const MadeStep& step : expected) EXPECT_TRUE(made.contains(step)) << step.tick;
}

TEST_P(ProgramTravel, FollowsEdgesWhenNobodyIsHeard) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 20), BUSHD_OK);
  begin(alone({at_edges(150'000), kProgramEnd}));
  pass(100);
  for (int i = 0; i < 2; ++i) {
    made.clear(), expected.clear();
    ASSERT_EQ(rig.awaited_edge(), BUSHD_EDGE_RISING);
    const std::int64_t edge_ns = rig.tick() * kTick + 700'000;
    rig.trigger(700'000);
    pass(400);
    expect_run(edge_ns + 150'000'000, true);
    expect_run(end_ns > edge_ns + kProgrammedReturnUs * 1000 ? (end_ns / kTick + 3) * kTick : 0,
               false);
    ASSERT_EQ(made.size(), std::size_t{2 * kProgrammedWay});
    EXPECT_TRUE(std::includes(made.begin(), made.end(), expected.begin(),
                              std::next(expected.begin(), kProgrammedWay)));
  }
  EXPECT_EQ(rig.mcu().config.program->stage, BUSHD_PROGRAM_RUNS);
  EXPECT_EQ(rig.poll().faults, 0);
  ASSERT_EQ(control(BUSHD_PROGRAM_STOP, 0, BUSHD_STOP_RAMP), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_STOPPED);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE);
}

TEST_P(ProgramTravel, WithoutAHostItEnds) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 20), BUSHD_OK);
  ProgramText text = alone({at_edges(150'000), kProgramEnd});
  text.flags = 0;
  begin(text);
  pass(40);
  expect_ended(BUSHD_PROGRAM_SILENCE);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE);
}

TEST_P(ProgramTravel, ALimitThatIsMetEarlyEndsTheProgram) {
  right_ = kProgrammedWay / 2;
  begin(alone({travel(), kProgramEnd}));
  expect_ended(BUSHD_PROGRAM_LIMIT);
  EXPECT_EQ(rig.poll().homing, BUSHD_TRAVEL_EARLY);
  begin(alone({travel(), kProgramEnd}));
  expect_ended(BUSHD_PROGRAM_LIMIT);
}

TEST_P(ProgramTravel, ALimitThatIsNotMetEndsTheProgram) {
  right_ = 10'000;
  begin(alone({travel(), kProgramEnd}));
  expect_ended(BUSHD_PROGRAM_TRAVELLED);
  EXPECT_EQ(rig.poll().homing, BUSHD_TRAVEL_NOT_REACHED);
}

TEST_P(ProgramTravel, IsNotPausedButStops) {
  begin(alone({travel(), kProgramEnd}));
  while (rig.pulses(kProgrammed) < 20) pass();
  EXPECT_EQ(control(BUSHD_PROGRAM_PAUSE), BUSHD_E_STATE);
  EXPECT_EQ(control(BUSHD_PROGRAM_STOP, 0, BUSHD_STOP_RAMP), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_STOPPED);
  EXPECT_EQ(rig.poll().homing, BUSHD_TRAVEL_STOPPED);
  EXPECT_LT(rig.pulses(kProgrammed), kProgrammedWay);
}

TEST_P(ProgramTravel, LeadsNoMotorBeyondItsRange) {
  ProgramText text = alone({travel(), kProgramEnd});
  text.most = kProgrammedWay - 1;
  begin(text);
  expect_ended(BUSHD_PROGRAM_RANGE);
  EXPECT_EQ(rig.pulses(kProgrammed), 0);
}

TEST_P(ProgramTravel, AnMcuThatDoesNotTravelTakesNone) {
  Rig other({.disabled_capabilities = BUSHD_CAN_TRAVEL, .program_bytes = 100});
  EXPECT_EQ(other.identify().capabilities & BUSHD_CAN_TRAVEL, 0u);
  other.mutable_mcu()->config.program->stage = BUSHD_PROGRAM_NONE;
  const Bytes bytes = bytes_of(alone({travel(), kProgramEnd}));
  ASSERT_EQ(put(other, bytes, 0, bytes.size()), BUSHD_OK);
  EXPECT_EQ(commit(other, bytes), BUSHD_E_UNKNOWN_MESSAGE);
}

// It waits for its own delay, whatever a program asks for meanwhile.
TEST_P(ProgramTravel, AnotherMotorsTravelIsNotBegunByARefusedOne) {
  constexpr std::uint8_t kOtherTravels = 3;
  constexpr std::uint16_t kBothBits = kProgrammedBit | 1 << kOtherTravels;
  ASSERT_EQ(rig.set_inputs({.limit_positive = kBothBits, .limit_negative = kBothBits}), BUSHD_OK);
  ASSERT_EQ(rig.motor_inputs({kProgrammed, 1, 2, 1}), BUSHD_OK);
  ASSERT_EQ(rig.motor_inputs({kOtherTravels, 3, 0, 3}), BUSHD_OK);
  rig.sense = [] { return bushd_inputs{kProgrammedLeft | 1, 0}; };
  rig.pass(2);
  const bushd_travel message = {.number = 9,
                                .kind = BUSHD_TRAVEL_LIMITS,
                                .motor = kOtherTravels,
                                .direction = 1,
                                .edge = BUSHD_EDGE_RISING,
                                .sensor = 0,
                                .steps = 50,
                                .delay_us = 100'000,
                                .wait_us = 200'000};
  ASSERT_EQ(rig.request(message), BUSHD_OK);
  rig.trigger(0);
  ASSERT_EQ(rig.mcu().travel.stage, BUSHD_TRAVEL_DELAY);
  begin(alone({travel(), kProgramEnd}));
  pass(10);
  EXPECT_EQ(state().reason, BUSHD_PROGRAM_REFUSED);
  EXPECT_EQ(rig.mcu().travel.stage, BUSHD_TRAVEL_DELAY);
  EXPECT_EQ(rig.pulses(kOtherTravels), 0);
}

}  // namespace
}  // namespace bushd::test
