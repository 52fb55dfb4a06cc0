// [[crate]] and [[crate.module]].
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "config/config.h"
#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::ConfigFile;
using test::kGood;
using test::loaded;
using test::replaced;
using testing::HasSubstr;

const std::string kCrate = kGood +
                           "[[crate]]\n"             // 38
                           "number = 1\n"            // 39
                           "[[crate.module]]\n"      // 40
                           "station = 5\n"           // 41
                           "type = \"bushd-2\"\n"    // 42
                           "f_start_hz = 100\n"      // 43
                           "motors = [\"theta\"]\n"  // 44
                           "[[crate.module]]\n"      // 45
                           "station = 7\n"           // 46
                           "type = \"bushd-1\"\n"    // 47
                           "motor = \"slit\"\n";     // 48

std::string error_of(const std::string& from, const std::string& to) {
  return test::error_of(replaced(kCrate, from, to));
}

TEST(ConfigCrates, NoneIsNeeded) {
  const auto config = loaded(kGood);
  EXPECT_TRUE(config.crates.empty());
}

TEST(ConfigCrates, ModulesHaveStationsAndMotors) {
  const auto config = loaded(kCrate);
  ASSERT_EQ(config.crates.size(), 1u);
  EXPECT_EQ(config.crates[0].number, 1);
  ASSERT_EQ(config.crates[0].modules.size(), 2u);
  const CamacModule& two = config.crates[0].modules[0];
  EXPECT_EQ(two.station, 5);
  EXPECT_EQ(two.type, CamacModule::Type::kBushd2);
  EXPECT_EQ(two.f_start_hz, 100);
  EXPECT_EQ(two.motors, std::vector<MotorId>{MotorId{0}});
  const CamacModule& one = config.crates[0].modules[1];
  EXPECT_EQ(one.station, 7);
  EXPECT_EQ(one.type, CamacModule::Type::kBushd1);
  EXPECT_EQ(one.motors, std::vector<MotorId>{MotorId{1}});
  EXPECT_EQ(one.adjustable_delay, CamacModule::AdjustableDelay::kReturn);
}

TEST(ConfigCrates, TheAdjustableDelayIsOfOneOfTwoRuns) {
  const auto delayed = [](const std::string& word) {
    return ConfigFile(kCrate + "adjustable_delay = \"" + word + "\"\n").load();
  };
  EXPECT_EQ(delayed("return")->crates[0].modules[1].adjustable_delay,
            CamacModule::AdjustableDelay::kReturn);
  EXPECT_EQ(delayed("opening")->crates[0].modules[1].adjustable_delay,
            CamacModule::AdjustableDelay::kOpening);
  EXPECT_THAT(delayed("both").error().text(),
              HasSubstr("is \"both\"; allowed: \"return\" or \"opening\""));
  EXPECT_THAT(error_of("f_start_hz = 100", "adjustable_delay = \"return\""),
              HasSubstr("adjustable_delay"))
      << "a key of BUSHD-1";
}

TEST(ConfigCrates, WithoutAComputerItsMcuHasToConsent) {
  const std::string alone = replaced(kCrate, "f_start_hz = 100", "without_computer = true");
  EXPECT_THAT(test::error_of(alone), HasSubstr("programs_without_host = true in its [[mcu]]"));
  const auto config =
      loaded(replaced(alone, "[[mcu]]\n", "[[mcu]]\nprograms_without_host = true\n"));
  EXPECT_TRUE(config.crates[0].modules[0].without_computer);
  EXPECT_FALSE(config.crates[0].modules[1].without_computer);
}

TEST(ConfigCrates, BadOnesAreRefused) {
  EXPECT_THAT(error_of("number = 1\n", "number = 63\n"), HasSubstr("1..62"));
  EXPECT_THAT(error_of("number = 1\n", ""), HasSubstr("crate[0].number"));
  EXPECT_THAT(error_of("station = 5\n", "station = 24\n"), HasSubstr("bushd.toml:41:"));
  EXPECT_THAT(error_of("station = 5\n", "station = 24\n"), HasSubstr("1..23"));
  EXPECT_THAT(error_of("station = 7\n", "station = 5\n"),
              HasSubstr("station 5 of crate 1 is already taken; allowed: each once"));
  EXPECT_THAT(error_of("\"bushd-2\"", "\"bushd-3\""),
              HasSubstr("is \"bushd-3\"; allowed: \"bushd-1\" or \"bushd-2\""));
  EXPECT_THAT(error_of("f_start_hz = 100", "f_start_hz = 101"), HasSubstr("1..100 Hz"));
  EXPECT_THAT(error_of("[\"theta\"]", "[]"), HasSubstr("has 0; allowed: 1..32 names of motors"));
  EXPECT_THAT(error_of("[\"theta\"]", "[3]"), HasSubstr("allowed: the name of a motor"));
  EXPECT_THAT(error_of("[\"theta\"]", "[\"chi\"]"),
              HasSubstr("crate[0].module[0].motors[0]: is \"chi\"; allowed: names of [[motor]]"));
  EXPECT_THAT(error_of("\"slit\"\n", "\"slit\"\nf_start_hz = 3\n"), HasSubstr("f_start_hz"));
  EXPECT_THAT(error_of("motor = \"slit\"\n", "motor = \"theta\"\n"),
              HasSubstr("motor \"theta\" is already one of station 5 of crate 1; allowed: each "
                        "once"));
  EXPECT_THAT(error_of("[\"theta\"]", "[\"theta\", \"theta\"]"), HasSubstr("each once"));
  EXPECT_THAT(test::error_of(kCrate + "[[crate]]\nnumber = 1\nmodule = []\n"),
              HasSubstr("crate 1 is already there"));
  EXPECT_THAT(error_of("number = 1\n", "number = 1\nname = \"a\"\n"), HasSubstr("name"));
}

TEST(ConfigCrates, ProgramsChangeTheTableOfNobodyElse) {
  const std::string same_group =
      replaced(kCrate, "group = \"slits\"\n", "group = \"goniometer\"\n");
  EXPECT_THAT(
      test::error_of(same_group),
      HasSubstr("motor \"theta\" of station 5 of crate 1 moves by programs, which become "
                "the table of group \"goniometer\", and motor \"slit\" has the same group"));
}

}  // namespace
}  // namespace bushd::config
