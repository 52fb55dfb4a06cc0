// Positions over power cuts of PC and MCUs, in the whole core: what is restored, what is refused,
// and that the disk knows of a motion before the line does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/kept_lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

TEST(KeptPositions, AreKnownToTheNextDaemon) {
  KeptLab lab;
  lab.reach("m01", 300);
  lab.run_for(0.2);
  lab.go_on_with_next_daemon();
  lab.expect_at_shaft("m01", api::Trust::kKnown);
  lab.reach("m01", 50);
}

TEST(KeptPositions, AreKnownThoughTheDaemonWasKilledInMotion) {
  KeptLab lab;
  lab.send(Ask::kMoveBy, {"m01"}, {5000});
  lab.run_for(0.7);
  lab.go_on_with_next_daemon();
  lab.run_for(3);
  lab.expect_at_shaft("m01", api::Trust::kKnown);
}

TEST(KeptPositions, AreRestoredAfterAnMcuHasLostPowerAtRest) {
  KeptLab lab;
  lab.reach("m01", 300);
  lab.reach("m02", -70);
  lab.run_for(0.2);
  lab.cut_mcu_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  lab.expect_at_shaft("m02", api::Trust::kRestored);
  EXPECT_THAT(lab.motor("m01").uncertain_reason, HasSubstr("300 steps"));
  lab.reach("m01", 50);
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {350}).result, "done");
  lab.expect_at_shaft("m01", api::Trust::kKnown);
}

TEST(KeptPositions, AreStaleToADaemonThatHasStoodStillUntilTheMcuReports) {
  KeptLab lab;
  lab.reach("m01", 300);
  lab.run_for(0.2);
  lab.cut_mcu_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  // Another one may have moved it meanwhile.
  lab.pause_daemon(1.7);
  const auto outdated = [&lab] { return lab.state_of("hall:1").state == api::McuState::kBusy; };
  ASSERT_TRUE(lab.run_until(outdated, 0.01));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kStale);
  lab.run_for(0.5);
  lab.expect_at_shaft("m01", api::Trust::kRestored);
}

TEST(KeptPositions, AreRestoredAfterEverythingHasLostPowerAtRest) {
  KeptLab lab;
  lab.reach("m01", 300);
  lab.run_for(0.2);
  lab.cut_all_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  lab.expect_at_shaft("m02", api::Trust::kRestored);
  // And again: what is restored stays so.
  lab.cut_all_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
}

TEST(KeptPositions, AreUncertainAfterAPowerCutInMotion) {
  for (const bool of_pc : {false, true}) {
    KeptLab lab;
    lab.reach("m01", 300);
    lab.send(Ask::kMoveBy, {"m01"}, {5000});
    lab.run_for(0.7);
    of_pc ? lab.cut_all_power() : lab.cut_mcu_power();
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
    lab.expect_refused("m01", "restarted while it moved; last known: ");
    lab.expect_at_shaft("m02", api::Trust::kRestored);
    // It stays so until somebody says where it stands.
    lab.go_on_with_next_daemon();
    lab.expect_refused("m01", "restarted while it moved; last known: ");
    EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "done");
    lab.reach("m01", 10);
  }
}

TEST(KeptPositions, NobodyHasToldWhereTheyAreOnTheFirstDay) {
  Lab lab(hall(1, 1));
  lab.keep_positions();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {100}).result, "reached");
  lab.run_for(0.2);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {100}).result, "reached");
}

TEST(KeptPositions, TheDiskKnowsOfAMotionBeforeTheLineDoes) {
  KeptLab lab;
  lab.run_for(0.5);
  lab.disk_us = 50'000;
  std::int64_t last_frame_us = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) {
    last_frame_us = lab.now_us();
    return true;
  };
  const std::int64_t asked_us = lab.now_us();
  const auto number = lab.send(Ask::kMoveBy, {"m01"}, {100});
  EXPECT_TRUE(lab.replies(number).empty());
  lab.run_for(0.049);
  EXPECT_TRUE(lab.replies(number).empty());
  lab.run_for(0.002);
  EXPECT_EQ(lab.last_reply(number).phase, Answer::kAccepted);
  EXPECT_GE(lab.now_us(), asked_us + 50'000);
  EXPECT_EQ(lab.wait(number).result, "reached");
}

// A power cut behind a mark makes a motor uncertain, though it has not moved.
TEST(KeptPositions, WhatIsRefusedWhateverTheDiskSaysLeavesNoMarkThere) {
  KeptLab lab;
  lab.run_for(0.5);
  lab.disk_us = 50'000;
  const auto number = lab.send(Ask::kMoveBy, {"m01"}, {3'000'000'000});
  ASSERT_FALSE(lab.replies(number).empty()) << "it waits for no disk";
  EXPECT_THAT(lab.last_reply(number).reason, HasSubstr("is beyond +-2147483647 steps"));
  const std::vector<api::MotorAmount> far = {{"m01", std::int64_t{3'000'000'000}}};
  const std::vector<api::MotorAmount> near = {{"m01", std::int64_t{100}}};
  const auto slowly = api::Speed{.per_s = 1e-9, .in_steps = true};
  for (const auto& [request, why] : std::initializer_list<std::pair<api::Request, const char*>>{
           {api::MoveLine{.motors = far}, "is beyond +-2147483647 steps"},
           {api::MoveLine{.motors = near, .speed = slowly}, "up to an hour a step"},
           {api::Arm{.delay_us = 1000, .motors = far}, "is beyond +-2147483647 steps"},
           {api::Arm{.delay_us = 1, .motors = near}, "after the trigger; allowed: "},
           {api::Jog{.motor = "m01", .per_s = 1e-9, .in_steps = true}, "up to an hour a step"},
           {api::Jog{.motor = "m01", .per_s = 100, .keepalive_ms = 1}, "keepalive time of 1 ms"},
           {api::SetPosition{.motors = far}, "positions lie within"}}) {
    const auto asked = lab.send(request);
    ASSERT_FALSE(lab.replies(asked).empty()) << why << ": it waits for no disk";
    EXPECT_THAT(lab.last_reply(asked), Ends("refused", why)) << why;
  }
  // An MCU that loses its power now stands where it stood.
  lab.run_for(0.2);
  lab.cut_mcu_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {100}).result, "reached");
}

TEST(KeptPositions, WhatIsStoppedBeforeItBeginsDoesNotBegin) {
  KeptLab lab;
  lab.run_for(0.5);
  lab.disk_us = 50'000;
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {100});
  const auto other = lab.send(Ask::kMoveBy, {"m02"}, {100});
  const auto stop = lab.send(Ask::kStop, {"m01"});
  EXPECT_THAT(lab.wait(move), Ends("stopped", "before this was carried out"));
  EXPECT_EQ(lab.wait(stop).result, "done");
  EXPECT_EQ(lab.wait(other).result, "reached");
  EXPECT_EQ(lab.motor("m01").position_steps, 0);
}

// The key has been let go before the disk is ready: nothing may move by it then.
TEST(KeptPositions, AJogWhoseClientIsSilentMeanwhileDoesNotBegin) {
  KeptLab lab;
  lab.disk_us = 600'000;
  const auto jog =
      lab.send(api::Jog{.motor = "m01", .per_s = 500, .in_steps = true, .keepalive_ms = 200});
  lab.run_for(3);
  EXPECT_THAT(lab.last_reply(jog), Ends("refused", "silent for longer than its keepalive time"));
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(KeptPositions, AMotorThatHasItsMarkWaitsForTheOthersWithIt) {
  KeptLab lab;
  lab.run_for(0.5);
  lab.disk_us = 200'000;
  const auto first = lab.send(Ask::kMoveBy, {"m01"}, {40});
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").moving; }, 1));
  const auto both = lab.send(Ask::kMoveBy, {"m01", "m02"}, {10, 10});
  ASSERT_TRUE(lab.run_until([&] { return !lab.replies(both).empty(); }, 0.25));
  EXPECT_EQ(lab.wait(both).result, "reached");
  EXPECT_THAT(lab.last_reply(first).result, testing::AnyOf("reached", "stopped"));
}

TEST(KeptPositions, ADiskThatDoesNotAnswerKeepsMotorsAtRest) {
  KeptLab lab;
  lab.run_for(0.5);
  lab.disk_us = 3'000'000;
  const auto number = lab.send(Ask::kMoveBy, {"m01"}, {100});
  lab.run_for(0.9);
  EXPECT_TRUE(lab.replies(number).empty());
  EXPECT_THAT(lab.wait(number), Ends("refused", "m01: the disk cannot be told that it moves"));
}

TEST(KeptPositions, ABrokenDiskKeepsMotorsAtRestButNotThoseThatMove) {
  KeptLab lab;
  const auto moving = lab.send(Ask::kMoveBy, {"m02"}, {5000});
  lab.run_for(0.5);
  lab.disk().set_broken(true);
  lab.expect_refused("m01", "input/output error");
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m02"}, {900}).result, "reached");
  EXPECT_EQ(lab.last_reply(moving).result, "stopped");
  lab.disk().set_broken(false);
  lab.run_for(2.5);
  lab.reach("m01", 10);
  lab.run_for(0.2);
  lab.cut_all_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  lab.expect_at_shaft("m02", api::Trust::kRestored);
}

TEST(KeptPositions, NotRequiredTheyAreUncertainAfterwards) {
  KeptLab lab("[state]\nrequired = false\n" + hall(1, 2));
  lab.run_for(0.5);
  lab.disk().set_broken(true);
  lab.reach("m01", 10);
  lab.cut_mcu_power();
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  lab.cut_all_power();
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kUncertain);
  lab.expect_refused("m02", "last known: 0 steps");
}

TEST(KeptPositions, RestoredMayBeTooLittle) {
  KeptLab lab(with_keys(hall(1, 2), "m01", "restored = \"refuse\"\n"));
  lab.reach("m01", 300);
  lab.run_for(0.2);
  lab.cut_mcu_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  lab.expect_refused("m01", "its position is only restored");
  lab.reach("m02", 10);
}

TEST(KeptPositions, OfMotorsWithLocalInputsAreUncertainAfterAPowerCut) {
  KeptLab lab(with_keys(hall(1, 2), "m01", "local = true\n"));
  lab.run_for(0.5);
  lab.cut_mcu_power();
  lab.expect_refused("m01", "people may have moved it");
  lab.expect_at_shaft("m02", api::Trust::kRestored);
}

TEST(KeptPositions, AreKnownOnceTheyAreConfirmed) {
  KeptLab lab;
  lab.reach("m01", 300);
  lab.send(Ask::kMoveBy, {"m01"}, {5000});
  lab.run_for(0.7);
  lab.cut_mcu_power();
  lab.expect_refused("m01", "or 'bushctl confirm m01' if it stands where it is shown");
  const std::int64_t shown = lab.motor("m01").position_steps;
  EXPECT_EQ(lab.ask(api::Confirm{{"m01", "m02"}}).result, "done");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.motor("m01").position_steps, shown);
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kKnown);
  lab.run_for(0.2);
  lab.go_on_with_next_daemon();
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  lab.send(Ask::kMoveBy, {"m01"}, {500});
  lab.run_for(0.1);
  EXPECT_THAT(lab.ask(api::Confirm{{"m01"}}).reason, HasSubstr("moves"));
  EXPECT_THAT(lab.ask(api::Confirm{{"m09"}}).reason, HasSubstr("there is no motor"));
}

// Whoever is answered finds it, also if the daemon is killed in the next moment.
TEST(KeptPositions, AreConfirmedWhenTheDiskHasIt) {
  KeptLab lab;
  lab.send(Ask::kMoveBy, {"m01"}, {5000});
  lab.run_for(0.7);
  lab.cut_mcu_power();
  ASSERT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  lab.disk_us = 200'000;
  const auto number = lab.send(api::Confirm{{"m01"}});
  ASSERT_TRUE(lab.run_until([&] { return lab.has_result(number); }, 2));
  EXPECT_EQ(lab.last_reply(number).result, "done");
  lab.go_on_with_next_daemon();
  lab.expect_at_shaft("m02", api::Trust::kRestored);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

TEST(KeptPositions, ConfirmedOnABrokenDiskAreNotSaidToBeDone) {
  KeptLab lab;
  lab.run_for(0.5);
  lab.cut_mcu_power();
  ASSERT_EQ(lab.motor("m01").trust, api::Trust::kRestored);
  lab.disk().set_broken(true);
  EXPECT_THAT(lab.ask(api::Confirm{{"m01"}}), Ends("fault", "it is lost if bushd ends"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown) << "until then it counts";
  lab.disk().set_broken(false);
  lab.run_for(2.5);
  lab.go_on_with_next_daemon();
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

// The disk has its motion once a second; the daemon has heard more.
TEST(KeptPositions, LastKnownAreThoseHeardLast) {
  KeptLab lab;
  const auto number = lab.send(Ask::kMoveBy, {"m01"}, {5000});
  lab.run_for(1.9);
  lab.bus(0).reboot(0);
  lab.wait(number);
  const auto asked = lab.send(api::GetHistory{.motor = "m01", .most = 1});
  lab.wait(asked);
  ASSERT_EQ(lab.history(asked).size(), 1u);
  const std::int64_t heard = lab.history(asked)[0].to_steps;
  EXPECT_GT(heard, 3000);
  for (const bool restart : {false, true}) {
    restart ? lab.go_on_with_next_daemon() : lab.reconnect();
    EXPECT_EQ(lab.motor("m01").position_steps, heard) << "which people may confirm";
    lab.expect_refused("m01", "last known: " + std::to_string(heard) + " steps, in motion");
  }
}

TEST(KeptPositions, AreOfAnotherScaleUntilSomebodyConfirmsThem) {
  std::string toml = with_keys(hall(1, 2), "m01", "unit = \"mm\"\nsteps_per_unit = 400\n");
  KeptLab lab(toml);
  lab.reach("m01", 300);
  lab.run_for(0.2);
  toml.replace(toml.find("400"), 3, "800");
  lab.use_configuration(toml);
  lab.reconnect();
  lab.expect_refused("m01", "its steps_per_unit was changed from 400 to 800");
  EXPECT_EQ(lab.ask(api::Confirm{{"m01"}}).result, "done");
  lab.expect_at_shaft("m01", api::Trust::kKnown);
}

TEST(KeptPositions, KeepTheirOffsetUntilTheFileIsEdited) {
  std::string toml =
      with_keys(hall(1, 1), "m01", "unit = \"mm\"\nsteps_per_unit = 400\noffset = 2\n");
  KeptLab lab(toml);
  lab.reach("m01", 400);
  EXPECT_EQ(lab.motor("m01").user, 3);
  EXPECT_EQ(lab.ask(api::SetPosition{.motors = {{"m01", api::UserUnits{10}}}}).result, "done");
  EXPECT_EQ(lab.motor("m01").user, 10);
  lab.run_for(0.2);
  lab.cut_pc_power();
  lab.reconnect();
  EXPECT_EQ(lab.motor("m01").user, 10);
  EXPECT_EQ(lab.motor("m01").dial, 1);
  toml.replace(toml.find("offset = 2"), 10, "offset = 5");
  lab.use_configuration(toml);
  lab.reconnect();
  EXPECT_EQ(lab.motor("m01").user, 6);
}

TEST(KeptPositions, HaveAHistory) {
  KeptLab lab;
  lab.reach("m01", 300);
  lab.send(Ask::kMoveBy, {"m01"}, {5000});
  lab.run_for(0.5);
  lab.ask(Ask::kStop, {"m01"});
  lab.run_for(0.2);
  const auto number = lab.send(api::GetHistory{.motor = "m01", .most = 10});
  EXPECT_EQ(lab.wait(number).result, "done");
  const auto history = lab.history(number);
  ASSERT_EQ(history.size(), 3u);
  EXPECT_EQ(history[0].outcome, "stopped");
  EXPECT_THAT(history[0].reason, HasSubstr("asked for by command"));
  EXPECT_EQ(history[0].from_steps, 300);
  EXPECT_EQ(history[0].to_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(history[1].outcome, "reached");
  EXPECT_EQ(history[1].what, "move");
  EXPECT_THAT(history[1].who, HasSubstr("of test"));
  EXPECT_EQ(history[2].what, "set") << "when it was connected for the first time";
  EXPECT_THAT(lab.ask(api::GetHistory{.motor = "m01", .most = 0}).reason,
              HasSubstr("allowed: 1 to 1000"));
  Lab without(hall(1, 1));
  EXPECT_THAT(without.ask(api::GetHistory{.motor = "m01"}).reason, HasSubstr("nothing is kept"));
}

TEST(KeptPositions, AManyMotorsStartCostsOneSync) {
  KeptLab lab(hall(2, 8));
  lab.run_for(0.5);
  const std::uint64_t before = lab.disk().syncs();
  std::vector<std::string> motors;
  for (int i = 1; i <= 16; ++i) motors.push_back((i < 10 ? "m0" : "m") + std::to_string(i));
  const auto number = lab.send(Ask::kMoveBy, motors, std::vector<std::int64_t>(16, 100));
  ASSERT_TRUE(lab.run_until([&] { return !lab.replies(number).empty(); }, 1));
  EXPECT_EQ(lab.disk().syncs() - before, 1u);
  EXPECT_EQ(lab.wait(number).result, "reached");
}

}  // namespace
}  // namespace bushd::test
