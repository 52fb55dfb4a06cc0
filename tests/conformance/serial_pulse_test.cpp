// What a controller without firmware has to do as an MCU does, on all kinds of ports: counts,
// tables, limits, homing, stops, and what it says when it cannot know.
#include <cstdlib>
#include <random>
#include <string>

#include "conformance/pulse_bench.h"

namespace bushd::test {
namespace {

class Port : public testing::TestWithParam<PortTarget> {};
INSTANTIATE_TEST_SUITE_P(Of, Port, testing::ValuesIn(port_targets()),
                         [](auto& target) { return target.param.name; });

std::vector<PortTarget> targets_that_tell_empty() {
  std::vector<PortTarget> those = port_targets();
  std::erase_if(those, [](const PortTarget& target) { return !target.tells_empty; });
  return those;
}

// Whose driver tells what it still has. Others are taken to be late by no more than 20 ms, so what
// they hold untold is not stalled in motion.
class PortThatTellsEmpty : public Port {};
INSTANTIATE_TEST_SUITE_P(Of, PortThatTellsEmpty, testing::ValuesIn(targets_that_tell_empty()),
                         [](auto& target) { return target.param.name; });

TEST_P(Port, TellsWhoItIs) {
  PulseBench bench(GetParam());
  const link::McuView& view = bench.master().view({0});
  EXPECT_EQ(view.phase, link::McuPhase::kOnline);
  EXPECT_EQ(view.identity.protocol_version, BUSHD_PROTOCOL_VERSION);
  EXPECT_EQ(view.identity.motors, 1);
  EXPECT_EQ(view.identity.boot_number, 1);
  EXPECT_EQ(view.identity.unique_id[6] << 8 | view.identity.unique_id[7], 4711);
  EXPECT_EQ(view.report.motor_count, 1);
}

TEST_P(Port, EveryNumberOfStepsIsExact) {
  PulseBench bench(GetParam());
  std::int64_t position = 0;
  for (int steps = 1; steps <= 30; ++steps) {
    const int way = steps % 3 == 0 ? -steps : steps;
    const std::size_t made = bench.drive().steps();
    bench.move(way);
    position += way;
    ASSERT_EQ(bench.drive().position_steps(), position) << steps;
    ASSERT_NO_FATAL_FAILURE(bench.expect_run(made));
  }
}

TEST_P(Port, NoStepIsEarlierThanItsTable) {
  PulseBench bench(GetParam());
  for (const std::int64_t steps : {1200, -99, 100, 3001}) {
    const std::size_t made = bench.drive().steps();
    bench.move(steps);
    ASSERT_EQ(bench.drive().steps() - made, static_cast<std::size_t>(std::abs(steps)));
    ASSERT_NO_FATAL_FAILURE(bench.expect_run(made));
  }
}

// Below the table's slowest delay, between, and none.
TEST_P(Port, RunsKeepToTheirSpeedLimits) {
  PulseBench bench(GetParam());
  for (const std::uint16_t shortest_delay : std::initializer_list<std::uint16_t>{700, 17, 0}) {
    const std::size_t made = bench.drive().steps();
    bench.move(120, shortest_delay);
    ASSERT_EQ(bench.drive().steps() - made, 120u);
    ASSERT_NO_FATAL_FAILURE(bench.expect_run(made, shortest_delay));
  }
}

TEST_P(Port, AStopAnywhereIsARamp) {
  for (const double after_s : {0.0, 0.003, 0.02, 0.08, 0.15, 0.3, 0.7, 1.1}) {
    PulseBench bench(GetParam());
    bench.begin(3000);
    bench.run_for(after_s);
    const auto before = static_cast<std::int64_t>(bench.drive().steps());
    bench.stop();
    bench.finish();
    ASSERT_NO_FATAL_FAILURE(bench.expect_run(0));
    EXPECT_LE(static_cast<std::int64_t>(bench.drive().steps()) - before,
              PulseBench::kUnderWay + PulseBench::kRampDown);
  }
}

// A stop in the ramp-down changes nothing.
TEST_P(Port, AStopInTheRampDownLeavesItsEnd) {
  PulseBench bench(GetParam());
  bench.begin(500);
  while (bench.drive().steps() < 480) bench.run_for(0.001);
  bench.stop();
  bench.finish();
  EXPECT_EQ(bench.drive().position_steps(), 500);
  bench.expect_run(0);
}

TEST_P(Port, ATargetFartherOnAndASlowerSpeed) {
  PulseBench bench(GetParam());
  bench.begin(900);
  bench.run_for(0.4);
  bench.aim(1500);
  bench.run_for(0.2);
  bench.aim(1500, 40);
  bench.finish();
  EXPECT_EQ(bench.drive().position_steps(), 1500);
  bench.expect_run(0);
}

TEST_P(Port, ALimitRampsDownAndForbidsItsDirection) {
  for (const int direction : {1, -1}) {
    PulseBench bench(GetParam());
    bench.drive().attach_switch(direction > 0 ? 1 : 2, {.at_steps = 600 * direction,
                                                        .positive_end = direction > 0,
                                                        .hysteresis_steps = 3,
                                                        .bounce_ns = 3'000'000});
    bench.begin(3000 * direction);
    bench.finish();
    const std::int64_t beyond = bench.drive().position_steps() * direction - 600;
    EXPECT_GE(beyond, 0);
    // 2 ms until the line is read, and 3 ms for which it bounces: at full speed 13 steps.
    EXPECT_LE(beyond, 13 + PulseBench::kUnderWay + PulseBench::kRampDown);
    bench.expect_run(0);
    EXPECT_EQ(direction > 0 ? bench.report().forbidden_positive : bench.report().forbidden_negative,
              1);
    EXPECT_EQ(direction > 0 ? bench.report().forbidden_negative : bench.report().forbidden_positive,
              0);
    const auto at = bench.drive().position_steps();
    bench.begin(100 * direction);
    bench.finish();
    EXPECT_EQ(bench.drive().position_steps(), at) << "towards its switch";
    bench.move(-200 * direction);
    EXPECT_EQ(bench.drive().position_steps(), at - 200 * direction);
  }
}

TEST_P(Port, ALimitMayStopAtOnce) {
  PulseBench bench(GetParam(), true);
  bench.drive().attach_switch(1, {.at_steps = 600, .positive_end = true});
  bench.begin(3000);
  bench.finish();
  EXPECT_GE(bench.drive().position_steps(), 600);
  EXPECT_LE(bench.drive().position_steps(), 600 + 5 + PulseBench::kUnderWay);
}

TEST_P(Port, HomeIsFoundToTheStepFromAnywhereBetweenTheLimits) {
  for (const std::int64_t from : {0, -350, 500}) {
    PulseBench bench(GetParam());
    bench.drive().attach_switch(0,
                                {.at_steps = -300, .hysteresis_steps = 4, .bounce_ns = 3'000'000});
    bench.drive().attach_switch(2, {.at_steps = -600, .bounce_ns = 3'000'000});
    bench.move(from);
    ASSERT_EQ(bench.home(-1), BUSHD_HOMING_DONE) << from;
    EXPECT_EQ(bench.drive().position_steps(), -300);
    EXPECT_EQ(bench.counted(), 0);
    EXPECT_EQ(bench.report().homed, 1);
    bench.move(300);
    EXPECT_EQ(bench.drive().position_steps(), 0);
  }
}

TEST_P(Port, HomingLooksOnTheOtherSideOfALimit) {
  PulseBench bench(GetParam());
  bench.drive().attach_switch(2, {.at_steps = -200});
  bench.drive().attach_switch(0, {.at_steps = 300, .positive_end = true, .width_steps = 60});
  ASSERT_EQ(bench.home(-1), BUSHD_HOMING_DONE);
  EXPECT_EQ(bench.drive().position_steps(), 359);
}

TEST_P(Port, NoHomeBetweenTheLimitsIsTold) {
  PulseBench bench(GetParam());
  bench.drive().attach_switch(2, {.at_steps = -200});
  bench.drive().attach_switch(1, {.at_steps = 200, .positive_end = true});
  EXPECT_EQ(bench.home(-1), BUSHD_HOMING_NOT_FOUND);
  bench.expect_count();
  EXPECT_EQ(bench.report().homed, 0);
}

TEST_P(Port, HomingIsGivenUpOnRequest) {
  PulseBench bench(GetParam());
  bench.master().home({0}, {.motor = 0,
                            .direction = -1,
                            .most_steps = 3000,
                            .shortest_delay = 0,
                            .slow_steps = 200,
                            .slow_delay = 1000,
                            .position_steps = 0});
  bench.run_for(0.5);
  bench.give_up_homing();
  bench.run_for(2);
  EXPECT_EQ(bench.report().homing, BUSHD_HOMING_STOPPED);
  EXPECT_LT(bench.drive().steps(), 3000u);
  bench.expect_count();
  bench.expect_run(0);
}

TEST_P(Port, AnEmergencyStopComesBeforeAllElseAndIsLatched) {
  for (const bushd_stop_mode mode : {BUSHD_STOP_RAMP, BUSHD_STOP_IMMEDIATE}) {
    PulseBench bench(GetParam());
    bench.begin(3000);
    bench.run_for(0.6);
    const auto before = static_cast<std::int64_t>(bench.drive().steps());
    bench.aim(2800);
    bench.emergency_stop(mode);
    bench.run_for(1);
    const auto more = static_cast<std::int64_t>(bench.drive().steps()) - before;
    EXPECT_LE(more, PulseBench::kUnderWay +
                        (mode == BUSHD_STOP_RAMP ? PulseBench::kRampDown : std::int64_t{0}));
    bench.expect_count();
    if (mode == BUSHD_STOP_RAMP) bench.expect_run(0);
    EXPECT_EQ(bench.report().faults, BUSHD_FAULT_EMERGENCY);
    EXPECT_EQ(bench.report().state, BUSHD_STATE_FAULT);
    bench.clear_faults();
    EXPECT_EQ(bench.report().faults, 0);
    const auto at = bench.drive().position_steps();
    bench.move(50);
    EXPECT_EQ(bench.drive().position_steps(), at + 50);
  }
}

TEST_P(Port, AnEmergencyStopBeforeTheFirstByteMovesNothing) {
  PulseBench bench(GetParam());
  bench.begin(3000);
  bench.run_for(0.004);
  bench.emergency_stop(BUSHD_STOP_RAMP);
  bench.run_for(1);
  EXPECT_EQ(bench.drive().steps(), 0u);
  EXPECT_EQ(bench.counted(), 0);
}

// Whether bytes have left that were under way nobody knows: as many steps are told.
TEST_P(Port, ALostPortTellsHowManyStepsMayBeMissing) {
  for (const double after_s : {0.05, 0.2, 0.6, 1.0}) {
    PulseBench bench(GetParam());
    bench.begin(3000);
    bench.run_for(after_s);
    bench.lose_port();
    ASSERT_EQ(bench.count_of<link::PositionUncertain>(), 0u);
    bench.run_for(0.01);
    ASSERT_EQ(bench.count_of<link::PositionUncertain>(), 1u) << after_s;
    const std::string& reason = bench.master().view({0}).uncertain_reason;
    const std::int64_t most = std::stoll(reason.substr(reason.find("while ") + 6));
    bench.open_port();
    bench.run_for(0.3);
    EXPECT_LE(std::abs(bench.counted() - bench.drive().position_steps()), most) << reason;
    // 20 ms under way, and 20 ms that an adapter may have had untold.
    EXPECT_LE(most, 2 * PulseBench::kUnderWay) << reason;
  }
}

TEST_P(Port, APortLostAtRestLosesNothing) {
  PulseBench bench(GetParam());
  bench.move(321);
  bench.lose_port();
  bench.run_for(0.5);
  bench.open_port();
  bench.run_for(0.2);
  EXPECT_EQ(bench.count_of<link::PositionUncertain>(), 0u);
  bench.expect_count();
  bench.move(-321);
  EXPECT_EQ(bench.drive().position_steps(), 0);
}

// The bench looks at each edge: DIR is 1 ms away from every step.
TEST_P(Port, TheDirectionIsSetWellBeforeAStep) {
  PulseBench bench(GetParam());
  for (int i = 0; i < 12; ++i) bench.move(i % 2 == 0 ? 1 + i : -2 * i);
  bench.begin(700);
  bench.run_for(0.3);
  bench.stop();
  bench.finish();
  bench.move(-700);
}

TEST_P(PortThatTellsEmpty, AStalledDriverIsNotCountedOn) {
  PulseBench bench(GetParam());
  bench.begin(3000);
  bench.run_for(0.7);
  bench.stall(true);
  for (int i = 0; i < 10; ++i) {
    bench.run_for(0.05);
    ASSERT_LE(bench.counted(), bench.drive().position_steps()) << i;
  }
  bench.stall(false);
  bench.finish();
  EXPECT_EQ(bench.drive().position_steps(), 3000);
  bench.expect_run(0);
}

// A driver that has passed nothing on goes on while the daemon stands still: bytes have just begun
// to leave, however long ago they were written.
void pass_on_late(PulseBench& bench, int steps, std::uint16_t shortest_delay) {
  bench.stall(true);
  bench.begin(steps, shortest_delay);
  bench.run_for(0.2);
  ASSERT_EQ(bench.report().moving, 1);
  bench.pause(0.3);
  ASSERT_EQ(bench.drive().steps(), 0u);
  bench.stall(false);
  bench.pause(0.001);
}

// Until all have left the motor is not told to rest, nor is the rate or the direction changed.
TEST_P(Port, BytesThatLeaveLateAreWaitedFor) {
  for (const std::uint16_t shortest_delay : {std::uint16_t{0}, std::uint16_t{1'500}}) {
    for (int steps = 1; steps <= 12; ++steps) {
      PulseBench bench(GetParam());
      ASSERT_NO_FATAL_FAILURE(pass_on_late(bench, steps, shortest_delay));
      for (int i = 0; i < 10'000 && bench.report().moving != 0; ++i) bench.run_for(0.0002);
      EXPECT_EQ(bench.drive().position_steps(), steps);
      EXPECT_EQ(bench.drive().queued(), 0u) << "after " << steps << " steps";
      bench.finish();
      bench.move(-steps);
      EXPECT_EQ(bench.drive().position_steps(), 0);
    }
  }
}

TEST_P(Port, BytesThatLeaveLateMayBeMissingWhereThePortIsLost) {
  PulseBench bench(GetParam());
  ASSERT_NO_FATAL_FAILURE(pass_on_late(bench, 2, 0));
  bench.run_for(0.004);
  bench.lose_port();
  bench.run_for(0.1);
  EXPECT_EQ(bench.count_of<link::PositionUncertain>(), 1u);
}

// A port has no communication timeout that ramps down: it makes what was under way, and stands.
TEST_P(Port, ADaemonThatStandsStillEndsWhatIsUnderWayAndGoesOn) {
  PulseBench bench(GetParam());
  bench.begin(3000);
  bench.run_for(0.7);
  const auto before = static_cast<std::int64_t>(bench.drive().steps());
  bench.pause(1.0);
  EXPECT_LE(static_cast<std::int64_t>(bench.drive().steps()) - before, PulseBench::kUnderWay);
  bench.finish();
  EXPECT_EQ(bench.drive().position_steps(), 3000);
  bench.expect_run(0);
}

TEST_P(Port, AfterARestartItCountsOnFromWhereItIsTold) {
  PulseBench bench(GetParam());
  bench.move(345);
  bench.restart();
  bench.run_for(0.3);
  EXPECT_EQ(bench.master().view({0}).identity.boot_number, 2) << "so the daemon knows";
  EXPECT_EQ(bench.counted(), 0);
  bench.set_position(345);
  EXPECT_EQ(bench.counted(), 345);
  bench.move(-345);
  EXPECT_EQ(bench.drive().position_steps(), 0);
}

// What the daemon before had written moves the motor still: nobody is told that it stands.
TEST_P(PortThatTellsEmpty, AfterARestartInMotionItWaitsForTheBytesOfTheOneBefore) {
  PulseBench bench(GetParam());
  bench.begin(3000);
  bench.run_for(0.7);
  bench.stall(true);
  bench.run_for(0.1);
  bench.restart();
  bench.run_for(0.5);
  EXPECT_NE(bench.master().view({0}).phase, link::McuPhase::kOnline);
  bench.stall(false);
  bench.run_for(0.5);
  EXPECT_EQ(bench.master().view({0}).phase, link::McuPhase::kOnline);
  EXPECT_EQ(bench.drive().queued(), 0u);
}

// What is asked, and when: what is counted is what the line did.
TEST_P(Port, CountsEveryStepOfRandomOrders) {
  const char* given = std::getenv("BUSHD_SEED");
  const unsigned seed = given != nullptr ? static_cast<unsigned>(std::stoul(given)) : 20261123;
  std::printf("  seed %u\n", seed);
  std::mt19937 random(seed);
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  PulseBench bench(GetParam());
  for (int i = 0; i < 40; ++i) {
    const std::size_t made = bench.drive().steps();
    bench.begin(below(2400) - 1200, static_cast<std::uint16_t>(below(3) == 0 ? below(60) : 0));
    bench.run_for(0.001 * below(900));
    const bool stopped = below(3) == 0;
    if (stopped) bench.stop();
    if (below(8) == 0) bench.pause(0.001 * below(150));
    ASSERT_NO_FATAL_FAILURE(bench.finish());
    ASSERT_NO_FATAL_FAILURE(bench.expect_run(made, 0, stopped));
  }
}

}  // namespace
}  // namespace bushd::test
