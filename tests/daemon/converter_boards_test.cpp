// Motors behind a board with a voltage-to-frequency converter: the core, the exchange, and a board
// and a converter that share no code with them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "daemon/board_claims.h"

namespace bushd::test::converter_boards {
namespace {

using testing::HasSubstr;
using Character = sim::FrequencyConverter::Character;

constexpr double kHzPerCode = 10;
constexpr int kBaud = 115'200;
// The board's answer and the next code on the line, and the microsecond of the daemon's clock. A
// pulse is on a whole nanosecond.
constexpr std::int64_t kLineNs = 20'000'000'000 / kBaud + 2'000;
constexpr std::int64_t kNs = 2;

std::string with_converter(const std::string& bus_keys = "") {
  return with_motors_of_board(kBaud, "converter = { max_hz = 2500, max_code = 250 }", bus_keys);
}

class ConverterLab : public BoardLab {
 public:
  explicit ConverterLab(const std::string& toml = with_converter()) : BoardLab(toml) {}
  void has(const Character& character) { board(0).set_converter(now_us() * 1000, character); }
};

TEST(ConverterBoards, MoveIsItsHeaderAndTheCodesOfItsSpeeds) {
  const auto codes = converter_codes();
  EXPECT_EQ(codes.front(), 10);
  EXPECT_EQ(codes.back(), 250);
  for (const std::int64_t steps : {1, 2, 7, 475, 477, 2000}) {
    SCOPED_TRACE(steps);
    ConverterLab lab;
    expect_header_and_codes(lab, steps, codes);
  }
}

// With the gain g and the offset o an interval is 1 / (g (K + o)), and what the line takes on top
// of that. The steps are as many as were asked for, whatever that is.
TEST(ConverterBoards, GainAndOffsetChangeTimesAndNotCounts) {
  const auto codes = converter_codes();
  for (const double gain : {0.8, 1.0, 1.25}) {
    for (const double offset : {-3.0, 0.0, 2.5}) {
      SCOPED_TRACE(std::to_string(gain) + ' ' + std::to_string(offset));
      ConverterLab lab;
      lab.has({.hz_per_code = kHzPerCode * gain, .offset_codes = offset});
      EXPECT_EQ(lab.move("m0", 1000).result, "reached");
      EXPECT_EQ(lab.shaft_steps("m0"), 1000);
      EXPECT_EQ(lab.motor("m0").position_steps, 1000);
      EXPECT_TRUE(lab.trusted("m0")) << lab.motor("m0").uncertain_reason;
      const auto& steps = lab.board(0).steps();
      ASSERT_EQ(steps.size(), 1000u);
      for (std::size_t k = 1; k < steps.size(); ++k) {
        const auto code = static_cast<double>(code_of_step(codes, k, 1000));
        const double hz = kHzPerCode * gain * (code + offset);
        const auto period_ns = static_cast<std::int64_t>(1e9 / hz);
        // With an offset the converter goes on while the line is busy.
        const double at_rest = std::max(offset, 0.0) / (code + offset);
        const auto early_ns = static_cast<std::int64_t>(static_cast<double>(kLineNs) * at_rest);
        const std::int64_t taken_ns = steps[k].time_ns - steps[k - 1].time_ns;
        ASSERT_GE(taken_ns, period_ns - early_ns) << k;
        ASSERT_LE(taken_ns, period_ns + kLineNs + kNs) << k;
      }
      if (gain > 1 || offset > 0) continue;
      // A converter that is not too fast keeps to the table.
      for (std::size_t k = 1; k < steps.size(); ++k) {
        const std::int64_t table_ns =
            100'000'000 / (code_of_step(codes, k, 1000) + (code_of_step(codes, k, 1000) < 250));
        ASSERT_GE(steps[k].time_ns - steps[k - 1].time_ns, table_ns) << k;
      }
    }
  }
}

TEST(ConverterBoards, DriftInMotionChangesTimesAndNotCounts) {
  for (const double drift : {0.2, -0.02}) {
    ConverterLab lab;
    lab.has({.hz_per_code = kHzPerCode, .drift_per_s = drift});
    const auto move = lab.send(Ask::kMoveBy, {"m0"}, {6000});
    lab.moves(1500);
    const auto& steps = lab.board(0).steps();
    const std::int64_t before_ns = steps.back().time_ns - steps[steps.size() - 2].time_ns;
    lab.moves(5500);
    const std::int64_t after_ns = steps.back().time_ns - steps[steps.size() - 2].time_ns;
    EXPECT_EQ(drift > 0, after_ns < before_ns) << before_ns << ' ' << after_ns;
    EXPECT_THAT(lab.wait(move, 60), Ends("reached"));
    EXPECT_EQ(lab.shaft_steps("m0"), 6000);
    EXPECT_TRUE(lab.trusted("m0"));
  }
}

TEST(ConverterBoards, AConverterWithoutPulsesEndsTheMotionAfterASecond) {
  ConverterLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
  lab.moves(500);
  lab.has({.hz_per_code = kHzPerCode, .gives_pulses = false});
  const double cut_s = static_cast<double>(lab.now_us()) * 1e-6;
  const Answer answer = lab.wait(move);
  const double taken_s = static_cast<double>(lab.now_us()) * 1e-6 - cut_s;
  EXPECT_GE(taken_s, 1.0 - 0.001);
  EXPECT_LE(taken_s, 1.1);
  EXPECT_THAT(answer, Ends("link", "the board's converter gave no pulse within 1 s"));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  // No step is in doubt, but it stopped from speed.
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
  EXPECT_EQ(lab.motor("m0").trust, api::Trust::kUncertain);
  EXPECT_THAT(lab.motor("m0").uncertain_reason, HasSubstr("stopped without its ramp"));
  lab.has({.hz_per_code = kHzPerCode});
  lab.ask(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")});
  EXPECT_EQ(lab.move("m0", 100).result, "reached");
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
}

// The first speed of the table is K = 10.
TEST(ConverterBoards, AnOffsetThatTakesTheLowestSpeedsAwayIsNoticed) {
  ConverterLab lab;
  lab.has({.hz_per_code = kHzPerCode, .offset_codes = -10});
  EXPECT_THAT(lab.move("m0", 500).reason, HasSubstr("gave no pulse within 1 s"));
  EXPECT_EQ(lab.shaft_steps("m0"), 0);
}

TEST(ConverterBoards, PulsesForWhichNothingWaitsMoveNothing) {
  ConverterLab lab;
  lab.has({.hz_per_code = kHzPerCode, .offset_codes = 5});
  lab.run_for(10);
  EXPECT_EQ(lab.shaft_steps("m0"), 0);
  EXPECT_EQ(lab.move("m0", 100).result, "reached");
  EXPECT_GT(lab.board(0).converter().pulses(), 500u);
  EXPECT_EQ(lab.shaft_steps("m0"), 100);
}

TEST(ConverterBoards, StopSendsTheCodesOfTheRampDown) {
  ConverterLab lab;
  expect_stop_by_ramp(lab, converter_codes());
}

TEST(ConverterBoards, EmergencyStopsAreThoseOfEveryMotor) {
  for (const bool immediate : {false, true}) {
    ConverterLab lab(with_converter(immediate ? "emergency_stop = \"immediate\"\n" : ""));
    expect_emergency_stop(lab, immediate);
  }
}

// 5 steps/s, below K = 1: the daemon waits for the rest.
TEST(ConverterBoards, SlowerThanTheLowestCodeIsWaitedBeforeIt) {
  ConverterLab lab;
  lab.jog(5);
  lab.run_for(8);
  EXPECT_NEAR(static_cast<double>(lab.shaft_steps("m0")), 40, 2);
  lab.wait(lab.jog(0));
  EXPECT_EQ(lab.sent.back(), 1);
  EXPECT_TRUE(lab.trusted("m0"));
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
}

TEST(ConverterBoards, ATableFasterThanTheConverterIsNotPutInService) {
  ConverterLab lab;
  expect_least_step_us(lab, 400, "one period of its converter, 400000 ns by its max_hz");
}

// Each trouble leaves one step unknown at the most, and only where the motor is uncertain then.
TEST(ConverterBoards, WhateverHappensCountsAreRightOrSaidToBeUncertain) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto upto = [&random](unsigned n) { return static_cast<std::int64_t>(random() % n); };
    ConverterLab lab;
    lab.board(0).motor(0).right_limit_at = 500;
    for (int trouble = 0; trouble < 6; ++trouble) {
      lab.has({.hz_per_code = kHzPerCode * (0.5 + 0.01 * static_cast<double>(upto(100))),
               .offset_codes = 0.1 * static_cast<double>(upto(100)) - 5,
               .drift_per_s = 0.001 * static_cast<double>(upto(40)) - 0.02});
      const auto move = lab.send(Ask::kMoveBy, {"m0"}, {upto(800) - 400});
      lab.run_for(static_cast<double>(upto(500)) * 1e-3);
      const std::int64_t kind = upto(6);
      if (kind == 0) lab.unplug(0);
      if (kind == 1) lab.board(0).supply = false;
      if (kind == 2) lab.board(0).loses_answers = true;
      if (kind == 3) lab.send(Ask::kStop, {"m0"});
      if (kind == 4) lab.has({.hz_per_code = kHzPerCode, .gives_pulses = false});
      if (kind == 5) lab.send(Ask::kEmergencyStop, {});
      lab.run_for(static_cast<double>(upto(1500)) * 1e-3);
      lab.board(0).supply = true;
      lab.board(0).loses_answers = false;
      lab.has({.hz_per_code = kHzPerCode});
      if (kind == 0) lab.plug(0);
      ASSERT_TRUE(lab.run_until([&] { return lab.has_result(move); }, 60));
      lab.run_for(2.5);
      if (kind == 5) lab.ask(Ask::kClearFaults, {});
      if (lab.trusted("m0")) {
        ASSERT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0")) << trouble;
      } else {
        ASSERT_LE(std::abs(lab.motor("m0").position_steps - lab.shaft_steps("m0")), 1) << trouble;
        lab.ask(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")});
      }
    }
  }
}

}  // namespace
}  // namespace bushd::test::converter_boards
