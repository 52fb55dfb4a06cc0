// The same lab with trouble on the bus: what is lost is repaired, what cannot be repaired is told,
// and no step goes unaccounted for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

class Faults : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats, Faults,
                         testing::Values("fine", "coarse", "fine_table", "coarse_table",
                                         "fine_ticks"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(Faults, SomeLostWritesAreRepairedInTime) {
  ReadyLab lab(hall(2, 4, GetParam()));
  std::mt19937 random(1985);
  // One write in eight is lost: queues are 300 ms deep and polls come every 50 ms.
  int lost = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) {
    const bool keep = random() % 8 != 0;
    if (!keep) ++lost;
    return keep;
  };
  const Answer result = lab.ask(Ask::kMoveBy, {"m01", "m02", "m05"}, {15000, -9000, 12000});
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 15000);
  EXPECT_EQ(lab.shaft_steps("m02"), -9000);
  EXPECT_EQ(lab.shaft_steps("m05"), 12000);
  EXPECT_GT(lost, 10);
}

TEST_P(Faults, FlippedBitsAreDroppedCountedAndRepaired) {
  ReadyLab lab(hall(1, 2, GetParam()));
  std::mt19937 random(1985);
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    if (random() % 10 == 0)
      bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    return true;
  };
  const Answer result = lab.ask(Ask::kMoveBy, {"m01", "m02"}, {4000, -4000});
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 4000);
  EXPECT_EQ(lab.shaft_steps("m02"), -4000);
  EXPECT_GT(lab.bus(0).mcu(0).core().reception.bad_frames, 0);
}

// Whatever is lost of a stop, a motor ends where its result says.
TEST_P(Faults, LostReplacementIsPlannedAgain) {
  for (int lost = 1; lost <= 4; ++lost) {
    ReadyLab lab(hall(1, 2, GetParam()));
    const auto move = lab.send(Ask::kMoveBy, {"m01", "m02"}, {9000, 3000});
    lab.run_for(1.3);
    int count = 0;
    lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) { return ++count > lost; };
    EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.motor_results.at(0), "stopped") << lost << " lost: " << result.reason;
    EXPECT_EQ(result.motor_results.at(1), "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
    EXPECT_LT(result.position_steps.at(0), 9000);
    EXPECT_EQ(lab.shaft_steps("m02"), 3000);
  }
}

// A stop leaves the MCU with a short queue: a machine too busy to go on at once must not let it run
// empty.
TEST_P(Faults, DaemonPausedJustAfterAStop) {
  for (const double after_ms : {0.5, 5.0, 15.0, 40.0}) {
    ReadyLab lab(hall(2, 3, GetParam()));
    const auto move = lab.send(Ask::kMoveBy, {"m01", "m02", "m05"}, {9000, -9000, 9000});
    lab.run_for(1.3);
    lab.send(Ask::kStop, {});
    lab.run_for(after_ms / 1000);
    lab.pause_daemon(0.07);
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "stopped") << "paused " << after_ms << " ms after: " << result.reason;
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  }
}

TEST_P(Faults, LinkLostInMotionRunsDownAndGoesOnFromThere) {
  ReadyLab lab(hall(2, 4, GetParam()));
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m06"}, {9000, -9000});
  lab.run_for(1.5);
  lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "link");
  lab.run_for(2);
  const std::int64_t first = lab.shaft_steps("m01");
  EXPECT_GT(first, 0);
  EXPECT_LT(first, 9000);
  EXPECT_NE(lab.bus(0).mcu(0).core().faults & BUSHD_FAULT_LINK, 0) << "latched";
  lab.on_send = nullptr;
  lab.connect();
  EXPECT_EQ(lab.motor("m01").position_steps, first);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01", "m06"}, {0, 0}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.shaft_steps("m06"), 0);
}

// The daemon is stopped when it has just asked for reports: their latency is then its own.
void pause_when_asked(Lab& lab, double seconds) {
  bool asked = false;
  lab.on_send = [&asked](std::size_t, const std::vector<std::uint8_t>& bytes) {
    // The beginning of a broadcast POLL, address and type.
    for (std::size_t i = 0; i + 2 < bytes.size(); ++i) {
      const bool begins = i == 0 || bytes[i - 1] == 0;
      asked |= begins && bytes[i] == 1 && bytes[i + 2] == BUSHD_MSG_POLL;
    }
    return true;
  };
  EXPECT_TRUE(lab.run_until([&asked] { return asked; }, 1));
  lab.on_send = nullptr;
  lab.pause_daemon(seconds);
}

TEST_P(Faults, DaemonPausedForShortStillStopsAtOnce) {
  const auto steps_to_rest = [](double pause_s) {
    ReadyLab lab(hall(1, 2, GetParam()));
    lab.send(Ask::kMoveBy, {"m01"}, {200000});
    lab.run_for(1.5);
    pause_when_asked(lab, pause_s);
    const std::int64_t at = lab.shaft_steps("m01");
    EXPECT_EQ(lab.ask(Ask::kStop, {}).result, "done");
    return lab.shaft_steps("m01") - at;
  };
  EXPECT_LT(steps_to_rest(0.2), steps_to_rest(0) + 300) << "0.12 s at 2500 steps/s";
}

TEST_P(Faults, DaemonPausedLongerThanTheQueue) {
  ReadyLab lab(hall(1, 2, GetParam()));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {200000});  // 80 s
  lab.run_for(1.5);
  pause_when_asked(lab, 1.7);
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "link") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0)) << "read after the ramp-down";
  lab.connect();
  // At once, not where the broken-off move was to end, nor later by what the daemon was stopped.
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m02"}, {3}), 1).result, "reached");
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {3}), 1).result, "reached");
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveTo, {"m01"}, {0}), 20).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

// Another daemon may have been there meanwhile.
TEST_P(Faults, NothingIsKnownAfterALongPauseBeforeTheMcuHasReported) {
  ReadyLab lab(hall(1, 2, GetParam()));
  lab.run_for(1);
  ASSERT_EQ(lab.state_of("hall:1").motors.at(0).trust, api::Trust::kKnown);
  lab.pause_daemon(1.7);
  const auto outdated = [&lab] { return lab.state_of("hall:1").state == api::McuState::kBusy; };
  ASSERT_TRUE(lab.run_until(outdated, 0.01));
  EXPECT_EQ(lab.state_of("hall:1").motors.at(0).trust, api::Trust::kStale);
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {1})).reason,
              testing::HasSubstr("since this daemon stood still"));
  lab.run_for(0.1);
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kReady);
  EXPECT_EQ(lab.state_of("hall:1").motors.at(0).trust, api::Trust::kKnown);
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveBy, {"m01"}, {3}), 1).result, "reached");
}

TEST_P(Faults, PortLostAndBack) {
  ReadyLab lab(hall(1, 2, GetParam()));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {-9000});
  lab.run_for(1.1);
  lab.unplug(0);
  EXPECT_EQ(lab.last_reply(move).result, "link");
  lab.run_for(2);
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kOffline);
  EXPECT_THAT(lab.state_of("hall:1").detail, testing::HasSubstr("unplugged"));
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {1})).reason,
              testing::HasSubstr("offline"));
  lab.plug(0);
  lab.connect();
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {10}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 10);
}

TEST_P(Faults, NewDaemonTakesPositionsOverInMotion) {
  ReadyLab lab(hall(2, 4, GetParam()));
  lab.send(Ask::kMoveBy, {"m01", "m08"}, {9000, -9000});
  lab.run_for(1.5);
  lab.restart_daemon();
  lab.connect();
  for (const char* name : {"m01", "m08"}) {
    EXPECT_EQ(lab.motor(name).position_steps, lab.shaft_steps(name));
    EXPECT_NE(lab.shaft_steps(name), 0);
    EXPECT_EQ(lab.motor(name).trust, api::Trust::kUncertain)
        << "this daemon has not seen all of it";
  }
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01", "m08"}, {0, 0}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.shaft_steps("m08"), 0);
}

TEST_P(Faults, McuResetMakesPositionsUncertainUntilSet) {
  ReadyLab lab(hall(2, 2, GetParam()));
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m03"}, {9000, 700});
  lab.run_for(1.5);
  lab.bus(0).reboot(0, 50'000'000);
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.motor_results.at(0), "link") << result.reason;
  EXPECT_EQ(result.motor_results.at(1), "reached") << "the other MCU goes on";
  lab.connect();
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.motor("m03").trust, api::Trust::kKnown);
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {1})).reason,
              testing::HasSubstr("uncertain"));
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "done");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  const std::int64_t before = lab.shaft_steps("m01");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {25}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), before + 25);
}

TEST_P(Faults, StopForADeadMcuDoesNotStarveTheOthers) {
  ReadyLab lab(hall(2, 2, GetParam()));
  const auto dying = lab.send(Ask::kMoveBy, {"m01"}, {9000});
  const auto healthy = lab.send(Ask::kMoveBy, {"m03"}, {5000});
  lab.run_for(1.3);
  lab.bus(0).reboot(0, 3'600'000'000'000);
  lab.run_for(0.05);
  lab.send(Ask::kStop, {"m01"});
  EXPECT_EQ(lab.wait(dying).result, "link");
  const Answer result = lab.wait(healthy);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m03"), 5000);
}

TEST_P(Faults, DriversSwitchedOffStayOff) {
  ReadyLab lab(hall(1, 2, GetParam()));
  EXPECT_EQ(lab.ask(Ask::kDisable, {}).result, "done");
  const auto online = [&] {
    return lab.has_state("hall:1") && lab.state_of("hall:1").detail == "drivers disabled";
  };
  lab.unplug(0, 0.3);
  EXPECT_TRUE(lab.run_until(online, 10)) << "after a lost port";
  EXPECT_FALSE(lab.motor("m01").enabled);
  lab.restart_daemon();
  EXPECT_TRUE(lab.run_until(online, 10)) << "after a restart of the daemon";
  EXPECT_FALSE(lab.motor("m01").enabled);
  EXPECT_EQ(lab.ask(Ask::kEnable, {}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {25}).result, "reached");
}

// An MCU whose report was lost tells all of its 16 motors: 188 bytes, 3.8 ms at 500000 baud, as
// long as which nothing else may be heard. Ten that are lost in a row lose the MCU. They are asked
// for so that one comes through, whatever the phase, where bursts are 1.8 times as far apart: 7 ms.
// Asked for at an even pace, all would meet bursts of 8.2 ms, of which eight were between two of
// them.
TEST_P(Faults, NoiseFromTheLineDoesNoHarm) {
  for (const std::int64_t period_us : {7'000, 7'300, 8'200, 10'000, 20'000}) {
    ReadyLab lab(hall(1, 1, GetParam()));
    lab.read_period_us = 20;  // noise comes at its time, and not at the next thing that happens
    std::mt19937 random(1985);
    const auto move = lab.send(Ask::kMoveBy, {"m01"}, {3000});
    const std::int64_t begun_us = lab.now_us();
    for (std::int64_t at_us = begun_us; at_us < begun_us + 2'500'000; at_us += period_us) {
      lab.run_for(1e-6 * static_cast<double>(at_us - lab.now_us()));
      std::vector<std::uint8_t> noise(random() % 300);
      for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
      lab.core().receive(lab.now_us(), BusId{}, noise);
    }
    EXPECT_EQ(lab.wait(move).result, "reached") << "noise every " << period_us << " us";
    EXPECT_EQ(lab.shaft_steps("m01"), 3000);
  }
}

TEST_P(Faults, SilentMcuCostsTheOthersNothing) {
  Lab lab(hall(2, 2, GetParam()));
  lab.bus(0).reboot(1, 3'600'000'000'000);
  EXPECT_TRUE(lab.mcu_comes_to("hall:1", api::McuState::kReady, 10));
  EXPECT_EQ(lab.state_of("hall:2").state, api::McuState::kOffline);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {3000}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 3000);
}

}  // namespace
}  // namespace bushd::test
