// Programs in MCUs that nobody hears: what ends, what goes on, and what is known of it afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "daemon/program_lab.h"

namespace bushd::test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::SizeIs;

constexpr const char* kWithoutHost = "without_host = true\n";

TEST(ProgramsAlone, WithoutAHostTheyEnd) {
  ProgramLab lab(hall_of_programs(1, 1));
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro).result, "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 100; }));
  lab.unplug(0);
  const Answer result = lab.wait(run);
  EXPECT_EQ(result.result, "link");
  lab.run_for(5);
  const std::size_t made = lab.steps.of(0, 0).size();
  lab.run_for(5);
  EXPECT_EQ(lab.steps.of(0, 0).size(), made);
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01")) << "it is counted";
  lab.run_for(3);
  EXPECT_EQ(lab.steps.of(0, 0).size(), made);
}

TEST(ProgramsAlone, AnMcuThatIsLostBeforeTheStartTakesTheOthersWithIt) {
  ProgramLab lab(hall_of_programs(2, 1));
  lab.keep_positions();
  lab.connect();
  const char* const move = "[[frame]]\nmove_by = [50]\n";
  ASSERT_EQ(lab.put("a", "\"m01\"", move).result, "done");
  ASSERT_EQ(lab.put("b", "\"m02\"", move).result, "done");
  lab.disk_us = 400'000;  // the start waits for the mark
  const std::int64_t run = lab.run({"a", "b"});
  lab.run_for(0.05);
  lab.unplug(0);
  const Answer result = lab.wait(run);
  EXPECT_EQ(result.result, "link") << result.reason;
  EXPECT_THAT(result.motor_results, SizeIs(2));
  lab.disk_us = 500;
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  lab.run_for(2);
  EXPECT_TRUE(lab.steps.none());
  EXPECT_EQ(lab.wait(lab.run({"a", "b"})).result, "reached");
}

TEST(ProgramsAlone, ThoseThatMayGoOnHaveTheirResultLater) {
  ProgramLab lab(hall_of_programs(1, 1, true));
  ASSERT_EQ(lab.put("a", "\"m01\"",
                    "[[frame]]\nrepeat = 20\n[[frame]]\nmove_by = [50]\n[[frame]]\nwait_s = 0.2\n"
                    "[[frame]]\nnext = true\n",
                    kWithoutHost)
                .result,
            "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 100; }));
  lab.unplug(0);
  lab.run_for(3);
  EXPECT_FALSE(lab.has_result(run));
  EXPECT_GT(lab.shaft_steps("m01"), 200);
  lab.plug(0);
  const Answer result = lab.wait(run, 120);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 1000);
  EXPECT_EQ(lab.motor("m01").position_steps, 1000);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_THAT(lab.replies(run), SizeIs(2));
}

TEST(ProgramsAlone, AStopThatDoesNotReachItsMcuIsTakenThere) {
  ProgramLab lab(hall_of_programs(1, 1, true));
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro, kWithoutHost).result, "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 100; }));
  lab.unplug(0);
  ASSERT_TRUE(lab.run_until([&] { return !lab.all_ready(); }));
  lab.run_for(2);
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "link");
  EXPECT_FALSE(lab.has_result(run));
  lab.plug(0);
  EXPECT_EQ(lab.wait(run, 120).result, "stopped");
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
}

TEST(ProgramsAlone, ANewDaemonFindsOneThatRuns) {
  ProgramLab lab(hall_of_programs(1, 2, true));
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro, kWithoutHost).result, "done");
  lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 100; }));
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return !lab.warnings().empty(); }));
  EXPECT_EQ(lab.entry().stage, "runs");
  EXPECT_EQ(lab.entry().program, "");
  EXPECT_THAT(lab.warnings(), Contains(HasSubstr("goes on")));
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m01"}, {5}).reason, HasSubstr("a program of its"));
  const auto refusal = [&] { return lab.ask(Ask::kMoveBy, {"m02"}, {5}).reason; };
  ASSERT_TRUE(lab.run_until([&] { return refusal().find("offline") == std::string::npos; }));
  EXPECT_THAT(refusal(), HasSubstr("is told its inputs when the program of before"));
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
  EXPECT_EQ(lab.entry().stage, "ended");
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  const std::size_t made = lab.steps.of(0, 0).size();
  lab.run_for(3);
  EXPECT_EQ(lab.steps.of(0, 0).size(), made);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {5}).result, "reached") << "it is free";
}

// It is no MCU of this configuration, and never goes online while its program runs.
TEST(ProgramsAlone, AStopReachesAnMcuThatIsLeftAlone) {
  ProgramLab lab(hall_of_programs(1, 1, true));
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro, kWithoutHost).result, "done");
  lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 100; }));
  std::string other = hall_of_programs(1, 1, true);
  other.replace(other.find("bushd2-constant"), 15, "bushd2-scurve");
  lab.use_configuration(other);
  ASSERT_TRUE(lab.run_until([&] { return !lab.warnings().empty(); }));
  EXPECT_THAT(lab.warnings(), Contains(HasSubstr("goes on")));
  EXPECT_FALSE(lab.all_ready());
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "link") << "nobody sees it stand";
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  const std::size_t made = lab.steps.of(0, 0).size();
  lab.run_for(3);
  EXPECT_EQ(lab.steps.of(0, 0).size(), made);
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
}

TEST(ProgramsAlone, APauseThatDoesNotReachItsMcuSaysSo) {
  ProgramLab lab(hall_of_programs(1, 1, true));
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro, kWithoutHost).result, "done");
  const std::int64_t run = lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 100; }));
  lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
  const std::int64_t pause = lab.send(api::Pause{{"m01"}});
  lab.run_for(0.01);
  lab.unplug(0);
  EXPECT_THAT(lab.wait(pause), Ends("link", "may go on without a host"));
  lab.on_send = nullptr;
  lab.plug(0);
  ASSERT_TRUE(
      lab.run_until([&] { return lab.state_of("hall:1").state != api::McuState::kOffline; }));
  ASSERT_TRUE(lab.comes_to("runs"));
  ASSERT_TRUE(
      lab.run_until([&] { return lab.ask(api::Pause{{"m01"}}).reason == "paused: 1 motor"; }));
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
  EXPECT_EQ(lab.wait(run).result, "stopped");
}

TEST(ProgramsAlone, ANewDaemonThatKeepsPositionsKnowsThemByName) {
  ProgramLab lab(hall_of_programs(1, 1, true));
  lab.keep_positions();
  lab.connect();
  api::PutProgram put = ProgramLab::put_of(
      "a", "\"m01\"", "[[frame]]\nline_by = \"way.csv\"\n[[frame]]\nwait_s = 2\n", kWithoutHost);
  put.points = {{"way.csv", "m01\n40\n-40\n"}};
  ASSERT_EQ(lab.ask(put).result, "done");
  lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() == 80; }));
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.entry().program == "a"; }));
  EXPECT_EQ(lab.entry().stage, "runs");
  EXPECT_EQ(lab.entry().frame, 2);
  ASSERT_TRUE(lab.comes_to("ended"));
  lab.run_for(0.5);
  EXPECT_THAT(lab.wait(lab.run({"a"})), Ends("reached"));
  EXPECT_THAT(lab.steps.of(0, 0), SizeIs(160));
  ASSERT_EQ(lab.ask(api::EraseProgram{"a"}).result, "done");
  lab.restart_daemon();
  lab.connect();
  EXPECT_EQ(lab.entry().program, "");
}

TEST(ProgramsAlone, ANewDaemonThatDoesNotAllowItStopsIt) {
  ProgramLab lab(hall_of_programs(1, 1, true));
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro, kWithoutHost).result, "done");
  lab.run({"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 100; }));
  lab.use_configuration(hall_of_programs(1, 1, false));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 60));
  ASSERT_TRUE(lab.comes_to("ended"));
  const std::size_t made = lab.steps.of(0, 0).size();
  lab.run_for(3);
  EXPECT_EQ(lab.steps.of(0, 0).size(), made);
}

TEST(ProgramsAlone, ADaemonThatEndsLeavesThemAlone) {
  ProgramLab lab(hall_of_programs(2, 1, true));
  ASSERT_EQ(lab.put("a", "\"m01\"", kToAndFro, kWithoutHost).result, "done");
  ASSERT_EQ(lab.put("b", "\"m02\"", kToAndFro).result, "done");
  const std::int64_t run = lab.run({"a", "b"});
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(1, 0).size() > 100; }));
  lab.core().shut_down(lab.now_us());
  ASSERT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }));
  const Answer result = lab.wait(run);
  EXPECT_EQ(result.motor_results.at(0), "link");
  EXPECT_EQ(result.motor_results.at(1), "stopped");
  const std::size_t stopped = lab.steps.of(1, 0).size();
  const std::size_t alone = lab.steps.of(0, 0).size();
  lab.run_for(2);
  EXPECT_EQ(lab.steps.of(1, 0).size(), stopped);
  EXPECT_GT(lab.steps.of(0, 0).size(), alone);
}

}  // namespace
}  // namespace bushd::test
