// Moves through the whole daemon and the whole firmware, over a simulated line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

TEST(Moves, ConnectedMcusBecomeReadyWithEnabledDrivers) {
  Lab lab(hall(2, 16));
  lab.connect();
  EXPECT_EQ(lab.state_of("hall:1").motor_count, 16);
  EXPECT_EQ(lab.state_of("hall:2").boot_number, 2);
  EXPECT_TRUE(lab.motor("m32").enabled);
}

TEST(Moves, ShortAndLongMovesReachTheirTargets) {
  Lab lab(hall(1, 2));
  lab.connect();
  for (const std::int64_t steps : {1, 2, 3, 7, 400, 475, 476, 477, 2000, -1, -2883, -5}) {
    const std::int64_t from = lab.motor("m01").position_steps;
    const auto number = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {steps});
    const reply_t result = lab.wait(number);
    EXPECT_EQ(result.result, "reached") << steps << ": " << result.reason;
    EXPECT_EQ(result.position_steps.at(0), from + steps);
    EXPECT_EQ(lab.shaft_steps("m01"), from + steps);
    EXPECT_EQ(lab.replies(number).size(), 2u) << "accepted and exactly one result";
  }
  EXPECT_EQ(lab.shaft_steps("m02"), 0);
}

TEST(Moves, AllMotorsOfTwoMcusAtOnce) {
  for (const char* manner :
       {"fine", "coarse", "fine_table", "coarse_table", "fine_ticks", "coarse_ticks"}) {
    Lab lab(hall(2, 16, manner));
    lab.connect();
    std::vector<std::string> names;
    std::vector<std::int64_t> steps;
    for (int i = 1; i <= 32; ++i) {
      names.push_back((i < 10 ? "m0" : "m") + std::to_string(i));
      steps.push_back((i % 2 ? 1 : -1) * i * 117);
    }
    const reply_t result = lab.wait(lab.send(command_t::MOVE_RELATIVE, names, steps));
    EXPECT_EQ(result.result, "reached") << result.reason;
    for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(lab.shaft_steps(names[i]), steps[i]);
    EXPECT_EQ(lab.bus(0).collisions(), 0u);
    EXPECT_EQ(lab.bus(0).mcu(0).core().reception.bad_frames, 0);
    EXPECT_EQ(lab.bus(0).mcu(0).core().reception.rejected_frames, 0);
  }
}

TEST(Moves, MotorsStartAndEndIndependently) {
  Lab lab(hall(1, 3));
  lab.connect();
  const auto long_move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {5000});
  lab.run_for(0.7);
  const auto short_move = lab.send(command_t::MOVE_RELATIVE, {"m02"}, {-30});
  EXPECT_EQ(lab.wait(short_move).result, "reached");
  EXPECT_TRUE(lab.motor("m01").moving);
  const auto next = lab.send(command_t::MOVE_ABSOLUTE, {"m02"}, {100});
  EXPECT_EQ(lab.wait(next).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m02"), 100);
  EXPECT_EQ(lab.wait(long_move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 5000);
}

TEST(Moves, StopInFlightRampsDownAndKnowsWhereItStands) {
  Lab lab(hall(1, 3));
  lab.connect();
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {20000});
  const auto other = lab.send(command_t::MOVE_RELATIVE, {"m02"}, {3000});
  lab.run_for(1.5);
  const auto stop = lab.send(command_t::STOP, {"m01"});
  EXPECT_EQ(lab.wait(stop).result, "done");
  const reply_t result = lab.last_reply(move);
  EXPECT_EQ(result.result, "stopped");
  EXPECT_GT(result.position_steps.at(0), 0);
  EXPECT_LT(result.position_steps.at(0), 20000);
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_EQ(lab.wait(other).result, "reached") << "the other motor is not disturbed";
  EXPECT_EQ(lab.shaft_steps("m02"), 3000);
}

TEST(Moves, StopAtEveryPhaseOfAMoveLosesNoStep) {
  for (int ms = 0; ms <= 2400; ms += 40) {
    Lab lab(hall(1, 1));
    lab.connect();
    const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {-900});
    lab.run_for(ms * 1e-3);
    lab.wait(lab.send(command_t::STOP, {}));
    const reply_t result = lab.wait(move);
    EXPECT_THAT(result.result, testing::AnyOf("stopped", "reached"))
        << ms << " ms: " << result.reason;
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0)) << ms << " ms";
    // And it can move again.
    EXPECT_EQ(lab.wait(lab.send(command_t::MOVE_ABSOLUTE, {"m01"}, {5})).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), 5);
  }
}

TEST(Moves, StopBeforeTheStartMakesNoStep) {
  Lab lab(hall(1, 2));
  lab.connect();
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01", "m02"}, {500, 500});
  lab.wait(lab.send(command_t::STOP, {}));
  EXPECT_EQ(lab.wait(move).result, "stopped");
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.shaft_steps("m02"), 0);
}

TEST(Moves, RepeatedCommandIsAnsweredAgainAndNotRunAgain) {
  Lab lab(hall(1, 1));
  lab.connect();
  command_t command{};
  command.utime_us = 0;
  command.client_id = "test";
  command.number = 77;
  command.kind = command_t::MOVE_RELATIVE;
  command.motor_count = 1;
  command.motors = {"m01"};
  command.steps = {50};
  lab.command(command);
  lab.command(command);
  EXPECT_EQ(lab.replies(77).size(), 2u) << "accepted, twice";
  lab.wait(77);
  lab.command(command);
  EXPECT_EQ(lab.replies(77).size(), 5u) << "and both answers again";
  lab.run_for(2);
  EXPECT_EQ(lab.shaft_steps("m01"), 50);
}

TEST(Moves, RefusalsNameMotorAndCause) {
  Lab lab(hall(1, 2));
  lab.connect();
  const auto refused = [&](std::int8_t kind, std::vector<std::string> motors,
                           std::vector<std::int64_t> steps) {
    const reply_t reply = lab.last_reply(lab.send(kind, motors, steps));
    EXPECT_EQ(reply.phase, reply_t::REFUSED);
    EXPECT_EQ(reply.result, "refused");
    return reply.reason;
  };
  using testing::HasSubstr;
  EXPECT_THAT(refused(command_t::MOVE_RELATIVE, {"nobody"}, {1}), HasSubstr("no motor \"nobody\""));
  EXPECT_THAT(refused(command_t::MOVE_RELATIVE, {}, {}), HasSubstr("no motor is named"));
  EXPECT_THAT(refused(command_t::MOVE_RELATIVE, {"m01", "m01"}, {1, 2}),
              HasSubstr("m01 is named twice"));
  EXPECT_THAT(refused(command_t::MOVE_ABSOLUTE, {"m01"}, {INT64_MAX}), HasSubstr("out of range"));
  EXPECT_THAT(refused(command_t::MOVE_ABSOLUTE, {"m01"}, {INT64_MIN}), HasSubstr("out of range"));
  EXPECT_THAT(refused(command_t::MOVE_RELATIVE, {"m01"}, {3'000'000'000}), HasSubstr("beyond"));
  EXPECT_THAT(refused(99, {"m01"}, {1}), HasSubstr("no command kind 99"));
  lab.send(command_t::MOVE_RELATIVE, {"m01"}, {1000});
  EXPECT_THAT(refused(command_t::MOVE_RELATIVE, {"m02", "m01"}, {1, 3'000'000'000}),
              HasSubstr("m01: target 3000001000 is beyond"));
  EXPECT_THAT(refused(command_t::DISABLE, {"m02"}, {0}), HasSubstr("m01 moves"));
  EXPECT_THAT(refused(command_t::SET_POSITION, {"m01"}, {0}), HasSubstr("m01 moves"));
  lab.run_for(3);
  EXPECT_EQ(lab.shaft_steps("m02"), 0) << "a group move is refused as a whole";
}

TEST(Moves, AMoveOfManyYearsIsRefused) {
  Lab lab(hall(1, 1, "fine", "glacier"),
          "name = \"glacier\"\ntime_unit_ns = 1000000000\naccel = [60000]\n");
  lab.connect();
  const reply_t reply =
      lab.last_reply(lab.send(command_t::MOVE_RELATIVE, {"m01"}, {2'000'000'000}));
  EXPECT_EQ(reply.phase, reply_t::REFUSED);
  EXPECT_THAT(reply.reason, testing::HasSubstr("days"));
}

TEST(Moves, DisabledDriversRefuseMovesUntilEnabled) {
  Lab lab(hall(1, 1));
  lab.connect();
  EXPECT_EQ(lab.wait(lab.send(command_t::DISABLE, {})).result, "done");
  const reply_t reply = lab.last_reply(lab.send(command_t::MOVE_RELATIVE, {"m01"}, {5}));
  EXPECT_THAT(reply.reason, testing::HasSubstr("disabled"));
  EXPECT_EQ(lab.wait(lab.send(command_t::ENABLE, {"m01"})).result, "done");
  EXPECT_EQ(lab.wait(lab.send(command_t::MOVE_RELATIVE, {"m01"}, {5})).result, "reached");
}

TEST(Moves, SetPositionMovesNothing) {
  Lab lab(hall(1, 2));
  lab.connect();
  EXPECT_EQ(lab.wait(lab.send(command_t::SET_POSITION, {"m02"}, {-1234})).result, "done");
  EXPECT_EQ(lab.motor("m02").position_steps, -1234);
  EXPECT_EQ(lab.shaft_steps("m02"), 0);
  EXPECT_EQ(lab.wait(lab.send(command_t::MOVE_ABSOLUTE, {"m02"}, {-1200})).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m02"), 34);
}

TEST(Moves, SecondStopChangesNothing) {
  Lab lab(hall(1, 1));
  lab.connect();
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {20000});
  lab.run_for(1.5);
  lab.send(command_t::STOP, {"m01"});
  lab.run_for(0.05);
  lab.send(command_t::STOP, {});
  lab.core().shut_down(lab.now_us());
  const reply_t result = lab.wait(move);
  EXPECT_EQ(result.result, "stopped") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
}

TEST(Moves, ShutDownRampsEverythingDown) {
  Lab lab(hall(2, 16));
  lab.connect();
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01", "m17"}, {9000, -9000});
  lab.run_for(1.2);
  lab.core().shut_down(lab.now_us());
  EXPECT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }, 10));
  const reply_t result = lab.last_reply(move);
  EXPECT_EQ(result.result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_EQ(lab.shaft_steps("m17"), result.position_steps.at(1));
  EXPECT_THAT(lab.last_reply(lab.send(command_t::MOVE_RELATIVE, {"m01"}, {5})).reason,
              testing::HasSubstr("shutting down"));
}

}  // namespace
}  // namespace bushd::test
