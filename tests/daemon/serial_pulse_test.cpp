// A serial port as the controller of one motor, from a request to the levels on the line: the core
// with a virtual drive, whose steps are judged by the codes of the table and a rule of their own.
#include <numeric>

#include "daemon/pulse_ports.h"

namespace bushd::test {
namespace {

std::string port(const std::string& more_of_motor = {}) {
  return pulse_group() + pulse_port("com1", 0, "m", more_of_motor);
}

struct Desk : PulseLab {
  explicit Desk(const std::string& toml = port()) : PulseLab(toml) {}

  sim::PulseDrive& it() { return drive(0); }
  std::vector<std::int64_t> intervals() {
    const auto made = times(0);
    std::vector<std::int64_t> all;
    for (std::size_t i = 1; i < made.size(); ++i) all.push_back(made[i] - made[i - 1]);
    return all;
  }
  using PulseLab::ask;
  Answer ask(Ask what, std::int64_t steps) { return ask(what, {"m"}, {steps}); }
  // Steps from `from` on are one run from rest to rest.
  void expect_run(std::size_t from, std::size_t steps) {
    const auto made = times(0, from);
    ASSERT_EQ(made.size(), steps);
    expect_table(made);
  }
  void expect_settled(std::int64_t position) {
    EXPECT_EQ(it().position_steps(), position);
    EXPECT_EQ(motor("m").position_steps, position);
    EXPECT_EQ(it().faults(), 0u);
  }
  // All that it has done is one run, and counted.
  void expect_one_run() {
    expect_settled(it().position_steps());
    expect_run(0, it().steps());
  }
  // The port is plugged in again, and the motor is ready.
  void come_back() {
    plug(0);
    ASSERT_TRUE(run_until([&] { return all_ready(); }, 2));
    run_for(0.2);
  }
  // How many steps may be missing, as the reason of the uncertain position says; no more are.
  std::int64_t most_missing() {
    const std::string reason = motor("m").uncertain_reason;
    const std::size_t at = reason.find("while ");
    EXPECT_NE(at, std::string::npos) << reason;
    const std::int64_t most = at == std::string::npos ? 0 : std::stoll(reason.substr(at + 6));
    EXPECT_LE(std::abs(it().position_steps() - motor("m").position_steps), most);
    return most;
  }
};

struct ReadyDesk : Desk {
  explicit ReadyDesk(const std::string& toml = port()) : Desk(toml) { connect(); }
};

TEST(SerialPulse, MovesByItsTable) {
  ReadyDesk lab;
  EXPECT_THAT(lab.ask(Ask::kMoveBy, 1003), Ends("reached"));
  lab.expect_settled(1003);
  lab.expect_run(0, 1003);
  EXPECT_EQ(lab.motor("m").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, -7).result, "reached");
  lab.expect_settled(-7);
  lab.expect_run(1003, 1010);
}

// Not longer than what a change of rate and the bytes between cost: the bound is that of the
// planner's own test for such a table.
TEST(SerialPulse, TakesHardlyLongerThanItsTable) {
  ReadyDesk lab;
  lab.ask(Ask::kMoveBy, 4000);
  const auto all = pulse_codes();
  const std::int64_t ramps = 2 * std::accumulate(all.begin(), all.end(), std::int64_t{0});
  const std::int64_t by_table = (ramps + (4000 - 120) * kPulseCruise) * kPulseUnitNs;
  const auto made = lab.intervals();
  const std::int64_t took = std::accumulate(made.begin(), made.end(), std::int64_t{0});
  std::printf("  4000 steps: %.3f s by the table, %.3f s made\n",
              1e-9 * static_cast<double>(by_table), 1e-9 * static_cast<double>(took));
  EXPECT_LT(took, by_table * 3 / 2);
  EXPECT_EQ(lab.it().faults(), 0u);
}

TEST(SerialPulse, EveryNumberOfStepsIsExact) {
  ReadyDesk lab;
  std::int64_t position = 0;
  std::size_t made = 0;
  for (int steps = 1; steps <= 24; ++steps) {
    const int way = steps % 2 == 0 ? -steps : steps;
    ASSERT_EQ(lab.ask(Ask::kMoveBy, way).result, "reached") << steps;
    position += way;
    lab.expect_settled(position);
    lab.expect_run(made, static_cast<std::size_t>(steps));
    made += static_cast<std::size_t>(steps);
  }
}

TEST(SerialPulse, StopsAlongItsRamp) {
  ReadyDesk lab;
  const auto move = lab.send(Ask::kMoveBy, {"m"}, {5000});
  lab.run_for(1.0);
  const std::uint64_t before = lab.it().steps();
  EXPECT_EQ(lab.ask(Ask::kStop, {"m"}).result, "done");
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  const std::int64_t position = lab.it().position_steps();
  lab.expect_settled(position);
  lab.expect_run(0, lab.it().steps());
  // What was under way, at 2500 Hz; up to the tick after that; the ramp.
  EXPECT_LE(lab.it().steps() - before, 50u + 8u + 61u);
  EXPECT_GT(lab.it().steps(), before);
}

// What the driver still has has not been made, and no more is written on top of it: the ramp-down
// comes behind 20 ms of bytes, however long the driver stood.
TEST(SerialPulse, AStalledDriverIsNotCountedOn) {
  ReadyDesk lab;
  const auto move = lab.send(Ask::kMoveBy, {"m"}, {8000});
  lab.run_for(1.5);
  lab.stall_pulses(true);
  for (int i = 0; i < 20; ++i) {
    lab.run_for(0.05);
    ASSERT_LE(lab.motor("m").position_steps, lab.it().position_steps()) << i;
  }
  lab.stall_pulses(false);
  lab.run_for(0.003);
  const std::int64_t before = lab.it().position_steps();
  lab.send(Ask::kStop, {"m"});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_LE(lab.it().position_steps() - before, 50 + 8 + 61);
  lab.expect_one_run();
}

// A daemon was killed, and what it had written leaves later.
TEST(SerialPulse, WhatAnEarlierDaemonHasLeftInTheDriverIsWaitedFor) {
  ReadyDesk lab;
  lab.send(Ask::kMoveBy, {"m"}, {8000});
  lab.run_for(1.5);
  lab.stall_pulses(true);
  lab.run_for(0.1);
  lab.restart_daemon();
  lab.run_for(0.5);
  EXPECT_FALSE(lab.has_state("com1") && lab.state_of("com1").state == api::McuState::kReady);
  lab.stall_pulses(false);
  EXPECT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 1));
  EXPECT_EQ(lab.it().queued(), 0u);
}

TEST(SerialPulse, TakesAnotherTarget) {
  ReadyDesk lab;
  const auto first = lab.send(Ask::kMoveTo, {"m"}, {3000});
  lab.run_for(0.8);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, 3500).result, "reached");
  EXPECT_EQ(lab.last_reply(first).result, "stopped");
  lab.expect_settled(3500);
  lab.expect_run(0, 3500);
  lab.send(Ask::kMoveTo, {"m"}, {6000});
  lab.run_for(0.8);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, 3600).result, "reached");
  lab.expect_settled(3600);
}

TEST(SerialPulse, JogsUntilItsClientLetsGo) {
  ReadyDesk lab;
  const auto jog = lab.send(api::Jog{.motor = "m", .per_s = -1000, .in_steps = true});
  lab.run_for(0.5);
  EXPECT_LT(lab.it().position_steps(), -50);
  lab.ask(api::Jog{.motor = "m", .per_s = 0, .in_steps = true});
  EXPECT_TRUE(lab.run_until([&] { return lab.has_result(jog); }, 5));
  lab.run_for(0.1);
  lab.expect_one_run();
}

TEST(SerialPulse, LimitStopsIt) {
  for (const bool immediate : {false, true}) {
    ReadyDesk lab(port(immediate ? "limit_action = \"immediate\"\n" : ""));
    lab.it().attach_switch(1, {.at_steps = 1200, .positive_end = true});
    EXPECT_THAT(lab.ask(Ask::kMoveBy, 4000), Ends("limit"));
    const std::int64_t position = lab.it().position_steps();
    lab.expect_settled(position);
    EXPECT_GE(position, 1200);
    // A look every 2 ms, 20 ms under way, and the ramp.
    EXPECT_LE(position, 1200 + 5 + 50 + (immediate ? 5 : 66));
    EXPECT_TRUE(lab.motor("m").inhibited.positive);
    EXPECT_EQ(lab.ask(Ask::kMoveBy, 10).result, "refused");
    if (immediate) continue;
    lab.expect_run(0, lab.it().steps());
    EXPECT_EQ(lab.ask(Ask::kMoveBy, -500).result, "reached");
    lab.expect_settled(position - 500);
  }
}

TEST(SerialPulse, HomesToTheStep) {
  for (const bool tells_empty : {true, false}) {
    Desk lab;
    lab.set_driver(true, tells_empty);
    lab.connect();
    lab.it().attach_switch(0, {.at_steps = -700, .hysteresis_steps = 3, .bounce_ns = 4'000'000});
    const Answer answer = lab.wait(lab.send(Ask::kHome, {"m"}), 200);
    ASSERT_EQ(answer.result, "reached") << answer.reason;
    EXPECT_EQ(lab.it().position_steps(), -700);
    EXPECT_EQ(lab.motor("m").position_steps, 0);
    EXPECT_EQ(lab.it().faults(), 0u);
    EXPECT_EQ(lab.ask(Ask::kMoveTo, 700).result, "reached");
    EXPECT_EQ(lab.it().position_steps(), 0);
  }
}

TEST(SerialPulse, HomingLooksBehindALimitAndGivesUp) {
  ReadyDesk lab;
  lab.it().attach_switch(2, {.at_steps = -300});
  lab.it().attach_switch(0, {.at_steps = 400, .positive_end = true, .width_steps = 200});
  EXPECT_EQ(lab.wait(lab.send(Ask::kHome, {"m"}), 200).result, "reached");
  // It becomes active towards the negative end at its far edge.
  EXPECT_EQ(lab.it().position_steps(), 599);
  EXPECT_EQ(lab.it().faults(), 0u);
}

TEST(SerialPulse, PortLostInMotionIsTold) {
  ReadyDesk lab;
  const auto move = lab.send(Ask::kMoveBy, {"m"}, {5000});
  lab.run_for(1.0);
  lab.unplug(0);
  EXPECT_EQ(lab.wait(move).result, "link");
  ASSERT_NO_FATAL_FAILURE(lab.come_back());
  EXPECT_EQ(lab.motor("m").trust, api::Trust::kUncertain);
  const std::string reason = lab.motor("m").uncertain_reason;
  EXPECT_NE(reason.find(" steps were under way: as many may be missing"), std::string::npos)
      << reason;
  EXPECT_LE(lab.most_missing(), 2 * 50 + 5);
  lab.ask(Ask::kSetPosition, {"m"}, {0});
  const std::int64_t from = lab.it().position_steps();
  EXPECT_EQ(lab.ask(Ask::kMoveTo, 50).result, "reached");
  EXPECT_EQ(lab.it().position_steps(), from + 50);
}

TEST(SerialPulse, PortLostAtRestLosesNothing) {
  ReadyDesk lab;
  lab.ask(Ask::kMoveBy, 321);
  lab.unplug(0);
  lab.run_for(0.5);
  ASSERT_NO_FATAL_FAILURE(lab.come_back());
  EXPECT_EQ(lab.motor("m").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, 0).result, "reached");
  lab.expect_settled(0);
}

// Homing is none of the plan's: its ticks have gone on meanwhile, and go on.
TEST(SerialPulse, PortLostWhileHomingDelaysNothingAfterwards) {
  ReadyDesk lab;
  lab.ask(Ask::kMoveBy, 321);
  lab.run_for(10);
  const auto home = lab.send(Ask::kHome, {"m"});
  lab.run_for(0.5);
  lab.unplug(0);
  lab.wait(home);
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 2));
  lab.ask(Ask::kSetPosition, {"m"}, {0});
  EXPECT_EQ(lab.wait(lab.send(Ask::kMoveTo, {"m"}, {50}), 2).result, "reached");
}

// This program stood still as the port was lost: nobody knows whether what was under way has left.
TEST(SerialPulse, PortLostWhileTheDaemonStandsStillIsUncertain) {
  ReadyDesk lab;
  lab.send(Ask::kMoveBy, {"m"}, {5000});
  lab.run_for(1.0);
  const std::int64_t before = lab.it().position_steps();
  lab.pause_daemon(1.0);
  const std::int64_t made = lab.it().position_steps() - before;
  EXPECT_GT(made, 0);
  lab.unplug(0);
  ASSERT_NO_FATAL_FAILURE(lab.come_back());
  EXPECT_EQ(lab.motor("m").trust, api::Trust::kUncertain);
  lab.most_missing();
}

TEST(SerialPulse, EmergencyStopLatchesUntilCleared) {
  ReadyDesk lab;
  const auto move = lab.send(Ask::kMoveBy, {"m"}, {5000});
  lab.run_for(0.7);
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  lab.expect_one_run();
  EXPECT_EQ(lab.ask(Ask::kMoveBy, 10).result, "refused");
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {"m"}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, 10).result, "reached");
}

TEST(SerialPulse, ServesDriversThatCanLess) {
  for (const bool any : {true, false}) {
    for (const bool empty : {true, false}) {
      for (const std::uint32_t base : {0u, 115'200u}) {
        Desk lab;
        lab.set_driver(any, empty, base);
        lab.connect();
        EXPECT_EQ(lab.ask(Ask::kMoveBy, 777).result, "reached");
        lab.expect_settled(777);
        lab.expect_run(0, 777);
      }
    }
  }
}

TEST(SerialPulse, SlowSpeedsWaitBetweenBytes) {
  ReadyDesk lab;
  EXPECT_EQ(lab.ask(api::Move{.kind = api::Move::Kind::kRelative,
                              .motors = motor_steps({"m"}, {4}),
                              .speed = api::Speed{.per_s = 2, .in_steps = true}})
                .result,
            "reached");
  lab.expect_settled(4);
  for (const std::int64_t ns : lab.intervals()) {
    EXPECT_GE(ns, 500'000'000);
    EXPECT_LE(ns, 740'000'000);
  }
}

TEST(SerialPulse, TellsPausesAmidBytes) {
  ReadyDesk lab;
  EXPECT_EQ(lab.ask(Ask::kMoveBy, 1000).result, "reached");
  EXPECT_EQ(lab.state_of("com1").detail, "");
  const auto move = lab.send(Ask::kMoveBy, {"m"}, {4000});
  lab.run_for(1.0);
  lab.pause_daemon(0.1);
  EXPECT_EQ(lab.wait(move).result, "reached");
  lab.expect_settled(5000);
  lab.expect_run(1000, 4000);
  lab.run_for(0.2);
  EXPECT_NE(lab.state_of("com1").detail.find("the longest 8"), std::string::npos)
      << lab.state_of("com1").detail;
}

TEST(SerialPulse, HomingStopsOnRequest) {
  ReadyDesk lab;
  const auto home = lab.send(Ask::kHome, {"m"});
  lab.run_for(0.8);
  EXPECT_EQ(lab.ask(Ask::kStop, {"m"}).result, "done");
  EXPECT_EQ(lab.last_reply(home).result, "stopped");
  lab.run_for(0.1);
  lab.expect_one_run();
}

TEST(SerialPulse, HasNoDriverToDisable) {
  ReadyDesk lab;
  EXPECT_NE(lab.ask(Ask::kDisable, {"m"}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, 5).result, "reached");
}

TEST(SerialPulse, ItsPositionOutlivesTheDaemon) {
  Desk lab;
  lab.keep_positions();
  lab.connect();
  EXPECT_EQ(lab.ask(Ask::kMoveBy, 345).result, "reached");
  lab.run_for(0.5);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 5));
  lab.run_for(0.5);
  EXPECT_EQ(lab.motor("m").position_steps, 345);
  EXPECT_EQ(lab.motor("m").trust, api::Trust::kRestored) << lab.motor("m").uncertain_reason;
  EXPECT_EQ(lab.ask(Ask::kMoveTo, 0).result, "reached");
  EXPECT_EQ(lab.it().position_steps(), 0);

  lab.send(Ask::kMoveTo, {"m"}, {4000});
  lab.run_for(1);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 5));
  lab.run_for(0.5);
  EXPECT_EQ(lab.motor("m").trust, api::Trust::kUncertain);
}

// Whatever is asked of it, and whenever: what it says is what the line did.
TEST(SerialPulse, CountsEveryStepOfADayOfOrders) {
  const unsigned seed = std::random_device{}();
  std::printf("  seed %u\n", seed);
  std::mt19937 random(seed);
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  Desk lab;
  lab.it().attach_switch(1, {.at_steps = 2000, .positive_end = true, .bounce_ns = 2'000'000});
  lab.it().attach_switch(2, {.at_steps = -2000, .bounce_ns = 2'000'000});
  lab.connect();
  for (int i = 0; i < 120; ++i) {
    switch (below(6)) {
      case 0:
        lab.send(Ask::kStop, {"m"});
        break;
      case 1:
        lab.send(api::Pause{{"m"}});
        lab.run_for(0.01 * below(40));
        lab.send(api::Resume{{"m"}});
        break;
      default:
        lab.send(Ask::kMoveTo, {"m"}, {below(5000) - 2500});
    }
    lab.run_for(0.001 * below(900));
    if (below(12) == 0) lab.pause_daemon(0.001 * below(200));
  }
  lab.ask(Ask::kStop, {"m"});
  lab.run_for(1);
  lab.expect_settled(lab.it().position_steps());
  EXPECT_EQ(lab.motor("m").trust, api::Trust::kKnown) << lab.motor("m").uncertain_reason;
  lab.expect_no_faster(0);
}

}  // namespace
}  // namespace bushd::test
