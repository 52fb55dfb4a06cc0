// Moves through the whole daemon and the whole firmware, over a simulated line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

TEST(Moves, ConnectedMcusBecomeReadyWithEnabledDrivers) {
  ReadyLab lab(hall(2, 16));
  EXPECT_EQ(lab.state_of("hall:1").motors.size(), 16u);
  EXPECT_EQ(lab.state_of("hall:2").boot, 2);
  EXPECT_TRUE(lab.motor("m32").enabled);
}

TEST(Moves, ShortAndLongMovesReachTheirTargets) {
  ReadyLab lab(hall(1, 2));
  for (const std::int64_t steps : {1, 2, 3, 7, 400, 475, 476, 477, 2000, -1, -2883, -5}) {
    const std::int64_t from = lab.motor("m01").position_steps;
    const auto number = lab.send(Ask::kMoveBy, {"m01"}, {steps});
    const Answer result = lab.wait(number);
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
    ReadyLab lab(hall(2, 16, manner));
    std::vector<std::string> names;
    std::vector<std::int64_t> steps;
    for (int i = 1; i <= 32; ++i) {
      names.push_back((i < 10 ? "m0" : "m") + std::to_string(i));
      steps.push_back((i % 2 ? 1 : -1) * i * 117);
    }
    const Answer result = lab.ask(Ask::kMoveBy, names, steps);
    EXPECT_EQ(result.result, "reached") << result.reason;
    for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(lab.shaft_steps(names[i]), steps[i]);
    EXPECT_EQ(lab.bus(0).collisions(), 0u);
    EXPECT_EQ(lab.bus(0).mcu(0).core().reception.bad_frames, 0);
    EXPECT_EQ(lab.bus(0).mcu(0).core().reception.rejected_frames, 0);
  }
}

TEST(Moves, MotorsStartAndEndIndependently) {
  ReadyLab lab(hall(1, 3));
  const auto long_move = lab.send(Ask::kMoveBy, {"m01"}, {5000});
  lab.run_for(0.7);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {-30}).result, "reached");
  EXPECT_TRUE(lab.motor("m01").moving);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m02"}, {100}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m02"), 100);
  EXPECT_EQ(lab.wait(long_move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 5000);
}

TEST(Moves, StopInFlightRampsDownAndKnowsWhereItStands) {
  ReadyLab lab(hall(1, 3));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  const auto other = lab.send(Ask::kMoveBy, {"m02"}, {3000});
  lab.run_for(1.5);
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
  const Answer result = lab.last_reply(move);
  EXPECT_EQ(result.result, "stopped");
  EXPECT_GT(result.position_steps.at(0), 0);
  EXPECT_LT(result.position_steps.at(0), 20000);
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_EQ(lab.wait(other).result, "reached") << "the other motor is not disturbed";
  EXPECT_EQ(lab.shaft_steps("m02"), 3000);
}

TEST(Moves, StopAtEveryPhaseOfAMoveLosesNoStep) {
  for (int ms = 0; ms <= 2400; ms += 40) {
    ReadyLab lab(hall(1, 1));
    const auto move = lab.send(Ask::kMoveBy, {"m01"}, {-900});
    lab.run_for(ms * 1e-3);
    lab.ask(Ask::kStop, {});
    const Answer result = lab.wait(move);
    EXPECT_THAT(result.result, testing::AnyOf("stopped", "reached"))
        << ms << " ms: " << result.reason;
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0)) << ms << " ms";
    // And it can move again.
    EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {5}).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), 5);
  }
}

// What is told in few frames begins sooner than a stop can take effect.
TEST(Moves, StopBeforeTheStartMakesNoStep) {
  ReadyLab lab(hall(1, 2, "fine_ticks"));
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m02"}, {500, 500});
  lab.ask(Ask::kStop, {});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.shaft_steps("m02"), 0);
}

TEST(Moves, RefusalsNameMotorAndCause) {
  ReadyLab lab(hall(1, 2));
  const auto refused = [&](Ask kind, std::vector<std::string> motors,
                           std::vector<std::int64_t> steps) {
    const Answer reply = lab.last_reply(lab.send(kind, motors, steps));
    EXPECT_EQ(reply.phase, Answer::kRefused);
    EXPECT_EQ(reply.result, "refused");
    return reply.reason;
  };
  using testing::HasSubstr;
  EXPECT_THAT(refused(Ask::kMoveBy, {"nobody"}, {1}), HasSubstr("no motor \"nobody\""));
  EXPECT_THAT(refused(Ask::kMoveBy, {}, {}), HasSubstr("no motor is named"));
  EXPECT_THAT(refused(Ask::kMoveBy, {"m01", "m01"}, {1, 2}), HasSubstr("m01 is named twice"));
  EXPECT_THAT(refused(Ask::kMoveTo, {"m01"}, {INT64_MAX}), HasSubstr("out of range"));
  EXPECT_THAT(refused(Ask::kMoveTo, {"m01"}, {INT64_MIN}), HasSubstr("out of range"));
  EXPECT_THAT(refused(Ask::kMoveBy, {"m01"}, {3'000'000'000}), HasSubstr("beyond"));
  lab.send(Ask::kMoveBy, {"m01"}, {1000});
  EXPECT_THAT(refused(Ask::kMoveBy, {"m02", "m01"}, {1, 3'000'000'000}),
              HasSubstr("m01: target 3000001000 is beyond"));
  EXPECT_THAT(refused(Ask::kDisable, {"m02"}, {0}), HasSubstr("m01 moves"));
  EXPECT_THAT(refused(Ask::kSetPosition, {"m01"}, {0}), HasSubstr("m01 moves"));
  lab.run_for(3);
  EXPECT_EQ(lab.shaft_steps("m02"), 0) << "a group move is refused as a whole";
}

TEST(Moves, AMoveOfManyYearsIsRefused) {
  ReadyLab lab(hall(1, 1, "fine", "glacier"),
               "name = \"glacier\"\ntime_unit_ns = 1000000000\naccel = [60000]\n");
  const Answer reply = lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {2'000'000'000}));
  EXPECT_EQ(reply.phase, Answer::kRefused);
  EXPECT_THAT(reply.reason, testing::HasSubstr("days"));
}

TEST(Moves, DisabledDriversRefuseMovesUntilEnabled) {
  ReadyLab lab(hall(1, 1));
  EXPECT_EQ(lab.ask(Ask::kDisable, {}).result, "done");
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {5})).reason,
              testing::HasSubstr("disabled"));
  EXPECT_EQ(lab.ask(Ask::kEnable, {"m01"}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {5}).result, "reached");
}

TEST(Moves, SetPositionMovesNothing) {
  ReadyLab lab(hall(1, 2));
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m02"}, {-1234}).result, "done");
  EXPECT_EQ(lab.motor("m02").position_steps, -1234);
  EXPECT_EQ(lab.shaft_steps("m02"), 0);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m02"}, {-1200}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m02"), 34);
}

TEST(Moves, SecondStopChangesNothing) {
  ReadyLab lab(hall(1, 1));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(1.5);
  lab.send(Ask::kStop, {"m01"});
  lab.run_for(0.05);
  lab.send(Ask::kStop, {});
  lab.core().shut_down(lab.now_us());
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "stopped") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
}

TEST(Moves, ShutDownRampsEverythingDown) {
  ReadyLab lab(hall(2, 16));
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m17"}, {9000, -9000});
  lab.run_for(1.2);
  lab.core().shut_down(lab.now_us());
  EXPECT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }, 10));
  const Answer result = lab.last_reply(move);
  EXPECT_EQ(result.result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_EQ(lab.shaft_steps("m17"), result.position_steps.at(1));
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {5})).reason,
              testing::HasSubstr("shutting down"));
}

}  // namespace
}  // namespace bushd::test
