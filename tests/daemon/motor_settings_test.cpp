// Offset, direction and soft limits that are changed in operation: what counts at once, what is
// kept, and until when.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;

// m01 has a unit, m02 has none.
std::string blade(const std::string& keys = "offset = 10\nsoft_limits = [-5, 5.5]\n") {
  std::string toml = hall(1, 2);
  return toml.insert(toml.find("name = \"m01\""), "unit = \"mm\"\nsteps_per_unit = 400\n" + keys);
}

struct SettingsLab : Lab {
  explicit SettingsLab(const std::string& toml = blade(), bool kept = true) : Lab(toml) {
    if (kept) keep_positions();
    connect();
  }
  Answer change(const std::string& motor, const std::string& key, const std::string& value) {
    return wait(send(
        api::Configure{.kind = api::Configure::Kind::kChange, .changes = {{motor, key, value}}}));
  }
  std::vector<std::string> show(const std::string& motor) {
    const auto number = send(api::Configure{.motors = {motor}});
    wait(number);
    return settings(number);
  }
  void expect_done(const std::string& motor, const std::string& key, const std::string& value) {
    const Answer answer = change(motor, key, value);
    EXPECT_EQ(answer.result, "done") << answer.reason;
  }
  void expect_refused(const Answer& answer, const std::string& why) {
    EXPECT_EQ(answer.result, "refused");
    EXPECT_THAT(answer.reason, HasSubstr(why));
  }
  void restart(const std::string& toml) {
    use_configuration(toml);
    ASSERT_TRUE(run_until([this] { return all_ready(); }, 20));
    run_for(0.1);
  }
};

TEST(MotorSettings, AreShownAsTheyAreAndAsTheFileHasThem) {
  SettingsLab lab;
  EXPECT_THAT(lab.show("m01"), ElementsAre("m01 offset = 10, in the file 10",
                                           "m01 direction = positive, in the file positive",
                                           "m01 soft_limits = [-5, 5.5], in the file [-5, 5.5]"));
  EXPECT_THAT(lab.show("m02"), ElementsAre("m02 soft_limits = none, in the file none"));
  EXPECT_EQ(lab.wait(lab.send(api::Configure{.motors = {"m03"}})).result, "refused");
}

TEST(MotorSettings, CountAtOnceForRequestsAndForWhatClientsSee) {
  SettingsLab lab;
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveTo, {"m01"}, {400})).result, "reached");
  lab.expect_done("m01", "offset", "2.5");
  EXPECT_EQ(lab.motor("m01").user, 3.5);
  EXPECT_EQ(lab.description("m01").scale.offset, 2.5);
  lab.expect_done("m01", "direction", "negative");
  EXPECT_EQ(lab.motor("m01").user, 1.5);
  EXPECT_EQ(lab.motor("m01").dial, 1.0);
  EXPECT_TRUE(lab.description("m01").scale.negative);
  // The limits are where they were on the dial, so the user's have changed places.
  EXPECT_EQ(lab.description("m01").soft_limits, (units::SoftLimits{-5, 5.5}));
  lab.expect_refused(lab.wait(lab.send(api::Move{.kind = api::Move::Kind::kAbsolute,
                                                 .motors = {{"m01", api::UserUnits{7.6}}}})),
                     "allowed: -3.000");
  EXPECT_EQ(lab.wait(lab.send(api::Move{.kind = api::Move::Kind::kAbsolute,
                                        .motors = {{"m01", api::UserUnits{7.5}}}}))
                .result,
            "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), -2000);
  lab.expect_done("m01", "soft_limits", "none");
  EXPECT_FALSE(lab.description("m01").soft_limits);
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {-10})).result, "reached");
}

TEST(MotorSettings, SayWhereAMotorStandsThatIsOutside) {
  SettingsLab lab;
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveTo, {"m01"}, {400})).result, "reached");
  const Answer answer = lab.change("m01", "soft_limits", "[2, 3]");
  EXPECT_EQ(answer.result, "done");
  EXPECT_THAT(
      answer.reason,
      HasSubstr("m01: soft_limits = [2, 3]; it stands at 11.0000 mm, beyond its soft limits "
                "of 12.0000 mm to 13.0000 mm; it may be moved towards them"));
  lab.expect_refused(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {-1})), "soft limit");
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {100})).result, "reached");
  EXPECT_THAT(lab.change("m01", "soft_limits", "[1, 3]").reason, Not(HasSubstr("stands")));
}

TEST(MotorSettings, OfAMotorThatMovesStayAsTheyAre) {
  SettingsLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {1000});
  // Whether the disk knows of the move yet or not.
  lab.expect_refused(lab.change("m01", "offset", "1"), "m01 is about to move");
  lab.run_for(0.2);
  lab.expect_refused(lab.change("m01", "offset", "1"),
                     "m01 moves; what bushd.toml says of it can be changed at rest only");
  lab.expect_done("m02", "soft_limits", "-100,100");
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.motor("m01").user, 12.5);
  const auto set = lab.send(Ask::kSetPosition, {"m01"}, {0});
  lab.run_for(0.002);
  lab.expect_refused(lab.change("m01", "offset", "1"), "m01: its position is being set");
  EXPECT_EQ(lab.wait(set).result, "done");
}

TEST(MotorSettings, ThatMakeNoSenseAreRefusedWithMotorKeyCauseAndRemedy) {
  SettingsLab lab;
  lab.expect_refused(lab.change("m01", "offset", "1e300"), "m01: offset: an offset of 1e+300 mm");
  lab.expect_refused(lab.change("m01", "offset", "2mm"),
                     "m01: offset: is \"2mm\"; allowed: a number of user units");
  lab.expect_refused(lab.change("m01", "direction", "left"),
                     "m01: direction: is \"left\"; allowed: negative, positive");
  lab.expect_refused(lab.change("m01", "soft_limits", "[3, 2]"),
                     "m01: soft_limits: has no step from 3 to 2");
  lab.expect_refused(lab.change("m01", "soft_limits", "nan,3"), "allowed: [LOWEST, HIGHEST]");
  lab.expect_refused(lab.change("m01", "unit", "deg"),
                     "m01: \"unit\" cannot be changed in operation");
  lab.expect_refused(lab.change("m02", "offset", "1"), "m02: offset: it has no unit");
  lab.expect_refused(lab.change("m03", "offset", "1"), "m03");
  lab.expect_refused(lab.wait(lab.send(api::Configure{.kind = api::Configure::Kind::kChange})),
                     "no change");
  // All of it or nothing.
  lab.expect_refused(lab.wait(lab.send(api::Configure{
                         .kind = api::Configure::Kind::kChange,
                         .changes = {{"m01", "offset", "1"}, {"m02", "soft_limits", "1"}}})),
                     "m02");
  EXPECT_EQ(lab.motor("m01").user, 10);
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(MotorSettings, AGreatestSpeedCountsFromTheNextMoveOnAndIsKept) {
  SettingsLab lab;
  const auto seconds = [&lab](std::int64_t steps) {
    const std::int64_t before_us = lab.now_us();
    EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {steps})).result, "reached");
    return static_cast<double>(lab.now_us() - before_us) * 1e-6;
  };
  // 400 delays of 10 ms; and before the first one and after the last less than the 0.5 s by which
  // motion is sent ahead at most.
  const auto is_slow = testing::AllOf(testing::Ge(4.0), testing::Lt(4.5));
  EXPECT_LT(seconds(400), 1);
  lab.expect_done("m01", "max_speed", "0.25");  // 100 steps a second
  EXPECT_THAT(lab.show("m01"), Contains("m01 max_speed = 0.25, in the file none"));
  EXPECT_THAT(seconds(-400), is_slow);
  lab.cut_pc_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 20));
  EXPECT_THAT(seconds(400), is_slow) << "the state store has kept it";
  lab.expect_refused(lab.change("m01", "local", "true"), "set max_speed=none first");
  lab.expect_refused(lab.change("m01", "max_speed", "0"),
                     "m01: max_speed: is \"0\"; allowed: a number");
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {-400});
  lab.run_for(0.3);
  lab.expect_refused(lab.change("m01", "max_speed", "none"), "at rest only");
  EXPECT_EQ(lab.wait(move).result, "reached");
  lab.expect_done("m01", "max_speed", "none");
  EXPECT_LT(seconds(400), 1);
  EXPECT_THAT(lab.show("m01"), Not(Contains(HasSubstr("max_speed"))));
}

// Each of the two keeps the other away, so their order counts where both are kept.
TEST(MotorSettings, AGreatestSpeedAndLocalInputsTakeTurnsOverARestart) {
  const std::string slow = "offset = 10\nmax_speed = 0.25\n";
  SettingsLab lab(blade(slow));
  EXPECT_EQ(lab.wait(lab.send(api::Configure{
                         .kind = api::Configure::Kind::kChange,
                         .changes = {{"m01", "max_speed", "none"}, {"m01", "local", "true"}}}))
                .result,
            "done");
  lab.restart(blade(slow));
  EXPECT_THAT(lab.show("m01"), IsSupersetOf({"m01 local = true, in the file false",
                                             "m01 max_speed = none, in the file 0.25"}));
  const std::string local = "offset = 10\nlocal = true\n";
  SettingsLab other(blade(local));
  EXPECT_EQ(other
                .wait(other.send(api::Configure{
                    .kind = api::Configure::Kind::kChange,
                    .changes = {{"m01", "local", "false"}, {"m01", "max_speed", "0.25"}}}))
                .result,
            "done");
  other.restart(blade(local));
  EXPECT_THAT(other.show("m01"), IsSupersetOf({"m01 local = false, in the file true",
                                               "m01 max_speed = 0.25, in the file none"}));
}

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
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {40})).result, "reached");
  // A second of it: 250 steps by 500 steps/s^2, and some more where the least speed is above that.
  const auto press = [&lab] {
    const std::int64_t before = lab.shaft_steps("m01");
    hold_forward(lab, true);
    lab.run_for(1);
    const std::int64_t made = lab.shaft_steps("m01") - before;
    lab.expect_refused(lab.change("m01", "velocity", "none"), "");
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
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 20));
  EXPECT_GT(press(), 100) << "the state store has kept it";
  lab.expect_done("m01", "local", "false");
  EXPECT_EQ(press(), 0);
  lab.expect_refused(lab.change("m01", "local", "yes"), "m01: local: is \"yes\"");

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
  lab.expect_refused(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {100})), "limit");
  lab.expect_done("m01", "input_active", "open");
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {100})).result, "reached");
  lab.bus(0).mcu(0).set_inputs({0, 0});
  lab.run_for(0.2);
  lab.expect_refused(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {100})), "limit");
  lab.restart(blade("limit = \"positive\"\n"));
  lab.expect_refused(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {100})), "limit");
  EXPECT_THAT(lab.show("m01"), Contains("m01 input_active = open, in the file closed"));
}

TEST(MotorSettings, OfTheMcuAreRefusedWhereTheyDoNotApplyOrAnotherMotorMoves) {
  SettingsLab lab(blade("local = true\n"));
  lab.expect_refused(lab.change("m02", "velocity", "100,1500,500"),
                     "m02: velocity: no local inputs move it");
  lab.expect_refused(lab.change("m01", "currents", "1500,1000,300"),
                     "m01: currents: its MCU does not drive it by phases");
  const auto move = lab.send(Ask::kMoveBy, {"m02"}, {1000});
  lab.run_for(0.3);
  lab.expect_refused(lab.change("m01", "velocity", "100,1500,500"),
                     "a motor of MCU hall:1 moves; what it does by itself can be changed when "
                     "all of them are at rest");
  lab.expect_done("m01", "soft_limits", "[-5, 500]");
  EXPECT_EQ(lab.wait(move).result, "reached");
}

// A default that is written is an edit, and one that is taken out too.
TEST(MotorSettings, EndWhenTheFileGetsOrLosesAKeyWithItsDefault) {
  for (const bool at_first : {false, true}) {
    SettingsLab lab(blade(at_first ? "offset = 0\nlocal = false\n" : ""));
    lab.expect_done("m01", "offset", "7");
    lab.expect_done("m01", "local", "true");
    lab.restart(blade(at_first ? "offset = 0.0\nlocal = false\n" : ""));
    EXPECT_THAT(lab.show("m01"), IsSupersetOf({"m01 offset = 7, in the file 0",
                                               "m01 local = true, in the file false"}));
    lab.restart(blade(at_first ? "local = false\n" : "offset = 0\n"));
    EXPECT_THAT(lab.show("m01"), IsSupersetOf({"m01 offset = 0, in the file 0",
                                               "m01 local = true, in the file false"}));
    lab.restart(blade(at_first ? "" : "offset = 0\nlocal = false\n"));
    EXPECT_THAT(lab.show("m01"), Not(Contains(HasSubstr("local"))));
  }
}

TEST(MotorSettings, AreKeptOverPowerCutsUntilTheFileIsEdited) {
  SettingsLab lab;
  lab.expect_done("m01", "offset", "2.5");
  lab.expect_done("m01", "direction", "negative");
  lab.expect_done("m01", "soft_limits", "none");
  lab.cut_pc_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 20));
  EXPECT_THAT(lab.show("m01"), ElementsAre("m01 offset = 2.5, in the file 10",
                                           "m01 direction = negative, in the file positive",
                                           "m01 soft_limits = none, in the file [-5, 5.5]"));
  // Each by itself, and what was edited stays so though the file goes back.
  lab.restart(blade("offset = 11\nsoft_limits = [-5, 5.5]\n"));
  EXPECT_THAT(lab.show("m01"), ElementsAre("m01 offset = 11, in the file 11",
                                           "m01 direction = negative, in the file positive",
                                           "m01 soft_limits = none, in the file [-5, 5.5]"));
  lab.restart(blade());
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 10, in the file 10");
  // What the file makes impossible does not count.
  lab.restart(hall(1, 2));
  EXPECT_THAT(lab.show("m01"), ElementsAre("m01 soft_limits = none, in the file none"));
}

TEST(MotorSettings, OfSetAreTheSame) {
  SettingsLab lab;
  EXPECT_EQ(lab.wait(lab.send(api::SetPosition{.motors = {{"m01", api::UserUnits{3.25}}}})).result,
            "done");
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 3.25, in the file 10");
  lab.expect_done("m01", "offset", "10");
  lab.restart(blade());
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 10, in the file 10");
}

TEST(MotorSettings, ThatWereSavedCountAsThoseOfTheFile) {
  SettingsLab lab;
  lab.expect_done("m01", "offset", "2.5");
  EXPECT_EQ(lab.wait(lab.send(api::Configure{.kind = api::Configure::Kind::kSaved,
                                             .changes = {{"m01", "offset", "2.5"}},
                                             .file_sha256 = "abc"}))
                .result,
            "done");
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 2.5, in the file 2.5");
  // What is changed after that is newer than the file.
  lab.expect_done("m01", "offset", "7");
  lab.restart(blade("offset = 2.5\nsoft_limits = [-5, 5.5]\n"));
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 7, in the file 2.5");
}

TEST(MotorSettings, WithoutAStoreCountUntilTheDaemonEnds) {
  SettingsLab lab(blade(), false);
  EXPECT_THAT(lab.change("m01", "offset", "2.5").reason, HasSubstr("there is no state store"));
  EXPECT_EQ(lab.motor("m01").user, 2.5);
  lab.restart(blade());
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 10, in the file 10");
}

TEST(MotorSettings, AreToldAsDoneWhenTheDiskHasThem) {
  SettingsLab lab;
  lab.run_for(0.2);
  lab.disk_us = 40'000;
  const auto number = lab.send(
      api::Configure{.kind = api::Configure::Kind::kChange, .changes = {{"m01", "offset", "2.5"}}});
  lab.run_for(0.03);
  EXPECT_FALSE(lab.has_result(number));
  EXPECT_EQ(lab.wait(number).result, "done");
}

TEST(MotorSettings, AreNotToldAsDoneWhileTheDiskDoesNotTakeThem) {
  const api::Request change =
      api::Configure{.kind = api::Configure::Kind::kChange, .changes = {{"m01", "offset", "2.5"}}};
  for (const bool hangs : {false, true}) {
    SettingsLab lab;
    lab.run_for(0.2);
    lab.disk().set_broken(!hangs);
    if (hangs) lab.disk_us = 100'000'000;
    const auto number = lab.send(change);
    lab.run_for(2.9);
    EXPECT_FALSE(lab.has_result(number)) << "it may get there yet";
    EXPECT_EQ(lab.wait(number).result, "fault");
    EXPECT_THAT(lab.last_reply(number).reason,
                AllOf(HasSubstr("m01: offset = 2.5; this counts, but is not on the disk"),
                      HasSubstr(hangs ? "does not answer" : "disk")));
    EXPECT_EQ(lab.motor("m01").user, 2.5);
  }
}

TEST(MotorSettings, AreDoneWhenTheDiskTakesThemInTheEnd) {
  SettingsLab lab;
  lab.run_for(0.2);
  lab.disk().set_broken(true);
  const auto number = lab.send(
      api::Configure{.kind = api::Configure::Kind::kChange, .changes = {{"m01", "offset", "2.5"}}});
  lab.run_for(0.5);
  lab.disk().set_broken(false);
  EXPECT_EQ(lab.wait(number).result, "done");
}

TEST(MotorSettings, ChangesAreInTheHistory) {
  SettingsLab lab;
  lab.expect_done("m01", "offset", "2.5");
  const auto number = lab.send(api::GetHistory{.motor = "m01", .most = 1});
  lab.wait(number);
  ASSERT_EQ(lab.history(number).size(), 1u);
  EXPECT_EQ(lab.history(number).front().what, "config");
  EXPECT_EQ(lab.history(number).front().reason, "offset = 2.5, was 10");
  EXPECT_THAT(lab.history(number).front().who, HasSubstr("test"));
  EXPECT_EQ(lab.history(number).front().from_text, "10.0000 mm");
  EXPECT_EQ(lab.history(number).front().to_text, "2.5000 mm");
}

TEST(MotorSettings, TheHistoryHasWhatWasSetAndMovedAsPeopleSawIt) {
  SettingsLab lab;
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveTo, {"m01"}, {400})).result, "reached");
  EXPECT_EQ(lab.wait(lab.send(api::SetPosition{.motors = {{"m01", api::UserUnits{3}}}})).result,
            "done");
  EXPECT_EQ(lab.wait(lab.send(Ask::kSetPosition, {"m01"}, {800})).result, "done");
  EXPECT_EQ(lab.wait(lab.send(Ask::kSetPosition, {"m02"}, {8})).result, "done");
  const auto line = [](const api::PastMotion& motion) {
    return motion.what + " " + motion.from_text + " to " + motion.to_text + " " + motion.reason;
  };
  const auto number = lab.send(api::GetHistory{.motor = "m01", .most = 3});
  lab.wait(number);
  std::vector<std::string> lines;
  for (const api::PastMotion& motion : lab.history(number)) lines.push_back(line(motion));
  EXPECT_THAT(lines, ElementsAre("set 3.0000 mm to 4.0000 mm ",
                                 "set 11.0000 mm to 3.0000 mm offset = 2, was 10",
                                 HasSubstr("move 10.0000 mm to 11.0000 mm")));
  const auto plain = lab.send(api::GetHistory{.motor = "m02", .most = 1});
  lab.wait(plain);
  EXPECT_EQ(line(lab.history(plain).at(0)), "set  to  ");
}

TEST(MotorSettings, WhatWasKnownLastIsSaidInTheMotorsUnit) {
  SettingsLab lab;
  lab.send(Ask::kMoveBy, {"m01"}, {2000});
  lab.run_for(0.7);
  lab.bus(0).reboot(0);
  lab.run_for(0.1);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 20));
  lab.run_for(0.2);
  EXPECT_THAT(lab.motor("m01").uncertain_reason,
              testing::ContainsRegex("last known: [0-9]+ steps .1[0-9].[0-9]* mm."));
}

// An MCU with two motors by phases; m01 has a unit.
std::string phases() {
  std::string toml = blade("");
  const std::string mcu = "address = 1\n";
  return toml.insert(toml.find(mcu) + mcu.size(),
                     "steps = \"phases\" # unipolar\nphase_sequence = \"full\"\n");
}

const bushd_emission& emission_of(SettingsLab& lab) {
  return lab.bus(0).mcu(0).core().emission.settings;
}

TEST(MotorSettings, ASequenceOfPhasesWaitsUntilItsMcuHasNoProgram) {
  SettingsLab lab(phases());
  const api::PutProgram put{
      .program = "back",
      .text = "motors = [\"m01\"]\nunit = \"steps\"\n[[frame]]\nmove_by = [-5]\n"};
  ASSERT_EQ(lab.wait(lab.send(put)).result, "done");
  lab.expect_refused(lab.change("m01", "phase_sequence", "half"), "has a program");
  ASSERT_EQ(lab.wait(lab.send(api::EraseProgram{"back"})).result, "done");
  lab.expect_done("m01", "phase_sequence", "half");
}

TEST(MotorSettings, ASequenceOfPhasesIsThatOfTheMcuAndOfAllItsMotors) {
  SettingsLab lab(phases());
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_FULL);
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveTo, {"m01"}, {400})).result, "reached");
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
  lab.expect_refused(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {10})), "its phases began anew");
  EXPECT_EQ(lab.wait(lab.send(Ask::kSetPosition, {"m01"}, {0})).result, "done");
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {10})).result, "reached");
  // Twice the same is no change.
  EXPECT_EQ(lab.change("m01", "phase_sequence", "half").reason,
            "m01: phase_sequence = half; m02: phase_sequence = half");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

TEST(MotorSettings, ASequenceOfPhasesIsChangedWhileAllMotorsOfTheMcuRest) {
  SettingsLab lab(phases());
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {1000});
  lab.run_for(0.2);
  lab.expect_refused(lab.change("m02", "phase_sequence", "half"),
                     "a motor of MCU hall:1 moves; what it does by itself can be changed when all "
                     "of them are at rest");
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(emission_of(lab).sequence, BUSHD_PHASES_FULL);
  lab.expect_refused(lab.change("m01", "phase_sequence", "three-phase"),
                     "allowed: wave, full, half");
  lab.expect_refused(lab.change("m01", "phase_sequence", "quarter"), "is \"quarter\"");
  SettingsLab other;
  other.expect_refused(other.change("m01", "phase_sequence", "half"),
                       "its MCU does not drive it by phases");
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
