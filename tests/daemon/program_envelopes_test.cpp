// Envelopes in motions and in programs: each step at its time, as its zones and its table say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "daemon/program_lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

constexpr std::int64_t kUnitNs = 100'000;
constexpr double kSlotNs = 2.56e6 / 256;
constexpr const char* kTable =
    "name = \"glacier\"\ntime_unit_ns = 100000\naccel = [80, 60, 50, 40, 30, 25, 20]\n";
constexpr const char* kEnvelope =
    "table = \"glacier\"\nzones = [[0, 200], [10, 500], [40, 100]]\nend = 50\n";

// By hand: 200 steps/s are 50 units, 500 are 20, 100 are 100.
std::vector<std::int64_t> due_units() {
  std::vector<std::int64_t> delays{80, 60};
  delays.insert(delays.end(), 8, 50);
  for (const int up : {40, 30, 25}) delays.push_back(up);
  delays.insert(delays.end(), 21, 20);
  for (const int down : {25, 30, 40, 50, 60, 80}) delays.push_back(down);
  delays.insert(delays.end(), 10, 100);
  std::vector<std::int64_t> due;
  std::int64_t at = 0;
  for (const std::int64_t delay : delays) due.push_back(at += delay);
  return due;
}

void expect_due(const std::vector<sim::TimeNs>& made, double within_ns) {
  const auto due = due_units();
  ASSERT_THAT(made, SizeIs(due.size()));
  for (std::size_t i = 0; i < due.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(made[i] - made[0]),
                static_cast<double>((due[i] - due[0]) * kUnitNs), within_ns)
        << "step " << i;
  }
}

struct Times {
  StepTimes times;
};
struct EnvelopeLab : private Times, public Lab {
  explicit EnvelopeLab(const std::string& of_motor = {})
      : Lab(hall(1, 2, "fine", "glacier") + of_motor, kTable, &times) {
    connect();
  }
  const std::vector<sim::TimeNs>& steps() { return times.of(0, 0); }

  Answer put(const std::string& frames, const std::string& envelope = kEnvelope,
             const std::string& head = "motors = [\"m01\"]\n") {
    return ask(api::PutProgram{
        .program = "scan", .text = head + frames, .points = {{"in.envelope", envelope}}});
  }
};

constexpr const char* kRun = "[[frame]]\nenvelope = \"in.envelope\"\n";

TEST(ProgramEnvelopes, AnMcuMakesEachStepAtItsTime) {
  EnvelopeLab lab;
  const Answer put = lab.put(kRun);
  ASSERT_EQ(put.result, "done") << put.reason;
  ASSERT_THAT(put.programs, SizeIs(1));
  EXPECT_EQ(put.programs[0].motors[0].end_steps, 50);
  // To the end of its last tick.
  const std::int64_t due_us = due_units().back() * kUnitNs / 1000;
  EXPECT_GE(put.programs[0].duration_us, due_us);
  EXPECT_LE(put.programs[0].duration_us, due_us + 2 * 2560);
  EXPECT_THAT(lab.ask(api::RunPrograms{{"scan"}}), Ends("reached"));
  EXPECT_EQ(lab.shaft_steps("m01"), 50);
  expect_due(lab.steps(), 1.5 * kSlotNs);
}

TEST(ProgramEnvelopes, RunAgainAndAgainBetweenMovesByTheTable) {
  EnvelopeLab lab;
  const std::string frames = std::string("[[frame]]\nrepeat = 2\n") + kRun +
                             "[[frame]]\nmove_by = [-50]\n[[frame]]\nnext = true\n";
  ASSERT_EQ(lab.put(frames, kEnvelope, "motors = [\"m01\"]\nunit = \"steps\"\n").result, "done");
  EXPECT_EQ(lab.ask(api::RunPrograms{{"scan"}}).result, "reached");
  const auto all = lab.steps();
  ASSERT_THAT(all, SizeIs(4 * 50));
  expect_due({all.begin(), all.begin() + 50}, 1.5 * kSlotNs);
  expect_due({all.begin() + 100, all.begin() + 150}, 1.5 * kSlotNs);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(ProgramEnvelopes, AreWhatAMotionByThesePointsMakes) {
  EnvelopeLab lab;
  EXPECT_THAT(
      lab.ask(api::MovePath{
          .motors = {"m01"}, .rows = 3, .positions = {10, 40, 50}, .speeds = {200, 500, 100}}),
      Ends("reached"));
  // A tick tells a mean where the delay changes within it, by 2 ms at most here: a quarter of that
  // is the most by which a step is off. The last one comes at the end of its tick.
  auto made = lab.steps();
  ASSERT_THAT(made, SizeIs(50));
  const double last_ns = static_cast<double>((due_units()[49] - due_units()[0]) * kUnitNs);
  EXPECT_NEAR(static_cast<double>(made[49] - made[0]), last_ns, 2'560'000);
  made.back() = made[0] + static_cast<sim::TimeNs>(last_ns);
  expect_due(made, 2e6 / 4);
}

TEST(ProgramEnvelopes, WhatDoesNotFitIsRefused) {
  EnvelopeLab lab;
  const auto refusal = [](const Answer& answer) {
    return answer.result == "refused" ? answer.reason : "not refused: " + answer.result;
  };
  const std::string other = "table = \"feed\"\nzones = [[0, 200]]\nend = 50\n";
  EXPECT_THAT(refusal(lab.put(kRun, other)),
              HasSubstr("its envelope is for the table \"feed\", and m01 goes by \"glacier\""));
  const std::string fast = "table = \"glacier\"\nzones = [[0, 200], [9, 600]]\nend = 50\n";
  EXPECT_THAT(refusal(lab.put(kRun, fast)),
              HasSubstr("zones[1]: has 600 steps/s, and the table \"glacier\" reaches 500"));
  const std::string place = std::string(kEnvelope) + "by = \"position\"\n";
  EXPECT_THAT(refusal(lab.put(kRun, place)), HasSubstr("goes by positions"));
  const std::string scaled = std::string(kEnvelope) + "steps_per_unit = 2\n";
  EXPECT_THAT(refusal(lab.put(kRun, scaled)), HasSubstr("has 2 steps per unit, and m01 has 1"));
  EXPECT_THAT(refusal(lab.put(kRun, "zones = 3\n")), HasSubstr("in.envelope:1"));
  EXPECT_THAT(refusal(lab.put(kRun, kEnvelope, "motors = [\"m01\", \"m02\"]\n")),
              HasSubstr("envelope: for several motors"));
  EXPECT_THAT(refusal(lab.put(std::string(kRun) + "[[frame]]\nline_by = [[5]]\n")),
              HasSubstr("a line or a travel, in a program with an envelope"));
  EXPECT_THAT(refusal(lab.put(std::string(kRun) + "speed = 5\n")), HasSubstr("unknown key"));
  EXPECT_THAT(refusal(lab.put("[[frame]]\nenvelope = \"out.envelope\"\n")),
              HasSubstr("\"out.envelope\" has not been sent with it"));
  EXPECT_TRUE(lab.steps().empty());
}

// Its delays are no table: stops go by that of the group.
TEST(ProgramEnvelopes, AStopRampsDownByTheTable) {
  EnvelopeLab lab;
  ASSERT_EQ(lab.put(kRun).result, "done");
  const std::int64_t run = lab.send(api::RunPrograms{{"scan"}});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps().size() > 12; }));
  lab.send(api::Stop{{"m01"}});
  EXPECT_THAT(lab.wait(run), Ends("stopped"));
  const auto made = lab.steps().size();
  EXPECT_LT(made, 50U);
  EXPECT_EQ(lab.shaft_steps("m01"), static_cast<std::int64_t>(made));
}

}  // namespace
}  // namespace bushd::test
