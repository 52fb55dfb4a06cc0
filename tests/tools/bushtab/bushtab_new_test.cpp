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

class BushtabLoad : public testing::Test {
 protected:
  Outcome run(const std::string& name, const std::string& load) {
    return bushtab("new " + name + " --law torque --start 200 --max 3kHz --torque " + curve_ +
                   " --friction 2Ncm --dir " + directory_.path().string() + load);
  }
  std::string codes(const std::string& name) {
    const std::string text = read_file(directory_.path() / (name + ".toml"));
    return text.substr(text.find("time_unit_ns"));
  }

  TempDirectory directory_;
  std::string curve_ = directory_.write("m.csv", "speed_rpm,torque_ncm\n0,40\n600,30\n1500,10\n");
};

// 2 kg on 5 mm are 12.66515 g cm2, by hand; of 0.5 kg on a belt of 40 mm 202.6424, behind a gear of
// 3 22.51582; of 900 g cm2 behind a gear of 3 100.
TEST_F(BushtabLoad, CountsAsSoMuchMoreInertia) {
  const Outcome screw = run("screw", " --inertia 200gcm2 --mass-kg 2 --lead-mm 5");
  EXPECT_EQ(screw.exit_code, 0) << screw.err;
  EXPECT_THAT(screw.err,
              HasSubstr("inertia at the motor: 2.13e-05 kg m2, 1.27e-06 of it by the load\n"));
  ASSERT_EQ(run("a", " --inertia 212.66515gcm2").exit_code, 0);
  EXPECT_EQ(codes("screw"), codes("a"));
  ASSERT_EQ(run("belt", " --inertia 200gcm2 --mass-kg 0.5 --belt-mm 40 --gear 3").exit_code, 0);
  ASSERT_EQ(run("b", " --inertia 222.51582gcm2").exit_code, 0);
  EXPECT_EQ(codes("belt"), codes("b"));
  ASSERT_EQ(run("turns", " --inertia 200gcm2 --load-inertia 900gcm2 --gear 3").exit_code, 0);
  ASSERT_EQ(run("c", " --inertia 300gcm2").exit_code, 0);
  EXPECT_EQ(codes("turns"), codes("c"));
}

TEST_F(BushtabLoad, HalfALoadIsRefusedWithWhatIsMissing) {
  const std::string rotor = " --inertia 200gcm2";
  EXPECT_THAT(run("t", rotor + " --mass-kg 2").err, HasSubstr("--lead-mm or --belt-mm"));
  EXPECT_THAT(run("t", rotor + " --lead-mm 5").err,
              HasSubstr("needs the mass that is moved: --mass-kg"));
  EXPECT_THAT(run("t", rotor + " --mass-kg 2 --lead-mm 5 --belt-mm 5").err,
              HasSubstr("one of them"));
  EXPECT_THAT(run("t", rotor + " --gear 2").err, HasSubstr("--mass-kg or --load-inertia"));
  EXPECT_THAT(
      run("t", " --mass-kg 2 --lead-mm 5").err,
      HasSubstr("the load is 1.27e-06 kg m2 at the motor, and the rotor adds to that: --inertia"));
  EXPECT_THAT(bushtab("new t --print" + std::string(kProfile) + " --mass-kg 2 --lead-mm 5").err,
              HasSubstr("--torque FILE"));
}

}  // namespace
}  // namespace bushd::test
