// bushctl program: what it asks the daemon for, and what it prints, over real LCM.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/bushctl/run_bushctl.h"

namespace bushctl::test {
namespace {

using api::Outcome;
using testing::ElementsAre;
using testing::HasSubstr;

const api::ProgramEntry kScan{.mcu = "hall:1",
                              .program = "scan",
                              .checksum = "0a1b2c3d",
                              .stage = "loaded",
                              .bytes = 31,
                              .memory = 4096,
                              .duration_us = 1'500'000,
                              .waits_for_inputs = true,
                              .motors = {{.motor = "theta", .most_steps = 400, .edges = 400},
                                         {.motor = "chi", .least_steps = -5, .edges = 10}}};

Replies answered(const api::Request& request) {
  if (const auto* run = std::get_if<api::RunPrograms>(&request)) {
    std::vector<api::MotorResult> motors{
        {.motor = "theta", .outcome = Outcome::kReached, .table = {.name = "own", .hash = "ab"}}};
    return {api::Accepted{},
            api::Completed{.outcome = Outcome::kReached,
                           .reason = run->programs.front() + " ended at frame 4: its end",
                           .detail = motors}};
  }
  if (std::holds_alternative<api::EraseProgram>(request)) {
    return {api::Accepted{},
            api::Completed{.outcome = Outcome::kDone, .reason = "erased", .detail = {}}};
  }
  return {api::Accepted{},
          api::Completed{
              .outcome = Outcome::kDone, .reason = "done", .detail = api::ProgramList{{kScan}}}};
}

FakeDaemon::Answer programs() {
  return [](const api::Request& request, int) { return answered(request); };
}

std::string written(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + name;
  std::ofstream(path) << text;
  return path;
}

constexpr const char* kText = "motors = [\"theta\", \"chi\"]\n[[frame]]\nline_to = \"way.csv\"\n";

TEST(BushctlProgram, PutSendsTheTextsAndPrintsWhatItWillDo) {
  FakeDaemon daemon(programs());
  written("way.csv", "theta,chi\n400,-5\n");
  const Ran ran = bushctl({"program", "put", "scan", written("scan.toml", kText)});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "scan on hall:1: 31 of 4096 bytes, 1.500 s\n"
            "theta: between 0 steps and 400 steps, ends at 0 steps, 400 steps\n"
            "chi: between -5 steps and 0 steps, ends at 0 steps, 10 steps\n"
            "waits for inputs: that time is not in the duration\n");
  EXPECT_EQ(ran.err, "") << "progress is for terminals";
  const auto put = only<api::PutProgram>(daemon);
  EXPECT_EQ(put.program, "scan");
  EXPECT_EQ(put.text, kText);
  EXPECT_THAT(put.points, ElementsAre(api::PutProgram::Points{"way.csv", "theta,chi\n400,-5\n"}));
  EXPECT_FALSE(put.dry_run);
}

TEST(BushctlProgram, ADryRunSaysSoAndJsonIsTheEntry) {
  FakeDaemon daemon(programs());
  written("way.csv", "theta,chi\n400,-5\n");
  const Ran ran =
      bushctl({"program", "put", "scan", written("scan.toml", kText), "--dry-run", "--json"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json["program"], "scan");
  EXPECT_EQ(json["bytes"], 31);
  EXPECT_EQ(json["motors"][1]["least_steps"], -5);
  EXPECT_TRUE(only<api::PutProgram>(daemon).dry_run);
}

TEST(BushctlProgram, AWrongTextIsNotSent) {
  FakeDaemon daemon(programs());
  const Ran ran =
      bushctl({"program", "put", "scan", written("wrong.toml", "motors = [\"a\"]\nframes = 3\n")});
  EXPECT_EQ(ran.code, 2);
  EXPECT_THAT(ran.err, HasSubstr("wrong.toml"));
  EXPECT_TRUE(daemon.requests().empty());
}

TEST(BushctlProgram, ARefusalIsTold) {
  FakeDaemon daemon([](const api::Request&, int) { return Replies{api::Refused{"no MCU can"}}; });
  written("way.csv", "theta,chi\n400,-5\n");
  const std::string file = written("scan.toml", kText);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"program", "put", "scan", file},
        {"program", "list"},
        {"program", "run", "scan"},
        {"program", "run", "scan", "--wait"},
        {"program", "erase", "scan"}}) {
    const Ran ran = bushctl(words);
    EXPECT_EQ(ran.code, 1) << words[1];
    EXPECT_THAT(ran.err, HasSubstr("no MCU can")) << words[1];
    EXPECT_EQ(ran.out, "") << words[1];
  }
}

TEST(BushctlProgram, ListsThem) {
  FakeDaemon daemon(programs());
  EXPECT_THAT(bushctl({"program", "list"}).out, HasSubstr("hall:1  scan     loaded"));
  const auto json = nlohmann::json::parse(bushctl({"program", "list", "--json"}).out);
  EXPECT_EQ(json["programs"][0]["checksum"], "0a1b2c3d");
}

TEST(BushctlProgram, RunsAndWaits) {
  FakeDaemon daemon(programs());
  const Ran ran = bushctl({"program", "run", "scan", "other", "--wait"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(ran.out,
            "accepted\ntheta: reached, stands at 0 by own (ab)\n"
            "scan ended at frame 4: its end\n");
  const auto requests = daemon.requests();
  ASSERT_EQ(requests.size(), 2u) << "whom Ctrl-C stops is asked before";
  EXPECT_THAT(std::get<api::RunPrograms>(requests[1]).programs, ElementsAre("scan", "other"));
}

TEST(BushctlProgram, CtrlCStopsItsMotors) {
  FakeDaemon daemon;
  std::atomic<bool> stopped{false};
  daemon.start([&stopped](const api::Request& request, int) -> Replies {
    if (std::holds_alternative<api::Stop>(request)) {
      stopped = true;
      return {api::Accepted{}};
    }
    if (!std::holds_alternative<api::RunPrograms>(request)) return answered(request);
    if (!stopped) return {api::Accepted{}};
    return {api::Completed{
        .outcome = Outcome::kStopped, .reason = "at frame 2: stopped", .detail = {}}};
  });
  Program run(with_program({"program", "run", "scan", "--wait"}));
  ASSERT_TRUE(run.wait_for("accepted"));
  run.send_signal(SIGINT);
  EXPECT_EQ(run.finish(), 130);
  EXPECT_THAT(run.err(), HasSubstr("stopped: at frame 2: stopped"));
  const auto requests = daemon.requests();
  ASSERT_EQ(requests.size(), 3u);
  EXPECT_THAT(std::get<api::Stop>(requests[2]).motors, ElementsAre("theta", "chi"));
}

TEST(BushctlProgram, ErasesOne) {
  FakeDaemon daemon(programs());
  EXPECT_EQ(bushctl({"program", "erase", "scan"}).out, "accepted\ndone: erased\n");
  EXPECT_EQ(only<api::EraseProgram>(daemon).program, "scan");
}

}  // namespace
}  // namespace bushctl::test
