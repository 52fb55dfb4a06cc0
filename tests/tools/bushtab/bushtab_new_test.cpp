// bushtab new, from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "run_bushtab.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const char* const kProfile = " --law constant --start 100Hz --max 1kHz --acceleration 5kHz/s";

TEST(BushtabNew, MakesAFileThatIsRevisionOne) {
  const TempDirectory directory;
  const std::string table = directory.path() / "mine.toml";
  const Outcome made =
      bushtab("new " + table + kProfile + " --comment why --description 'a motor'");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.out, table + ": revision 1\n");
  EXPECT_THAT(read_file(table), StartsWith("# why\nname = \"mine\"\ndescription = \"a motor\"\n"
                                           "revision = 1\ntime_unit_ns = 200\naccel = [\n"));
  EXPECT_EQ(bushtab("check " + table).exit_code, 0);
  EXPECT_THAT(bushtab("new " + table + kProfile).err, HasSubstr("is there already"));
  EXPECT_EQ(bushtab("new --replace " + table + kProfile).out, table + ": revision 2\n");
}

TEST(BushtabNew, NamesLiveInTheDirectoryOfTables) {
  const TempDirectory directory;
  const std::string places = " --dir " + directory.path().string();
  EXPECT_EQ(bushtab("new mine" + std::string(kProfile) + places).exit_code, 0);
  EXPECT_THAT(bushtab("show mine" + places).out, HasSubstr("100..1000 steps/s"));
  EXPECT_EQ(bushtab("show mine@1" + places).exit_code, 0);
  EXPECT_THAT(bushtab("show mine@2" + places).err, HasSubstr("has no revision 2"));
}

TEST(BushtabNew, DirectoryThatIsNotThereIsMadeAndSaid) {
  const TempDirectory directory;
  const std::string tables = directory.path() / "a/b";
  const Outcome refused =
      bushtab("new mine --law constant --start 1kHz --max 100Hz --time 1s --dir " + tables);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(tables));
  const Outcome made = bushtab("new mine" + std::string(kProfile) + " --json --dir " + tables);
  EXPECT_EQ(made.exit_code, 0);
  EXPECT_THAT(made.out, StartsWith("{"));
  EXPECT_EQ(made.err, "made the directory " + tables + "\n");
  const std::string others = directory.path() / "c";
  EXPECT_EQ(bushtab("copy bushd2-constant mine --dir " + others).exit_code, 0);
  EXPECT_EQ(bushtab("copy bushd2-scurve other --dir " + others).err, "");
}

TEST(BushtabNew, PrintLeavesNothingBehind) {
  const TempDirectory directory;
  const std::string places = " --dir " + directory.path().string();
  EXPECT_THAT(bushtab("new mine --print" + std::string(kProfile) + places).out,
              StartsWith("name = \"mine\"\n"));
  EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

TEST(BushtabNew, WrongUnitsAreWrongUsage) {
  const Outcome outcome =
      bushtab("new ./x.toml --law constant --start 100rpm --max 1kHz --time 1s");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("--start: \"100rpm\"; allowed: a number with one of the units "
                                     "steps/s, Hz, kHz"));
}

TEST(BushtabNew, WhatCannotWorkIsRefused) {
  const Outcome outcome = bushtab("new ./x.toml --law constant --start 1kHz --max 100Hz --time 1s");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("allowed: up to the maximum, 100"));
}

}  // namespace
}  // namespace bushd::test
