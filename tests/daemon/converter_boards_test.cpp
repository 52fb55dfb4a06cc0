// Motors behind a board with a voltage-to-frequency converter: the core, the exchange, and a board
// and a converter that share no code with them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "daemon/lab.h"
#include "tables/table_file.h"

namespace bushd::test::converter_boards {
namespace {

using testing::HasSubstr;
using Character = sim::FrequencyConverter::Character;

constexpr double kHzPerCode = 10;
constexpr std::int64_t kBaud = 115'200;
// The board's answer and the next code on the line, and the microsecond of the daemon's clock. A
// pulse is on a whole nanosecond.
constexpr std::int64_t kLineNs = 20'000'000'000 / kBaud + 2'000;
constexpr std::int64_t kNs = 2;

std::string with_converter(const std::string& converter = "{ max_hz = 2500, max_code = 250 }",
                           const std::string& bus_keys = "") {
  return "[[bus]]\nname = \"board\"\nkind = \"commutator\"\nport = \"/dev/null\"\nbaud = 115200\n"
         "converter = " +
         converter + "\n" + bus_keys +
         "[[group]]\nname = \"axes\"\ntable = \"bushd2-constant\"\n"
         "[[motor]]\nname = \"m0\"\nmcu = \"board\"\noutput = 0\ngroup = \"axes\"\n"
         "[[motor]]\nname = \"m5\"\nmcu = \"board\"\noutput = 5\ngroup = \"axes\"\n";
}

class ConverterLab : public Lab {
 public:
  explicit ConverterLab(const std::string& toml = with_converter()) : Lab(toml) {
    connect();
    on_send = [this](std::size_t, std::vector<std::uint8_t>& bytes) {
      for (const std::uint8_t byte : bytes) sent.push_back(byte);
      return true;
    };
  }
  Answer move(const std::string& motor, std::int64_t steps) {
    return wait(send(Ask::kMoveBy, {motor}, {steps}), 120);
  }
  bool trusted(const std::string& name) const { return motor(name).trust == api::Trust::kKnown; }
  void moves(std::int64_t steps) {
    ASSERT_TRUE(run_until([&] { return std::abs(shaft_steps("m0")) >= steps; }));
  }
  void has(const Character& character) { board(0).set_converter(now_us() * 1000, character); }

  std::vector<std::uint8_t> sent;
};

// Delays of 250, 249, ..., 10 codes of 40 us: K is 2500 / 2500 Hz x 10^8 ns / delay, rounded down.
std::vector<std::int64_t> converter_codes() {
  const auto loaded = tables::load(*tables::find("bushd2-constant", tables::shipped_directories()));
  const bushd_ramp& accel = (*loaded)->view().accel;
  std::vector<std::int64_t> codes;
  for (std::uint32_t i = 0; i < accel.count; ++i) codes.push_back(2500 / accel.code[i]);
  return codes;
}

std::int64_t code_of_step(const std::vector<std::int64_t>& codes, std::size_t k, std::size_t n) {
  return codes[std::min({k, n - 1 - k, codes.size() - 1})];
}

TEST(ConverterBoards, MoveIsItsHeaderAndTheCodesOfItsSpeeds) {
  const auto codes = converter_codes();
  EXPECT_EQ(codes.front(), 10);
  EXPECT_EQ(codes.back(), 250);
  for (const std::int64_t steps : {1, 2, 7, 475, 477, 2000}) {
    SCOPED_TRACE(steps);
    ConverterLab lab;
    const Answer answer = lab.move("m5", -steps);
    EXPECT_EQ(answer.result, "reached") << answer.reason;
    EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{-steps});
    EXPECT_EQ(lab.shaft_steps("m5"), -steps);
    EXPECT_EQ(lab.shaft_steps("m0"), 0);
    std::vector<std::uint8_t> expected{0, 0x8D};
    for (std::int64_t k = 0; k < steps; ++k) {
      expected.push_back(static_cast<std::uint8_t>(
          code_of_step(codes, static_cast<std::size_t>(k), static_cast<std::size_t>(steps))));
    }
    EXPECT_EQ(lab.sent, expected);
    EXPECT_TRUE(lab.trusted("m5"));
    EXPECT_TRUE(lab.errors().empty());
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
    const Answer answer = lab.wait(move, 60);
    EXPECT_EQ(answer.result, "reached") << answer.reason;
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
  EXPECT_EQ(answer.result, "link") << answer.reason;
  EXPECT_THAT(answer.reason, HasSubstr("the board's converter gave no pulse within 1 s"));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  // No step is in doubt, but it stopped from speed.
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
  EXPECT_EQ(lab.motor("m0").trust, api::Trust::kUncertain);
  EXPECT_THAT(lab.motor("m0").uncertain_reason, HasSubstr("stopped without its ramp"));
  lab.has({.hz_per_code = kHzPerCode});
  lab.wait(lab.send(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")}));
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
  const auto codes = converter_codes();
  ConverterLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
  lab.moves(1000);
  lab.wait(lab.send(Ask::kStop, {"m0"}));
  const Answer answer = lab.wait(move);
  EXPECT_EQ(answer.result, "stopped");
  const std::int64_t made = lab.shaft_steps("m0");
  EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{made});
  EXPECT_GE(made, 1238);
  EXPECT_LE(made, 1260);
  ASSERT_GE(lab.sent.size(), 240u);
  const std::vector<std::uint8_t> last(lab.sent.end() - 238, lab.sent.end());
  for (std::size_t k = 0; k < 238; ++k) EXPECT_EQ(last[k], codes[237 - k]) << k;
  EXPECT_TRUE(lab.trusted("m0"));
  EXPECT_EQ(lab.move("m0", -made).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m0"), 0);
}

TEST(ConverterBoards, EmergencyStopsAreThoseOfEveryMotor) {
  for (const bool immediate : {false, true}) {
    ConverterLab lab(with_converter("{ max_hz = 2500, max_code = 250 }",
                                    immediate ? "emergency_stop = \"immediate\"\n" : ""));
    const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
    lab.moves(1000);
    const std::int64_t at = lab.shaft_steps("m0");
    EXPECT_EQ(lab.wait(lab.send(Ask::kEmergencyStop, {})).result, "done");
    const Answer answer = lab.wait(move);
    const std::int64_t made = lab.shaft_steps("m0") - at;
    EXPECT_GE(made, immediate ? 0 : 238);
    EXPECT_LE(made, immediate ? 2 : 241);
    EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{lab.shaft_steps("m0")});
    EXPECT_EQ(lab.trusted("m0"), !immediate);
  }
}

// 5 steps/s, below K = 1: the daemon waits for the rest.
TEST(ConverterBoards, SlowerThanTheLowestCodeIsWaitedBeforeIt) {
  ConverterLab lab;
  const auto jog = [&](double per_s) {
    return lab.send(
        api::Jog{.motor = "m0", .per_s = per_s, .in_steps = true, .keepalive_ms = 10'000});
  };
  jog(5);
  lab.run_for(8);
  EXPECT_NEAR(static_cast<double>(lab.shaft_steps("m0")), 40, 2);
  lab.wait(jog(0));
  EXPECT_EQ(lab.sent.back(), 1);
  EXPECT_TRUE(lab.trusted("m0"));
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
}

TEST(ConverterBoards, ATableFasterThanTheConverterIsNotPutInService) {
  ConverterLab lab;
  lab.write_file("swift.toml", "name = \"swift\"\ntime_unit_ns = 1000\naccel = [9000, 399]\n");
  lab.write_file("just.toml", "name = \"just\"\ntime_unit_ns = 1000\naccel = [9000, 400]\n");
  const Answer swift = lab.wait(lab.use("axes", "swift"));
  EXPECT_NE(swift.result, "done");
  EXPECT_THAT(swift.reason, HasSubstr("one period of its converter, 400000 ns by its max_hz"));
  const Answer just = lab.wait(lab.use("axes", "just"));
  EXPECT_EQ(just.result, "done") << just.reason;
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
      if (kind == 5) lab.wait(lab.send(Ask::kClearFaults, {}));
      if (lab.trusted("m0")) {
        ASSERT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0")) << trouble;
      } else {
        ASSERT_LE(std::abs(lab.motor("m0").position_steps - lab.shaft_steps("m0")), 1) << trouble;
        lab.wait(lab.send(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")}));
      }
    }
  }
}

}  // namespace
}  // namespace bushd::test::converter_boards
