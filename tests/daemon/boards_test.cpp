// Motors behind commutator boards: the core, the exchange and a board that shares no code with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "daemon/board_claims.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kUnitNs = 40'000;  // of a code, F_start 100 Hz
constexpr int kBaud = 115'200;

std::string with_board(const std::string& motor_keys = "", const std::string& bus_keys = "") {
  return with_motors_of_board(kBaud, "start_hz = 100", bus_keys, motor_keys);
}

class DelayLab : public BoardLab {
 public:
  explicit DelayLab(const std::string& toml = with_board()) : BoardLab(toml) {}
};

TEST(Boards, MoveIsItsHeaderAndTheCodesOfItsTable) {
  const auto accel = delay_codes();
  ASSERT_EQ(accel.size(), 238u);
  for (const std::int64_t steps : {1, 2, 7, 475, 476, 477, 2000}) {
    SCOPED_TRACE(steps);
    DelayLab lab;
    expect_header_and_codes(lab, steps, accel);
  }
}

TEST(Boards, NoStepIsEarlierThanItsTable) {
  DelayLab lab;
  EXPECT_EQ(lab.move("m0", 1000).result, "reached");
  const auto accel = delay_codes();
  const auto& steps = lab.board(0).steps();
  ASSERT_EQ(steps.size(), 1000u);
  // The board's answer and the next code on the line, and the microsecond of the daemon's clock.
  const std::int64_t line_ns = 20'000'000'000 / kBaud + 2'000;
  for (std::size_t k = 1; k < steps.size(); ++k) {
    const std::int64_t code_ns = code_of_step(accel, k, 1000) * kUnitNs;
    const std::int64_t taken_ns = steps[k].time_ns - steps[k - 1].time_ns;
    ASSERT_GE(taken_ns, code_ns) << k;
    ASSERT_LE(taken_ns, code_ns + line_ns) << k;
  }
}

TEST(Boards, StopSendsTheCodesOfTheRampDown) {
  DelayLab lab;
  expect_stop_by_ramp(lab, delay_codes());
}

TEST(Boards, AnotherTargetInMotionIsReached) {
  DelayLab lab;
  const auto first = lab.send(Ask::kMoveTo, {"m0"}, {5000});
  lab.moves(300);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m0"}, {-100}).result, "reached");
  EXPECT_EQ(lab.last_reply(first).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m0"), -100);
  EXPECT_TRUE(lab.errors().empty());
}

TEST(Boards, OneMotorAtATime) {
  DelayLab lab;
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m0", "m5"}, {100, 100}),
              Ends("refused", "moves one motor at a time; move m5 after m0"));
  const auto first = lab.send(Ask::kMoveBy, {"m0"}, {3000});
  lab.moves(10);
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m5"}, {100}).reason,
              HasSubstr("m0 moves, and the board board moves one motor at a time"));
  EXPECT_EQ(lab.wait(first).result, "reached");
  EXPECT_EQ(lab.move("m5", 100).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m5"), 100);
}

TEST(Boards, LimitRampsDownAndForbids) {
  DelayLab lab;
  lab.board(0).motor(0).right_limit_at = 1000;
  const Answer answer = lab.move("m0", 20'000);
  EXPECT_EQ(answer.result, "limit") << answer.reason;
  const std::int64_t made = lab.shaft_steps("m0");
  EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{made});
  EXPECT_EQ(made, 1000 + 238);  // the next step, of code 10, and the 237 with longer codes
  EXPECT_TRUE(lab.trusted("m0"));
  EXPECT_EQ(lab.move("m0", 10).result, "refused");
  EXPECT_EQ(lab.move("m0", -made).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m0"), 0);
  EXPECT_EQ(lab.move("m0", 10).result, "reached");
}

TEST(Boards, LimitThatStopsImmediatelyLeavesThePositionUncertain) {
  DelayLab lab(with_board("limit_action = \"immediate\"\n"));
  lab.board(0).motor(0).left_limit_at = -1000;
  const Answer answer = lab.move("m0", -20'000);
  EXPECT_EQ(answer.result, "limit") << answer.reason;
  EXPECT_EQ(lab.shaft_steps("m0"), -1000);
  EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{-1000});
  EXPECT_EQ(lab.motor("m0").trust, api::Trust::kUncertain);
}

TEST(Boards, LostAnswerIsAStepThatIsUncertainAndSaid) {
  DelayLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
  lab.moves(500);
  lab.board(0).loses_answers = true;
  const Answer answer = lab.wait(move);
  EXPECT_THAT(answer, Ends("link", "the board did not answer"));
  lab.board(0).loses_answers = false;
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_EQ(lab.motor("m0").trust, api::Trust::kUncertain);
  EXPECT_THAT(lab.motor("m0").uncertain_reason, HasSubstr("may have been made or not"));
  // The step was made, its answer lost.
  EXPECT_EQ(lab.shaft_steps("m0"), lab.motor("m0").position_steps + 1);
  EXPECT_EQ(lab.move("m0", 100).result, "refused");
  lab.ask(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")});
  EXPECT_EQ(lab.move("m0", 100).result, "reached");
}

// A motor at 2500 steps/s that gets no code for 30 ms stands, and cannot go on at 2500 steps/s.
TEST(Boards, PauseAtSpeedIsSaidAndFollowedByTheRampUp) {
  const auto accel = delay_codes();
  DelayLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {3000});
  lab.moves(1000);
  lab.pause_daemon(0.03);
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m0"), 3000);
  EXPECT_THAT(lab.motor("m0").uncertain_reason, HasSubstr("a pause of 30 ms between two steps"));
  const auto& steps = lab.board(0).steps();
  std::size_t paused = 1;
  while (steps[paused].time_ns - steps[paused - 1].time_ns < 20'000'000) ++paused;
  for (std::size_t i = 1; i < accel.size(); ++i) {
    const std::int64_t taken_ns = steps[paused + i].time_ns - steps[paused + i - 1].time_ns;
    ASSERT_GE(taken_ns, accel[i] * kUnitNs) << i;
    ASSERT_LE(taken_ns, accel[i] * kUnitNs + 180'000) << i;
  }

  // A slow motor stands between all steps.
  lab.ask(Ask::kSetPosition, {"m0"}, {0});
  const auto slow = lab.send(Ask::kMoveBy, {"m0"}, {2});
  lab.run_for(0.005);
  lab.pause_daemon(0.03);
  EXPECT_EQ(lab.wait(slow).result, "reached");
  EXPECT_TRUE(lab.trusted("m0"));
}

TEST(Boards, CableThatIsCutLosesOneStepAtMost) {
  DelayLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
  lab.moves(500);
  lab.board(0).cut = true;
  EXPECT_EQ(lab.wait(move).result, "link");
  lab.board(0).cut = false;
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_LE(std::abs(lab.shaft_steps("m0") - lab.motor("m0").position_steps), 1);
  EXPECT_EQ(lab.motor("m0").trust, api::Trust::kUncertain);
}

TEST(Boards, PortThatIsLostSaysWhatWasUnderWay) {
  DelayLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
  lab.moves(500);
  lab.unplug(0);
  EXPECT_EQ(lab.wait(move).result, "link");
  lab.run_for(1);
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_LE(std::abs(lab.shaft_steps("m0") - lab.motor("m0").position_steps), 1);
  EXPECT_THAT(lab.motor("m0").uncertain_reason, HasSubstr("its port was lost"));
  lab.ask(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")});
  EXPECT_TRUE(lab.trusted("m0"));
  EXPECT_EQ(lab.move("m0", 100).result, "reached");
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
}

TEST(Boards, SupplyAndConnectionAreWatched) {
  for (const bool supply : {true, false}) {
    DelayLab lab;
    const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
    lab.moves(500);
    (supply ? lab.board(0).supply : lab.board(0).motor(0).connected) = false;
    EXPECT_THAT(lab.wait(move).reason,
                HasSubstr(supply ? "supply is missing" : "is not connected"));
    lab.board(0).supply = lab.board(0).motor(0).connected = true;
    ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
    EXPECT_EQ(lab.shaft_steps("m0"), lab.motor("m0").position_steps);
    EXPECT_EQ(lab.motor("m0").trust, api::Trust::kUncertain);
  }
}

TEST(Boards, EmergencyStopsAreThoseOfEveryMotor) {
  for (const bool immediate : {false, true}) {
    DelayLab lab(with_board("", immediate ? "emergency_stop = \"immediate\"\n" : ""));
    expect_emergency_stop(lab, immediate);
  }
}

TEST(Boards, DriversStayOnAndThereIsNoHome) {
  DelayLab lab;
  EXPECT_NE(lab.ask(Ask::kDisable, {"m0"}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kEnable, {"m0"}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kHome, {"m0"}).result, "refused");
}

TEST(Boards, PositionsAreKeptOverRestarts) {
  DelayLab lab;
  lab.keep_positions();
  lab.connect();
  lab.ask(Ask::kSetPosition, {"m0"}, {0});
  EXPECT_EQ(lab.move("m0", 321).result, "reached");
  lab.run_for(1);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  lab.run_for(0.5);
  EXPECT_EQ(lab.motor("m0").position_steps, 321);
  EXPECT_EQ(lab.motor("m0").trust, api::Trust::kRestored);
}

TEST(Boards, JogChangesSpeedAndDirectionAndEnds) {
  DelayLab lab;
  const auto first = lab.jog(200);
  lab.run_for(1);
  const std::int64_t slow = lab.shaft_steps("m0");
  EXPECT_NEAR(static_cast<double>(slow), 200, 20);
  lab.jog(1000);
  lab.run_for(1.5);
  EXPECT_GT(lab.shaft_steps("m0"), slow + 700);
  lab.jog(-300);
  lab.run_for(3);
  const std::int64_t at = lab.shaft_steps("m0");
  lab.run_for(1);
  // 84 codes of 40 us, and 20 bits of the line.
  EXPECT_NEAR(static_cast<double>(lab.shaft_steps("m0") - at), -1e6 / (84 * 40 + 174), 2);
  EXPECT_EQ(lab.wait(lab.jog(0)).result, "done");
  EXPECT_EQ(lab.wait(first).position_steps, std::vector<std::int64_t>{lab.shaft_steps("m0")});
  EXPECT_TRUE(lab.trusted("m0"));
}

// On its way to a lower speed a run is no state of a table; it goes on all the same.
TEST(Boards, ALowerSpeedInMotionIsApproachedAlongTheTable) {
  DelayLab lab;
  const auto accel = delay_codes();
  lab.jog(2000);
  lab.run_for(1.5);
  lab.jog(300);
  lab.run_for(2);
  lab.wait(lab.jog(0));
  EXPECT_TRUE(lab.trusted("m0")) << lab.motor("m0").uncertain_reason;
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
  const auto& steps = lab.board(0).steps();
  const std::size_t n = steps.size();
  ASSERT_GT(n, 600u);
  const auto code = [&](std::size_t i) { return accel[std::min(i, accel.size() - 1)]; };
  for (std::size_t k = 1; k < n; ++k) {
    ASSERT_GE(steps[k].time_ns - steps[k - 1].time_ns, std::max(code(k), code(n - 1 - k)) * kUnitNs)
        << k << " of " << n;
  }
}

// A board that was reset while it rested waits for a header, and some codes look like one.
TEST(Boards, EachMotionBeginsWithItsHeader) {
  DelayLab lab;
  EXPECT_EQ(lab.move("m0", 2).result, "reached");
  const std::size_t before = lab.sent.size();
  EXPECT_EQ(lab.move("m0", 2).result, "reached");
  const std::vector<std::uint8_t> second(lab.sent.begin() + static_cast<std::ptrdiff_t>(before),
                                         lab.sent.end());
  EXPECT_EQ(second, (std::vector<std::uint8_t>{0, 0x80, 250, 250}));
}

TEST(Boards, ATableFasterThanACodeIsNotPutInService) {
  DelayLab lab;
  expect_least_step_us(lab, 40, "one delay code, 40000 ns by its start_hz");
}

// Each trouble leaves one step unknown at the most, and only where the motor is uncertain then.
TEST(Boards, WhateverHappensCountsAreRightOrSaidToBeUncertain) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto upto = [&random](unsigned n) { return static_cast<std::int64_t>(random() % n); };
    DelayLab lab;
    lab.board(0).motor(0).right_limit_at = 3000;
    for (int trouble = 0; trouble < 30; ++trouble) {
      const auto move = lab.send(Ask::kMoveBy, {"m0"}, {upto(4000) - 2000});
      lab.run_for(static_cast<double>(upto(900)) * 1e-3);
      const std::int64_t kind = upto(8);
      if (kind == 0) lab.board(0).cut = true;
      if (kind == 1) lab.board(0).loses_answers = true;
      if (kind == 2) lab.unplug(0);
      if (kind == 3) lab.board(0).supply = false;
      if (kind == 4) lab.send(Ask::kStop, {"m0"});
      if (kind == 5) lab.send(Ask::kMoveBy, {"m0"}, {upto(4000) - 2000});
      if (kind == 6) lab.send(Ask::kEmergencyStop, {});
      lab.run_for(static_cast<double>(upto(300)) * 1e-3);
      lab.board(0).cut = lab.board(0).loses_answers = false;
      lab.board(0).supply = true;
      if (kind == 2) lab.plug(0);
      ASSERT_TRUE(lab.run_until([&] { return lab.has_result(move); }, 60));
      lab.run_for(5);
      lab.ask(Ask::kClearFaults, {});
      ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10)) << "trouble " << kind;
      const std::int64_t off = lab.shaft_steps("m0") - lab.motor("m0").position_steps;
      ASSERT_LE(std::abs(off), lab.trusted("m0") ? 0 : 1) << "trouble " << kind;
      ASSERT_FALSE(kind >= 4 && !lab.trusted("m0")) << "trouble " << kind;
      lab.ask(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")});
    }
  }
}

}  // namespace
}  // namespace bushd::test
