// The program bushtab, from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <sys/wait.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tables/random_table.h"
#include "tables/reference_move.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Outcome bushtab(const std::string& arguments) {
  const TempDirectory directory;
  const std::string out = directory.path() / "out";
  const std::string err = directory.path() / "err";
  const int status =
      std::system((BUSHTAB " " + arguments + " </dev/null >" + out + " 2>" + err).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out), read_file(err)};
}

std::string csv(const std::vector<int>& displacements) {
  std::string text = "tick,displacement\n";
  for (std::size_t tick = 0; tick < displacements.size(); ++tick) {
    text += std::to_string(tick) + "," + std::to_string(displacements[tick]) + "\n";
  }
  return text;
}

std::string expand_arguments(const std::string& table, std::int64_t steps, std::uint32_t tick_us,
                             const char* format) {
  return "expand --table " + table + " --steps " + std::to_string(steps) + " --tick-us " +
         std::to_string(tick_us) + " --format " + format;
}

// delays 1000, 600, 600, 1000 us: steps at 1.0, 1.6, 2.2 and 3.2 ms
const char* const kSmallTable = "name = \"small\"\ntime_unit_ns = 100000\naccel = [10, 6]\n";

TEST(BushtabExpand, CoarseIsTheByteOnTheLine) {
  const TempDirectory directory;
  const std::string table = directory.write("small.toml", kSmallTable);
  EXPECT_EQ(bushtab(expand_arguments(table, 4, 1000, "coarse")).out,
            "tick,displacement\n0,129\n1,129\n2,129\n3,129\n");
  EXPECT_EQ(bushtab(expand_arguments(table, -4, 2000, "coarse")).out,
            "tick,displacement\n0,2\n1,2\n");
}

TEST(BushtabExpand, FineIsStepsTimes256) {
  const TempDirectory directory;
  const std::string table = directory.write("small.toml", kSmallTable);
  // After 2 ms: 2 steps and 400 of 600 us; 256 * 2/3 = 170.67.
  EXPECT_EQ(bushtab(expand_arguments(table, 4, 2000, "fine")).out,
            "tick,displacement\n0,682\n1,342\n");
  EXPECT_EQ(bushtab(expand_arguments(table, -4, 2000, "fine")).out,
            "tick,displacement\n0,-682\n1,-342\n");
}

// The n-th fenced block of a language in docs/tables.md.
std::string documented(const std::string& language, int n) {
  const std::string text = read_file(BUSHD_SOURCE_DIR "/docs/tables.md");
  const std::string fence = "```" + language + "\n";
  std::size_t from = 0;
  for (int i = 0; i <= n; ++i) from = text.find(fence, from) + fence.size();
  return text.substr(from, text.find("```", from) - from);
}

TEST(BushtabExpand, DoesWhatTheDocumentationSays) {
  const TempDirectory directory;
  const std::string table = directory.write("small.toml", documented("toml", 0));
  EXPECT_EQ(bushtab(expand_arguments(table, 4, 2000, "fine")).out, documented("csv", 0));
  EXPECT_EQ(bushtab(expand_arguments(table, 4, 1000, "coarse")).out, documented("csv", 1));
}

TEST(BushtabExpand, NoStepsAreTheHeaderOnly) {
  for (const char* format : {"coarse", "fine"}) {
    const Outcome outcome = bushtab(expand_arguments("bushd2-constant", 0, 2560, format));
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_EQ(outcome.out, "tick,displacement\n");
  }
}

TEST(BushtabExpand, AgreesWithTheSlowReference) {
  const TempDirectory directory;
  EXPECT_TRUE(rc::check("CSV of random moves", [&] {
    const RandomCase made = random_case(1000);
    const std::string table = directory.write("random.toml", file_text(made.content));
    std::int64_t steps = random_in(-500, 500);
    while (ReferenceMove(made.content, steps, made.tick_ns).active_ticks() > 10000) steps /= 2;
    const ReferenceMove reference(made.content, steps, made.tick_ns);
    const std::uint32_t tick_us = made.tick_ns / 1000;
    RC_ASSERT(bushtab(expand_arguments(table, steps, tick_us, "coarse")).out ==
              csv(reference.coarse()));
    RC_ASSERT(bushtab(expand_arguments(table, steps, tick_us, "fine")).out ==
              csv(reference.fine()));
  }));
}

TEST(BushtabExpand, MoveOfManyBlocksIsComplete) {
  const Outcome outcome = bushtab(expand_arguments("bushd2-scurve", 50000, 2560, "coarse"));
  EXPECT_EQ(outcome.exit_code, 0);
  std::int64_t steps = 0;
  std::size_t comma = outcome.out.find('\n');
  while ((comma = outcome.out.find(',', comma + 1)) != std::string::npos) {
    steps += std::stoi(outcome.out.substr(comma + 1)) - 128;
  }
  EXPECT_EQ(steps, 50000);
}

TEST(BushtabExpand, TableTooFastForTheTickIsRefused) {
  const Outcome outcome = bushtab(expand_arguments("micro16-standard", 100, 20000, "fine"));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(outcome.err,
              HasSubstr("micro16-standard.toml: makes up to 401 steps in a tick of 20000 us; "
                        "allowed: 127"));
}

TEST(BushtabExpand, WrongUsageHasAnExitCodeOfItsOwn) {
  for (const std::string& arguments :
       {expand_arguments("bushd2-constant", 2147483648, 2560, "fine"),
        expand_arguments("bushd2-constant", -2147483648, 2560, "fine"),
        expand_arguments("bushd2-constant", 1, 199, "fine"),
        expand_arguments("bushd2-constant", 1, 20001, "fine"),
        expand_arguments("bushd2-constant", 1, 2560, "medium"), std::string("expand"),
        std::string()}) {
    const Outcome outcome = bushtab(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_THAT(outcome.out, IsEmpty());
  }
}

TEST(BushtabExpand, FractionsOfAStepAreToldApartFromTooManySteps) {
  const Outcome fraction =
      bushtab("expand --table bushd2-constant --steps 5.5 --tick-us 2560 --format fine");
  EXPECT_EQ(fraction.exit_code, 2);
  EXPECT_THAT(fraction.err, HasSubstr("--steps: 5.5 is not a whole number"));
  const Outcome many = bushtab(expand_arguments("bushd2-constant", 2147483648, 2560, "fine"));
  EXPECT_THAT(many.err, HasSubstr("2147483648 not in range"));
}

TEST(BushtabExpand, FullDiskIsAnError) {
  const std::string arguments = expand_arguments("bushd2-constant", 100, 2560, "fine");
  const int status = std::system((BUSHTAB " " + arguments + " >/dev/full 2>/dev/null").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
}

TEST(BushtabCheck, GoodFilesPass) {
  const Outcome outcome = bushtab("check " BUSHD_SOURCE_DIR "/tables/*.toml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("bushd2-resonance.toml: good\n"));
}

TEST(BushtabCheck, TakesNamesOfShippedTables) {
  const Outcome outcome = bushtab("check bushd2-constant nosuch");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "bushd2-constant: good\n");
  EXPECT_THAT(outcome.err, HasSubstr("there is no table \"nosuch\""));
}

TEST(BushtabCheck, EveryBadFileIsNamedWithLineAndKey) {
  const TempDirectory directory;
  const std::string bad =
      directory.write("bad.toml", "name = \"bad\"\ntime_unit_ns = 1\naccel = [\n9,\n10]\n");
  const std::string worse = directory.write("worse.toml", "name = 1\n");
  const std::string good = directory.write("good.toml", kSmallTable);
  const Outcome outcome = bushtab("check " + bad + " " + good + " " + worse);
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, good + ": good\n");
  EXPECT_THAT(outcome.err, StartsWith(bad + ":5: accel[1]: is 10 after 9; allowed: "));
  EXPECT_THAT(outcome.err, HasSubstr("\n" + worse + ":1: name: is 1; allowed: "));
}

TEST(BushtabShow, TellsSpeedsTimesAndCounts) {
  const Outcome outcome = bushtab("show bushd2-constant");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, HasSubstr("238 codes 250..10, 100..2500 steps/s"));
  EXPECT_THAT(outcome.out,
              HasSubstr("code 10, 2500 steps/s, reached by moves of 475 steps or more"));
}

TEST(BushtabShow, JsonHasTheSame) {
  const TempDirectory directory;
  const std::string table =
      directory.write("t.toml", std::string(kSmallTable) + "decel = [5, 20, 40]\ncruise = 5\n");
  const Outcome outcome = bushtab("show --json " + table);
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* part : {"\"symmetric\": false", "\"codes\": 2", "\"time_ns\": 1600000",
                           "\"codes\": 3", "\"time_ns\": 6500000", "\"steps_per_s\": 2000.0",
                           "\"shortest_cruising_move_steps\": 5", "\"longest_tick_us\": 20000"}) {
    EXPECT_THAT(outcome.out, HasSubstr(part));
  }
}

TEST(BushtabShow, UnknownNameListsWhereItLooked) {
  const Outcome outcome = bushtab("show nosuch");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("there is no table \"nosuch\": no file nosuch.toml in "));
}

}  // namespace
}  // namespace bushd::test
