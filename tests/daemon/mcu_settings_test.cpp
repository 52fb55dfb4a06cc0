// Settings that are changed in operation and that the MCU is told: local inputs, keypads, levels of
// inputs, phases.
#include "daemon/settings_lab.h"

namespace bushd::test {
namespace {

using testing::Contains;
using testing::IsEmpty;

// m01 has local inputs.
void hold_forward(Lab& lab, bool held) {
  lab.bus(0).mcu(0).set_inputs({0, static_cast<std::uint8_t>(held ? BUSHD_INPUT_FORWARD : 0)});
}

TEST(MotorSettings, OfTheVelocityLoopAreToldToTheMcu) {
  const std::string local = "offset = 10\nlocal = true\n";
  SettingsLab lab(blade(local));
  EXPECT_THAT(lab.show("m01").back(), "m01 velocity = none, in the file none");
  lab.expect_done("m01", "velocity", "100,1500,500");
  EXPECT_THAT(lab.show("m01").back(),
              "m01 velocity = { min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = 500 "
              "}, in the file none");
  lab.expect_reached(lab.move_by("m01", 40));
  // A second of it: 250 steps by 500 steps/s^2, and some more where the least speed is above that.
  const auto press = [&lab] {
    const std::int64_t before = lab.shaft_steps("m01");
    hold_forward(lab, true);
    lab.run_for(1);
    const std::int64_t made = lab.shaft_steps("m01") - before;
    lab.expect_refused("m01", "velocity", "none", "");
    hold_forward(lab, false);
    EXPECT_TRUE(
        lab.run_until([&] { return lab.motor("m01").activity == api::Activity::kResting; }, 5));
    EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
    return made;
  };
  EXPECT_NEAR(static_cast<double>(press()), 255, 20);
  lab.restart(blade(local));
  EXPECT_NEAR(static_cast<double>(press()), 255, 20) << "the state store has kept it";
  lab.expect_done("m01", "velocity", "none");
  EXPECT_GT(press(), 300) << "by its table";
}

// Whatever the MCU has been asked by then. What was not asked of it yet is refused while it is
// being configured, and changes nothing.
TEST(MotorSettings, ThatTheMcuKeepsLeavePositionsThatAreBeingSet) {
  int done = 0;
  for (int ms = 0; ms <= 20; ++ms) {
    SCOPED_TRACE(std::to_string(ms) + " ms");
    SettingsLab lab(blade("offset = 10\nlocal = true\n"));
    const auto set = lab.send(Ask::kSetPosition, {"m02"}, {77});
    lab.run_for(ms * 1e-3);
    lab.expect_done("m01", "velocity", "100,1500,500");
    const Answer answer = lab.wait(set);
    lab.run_for(0.2);
    const bool is_done = answer.result == "done";
    if (!is_done) {
      EXPECT_EQ(answer.result, "refused") << answer.reason;
    }
    done += is_done;
    EXPECT_EQ(lab.motor("m02").position_steps, is_done ? 77 : 0);
    EXPECT_EQ(lab.motor("m02").trust, api::Trust::kKnown);
    EXPECT_THAT(lab.warnings(), IsEmpty());
    EXPECT_THAT(lab.errors(), IsEmpty());
  }
  EXPECT_GE(done, 18);
}

TEST(MotorSettings, OfWhoMovesAMotorAreToldToTheMcu) {
  SettingsLab lab;
  EXPECT_EQ(lab.show("m01").size(), 3u) << "nobody needs to be told";
  const auto press = [&lab] {
    const std::int64_t before = lab.shaft_steps("m01");
    hold_forward(lab, true);
    lab.run_for(1);
    hold_forward(lab, false);
    lab.run_for(3);
    EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
    return lab.shaft_steps("m01") - before;
  };
  EXPECT_EQ(press(), 0);
  lab.expect_done("m01", "local", "true");
  EXPECT_THAT(lab.show("m01"), Contains("m01 local = true, in the file false"));
  EXPECT_GT(press(), 100);
  lab.cut_pc_power();
  lab.connect_again();
  EXPECT_GT(press(), 100) << "the state store has kept it";
  lab.expect_done("m01", "local", "false");
  EXPECT_EQ(press(), 0);
  lab.expect_refused("m01", "local", "yes", "m01: local: is \"yes\"");

  sim::VirtualMcu& mcu = lab.bus(0).mcu(0);
  const auto key = [&](std::uint8_t byte, double seconds) {
    const std::int64_t before = lab.shaft_steps("m01");
    mcu.keypad_byte(byte, lab.now_us() * 1000);
    lab.run_for(seconds);
    return lab.shaft_steps("m01") - before;
  };
  EXPECT_EQ(key(0x00, 1), 0);
  lab.expect_done("m01", "keypad", "true");
  // A key that is held when an MCU gets the motor must be seen released for 0.5 s.
  lab.run_for(0.6);
  // For 500 ms, 3 ms a step, and its ramps.
  EXPECT_NEAR(static_cast<double>(key(0x00, 2)), 166, 10);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
  lab.restart(blade("offset = 10\nsoft_limits = [-5, 5.5]\n"));
  EXPECT_NEAR(static_cast<double>(key(0xFF, 2)), -166, 10) << "the state store has kept it";
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
}

// A limit switch that opens was wired where one that closes was expected.
TEST(MotorSettings, TheLevelOfAnInputCountsAtOnce) {
  SettingsLab lab(blade("limit = \"positive\"\n"));
  lab.bus(0).mcu(0).set_inputs({1, 0});
  lab.run_for(0.2);
  lab.expect_refused(lab.move_by("m01", 100), "limit");
  lab.expect_done("m01", "input_active", "open");
  lab.expect_reached(lab.move_by("m01", 100));
  lab.bus(0).mcu(0).set_inputs({0, 0});
  lab.run_for(0.2);
  lab.expect_refused(lab.move_by("m01", 100), "limit");
  lab.restart(blade("limit = \"positive\"\n"));
  lab.expect_refused(lab.move_by("m01", 100), "limit");
  EXPECT_THAT(lab.show("m01"), Contains("m01 input_active = open, in the file closed"));
}

TEST(MotorSettings, OfTheMcuAreRefusedWhereTheyDoNotApplyOrAnotherMotorMoves) {
  SettingsLab lab(blade("local = true\n"));
  lab.expect_refused("m02", "velocity", "100,1500,500", "m02: velocity: no local inputs move it");
  lab.expect_refused("m01", "currents", "1500,1000,300",
                     "m01: currents: its MCU does not drive it by phases");
  const auto move = lab.send(Ask::kMoveBy, {"m02"}, {1000});
  lab.run_for(0.3);
  lab.expect_refused("m01", "velocity", "100,1500,500",
                     "a motor of MCU hall:1 moves; what it does by itself can be changed when "
                     "all of them are at rest");
  lab.expect_done("m01", "soft_limits", "[-5, 500]");
  lab.expect_reached(lab.wait(move));
}

// An MCU with two motors by phases; m01 has a unit.
std::string phases() {
  return with_mcu_keys(blade(""), "steps = \"phases\" # unipolar\nphase_sequence = \"full\"\n");
}

const bushd_emission& emission_of(SettingsLab& lab) {
  return lab.bus(0).mcu(0).core().emission.settings;
}

TEST(MotorSettings, ASequenceOfPhasesWaitsUntilItsMcuHasNoProgram) {
  SettingsLab lab(phases());
  const api::PutProgram put{
      .program = "back",
      .text = "motors = [\"m01\"]\nunit = \"steps\"\n[[frame]]\nmove_by = [-5]\n"};
  lab.expect_done(put);
  lab.expect_refused("m01", "phase_sequence", "half", "has a program");
  lab.expect_done(api::EraseProgram{"back"});
  lab.expect_done("m01", "phase_sequence", "half");
}

TEST(MotorSettings, ASequenceOfPhasesIsThatOfTheMcuAndOfAllItsMotors) {
  SettingsLab lab(phases());
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_FULL);
  lab.move_to("m01", 400);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  const Answer answer = lab.change("m02", "phase_sequence", "half");
  EXPECT_EQ(answer.result, "done") << answer.reason;
  EXPECT_EQ(
      answer.reason,
      "m02: phase_sequence = half; its position is uncertain until it is set or homed; a step "
      "is half as far now, and so soft limits, speeds and tables mean half as much; m01: "
      "phase_sequence = half; its position is uncertain until it is set or homed; a step is "
      "half as far now, and so soft limits, speeds and tables mean half as much: write "
      "steps_per_unit anew into bushd.toml, and restart bushd");
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_HALF);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  lab.run_for(0.2);
  for (const char* name : {"m01", "m02"}) {
    EXPECT_THAT(lab.show(name),
                Contains(std::string(name) + " phase_sequence = half, in the file full"));
    EXPECT_EQ(lab.motor(name).trust, api::Trust::kUncertain);
    EXPECT_EQ(lab.motor(name).uncertain_reason,
              "its phases began anew when phase_sequence became half, and was full");
  }
  lab.expect_refused(lab.move_by("m01", 10), "its phases began anew");
  lab.expect_done(request_of(Ask::kSetPosition, {"m01"}, {0}));
  lab.expect_reached(lab.move_by("m01", 10));
  // Twice the same is no change.
  EXPECT_EQ(lab.change("m01", "phase_sequence", "half").reason,
            "m01: phase_sequence = half; m02: phase_sequence = half");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

TEST(MotorSettings, ASequenceOfPhasesIsChangedWhileAllMotorsOfTheMcuRest) {
  SettingsLab lab(phases());
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {1000});
  lab.run_for(0.2);
  lab.expect_refused("m02", "phase_sequence", "half",
                     "a motor of MCU hall:1 moves; what it does by itself can be changed when all "
                     "of them are at rest");
  lab.expect_reached(lab.wait(move));
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_FULL);
  lab.expect_refused("m01", "phase_sequence", "three-phase", "allowed: wave, full, half");
  lab.expect_refused("m01", "phase_sequence", "quarter", "is \"quarter\"");
  SettingsLab other;
  other.expect_refused("m01", "phase_sequence", "half", "its MCU does not drive it by phases");
}

TEST(MotorSettings, ASequenceOfPhasesIsKeptUntilTheFileIsEdited) {
  SettingsLab lab(phases());
  lab.expect_done("m01", "phase_sequence", "half");
  lab.restart(phases());
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_HALF);
  EXPECT_THAT(lab.show("m02"), Contains("m02 phase_sequence = half, in the file full"));
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kUncertain) << "kept as well";
  std::string edited = phases();
  edited.replace(edited.find("\"full\""), 6, "\"wave\"");
  lab.restart(edited);
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_WAVE);
  lab.restart(phases());
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_FULL);
}

}  // namespace
}  // namespace bushd::test
