// Programs: how they come into the MCU, what is refused, and what ends them.
#include "firmware/programs.h"

namespace bushd::test {
namespace {

ProgramFrame move_by(std::vector<std::uint8_t> motors, std::vector<std::int32_t> steps) {
  return {.kind = Kind::kMoveBy, .motors = std::move(motors), .to = {std::move(steps)}};
}
ProgramText endless(std::uint8_t flags = 0) {
  return {.flags = flags,
          .frames = {{.kind = Kind::kRepeat},
                     move_by({0, 1}, {400, -50}),
                     wait_us(30'000),
                     move_by({0, 1}, {-400, 50}),
                     {.kind = Kind::kNext},
                     kProgramEnd}};
}

class Program : public Programs {
 protected:
  void expect_stops() {
    ASSERT_EQ(control(BUSHD_PROGRAM_STOP), BUSHD_OK);
    expect_ended(BUSHD_PROGRAM_STOPPED);
  }
  // One that goes on without a host begins, of motors 0 and 1. Returns ticks of motor 2 that end
  // while it moves.
  Ticks begin_beside_another() {
    ProgramText text = endless(BUSHD_PROGRAM_WITHOUT_HOST);
    text.motors = 3;
    begin(text);
    pass(5);
    return {.flags = kStart,
            .first = rig.first_open(),
            .count = 2,
            .mask = 4,
            .displacements = {one(), one()},
            .delays = {64}};
  }
};
BUSHD_IN_BOTH_FORMATS(Program);

TEST_P(Program, NothingRunsFromHalfAnUpload) {
  const Bytes bytes = bytes_of(endless());
  EXPECT_EQ(state().memory, rig.options().program_bytes);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE) << "there is none";
  const std::size_t half = bytes.size() / 2;
  const Bytes first(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(half));
  const Bytes second(bytes.begin() + static_cast<std::ptrdiff_t>(half), bytes.end());
  EXPECT_EQ(put(second, half, bytes.size()), BUSHD_E_STATE) << "the first part is missing";
  ASSERT_EQ(put(first, 0, bytes.size()), BUSHD_OK);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_LOADING);
  EXPECT_EQ(state().size, half);
  EXPECT_EQ(commit(bytes), BUSHD_E_STATE);
  EXPECT_EQ(commit(first), BUSHD_E_STATE);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE);
  EXPECT_EQ(put(second, half + 1, bytes.size() + 1), BUSHD_E_STATE) << "a gap";
  ASSERT_EQ(put(second, half, bytes.size()), BUSHD_OK);
  ASSERT_EQ(put(second, half, bytes.size()), BUSHD_OK) << "its answer was lost";
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE) << "not committed";
  EXPECT_EQ(control(BUSHD_PROGRAM_COMMIT, 0, crc32(bytes) ^ 1), BUSHD_E_CRC);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE);
  ASSERT_EQ(commit(bytes), BUSHD_OK);
  ASSERT_EQ(commit(bytes), BUSHD_OK) << "its answer was lost";
  EXPECT_EQ(state().crc, crc32(bytes));
  EXPECT_EQ(state().size, bytes.size());
  ASSERT_EQ(control(BUSHD_PROGRAM_ERASE), BUSHD_OK);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_NONE);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE);
  EXPECT_TRUE(made.empty());
}

TEST_P(Program, ANewUploadDiscardsTheOneBefore) {
  ASSERT_EQ(load(endless()), BUSHD_OK);
  ASSERT_EQ(put({1}, 0, 30), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE);
  EXPECT_EQ(put({1, 2, 3}, 0, rig.options().program_bytes + 1u), BUSHD_E_CAPACITY);
}

TEST_P(Program, WhatIsNoProgramIsRefused) {
  Bytes bytes = bytes_of(endless());
  bytes[0] = 2;
  ASSERT_EQ(upload(bytes), BUSHD_OK);
  EXPECT_EQ(commit(bytes), BUSHD_E_VERSION);
  bytes[0] = 1;
  bytes.pop_back();
  ASSERT_EQ(upload(bytes), BUSHD_OK);
  EXPECT_EQ(commit(bytes), BUSHD_E_LENGTH);
  ProgramText text = endless();
  text.motors = 0x1F;
  EXPECT_EQ(load(text), BUSHD_E_FORMAT) << "it has four motors";
  text = {.frames = {{.kind = Kind::kWaitInput, .input = 4}, kProgramEnd}};
  EXPECT_EQ(load(text), BUSHD_E_FORMAT) << "and four inputs";
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE);
}

TEST_P(Program, AnElementaryLineIsRefusedWhereThatLawIsDenied) {
  const ProgramText text{
      .frames = {{.kind = Kind::kLineBy, .motors = {0, 1}, .to = {{9, 5}}, .elementary = true},
                 kProgramEnd}};
  EXPECT_EQ(load(text), BUSHD_OK);
  rig.mutable_mcu()->config.no_elementary = true;
  EXPECT_EQ(load(text), BUSHD_E_FORMAT);
}

TEST_P(Program, RunIsRefusedWithItsReason) {
  ProgramText text = endless();
  ASSERT_EQ(load(text), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open() - 1), BUSHD_E_LATE);
  EXPECT_EQ(start(rig.tick() + 32768), BUSHD_E_CAPACITY);
  text.least = 1;
  ASSERT_EQ(load(text), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_FORMAT) << "it stands outside";
  text = {.frames = {{.kind = Kind::kLineBy, .motors = {0}, .to = {{9}}}, kProgramEnd}};
  Bytes bytes = bytes_of(text);
  bytes[4 + 4 * 9 + 3] = 3;  // the table of the line
  ASSERT_EQ(upload(bytes), BUSHD_OK);
  ASSERT_EQ(commit(bytes), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_NO_TABLE);
  bytes[4 + 4 * 9 + 3] = 0;
  bytes[4] = 2;  // that of motor 0
  ASSERT_EQ(upload(bytes), BUSHD_OK);
  ASSERT_EQ(commit(bytes), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_NO_TABLE);
  ASSERT_EQ(load(endless()), BUSHD_OK);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 4, 0)), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE) << "motor 0 moves";
  EXPECT_TRUE(made.empty());
}

TEST_P(Program, TheSameRunAgainChangesNothing) {
  ASSERT_EQ(load({.frames = {move_by({0}, {5}), kProgramEnd}}), BUSHD_OK);
  ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
  ASSERT_EQ(control(BUSHD_PROGRAM_RUN, number_, rig.first_open()), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_DONE);
  ASSERT_EQ(control(BUSHD_PROGRAM_RUN, number_, rig.first_open()), BUSHD_OK);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_ENDED);
  ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_DONE);
  EXPECT_EQ(rig.pulses(0), 10);
}

TEST_P(Program, ItsMotorsAreNobodyElses) {
  ProgramText text = endless();
  text.motors = 3;
  begin(text);
  for (const int ticks : {1, 100}) {  // before its first step, and later
    pass(ticks);
    EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 4)), BUSHD_E_STATE);
    EXPECT_EQ(rig.set_position(1, 7), BUSHD_E_STATE);
    EXPECT_EQ(rig.assign(0, 0), BUSHD_E_STATE);
    EXPECT_EQ(rig.begin(1, law), BUSHD_E_STATE);
    EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_E_STATE);
    EXPECT_EQ(rig.local(1), BUSHD_E_STATE);
    EXPECT_EQ(rig.arm(9, BUSHD_EDGE_RISING, 5000, {{0, 0, 1, 5, 0}}), BUSHD_E_STATE);
    EXPECT_EQ(rig.home({0, 1, 10, 0, 5, 2000, 0}), BUSHD_E_STATE);
    EXPECT_EQ(put({1}, 0, 30), BUSHD_E_STATE);
    EXPECT_EQ(control(BUSHD_PROGRAM_ERASE), BUSHD_E_STATE);
    EXPECT_EQ(start(rig.first_open()), BUSHD_E_STATE);
    --number_;
    EXPECT_EQ(rig.poll().moving & 3, 3);
    EXPECT_EQ(rig.poll().autonomous, 3);
  }
  const Ticks other{.flags = kStart,
                    .first = rig.first_open(),
                    .mask = 4,
                    .displacements = {one()},
                    .delays = {0}};
  EXPECT_EQ(rig.take(other), BUSHD_OK) << "another motor is free";
  expect_stops();
  EXPECT_EQ(rig.pulses(2), 1);
}

TEST_P(Program, AnEmergencyEndsItByItsTablesOrAtOnce) {
  for (const bushd_stop_mode mode : {BUSHD_STOP_RAMP, BUSHD_STOP_IMMEDIATE}) {
    begin(endless(BUSHD_PROGRAM_WITHOUT_HOST));
    pass(90);
    ASSERT_NE(rig.slot_buffer().active, 0);
    rig.emergency(mode);
    const std::uint32_t asked = rig.tick();
    expect_ended(BUSHD_PROGRAM_FAULT);
    EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_EMERGENCY);
    if (mode == BUSHD_STOP_IMMEDIATE) {
      EXPECT_LE(made.rbegin()->tick, asked + 1);
    }
    ASSERT_EQ(rig.clear(BUSHD_FAULT_EMERGENCY), BUSHD_OK);
    pass(200);
    EXPECT_EQ(state().stage, BUSHD_PROGRAM_ENDED) << "it does not go on";
  }
}

TEST_P(Program, TheEmergencyInputEndsItAtRestToo) {
  InputSettings settings;
  settings.emergency = 1;
  ASSERT_EQ(rig.set_inputs(settings), BUSHD_OK);
  begin({.flags = BUSHD_PROGRAM_WITHOUT_HOST, .frames = {wait_us(5'000'000), kProgramEnd}});
  pass(20);
  rig.pins({0, BUSHD_INPUT_EMERGENCY});
  expect_ended(BUSHD_PROGRAM_FAULT);
}

TEST_P(Program, OvercurrentEndsIt) {
  InputSettings settings;
  settings.overcurrent = 500;
  ASSERT_EQ(rig.set_inputs(settings), BUSHD_OK);
  begin(endless(BUSHD_PROGRAM_WITHOUT_HOST));
  pass(60);
  rig.current(501);
  const std::uint32_t asked = rig.tick();
  // The step that is prepared when it is noticed may be cut by EN; it is counted, as always.
  const bushd_program_state ended = pass_until_ended();
  EXPECT_EQ(ended.reason, BUSHD_PROGRAM_FAULT);
  EXPECT_EQ(rig.poll().motor[0].position_steps, rig.pulses(0));
  EXPECT_LE(made.rbegin()->tick, asked + 2);
  EXPECT_FALSE(rig.enabled());
}

TEST_P(Program, SilenceEndsItAlongItsTables) {
  for (const bool at_rest : {false, true}) {
    ASSERT_EQ(rig.configure(format, Rig::kTickNs, 200), BUSHD_OK);
    begin(at_rest ? ProgramText{.frames = {wait_us(60'000'000), kProgramEnd}} : endless());
    pass(205);
    const std::uint32_t from = rig.tick();
    pass(300);
    const bushd_program_state ended = state();
    EXPECT_EQ(ended.stage, BUSHD_PROGRAM_ENDED);
    EXPECT_EQ(ended.reason, BUSHD_PROGRAM_SILENCE);
    EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
    if (!at_rest) {
      EXPECT_LE(made.rbegin()->tick, from + 60);
    }
    expect_counted();
    ASSERT_EQ(rig.clear(BUSHD_FAULT_LINK), BUSHD_OK);
    ASSERT_EQ(rig.configure(format, Rig::kTickNs, 65535), BUSHD_OK);
  }
}

TEST_P(Program, GoesOnInSilenceIfItSaysSo) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 100), BUSHD_OK);
  const ProgramText text{.flags = BUSHD_PROGRAM_WITHOUT_HOST,
                         .frames = {{.kind = Kind::kRepeat, .count = 5},
                                    move_by({0, 1}, {300, -50}),
                                    wait_us(400'000),
                                    {.kind = Kind::kLineBy, .motors = {0, 1}, .to = {{-300, 50}}},
                                    {.kind = Kind::kNext},
                                    kProgramEnd}};
  ASSERT_EQ(load(text), BUSHD_OK);
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(start(first), BUSHD_OK);
  ProgramWalk walk(law, Rig::kTickNs, rig.options().slots);
  walk.run(text, first);
  // Not a byte is heard.
  while (rig.mcu().config.program->motors != 0) pass();
  ASSERT_GT(rig.tick() - first, 1000u);
  pass(3);
  EXPECT_EQ(made, walk.steps());
  EXPECT_EQ(state().reason, BUSHD_PROGRAM_DONE);
  EXPECT_EQ(state().repeats, 5u);
  EXPECT_EQ(rig.poll().faults, 0);
  expect_counted();
}

// The stream of another motor starves, and its MCU says so; that is no matter of the program.
TEST_P(Program, AStreamThatStarvesDoesNotEndOneWithoutHost) {
  Ticks other = begin_beside_another();
  ASSERT_EQ(rig.take(other), BUSHD_OK);
  pass(300);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_RUNS);
  expect_stops();
}

// Faults that end no program are not kept from other motors for as long as one goes on.
TEST_P(Program, FaultsThatEndNoneAreClearedBesideOneWithoutHost) {
  Ticks other = begin_beside_another();
  ASSERT_EQ(rig.take(other), BUSHD_OK);
  while (rig.poll().faults == 0) pass();
  EXPECT_EQ(rig.clear(BUSHD_FAULT_LINK), BUSHD_E_STATE) << "the other motor ramps down";
  while ((rig.poll().moving & 4) != 0) pass();
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_E_STATE) << "it is not named";
  for (const unsigned ends : {BUSHD_FAULT_SELF_TEST, BUSHD_FAULT_EMERGENCY,
                              BUSHD_FAULT_EMERGENCY_INPUT, BUSHD_FAULT_OVERCURRENT}) {
    EXPECT_EQ(rig.clear(static_cast<std::uint8_t>(BUSHD_FAULT_LINK | ends)), BUSHD_E_STATE);
  }
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  ASSERT_EQ(rig.clear(BUSHD_FAULT_LINK), BUSHD_OK);
  EXPECT_EQ(rig.poll().faults, 0);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_RUN);
  other.first = rig.first_open();
  EXPECT_EQ(rig.take(other), BUSHD_OK) << "the other motor is free again";
  pass(300);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_RUNS);
  expect_stops();
}

TEST_P(Program, FaultsAreNotClearedBesideOneThatNeedsItsHost) {
  begin({.frames = {wait_us(5'000'000), kProgramEnd}});
  pass(3);
  EXPECT_EQ(rig.clear(BUSHD_FAULT_LINK), BUSHD_E_STATE);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_RUNS);
}

// An emergency and its clearing within one tick: the program has not looked at its faults yet.
TEST_P(Program, AnEmergencyIsNotClearedBeforeAProgramThatWaitsHasSeenIt) {
  begin({.flags = BUSHD_PROGRAM_WITHOUT_HOST, .frames = {wait_us(5'000'000), kProgramEnd}});
  pass(3);
  rig.emergency(BUSHD_STOP_RAMP);
  EXPECT_EQ(rig.clear(BUSHD_FAULT_EMERGENCY), BUSHD_E_STATE);
  EXPECT_EQ(rig.clear(BUSHD_FAULT_LINK), BUSHD_OK) << "which is none of the others";
  expect_ended(BUSHD_PROGRAM_FAULT);
}

// While it went on alone its clock drifted: who comes back says other times.
TEST_P(Program, OneWithoutHostComesIntoStepWithAHostThatComesBack) {
  begin({.flags = BUSHD_PROGRAM_WITHOUT_HOST,
         .frames = {move_by({0}, {900}), wait_us(200'000), move_by({0}, {-900}), kProgramEnd}});
  pass(100);
  ASSERT_NE(rig.slot_buffer().active, 0);
  const std::uint32_t far = rig.tick() + 5000;
  rig.sync({9, 1, false, 0, 0, 0});
  rig.sync({9, 2, true, 1, far, 0});
  EXPECT_EQ(rig.poll().faults, 0);
  EXPECT_EQ(rig.poll().flags & BUSHD_FLAG_SYNCED, 0);
  while (rig.mcu().config.program->moving != 0) pass();
  pass(3);
  EXPECT_EQ(rig.pulses(0), 900);
  rig.sync({9, 3, false, 0, 0, 0});
  rig.sync({9, 4, true, 3, far + 5000, 0});
  EXPECT_NE(rig.poll().flags & BUSHD_FLAG_SYNCED, 0);
  expect_ended(BUSHD_PROGRAM_DONE);
  EXPECT_EQ(rig.pulses(0), 0);
  EXPECT_EQ(rig.poll().faults, 0);
}

TEST_P(Program, ALimitEndsItForAllItsMotors) {
  InputSettings settings;
  settings.limit_positive = 1;
  ASSERT_EQ(rig.set_inputs(settings), BUSHD_OK);
  begin({.frames = {move_by({0, 1}, {400, -390}), kProgramEnd}});
  pass(60);
  ASSERT_GT(rig.pulses(0), 0);
  ASSERT_LT(rig.pulses(1), 0);
  rig.pins({1, 0});
  expect_ended(BUSHD_PROGRAM_LIMIT);
  EXPECT_LT(rig.pulses(0), 400);
  EXPECT_GT(rig.pulses(1), -390);
  // It is still there when it begins anew.
  ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
  const std::size_t before = made.size();
  expect_ended(BUSHD_PROGRAM_LIMIT);
  EXPECT_EQ(made.size(), before);
}

TEST_P(Program, NoFrameLeadsBeyondWhatAMotorMay) {
  for (const Kind kind : {Kind::kMoveBy, Kind::kLineBy}) {
    begin({.least = -30,
           .most = 100,
           .frames = {{.kind = Kind::kRepeat},
                      {.kind = kind, .motors = {0, 1}, .to = {{40, 0}}},
                      {.kind = Kind::kNext},
                      kProgramEnd}});
    const bushd_program_state ended = pass_until_ended();
    EXPECT_EQ(ended.reason, BUSHD_PROGRAM_RANGE);
    EXPECT_EQ(ended.repeats, 2u);
    EXPECT_EQ(rig.pulses(0), 80);
    begin({.frames = {{.kind = Kind::kMoveTo, .motors = {0}, .to = {{0}}}, kProgramEnd}});
    expect_ended(BUSHD_PROGRAM_DONE);
  }
}

TEST_P(Program, ALineWaitsForNobodyElses) {
  ProgramText text{.motors = 1,
                   .frames = {{.kind = Kind::kLineBy, .motors = {0}, .to = {{40}}}, kProgramEnd}};
  ASSERT_EQ(load(text), BUSHD_OK);
  const auto line =
      frame({.first = rig.first_open(), .motors = {{2, 500}, {3, 20}}, .longest = 500});
  ASSERT_EQ(rig.take(BUSHD_MSG_LINE_RUN, line), BUSHD_OK);
  ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
  const bushd_program_state ended = pass_until_ended();
  EXPECT_EQ(ended.reason, BUSHD_PROGRAM_REFUSED);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 0);
  EXPECT_EQ(rig.pulses(2), 500);
}

TEST_P(Program, AnMcuWithoutTheCapabilityKnowsNoneOfIt) {
  ReadyRig none(law, format, {.disabled_capabilities = BUSHD_CAN_PROGRAM});
  EXPECT_EQ(none.identify().capabilities & BUSHD_CAN_PROGRAM, 0u);
  EXPECT_EQ(none.request(BUSHD_MSG_PROGRAM_PUT, {0, 0, 9, 0, 1}), BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(none.request(BUSHD_MSG_PROGRAM, {0, 0, 0, 0, 0, 0}), BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(none.request(BUSHD_MSG_PROGRAM_STATE, {}), BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_NE(rig.identify().capabilities & BUSHD_CAN_PROGRAM, 0u);
}

TEST_P(Program, IsGoneAfterAReset) {
  begin(endless());
  pass(30);
  rig.restart_with_nvm();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_NONE);
  EXPECT_EQ(state().memory, rig.options().program_bytes);
  EXPECT_EQ(rig.poll().autonomous, 0);
}

}  // namespace
}  // namespace bushd::test
