// Files of a program as a request, and programs as people read them.
#include "tools/bushctl/program_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "tools/bushctl/program_text.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using testing::ElementsAre;
using testing::HasSubstr;

std::string written(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + name;
  std::ofstream(path) << text;
  return path;
}

constexpr const char* kText =
    "motors = [\"x\"]\n"
    "[[frame]]\n"
    "line_to = \"way.csv\"\n"
    "[[frame]]\n"
    "line_by = \"way.csv\"\n"
    "[[frame]]\n"
    "line_to = \"back.csv\"\n";

TEST(ProgramFile, BringsItsPointsEachOnce) {
  written("way.csv", "x\n1\n2\n");
  written("back.csv", "x\n0\n");
  const auto request = read_program("scan", written("scan.toml", kText));
  ASSERT_TRUE(request) << request.error().text();
  EXPECT_EQ(request->program, "scan");
  EXPECT_EQ(request->text, kText);
  EXPECT_FALSE(request->dry_run);
  EXPECT_THAT(request->points, ElementsAre(api::PutProgram::Points{"way.csv", "x\n1\n2\n"},
                                           api::PutProgram::Points{"back.csv", "x\n0\n"}));
}

TEST(ProgramFile, SaysWhereItIsWrong) {
  const auto why = [](const std::string& text) {
    const auto request = read_program("scan", written("wrong.toml", text));
    return request ? std::string() : request.error().text();
  };
  EXPECT_THAT(why("motors = [\"x\"]\n[[frame]]\nmove_to = [1, 2]\n"),
              testing::MatchesRegex(".*wrong.toml:3:.*2 numbers; allowed: 1.*"));
  EXPECT_THAT(why("motors = [\"x\"]\n[[frame]]\nline_to = \"missing.csv\"\n"),
              HasSubstr("missing.csv"));
  written("columns.csv", "y\n1\n");
  EXPECT_THAT(why("motors = [\"x\"]\n[[frame]]\nline_to = \"columns.csv\"\n"),
              HasSubstr("columns.csv: column \"y\" is not in `motors`"));
  EXPECT_THAT(why("motors = [\"x\"]\n[[frame]]\nline_to = \"..\"\n"), HasSubstr(".."));
  EXPECT_THAT(read_program("scan", testing::TempDir() + "absent.toml").error().text(),
              HasSubstr("absent.toml"));
}

TEST(ProgramFile, IsNoLongerThanAMessage) {
  const std::string head = "motors = [\"x\"]\n[[frame]]\nmove_to = [1]\n";
  const std::string fills = head + std::string(api::PutProgram::kMostBytes - head.size(), '#');
  EXPECT_TRUE(read_program("scan", written("fills.toml", fills)));
  EXPECT_FALSE(read_program("scan", written("fills.toml", fills + "#")));
  // Its points count.
  std::string points = "x\n";
  while (points.size() < api::PutProgram::kMostBytes - 20) points += "1\n";
  written("many.csv", points);
  const auto both = read_program(
      "scan", written("both.toml", "motors = [\"x\"]\n[[frame]]\nline_to = \"many.csv\"\n"));
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().text(), HasSubstr("bytes, with its files of points; allowed: 57344"));
}

bushd::client::Status in_mm() {
  bushd::client::Status status;
  status.states.resize(1);
  status.descriptions.resize(1);
  status.descriptions[0].snapshot.motors = {
      {.name = "x",
       .scale = {.unit = "mm", .steps_per_unit = {100, 1}, .negative = true, .decimals = 2}}};
  return status;
}

const api::ProgramEntry kScan{
    .mcu = "hall:1",
    .program = "scan",
    .checksum = "0a1b2c3d",
    .stage = "loaded",
    .bytes = 212,
    .memory = 8192,
    .duration_us = 12'300'000,
    .motors = {
        {.motor = "x", .least_steps = -100, .most_steps = 250, .end_steps = 50, .edges = 700}}};

TEST(ProgramText, SaysWhatItWillDo) {
  EXPECT_THAT(lines(kScan, in_mm()),
              ElementsAre("scan on hall:1: 212 of 8192 bytes, 12.300 s",
                          "x: between -2.50 mm and 1.00 mm, ends at -0.50 mm, 700 steps"));
  api::ProgramEntry more = kScan;
  more.pulses = 3;
  more.endless = true;
  more.waits_for_inputs = true;
  more.cut = true;
  more.without_host = true;
  EXPECT_THAT(lines(more, {}),
              ElementsAre("scan on hall:1: 212 of 8192 bytes, 12.300 s",
                          "x: between -100 steps and 250 steps, ends at 50 steps, 700 steps",
                          "3 pulses at the position compare output",
                          "without end: this is one pass of what it repeats",
                          "waits for inputs: that time is not in the duration",
                          "longer than was looked at: this is its beginning",
                          "goes on when no host is heard"));
}

TEST(ProgramText, ListsWhatEachMcuHas) {
  api::ProgramEntry runs = kScan;
  runs.stage = "runs";
  runs.frame = 3;
  runs.point = 17;
  runs.repeats = 2;
  runs.endless = true;
  runs.without_host = true;
  const api::ProgramEntry none{.mcu = "hall:2", .stage = "none", .memory = 4096};
  const api::ProgramEntry foreign{.mcu = "hall:3",
                                  .checksum = "12345678",
                                  .stage = "ended",
                                  .reason = "stopped",
                                  .bytes = 40,
                                  .memory = 4096,
                                  .frame = 4};
  EXPECT_THAT(
      table(api::ProgramList{{runs, none, foreign}}),
      ElementsAre(
          "MCU     PROGRAM  STAGE  FRAME        REPEATS        BYTES         DURATION  CHECKSUM",
          "hall:1  scan     runs   3, point 17        2  212 of 8192  12.300 s a pass  0a1b2c3d  "
          "without host",
          "hall:2  -        none   -                  0    0 of 4096                -  -",
          "hall:3  -        ended  4                  0   40 of 4096                -  12345678  "
          "stopped"));
}

TEST(ProgramText, TellsOnlyOfTheUploadThatIsUnderWay) {
  api::ProgramEntry entry = kScan;
  EXPECT_EQ(upload_text(api::ProgramList{{entry}}, "scan"), "");
  entry.stage = "loading";
  EXPECT_EQ(upload_text(api::ProgramList{{entry}}, "scan"),
            "scan: 212 bytes have arrived at hall:1");
  EXPECT_EQ(upload_text(api::ProgramList{{entry}}, "other"), "");
}

}  // namespace
}  // namespace bushctl
