// Programs that outlive resets, and those that begin by themselves when the power comes.
#include "engine/program.h"
#include "firmware/programs.h"

namespace bushd::test {
namespace {

constexpr std::uint8_t kKept = BUSHD_PROGRAM_KEPT;
constexpr std::uint8_t kAtPowerOn =
    BUSHD_PROGRAM_WITHOUT_HOST | BUSHD_PROGRAM_KEPT | BUSHD_PROGRAM_AT_POWER_ON;
// Ticks of one second, rounded up.
constexpr int kBefore = (1'000'000'000 + Rig::kTickNs - 1) / Rig::kTickNs;

class KeptProgram : public Programs {
 protected:
  KeptProgram() : Programs({.queue_ticks = 256, .keeps_programs = true}) {}

  static ProgramText to_and_fro(std::uint8_t flags) {
    return {.flags = flags,
            .motors = 3,
            .least = -30,
            .most = 40,
            .frames = {{.kind = Kind::kMoveBy, .motors = {0, 1}, .to = {{40, -25}}},
                       {.kind = Kind::kMoveBy, .motors = {0}, .to = {{-40}}},
                       kProgramEnd}};
  }
  // As a port goes through all that is kept.
  void scan(bool same) {
    bushd_mcu_nvm_scan pass{};
    bushd_mcu_nvm_begin_scan(&pass);
    while (bushd_mcu_nvm_scan_next(rig.mutable_mcu(), &pass, 64).at != nullptr) {
    }
    bushd_mcu_nvm_compared(rig.mutable_mcu(), same);
  }
  bool is_stored() { return (state().flags & BUSHD_PROGRAM_STORED) != 0; }
  void expect_nothing_moves(int ticks) {
    made.clear();
    pass(ticks);
    EXPECT_TRUE(made.empty());
  }
};
BUSHD_IN_BOTH_FORMATS(KeptProgram);

TEST_P(KeptProgram, IsThereAfterAResetAndWaitsToBeRun) {
  ASSERT_EQ(load(to_and_fro(kKept)), BUSHD_OK);
  const std::uint32_t crc = state().crc;
  rig.restart_with_nvm();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_LOADED);
  EXPECT_EQ(state().crc, crc);
  EXPECT_EQ(state().flags & kAtPowerOn, kKept);
  EXPECT_TRUE(is_stored());
  EXPECT_EQ(state().number, 0);
  EXPECT_EQ(rig.poll().flags & BUSHD_FLAG_ENABLED, 0);
  expect_nothing_moves(2 * kBefore);
  ASSERT_EQ(control(BUSHD_PROGRAM_ERASE), BUSHD_OK);
  rig.restart_with_nvm();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_NONE);
}

TEST_P(KeptProgram, IsRefusedWhereNothingOutlivesAReset) {
  ReadyRig none(law, format, {.keeps_programs = false});
  const Bytes bytes = bytes_of(to_and_fro(kKept));
  ASSERT_EQ(put(none, bytes, 0, bytes.size()), BUSHD_OK);
  EXPECT_EQ(commit(none, bytes), BUSHD_E_CAPACITY);
}

// A scan that had passed by the program before it changed tells nothing.
TEST_P(KeptProgram, IsStoredOnceAWholeScanSaysSo) {
  scan(true);
  scan(true);
  EXPECT_TRUE(is_stored()) << "there is none, and there would be none";
  ASSERT_EQ(load(to_and_fro(kKept)), BUSHD_OK);
  EXPECT_FALSE(is_stored());
  bushd_mcu_nvm_compared(rig.mutable_mcu(), true);  // that was under way
  EXPECT_FALSE(is_stored());
  scan(false);
  EXPECT_FALSE(is_stored());
  scan(true);
  EXPECT_TRUE(is_stored());
  ASSERT_EQ(control(BUSHD_PROGRAM_ERASE), BUSHD_OK);
  EXPECT_FALSE(is_stored()) << "a reset would bring it back";
  bushd_mcu_nvm_compared(rig.mutable_mcu(), true);
  EXPECT_FALSE(is_stored());
  scan(true);
  EXPECT_TRUE(is_stored());
}

TEST_P(KeptProgram, BeginsAtPowerOnAfterASecond) {
  ASSERT_EQ(load(to_and_fro(kAtPowerOn)), BUSHD_OK);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_LOADED) << "not when it is put";
  rig.restart_with_nvm();
  made.clear();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_RUNS);
  EXPECT_EQ(state().frame, 0);
  EXPECT_NE(rig.poll().flags & BUSHD_FLAG_ENABLED, 0);
  // The tick that is emitted after boot is 1; the program first looks at the one before.
  ProgramWalk walk(law, Rig::kTickNs, rig.options().slots);
  walk.run(to_and_fro(kAtPowerOn), rig.tick() + kBefore);
  EXPECT_EQ(pass_until_ended().reason, BUSHD_PROGRAM_DONE);
  EXPECT_EQ(made, walk.steps());
  expect_counted();
}

TEST_P(KeptProgram, BeginsOnlyWhenThePowerWasOff) {
  ASSERT_EQ(load(to_and_fro(kAtPowerOn)), BUSHD_OK);
  for (const auto cause : {BUSHD_RESET_EXTERNAL, BUSHD_RESET_WATCHDOG, BUSHD_RESET_UNKNOWN}) {
    rig.restart_with_nvm(cause);
    EXPECT_EQ(state().stage, BUSHD_PROGRAM_LOADED) << cause;
    expect_nothing_moves(2 * kBefore);
  }
  rig.restart_with_nvm(BUSHD_RESET_BROWN_OUT);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_RUNS);
}

TEST_P(KeptProgram, DoesNotBeginWhereItsTableIsNotThere) {
  ASSERT_EQ(load(to_and_fro(kAtPowerOn)), BUSHD_OK);
  ASSERT_EQ(rig.upload(1, law), BUSHD_OK);
  ASSERT_EQ(rig.assign(1, 1), BUSHD_OK);
  rig.restart_with_nvm();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_ENDED);
  EXPECT_EQ(state().reason, BUSHD_PROGRAM_REFUSED);
  EXPECT_EQ(rig.poll().flags & BUSHD_FLAG_ENABLED, 0);
  expect_nothing_moves(2 * kBefore);
}

TEST_P(KeptProgram, AnEmergencyInputEndsItBeforeItHasMovedAnything) {
  ASSERT_EQ(load(to_and_fro(kAtPowerOn)), BUSHD_OK);
  ASSERT_EQ(rig.set_inputs({.emergency = BUSHD_EMERGENCY_INPUT_RAMP}), BUSHD_OK);
  rig.restart_with_nvm();
  rig.pins({0, BUSHD_INPUT_EMERGENCY});
  expect_nothing_moves(2 * kBefore);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_ENDED);
  EXPECT_EQ(state().reason, BUSHD_PROGRAM_FAULT);
  rig.pins({});
  ASSERT_EQ(rig.clear(BUSHD_FAULT_EMERGENCY_INPUT), BUSHD_OK);
  expect_nothing_moves(2 * kBefore);
}

// Wherever its motors are when it begins, it goes by distances, and so far at most.
TEST_P(KeptProgram, CountsItsRangeFromWhereItBegins) {
  for (const std::int32_t at : {0, 70'000, -900}) {
    ASSERT_EQ(load(to_and_fro(kAtPowerOn)), BUSHD_OK);
    ASSERT_EQ(rig.set_position(0, at), BUSHD_OK);
    ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
    EXPECT_EQ(pass_until_ended().reason, BUSHD_PROGRAM_DONE);
    ProgramText text = to_and_fro(kAtPowerOn);
    text.frames = {{.kind = Kind::kRepeat, .count = 0},
                   {.kind = Kind::kMoveBy, .motors = {0}, .to = {{15}}},
                   {.kind = Kind::kNext},
                   kProgramEnd};
    ASSERT_EQ(load(text), BUSHD_OK);
    ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
    EXPECT_EQ(pass_until_ended().reason, BUSHD_PROGRAM_RANGE);
    EXPECT_EQ(rig.poll().motor[0].position_steps, at + 30) << "45 would be beyond 40";
  }
}

TEST_P(KeptProgram, AtPowerOnWantsTheOtherTwoAndNoPositions) {
  for (const int flags : {4, 5, 6, 8, 0x80}) {
    EXPECT_EQ(load(to_and_fro(static_cast<std::uint8_t>(flags))), BUSHD_E_FORMAT) << flags;
  }
  for (const Kind kind : {Kind::kMoveTo, Kind::kLineTo}) {
    ProgramText text = to_and_fro(kAtPowerOn);
    text.frames[1].kind = kind;
    EXPECT_EQ(load(text), BUSHD_E_FORMAT);
    text.flags = kKept | BUSHD_PROGRAM_WITHOUT_HOST;
    EXPECT_EQ(load(text), BUSHD_OK);
  }
}

}  // namespace
}  // namespace bushd::test
