// Offset, direction and soft limits that are changed in operation: what counts at once, what is
// kept, and until when. (What MCUs are told of: mcu_settings_test.cpp.)
#include "daemon/settings_lab.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;

TEST(MotorSettings, AreShownAsTheyAreAndAsTheFileHasThem) {
  SettingsLab lab;
  EXPECT_THAT(lab.show("m01"), ElementsAre("m01 offset = 10, in the file 10",
                                           "m01 direction = positive, in the file positive",
                                           "m01 soft_limits = [-5, 5.5], in the file [-5, 5.5]"));
  EXPECT_THAT(lab.show("m02"), ElementsAre("m02 soft_limits = none, in the file none"));
  EXPECT_EQ(lab.ask(api::Configure{.motors = {"m03"}}).result, "refused");
}

TEST(MotorSettings, CountAtOnceForRequestsAndForWhatClientsSee) {
  SettingsLab lab;
  lab.move_to("m01", 400);
  lab.expect_done("m01", "offset", "2.5");
  EXPECT_EQ(lab.motor("m01").user, 3.5);
  EXPECT_EQ(lab.description("m01").scale.offset, 2.5);
  lab.expect_done("m01", "direction", "negative");
  EXPECT_EQ(lab.motor("m01").user, 1.5);
  EXPECT_EQ(lab.motor("m01").dial, 1.0);
  EXPECT_TRUE(lab.description("m01").scale.negative);
  // The limits are where they were on the dial, so the user's have changed places.
  EXPECT_EQ(lab.description("m01").soft_limits, (units::SoftLimits{-5, 5.5}));
  const auto move_to_user = [&](double position) {
    return lab.ask(api::Move{.kind = api::Move::Kind::kAbsolute,
                             .motors = {{"m01", api::UserUnits{position}}}});
  };
  lab.expect_refused(move_to_user(7.6), "allowed: -3.000");
  lab.expect_reached(move_to_user(7.5));
  EXPECT_EQ(lab.shaft_steps("m01"), -2000);
  lab.expect_done("m01", "soft_limits", "none");
  EXPECT_FALSE(lab.description("m01").soft_limits);
  lab.expect_reached(lab.move_by("m01", -10));
}

TEST(MotorSettings, SayWhereAMotorStandsThatIsOutside) {
  SettingsLab lab;
  lab.move_to("m01", 400);
  EXPECT_THAT(lab.change("m01", "soft_limits", "[2, 3]"),
              Ends("done",
                   "m01: soft_limits = [2, 3]; it stands at 11.0000 mm, beyond its soft limits "
                   "of 12.0000 mm to 13.0000 mm; it may be moved towards them"));
  lab.expect_refused(lab.move_by("m01", -1), "soft limit");
  lab.expect_reached(lab.move_by("m01", 100));
  EXPECT_THAT(lab.change("m01", "soft_limits", "[1, 3]").reason, Not(HasSubstr("stands")));
}

TEST(MotorSettings, OfAMotorThatMovesStayAsTheyAre) {
  SettingsLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {1000});
  // Whether the disk knows of the move yet or not.
  lab.expect_refused("m01", "offset", "1", "m01 is about to move");
  lab.run_for(0.2);
  lab.expect_refused("m01", "offset", "1",
                     "m01 moves; what bushd.toml says of it can be changed at rest only");
  lab.expect_done("m02", "soft_limits", "-100,100");
  lab.expect_reached(lab.wait(move));
  EXPECT_EQ(lab.motor("m01").user, 12.5);
  const auto set = lab.send(Ask::kSetPosition, {"m01"}, {0});
  lab.run_for(0.002);
  lab.expect_refused("m01", "offset", "1", "m01: its position is being set");
  EXPECT_EQ(lab.wait(set).result, "done");
}

TEST(MotorSettings, ThatMakeNoSenseAreRefusedWithMotorKeyCauseAndRemedy) {
  SettingsLab lab;
  lab.expect_refused("m01", "offset", "1e300", "m01: offset: an offset of 1e+300 mm");
  lab.expect_refused("m01", "offset", "2mm",
                     "m01: offset: is \"2mm\"; allowed: a number of user units");
  lab.expect_refused("m01", "direction", "left",
                     "m01: direction: is \"left\"; allowed: negative, positive");
  lab.expect_refused("m01", "soft_limits", "[3, 2]", "m01: soft_limits: has no step from 3 to 2");
  lab.expect_refused("m01", "soft_limits", "nan,3", "allowed: [LOWEST, HIGHEST]");
  lab.expect_refused("m01", "unit", "deg", "m01: \"unit\" cannot be changed in operation");
  lab.expect_refused("m02", "offset", "1", "m02: offset: it has no unit");
  lab.expect_refused("m03", "offset", "1", "m03");
  lab.expect_refused(lab.ask(lab.changes({})), "no change");
  // All of it or nothing.
  lab.expect_refused(lab.ask(lab.changes({{"m01", "offset", "1"}, {"m02", "soft_limits", "1"}})),
                     "m02");
  EXPECT_EQ(lab.motor("m01").user, 10);
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(MotorSettings, AGreatestSpeedCountsFromTheNextMoveOnAndIsKept) {
  SettingsLab lab;
  const auto seconds = [&lab](std::int64_t steps) {
    const std::int64_t before_us = lab.now_us();
    lab.expect_reached(lab.move_by("m01", steps));
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
  lab.connect_again();
  EXPECT_THAT(seconds(400), is_slow) << "the state store has kept it";
  lab.expect_refused("m01", "local", "true", "set max_speed=none first");
  lab.expect_refused("m01", "max_speed", "0", "m01: max_speed: is \"0\"; allowed: a number");
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {-400});
  lab.run_for(0.3);
  lab.expect_refused("m01", "max_speed", "none", "at rest only");
  lab.expect_reached(lab.wait(move));
  lab.expect_done("m01", "max_speed", "none");
  EXPECT_LT(seconds(400), 1);
  EXPECT_THAT(lab.show("m01"), Not(Contains(HasSubstr("max_speed"))));
}

// Each of the two keeps the other away, so their order counts where both are kept.
TEST(MotorSettings, AGreatestSpeedAndLocalInputsTakeTurnsOverARestart) {
  const std::string slow = "offset = 10\nmax_speed = 0.25\n";
  SettingsLab lab(blade(slow));
  lab.expect_done(lab.changes({{"m01", "max_speed", "none"}, {"m01", "local", "true"}}));
  lab.restart(blade(slow));
  EXPECT_THAT(lab.show("m01"), IsSupersetOf({"m01 local = true, in the file false",
                                             "m01 max_speed = none, in the file 0.25"}));
  const std::string local = "offset = 10\nlocal = true\n";
  SettingsLab other(blade(local));
  other.expect_done(other.changes({{"m01", "local", "false"}, {"m01", "max_speed", "0.25"}}));
  other.restart(blade(local));
  EXPECT_THAT(other.show("m01"), IsSupersetOf({"m01 local = false, in the file true",
                                               "m01 max_speed = 0.25, in the file none"}));
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
  lab.connect_again();
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
  lab.expect_done(api::SetPosition{.motors = {{"m01", api::UserUnits{3.25}}}});
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 3.25, in the file 10");
  lab.expect_done("m01", "offset", "10");
  lab.restart(blade());
  EXPECT_THAT(lab.show("m01").front(), "m01 offset = 10, in the file 10");
}

TEST(MotorSettings, ThatWereSavedCountAsThoseOfTheFile) {
  SettingsLab lab;
  lab.expect_done("m01", "offset", "2.5");
  lab.expect_done(api::Configure{.kind = api::Configure::Kind::kSaved,
                                 .changes = {{"m01", "offset", "2.5"}},
                                 .file_sha256 = "abc"});
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
  const auto number = lab.send(lab.changes({{"m01", "offset", "2.5"}}));
  lab.run_for(0.03);
  EXPECT_FALSE(lab.has_result(number));
  EXPECT_EQ(lab.wait(number).result, "done");
}

TEST(MotorSettings, AreNotToldAsDoneWhileTheDiskDoesNotTakeThem) {
  for (const bool hangs : {false, true}) {
    SettingsLab lab;
    lab.run_for(0.2);
    lab.disk().set_broken(!hangs);
    if (hangs) lab.disk_us = 100'000'000;
    const auto number = lab.send(lab.changes({{"m01", "offset", "2.5"}}));
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
  const auto number = lab.send(lab.changes({{"m01", "offset", "2.5"}}));
  lab.run_for(0.5);
  lab.disk().set_broken(false);
  EXPECT_EQ(lab.wait(number).result, "done");
}

TEST(MotorSettings, ChangesAreInTheHistory) {
  SettingsLab lab;
  lab.expect_done("m01", "offset", "2.5");
  const auto past = lab.past("m01", 1);
  ASSERT_EQ(past.size(), 1u);
  EXPECT_EQ(past[0].what, "config");
  EXPECT_EQ(past[0].reason, "offset = 2.5, was 10");
  EXPECT_THAT(past[0].who, HasSubstr("test"));
  EXPECT_EQ(past[0].from_text, "10.0000 mm");
  EXPECT_EQ(past[0].to_text, "2.5000 mm");
}

TEST(MotorSettings, TheHistoryHasWhatWasSetAndMovedAsPeopleSawIt) {
  SettingsLab lab;
  lab.move_to("m01", 400);
  lab.expect_done(api::SetPosition{.motors = {{"m01", api::UserUnits{3}}}});
  lab.expect_done(request_of(Ask::kSetPosition, {"m01"}, {800}));
  lab.expect_done(request_of(Ask::kSetPosition, {"m02"}, {8}));
  const auto line = [](const api::PastMotion& motion) {
    return motion.what + " " + motion.from_text + " to " + motion.to_text + " " + motion.reason;
  };
  std::vector<std::string> lines;
  for (const api::PastMotion& motion : lab.past("m01", 3)) lines.push_back(line(motion));
  EXPECT_THAT(lines, ElementsAre("set 3.0000 mm to 4.0000 mm ",
                                 "set 11.0000 mm to 3.0000 mm offset = 2, was 10",
                                 HasSubstr("move 10.0000 mm to 11.0000 mm")));
  EXPECT_EQ(line(lab.past("m02", 1).at(0)), "set  to  ");
}

TEST(MotorSettings, WhatWasKnownLastIsSaidInTheMotorsUnit) {
  SettingsLab lab;
  lab.send(Ask::kMoveBy, {"m01"}, {2000});
  lab.run_for(0.7);
  lab.bus(0).reboot(0);
  lab.run_for(0.1);
  lab.connect_again();
  lab.run_for(0.2);
  EXPECT_THAT(lab.motor("m01").uncertain_reason,
              testing::ContainsRegex("last known: [0-9]+ steps .1[0-9].[0-9]* mm."));
}

}  // namespace
}  // namespace bushd::test
