// Programs in MCUs, asked for by clients: put, run, and what ends them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/program_lab.h"
#include "engine/frame.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

constexpr const char* kSquare = R"(
[[frame]]
move_by = [30, 0]
[[frame]]
repeat = 3
[[frame]]
line_by = [[20, 10], [-20, -10]]
[[frame]]
pulse_us = 50
[[frame]]
next = true
[[frame]]
move_to = [0, 5]
)";

TEST(Programs, DoWhatTheirTextSays) {
  ProgramLab lab;
  const Answer put = lab.put("square", "\"m01\", \"m02\"", kSquare);
  ASSERT_EQ(put.result, "done") << put.reason;
  ASSERT_THAT(put.programs, SizeIs(1));
  const api::ProgramEntry& entry = put.programs.front();
  EXPECT_EQ(entry.mcu, "hall:1");
  EXPECT_EQ(entry.program, "square");
  EXPECT_EQ(entry.stage, "loaded");
  EXPECT_EQ(entry.memory, 8192);
  EXPECT_EQ(entry.pulses, 3);
  EXPECT_FALSE(entry.endless || entry.cut || entry.waits_for_inputs);
  const api::ProgramEntry::Motor m01{"m01", 0, 50, 0, 30 + 3 * 40 + 30};
  const api::ProgramEntry::Motor m02{"m02", 0, 10, 5, 3 * 20 + 5};
  EXPECT_THAT(entry.motors, ElementsAre(m01, m02));
  EXPECT_TRUE(lab.steps.none()) << "nothing moves until it is run";

  const std::int64_t run = lab.run({"square"});
  const Answer result = lab.wait(run);
  EXPECT_THAT(result, Ends("reached", "done"));
  EXPECT_THAT(result.position_steps, ElementsAre(0, 5));
  EXPECT_THAT(lab.replies(run), SizeIs(2)) << "accepted, and one result";
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.shaft_steps("m02"), 5);
  EXPECT_THAT(lab.steps.of(0, 0), SizeIs(m01.edges));
  EXPECT_THAT(lab.steps.of(0, 1), SizeIs(m02.edges));
  // The walk tells its duration to the end of its last tick; the first edge comes in its first one.
  const sim::TimeNs took = lab.steps.of(0, 1).back() - lab.steps.of(0, 0).front();
  EXPECT_LE(took, entry.duration_us * 1000);
  EXPECT_EQ(lab.entry().stage, "ended");
  EXPECT_EQ(lab.entry().reason, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {10}).result, "reached") << "it is free";
}

// One motor after the other, as the printed function says, and no faster than their tables.
TEST(Programs, AnElementaryLineIsMadeStepByStep) {
  ProgramLab lab;
  const Answer put = lab.put("fine", "\"m01\", \"m02\"",
                             "[[frame]]\nline_by = [[300, 300], [-7, 3]]\nlaw = \"elementary\"\n");
  ASSERT_EQ(put.result, "done") << put.reason;
  EXPECT_EQ(lab.wait(lab.run({"fine"})).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 293);
  EXPECT_EQ(lab.shaft_steps("m02"), 303);
  const auto first = lab.steps.of(0, 0);
  const auto second = lab.steps.of(0, 1);
  ASSERT_THAT(first, SizeIs(307));
  ASSERT_THAT(second, SizeIs(303));
  for (std::size_t i = 0; i < 300; ++i) {
    ASSERT_LT(first[i], second[i]);
    ASSERT_LT(second[i], first[i + 1]);
  }
  // F = 0, -3, 4, 1, -2, 5, 2, -1, 6, 3: of 7 and 3 steps.
  const std::vector<std::size_t> order{0, 1, 0, 0, 1, 0, 0, 1, 0, 0};
  std::array<std::size_t, 2> next{300, 300};
  sim::TimeNs before = second[299];
  for (const std::size_t motor : order) {
    const sim::TimeNs at = motor == 0 ? first[next[0]++] : second[next[1]++];
    ASSERT_GT(at, before);
    before = at;
  }
}

TEST(Programs, ADryRunLeavesTheMcuAlone) {
  ProgramLab lab;
  api::PutProgram put = ProgramLab::put_of("square", "\"m01\", \"m02\"", kSquare);
  put.dry_run = true;
  const Answer answer = lab.ask(put);
  ASSERT_THAT(answer.programs, SizeIs(1));
  EXPECT_EQ(answer.programs[0].motors[0].edges, 180);
  EXPECT_EQ(answer.programs[0].stage, "none");
  EXPECT_EQ(lab.entry().stage, "none");
}

TEST(Programs, RefusalsSayWhy) {
  ProgramLab lab;
  const auto refusal = [&](const Answer& answer) {
    EXPECT_EQ(answer.phase, Answer::kRefused);
    return answer.reason;
  };
  const std::string frame = "[[frame]]\nmove_by = [1]\n";
  EXPECT_THAT(refusal(lab.put("a b", "\"m01\"", frame)), HasSubstr("no name of a program"));
  EXPECT_THAT(refusal(lab.put("a", "\"m09\"", frame)), HasSubstr("m09"));
  EXPECT_THAT(refusal(lab.put("a", "\"m01\", \"m03\"", "[[frame]]\nmove_by = [1, 1]\n")),
              HasSubstr("at hall:1 and at hall:2; a program is for one MCU"));
  EXPECT_THAT(refusal(lab.put("a", "\"m01\"", frame, "without_host = true\n")),
              HasSubstr("programs_without_host = true in its [[mcu]]"));
  EXPECT_THAT(refusal(lab.put("a", "\"m01\"", "[[frame]]\nline_by = \"no.csv\"\n")),
              HasSubstr("\"no.csv\" has not been sent"));
  EXPECT_THAT(refusal(lab.put("a", "\"m01\"", "[[frame]]\njump = 3\n")), HasSubstr("a:3"));
  EXPECT_THAT(refusal(lab.wait(lab.run({"a"}))), HasSubstr("no MCU has a program \"a\""));
  EXPECT_THAT(refusal(lab.wait(lab.run({}))), HasSubstr("no program is named"));
  EXPECT_THAT(refusal(lab.ask(api::EraseProgram{"a"})), HasSubstr("no MCU has a program \"a\""));
  ASSERT_EQ(lab.put("a", "\"m01\"", frame).result, "done");
  EXPECT_THAT(refusal(lab.put("a", "\"m03\"", frame)), HasSubstr("hall:1 has a program of that"));
  EXPECT_THAT(refusal(lab.wait(lab.run({"a", "a"}))), HasSubstr("named twice"));
  lab.send(Ask::kMoveBy, {"m01"}, {3000});
  EXPECT_THAT(refusal(lab.wait(lab.run({"a"}))), HasSubstr("m01 moves"));
  lab.ask(Ask::kStop, {"m01"});
  lab.ask(api::Hold{{"m01"}});
  EXPECT_THAT(refusal(lab.wait(lab.run({"a"}))), HasSubstr("'bushctl release m01'"));
}

TEST(Programs, ARunChecksAllOfItAgain) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\"", "[[frame]]\nmove_by = [100]\n").result, "done");
  lab.ask(api::Configure{.kind = api::Configure::Kind::kChange,
                         .changes = {{"m01", "soft_limits", "[-10, 50]"}}});
  const Answer answer = lab.wait(lab.run({"a"}));
  EXPECT_EQ(answer.phase, Answer::kRefused);
  EXPECT_THAT(answer.reason, HasSubstr("may go from -10 steps to 50 steps"));
  lab.ask(api::Configure{.kind = api::Configure::Kind::kChange,
                         .changes = {{"m01", "soft_limits", "[-10, 500]"}}});
  EXPECT_THAT(lab.wait(lab.run({"a"})).reason, HasSubstr("put it again"));
  EXPECT_TRUE(lab.steps.none());
}

TEST(Programs, ErasedOnesAreGone) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\"", "[[frame]]\nmove_by = [100]\n").result, "done");
  ASSERT_EQ(lab.ask(api::EraseProgram{"a"}).result, "done");
  EXPECT_TRUE(lab.comes_to("none"));
  EXPECT_EQ(lab.wait(lab.run({"a"})).phase, Answer::kRefused);
}

TEST(Programs, AStopOfOneMotorEndsThem) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\", \"m02\"",
                    "[[frame]]\nrepeat = 0\n[[frame]]\nmove_by = { m01 = 900 }\n"
                    "[[frame]]\nmove_by = { m01 = -900 }\n[[frame]]\nnext = true\n")
                .result,
            "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 200; }));
  EXPECT_EQ(lab.motor("m02").activity, api::Activity::kMoving) << "it is the program's";
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m02"}, {5}).reason, HasSubstr("a program of its"));
  EXPECT_EQ(lab.ask(Ask::kStop, {"m02"}).result, "done");
  const Answer result = lab.wait(run);
  EXPECT_THAT(result, Ends("stopped", "stopped on request, at frame 2 (a:5)"));
  EXPECT_EQ(result.position_steps.at(0), lab.shaft_steps("m01"));
  EXPECT_LT(lab.shaft_steps("m01"), 900) << "by its ramp, not at the end of the frame";
  const std::int64_t stood = lab.shaft_steps("m01");
  lab.run_for(3);
  EXPECT_EQ(lab.shaft_steps("m01"), stood);
}

TEST(Programs, AStopRightBehindTheRequestLetsNothingBegin) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro).result, "done");
  const std::int64_t run = lab.run({"a"});
  lab.send(Ask::kStop, {"m01"});
  EXPECT_EQ(lab.wait(run).result, "stopped");
  lab.run_for(2);
  EXPECT_TRUE(lab.steps.none());
  const std::int64_t again = lab.run({"a"});
  lab.run_for(0.004);
  lab.send(api::Pause{{"m01"}});
  EXPECT_EQ(lab.wait(again).result, "stopped") << "a pause before it has begun is a stop";
  EXPECT_TRUE(lab.steps.none());
}

TEST(Programs, PauseAndGoOn) {
  ProgramLab lab;
  ASSERT_EQ(
      lab.put("a", "\"m01\"", "[[frame]]\nmove_to = [2000]\n[[frame]]\nmove_to = [7]\n").result,
      "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 300; }));
  const Answer pause = lab.ask(api::Pause{{"m01"}});
  EXPECT_EQ(pause.result, "done") << pause.reason;
  EXPECT_EQ(pause.reason, "paused: 1 motor");
  EXPECT_EQ(lab.entry().stage, "paused");
  const std::int64_t stood = lab.shaft_steps("m01");
  lab.run_for(2);
  EXPECT_EQ(lab.shaft_steps("m01"), stood);
  EXPECT_EQ(lab.ask(api::Hold{{"m01"}}).result, "done");
  EXPECT_EQ(lab.ask(api::Resume{{"m01"}}).phase, Answer::kRefused);
  lab.ask(api::Release{{"m01"}});
  EXPECT_EQ(lab.ask(api::Resume{{"m01"}}).reason, "resumed: 1 motor");
  EXPECT_EQ(lab.wait(run).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 7);
  EXPECT_THAT(lab.steps.of(0, 0), SizeIs(2000 + 1993));
}

constexpr const char* kUntilTrigger =
    "[[frame]]\nmove_by = { m01 = 3000 }\nuntil_input = \"trigger\"\nafter = 250\n";

TEST(Programs, AnInputEndsTheMoveOfAFrame) {
  ProgramLab lab;
  const Answer put = lab.put("until", "\"m01\"", kUntilTrigger);
  ASSERT_EQ(put.result, "done") << put.reason;
  EXPECT_TRUE(put.programs.front().waits_for_inputs);
  EXPECT_EQ(put.programs.front().motors.front().most_steps, 3000);
  const std::int64_t run = lab.run({"until"});
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").position_steps > 400; }));
  const auto before = static_cast<std::int64_t>(lab.steps.of(0, 0).size());
  lab.bus(0).mcu(0).set_inputs({0, BUSHD_INPUT_TRIGGER});
  EXPECT_THAT(lab.wait(run), Ends("reached"));
  const auto made = static_cast<std::int64_t>(lab.steps.of(0, 0).size());
  EXPECT_EQ(lab.motor("m01").position_steps, made);
  // It is looked at within two ticks, in which it makes 2 * 7 steps at most.
  EXPECT_GE(made, before + 250);
  EXPECT_LE(made, before + 250 + 14);
  lab.bus(0).mcu(0).set_inputs({0, 0});
  EXPECT_THAT(lab.wait(lab.run({"until"})), Ends("fault", "on the whole way of its move"));
  EXPECT_EQ(lab.motor("m01").position_steps, made + 3000);
}

TEST(Programs, APauseEndsAMoveUntilAnInput) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("until", "\"m01\"", kUntilTrigger).result, "done");
  const std::int64_t run = lab.run({"until"});
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").position_steps > 400; }));
  lab.ask(api::Pause{{"m01"}});
  EXPECT_EQ(lab.wait(run).result, "stopped");
  EXPECT_LT(lab.motor("m01").position_steps, 3000);
}

TEST(Programs, DoNotGoOnWhileOneOfTheirMotorsIsHeld) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\", \"m02\"", "[[frame]]\nmove_by = [900, 900]\n").result, "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 200; }));
  EXPECT_EQ(lab.ask(api::Pause{{"m01"}}).reason, "paused: 1 motor");
  lab.ask(api::Hold{{"m02"}});
  EXPECT_THAT(lab.ask(api::Resume{{"m01"}}).reason, HasSubstr("'bushctl release m02'"));
  const std::int64_t stood = lab.shaft_steps("m02");
  lab.run_for(2);
  EXPECT_EQ(lab.shaft_steps("m02"), stood);
  EXPECT_EQ(lab.ask(Ask::kStop, {"m02"}).result, "done");
  EXPECT_EQ(lab.wait(run).result, "stopped");
}

// The same with a limit that stops without a ramp: nobody knows whether it has overrun.
TEST(Programs, ALimitThatStopsThemAtOnceLeavesAPositionUncertain) {
  ProgramLab lab(with_keys(hall_of_programs(1, 1), "m01",
                           "inputs = { positive = 3 }\nlimit_action = \"immediate\"\n"));
  ASSERT_EQ(lab.put("a", "\"m01\"", "[[frame]]\nmove_by = [900]\n").result, "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 200; }));
  lab.bus(0).mcu(0).set_inputs({1U << 3, 0});
  const Answer result = lab.wait(run);
  EXPECT_EQ(result.result, "limit") << result.reason;
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

TEST(Programs, AnEmergencyStopEndsThem) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro).result, "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 100; }));
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  const Answer result = lab.wait(run);
  EXPECT_THAT(result, Ends("stopped", "emergency"));
  EXPECT_EQ(lab.wait(lab.run({"a"})).phase, Answer::kRefused);
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  const std::size_t before = lab.steps.of(0, 0).size();
  lab.run_for(2);
  EXPECT_EQ(lab.steps.of(0, 0).size(), before) << "clearing starts nothing";
}

TEST(Programs, OfSeveralMcusBeginWithTheSameTick) {
  ProgramLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\"", "[[frame]]\nmove_by = [50]\n").result, "done");
  ASSERT_EQ(lab.put("b", "\"m03\"", "[[frame]]\nmove_by = [50]\n").result, "done");
  const Answer result = lab.wait(lab.run({"a", "b"}));
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_THAT(result.motors, ElementsAre("m01", "m03"));
  ASSERT_THAT(lab.steps.of(0, 0), SizeIs(50));
  ASSERT_THAT(lab.steps.of(1, 0), SizeIs(50));
  // Ticks are 2.56 ms, and an MCU that is out by half of one is no more in step.
  EXPECT_LT(std::abs(lab.steps.of(0, 0).front() - lab.steps.of(1, 0).front()), 1'280'000);
}

// Whatever becomes of the requests on the line, either both begin in the same tick, or neither.
TEST(Programs, OfSeveralMcusBeginTogetherOrNotAtAll) {
  for (int frame = 0; frame < 12; ++frame) {
    ProgramLab lab;
    ASSERT_EQ(lab.put("a", "\"m01\"", "[[frame]]\nmove_by = [50]\n").result, "done");
    ASSERT_EQ(lab.put("b", "\"m03\"", "[[frame]]\nmove_by = [50]\n").result, "done");
    lab.run_for(0.3);
    const std::int64_t run = lab.run({"a", "b"});
    int frames = 0;
    // From one frame on nothing reaches the MCUs for a while.
    const std::int64_t lost_from = frame;
    std::int64_t until_us = INT64_MAX;
    lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) {
      if (frames++ == lost_from) until_us = lab.now_us() + 60'000;
      return frames <= lost_from || lab.now_us() >= until_us;
    };
    const Answer result = lab.wait(run);
    EXPECT_EQ(lab.steps.of(0, 0).empty(), lab.steps.of(1, 0).empty())
        << "frame " << frame << ": " << result.reason;
    if (result.result == "reached") {
      EXPECT_EQ(lab.steps.of(1, 0).size(), 50u);
    }
    if (!lab.steps.of(0, 0).empty() && !lab.steps.of(1, 0).empty()) {
      EXPECT_LT(std::abs(lab.steps.of(0, 0).front() - lab.steps.of(1, 0).front()), 1'280'000);
    }
  }
}

TEST(Programs, ATravelThatCannotBeginIsRefusedWhenItIsPut) {
  const std::string travel = "[[frame]]\ntravel_by = [60]\n";
  ProgramLab none;
  const Answer refused = none.put("scan", "\"m01\"", travel);
  EXPECT_THAT(refused, Ends("refused",
                            "motor \"m01\": it needs a limit switch of its own at each "
                            "end; see its 'inputs'"));
  ProgramLab lab(
      with_keys(hall_of_programs(1, 1), "m01", "inputs = { positive = 0, negative = 1 }\n"));
  EXPECT_EQ(lab.put("scan", "\"m01\"", travel).result, "done");
  EXPECT_THAT(lab.put("scan", "\"m01\"", travel + "after_edge_s = 0.01\n"),
              Ends("refused",
                   "after_edge_s: is 10000 us; allowed: 4 ticks of the bus or "
                   "more, which are 10240 us"));
  EXPECT_EQ(lab.put("scan", "\"m01\"", travel + "after_edge_s = 0.01024\n").result, "done");
}

}  // namespace
}  // namespace bushd::test
