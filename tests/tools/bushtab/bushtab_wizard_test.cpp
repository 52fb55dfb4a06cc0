// bushtab wizard, from outside, with its answers in a file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "run_bushtab.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class BushtabWizard : public testing::Test {
 protected:
  Outcome run(const std::string& answers, const std::string& options = "") {
    const std::string file = directory_.path() / "answers";
    std::ofstream(file, std::ios::binary) << answers;
    return bushtab("wizard " + table_ + options, "", file);
  }

  const TempDirectory directory_;
  const std::string table_ = directory_.path() / "feed.toml";
};

TEST_F(BushtabWizard, AnswersMakeTheTableThatOptionsOfNewMake) {
  const Outcome made = run("4kHz\n200Hz\n300ms\n150ms\nnone\nyes\n");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("MAX_SPEED (steps/s, Hz, kHz): 4kHz\n"));
  EXPECT_THAT(made.out, HasSubstr("steps/s of a move that just comes to cruise\n     4000 │"));
  EXPECT_THAT(made.out, HasSubstr(table_ + ": revision 1\n"));
  const std::string other = directory_.path() / "options" / "feed.toml";
  std::filesystem::create_directory(directory_.path() / "options");
  ASSERT_EQ(bushtab("new " + other +
                    " --law pto --max 4kHz --start 200Hz --time 300ms --decel-time 150ms")
                .exit_code,
            0);
  EXPECT_EQ(read_file(table_), read_file(other));
}

TEST_F(BushtabWizard, EmptyAnswersAreThoseShown) {
  const Outcome made = run("4kHz\n200Hz\n300ms\n\n\n\n");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("[300ms]"));
  EXPECT_THAT(read_file(table_), Not(HasSubstr("decel")));
}

TEST_F(BushtabWizard, NoAnswersAndNoTerminalIsRefused) {
  const Outcome refused = run("");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("run it in a terminal, or give it the answers"));
  EXPECT_FALSE(std::filesystem::exists(table_));
}

TEST_F(BushtabWizard, AnswersThatEndEarlyOrAreWrongWriteNothing) {
  struct Case {
    const char* answers;
    const char* said;
  };
  for (const Case& wrong : {
           Case{"4kHz\n200Hz\n", "the answers end here"},
           Case{"4kHz\n5kHz\n", "at most the maximum speed, 4000 steps/s"},
           Case{"fast\n", "\"fast\"; allowed: a number with one of the units"},
           Case{"-1\n", "MAX_SPEED (steps/s, Hz, kHz): must be above 0; nothing is written"},
           Case{"nan\n", "\"nan\"; allowed"},
           Case{"4kHz\n200Hz\n0s\n", "must be above 0"},
           Case{"4kHz\n200Hz\n1s\n1s\n/nowhere.csv\n", "/nowhere.csv"},
           Case{"4kHz\n200Hz\n1s\n1s\nnone\nmaybe\n", "allowed: yes, no, or again"},
           // No code of 16 bits is that long.
           Case{"1MHz\n", "allowed: a number with one of the units"},
       }) {
    SCOPED_TRACE(wrong.answers);
    const Outcome refused = run(wrong.answers);
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.err, HasSubstr(wrong.said));
    EXPECT_FALSE(std::filesystem::exists(table_));
  }
  EXPECT_THAT(run(std::string(5000, '1') + "\n").err, HasSubstr("4096 bytes at most"));
  EXPECT_EQ(run("4kHz\n200Hz\n1s\n1s\nnone\nno\n").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(table_));
}

TEST_F(BushtabWizard, AgainAsksAllWithTheAnswersReady) {
  const Outcome made = run("4kHz\n200Hz\n300ms\n150ms\nnone\nagain\n\n400Hz\n\n\n\nyes\n");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("SS_SPEED (steps/s, Hz, kHz) [200Hz]: 400Hz"));
  EXPECT_THAT(bushtab("show " + table_).out, HasSubstr("400..4000 steps/s"));
}

TEST_F(BushtabWizard, MotorSaysWhatItCannotFollow) {
  const std::string motor = std::string(BUSHD_SOURCE_DIR) + "/tables/motors/nema17.csv";
  const std::string of_motor = motor + "\n3200\n200\n60gcm2\n1Ncm\n2\n";
  const Outcome slow = run("8kHz\n1kHz\n300ms\n300ms\n" + of_motor + "yes\n");
  EXPECT_EQ(slow.exit_code, 0) << slow.err;
  EXPECT_THAT(slow.out, HasSubstr("the motor can follow it"));
  const Outcome fast = run("24kHz\n1kHz\n1ms\n1ms\n" + of_motor + "no\n");
  EXPECT_THAT(fast.out, HasSubstr("error: torque"));
}

TEST_F(BushtabWizard, ExistingTableNeedsReplace) {
  const std::string answers = "4kHz\n200Hz\n300ms\n150ms\nnone\nyes\n";
  ASSERT_EQ(run(answers).exit_code, 0);
  EXPECT_THAT(run(answers).err, HasSubstr("is there already"));
  EXPECT_THAT(run(answers, " --replace").out, HasSubstr("revision 2"));
}

}  // namespace
}  // namespace bushd::test
