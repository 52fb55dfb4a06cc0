// The program bushtab, from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "run_bushtab.h"
#include "source_path.h"
#include "tables/random_table.h"
#include "tables/reference_move.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

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
  const std::string text = read_file(source_path("docs/tables.md"));
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
  EXPECT_THAT(many.err,
              HasSubstr("2147483648 is out of range; allowed: -2147483647 to 2147483647"));
}

TEST(BushtabExpand, FullDiskIsAnError) {
  const std::string arguments = expand_arguments("bushd2-constant", 100, 2560, "fine");
  const int status = std::system((BUSHTAB " " + arguments + " >/dev/full 2>/dev/null").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
}

TEST(BushtabCheck, GoodFilesPass) {
  const Outcome outcome = bushtab("check " + source_path("tables/*.toml"));
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
  EXPECT_THAT(outcome.out, HasSubstr("\n" + good + ": good\n"));
  EXPECT_THAT(outcome.err, StartsWith(bad + ":5:1: accel[1]: is 10 after 9; allowed: "));
  EXPECT_THAT(outcome.err, HasSubstr("\n" + worse + ":1:8: name: is 1; allowed: "));
}

TEST(BushtabCheck, HostileFilesAreRefusedWithLineAndColumn) {
  const TempDirectory directory;
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  const auto refusal = [&](const std::string& accel) {
    const std::string path =
        directory.write("h.toml", "name = \"h\"\ntime_unit_ns = 1000\naccel = " + accel + "\n");
    const Outcome outcome = bushtab("check " + path);
    EXPECT_EQ(outcome.exit_code, 1) << accel.substr(0, 20);
    return outcome.err.substr(0, 1000);
  };
  EXPECT_THAT(refusal("[9, nan]"),
              HasSubstr("h.toml:3:13: accel[1]: is the floating-point number nan"));
  EXPECT_THAT(refusal("[9, -5]"), HasSubstr("h.toml:3:13: accel[1]: is -5"));
  EXPECT_THAT(refusal("[9, \"7\"]"), HasSubstr("h.toml:3:13: accel[1]: is the string"));
  EXPECT_THAT(refusal("9"), HasSubstr("h.toml:3:9: accel: is 9; allowed: an array"));
  EXPECT_THAT(refusal("[9] # \xff"),
              HasSubstr("h.toml:3:15: byte 0xff is not text; allowed: UTF-8"));
  EXPECT_THAT(refusal(repeated("[", 100'000)), HasSubstr("h.toml:3:"));
  EXPECT_THAT(refusal("[" + repeated("1,", 100'000) + "]"), HasSubstr("makes 100000 codes in all"));
  EXPECT_THAT(refusal("[" + repeated("1,", 1'100'000) + "]"),
              HasSubstr("larger than 2097152 bytes"));
}

TEST(BushtabCheck, StrictRefusesWarnings) {
  const TempDirectory directory;
  const std::string table = directory.write("small.toml", kSmallTable);
  EXPECT_EQ(bushtab("check " + table).exit_code, 0);
  const Outcome strict = bushtab("check --strict " + table);
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_THAT(strict.out, HasSubstr("warning: resolution: cruise: one code more changes"));
  const Outcome json = bushtab("check --strict --json " + table);
  EXPECT_EQ(json.exit_code, 1);
  for (const char* part : {"\"good\": false", "\"rule\": \"resolution\"", "\"limit\": 0.1"}) {
    EXPECT_THAT(json.out, HasSubstr(part));
  }
}

TEST(BushtabCheck, TableFasterThanTheMotorIsRefusedBeforehand) {
  const TempDirectory directory;
  const std::string curve =
      directory.write("m.csv", "speed_rpm,torque_ncm\n0,40\n600,30\n1500,10\n");
  const std::string motor =
      " --torque " + curve + " --inertia 200gcm2 --friction 2Ncm --safety 1.2";
  const std::string table = directory.path() / "t.toml";
  ASSERT_EQ(bushtab("new " + table + " --law torque --start 200 --max 3kHz" + motor).exit_code, 0);
  EXPECT_EQ(bushtab("check --strict " + table + motor).exit_code, 0);
  ASSERT_EQ(bushtab("scale --speed 1.3 " + table).exit_code, 0);
  const Outcome fast = bushtab("check " + table + motor);
  EXPECT_EQ(fast.exit_code, 1);
  EXPECT_THAT(fast.out, HasSubstr("error: torque: accel["));
  EXPECT_THAT(fast.out, HasSubstr("it will lose steps"));
}

// A table in a directory of its own, with the commands that change it.
class BushtabEdit : public testing::Test {
 protected:
  void SetUp() override {
    directory_.write("t.toml",
                     "# mine\nname = \"t\"\ntime_unit_ns = 1000\naccel = [90, 70, 50] # fast\n");
  }
  Outcome run(const std::string& arguments) { return bushtab(arguments + places_); }
  std::string text() { return read_file(directory_.path() / "t.toml"); }

  TempDirectory directory_;
  std::string places_ = " --dir " + directory_.path().string();
};

TEST_F(BushtabEdit, EveryCommandIsARevisionThatCanComeBack) {
  EXPECT_THAT(run("set t 1 71").out, HasSubstr("t.toml: revision 2\n"));
  EXPECT_THAT(text(), HasSubstr("accel = [90, 71, 50] # fast\n"));
  EXPECT_EQ(run("insert t 2 60 55").exit_code, 0);
  EXPECT_THAT(text(), HasSubstr("accel = [90, 71, 60, 55, 50] # fast\n"));
  EXPECT_EQ(run("delete t 0 2").exit_code, 0);
  EXPECT_THAT(text(), HasSubstr("accel = [60, 55, 50] # fast\n"));
  EXPECT_EQ(run("scale t --speed 0.5").exit_code, 0);
  EXPECT_THAT(text(), HasSubstr("accel = [120, 110, 100] # fast\n"));
  EXPECT_EQ(run("resample t --time-unit 2us").exit_code, 0);
  EXPECT_THAT(text(), HasSubstr("time_unit_ns = 2000\naccel = [60, 55, 50] # fast\n"));
  EXPECT_EQ(run("tag t good 3").exit_code, 0);
  EXPECT_EQ(run("revert t good").exit_code, 0);
  EXPECT_THAT(text(), StartsWith("# mine\nname = \"t\"\nrevision = 7\ntime_unit_ns = 1000\n"
                                 "accel = [90, 71, 60, 55, 50] # fast\n"));
  const Outcome log = run("log t");
  EXPECT_THAT(log.out, HasSubstr("revert to 3\n"));
  EXPECT_THAT(log.out, HasSubstr("insert 2 codes at 2  [good]\n"));
  EXPECT_THAT(log.out, HasSubstr("found\n"));
  EXPECT_THAT(run("log t --json").out, HasSubstr("\"note\": \"delete 2 codes from 0\""));
}

TEST_F(BushtabEdit, ChangeThatIsNoTableIsRefusedAndTheOldOneStays) {
  const std::string before = text();
  const Outcome outcome = run("set t 1 95");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("accel[1]: is 95 after 90"));
  EXPECT_THAT(run("set t 3 40").err, HasSubstr("accel has no index 3; allowed: 0..2"));
  EXPECT_EQ(run("set t 0 70000").exit_code, 2);
  EXPECT_EQ(text(), before);
}

TEST_F(BushtabEdit, FactorThatIsNoneIsNamed) {
  for (const char* factor : {"2x", "0", "-1", "nan", "inf"}) {
    const Outcome outcome = run(std::string("scale t --speed ") + factor);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err,
                StartsWith(std::string("--speed: ") + factor + " is not a number above 0\n"));
  }
}

TEST_F(BushtabEdit, EditorsTextIsCheckedOnReturn) {
  EXPECT_THAT(bushtab("edit t" + places_, "EDITOR='sed -i s/90/80/'").out, HasSubstr("revision 2"));
  EXPECT_THAT(text(), HasSubstr("accel = [80, 70, 50] # fast\n"));
  const std::string before = text();
  const Outcome bad = bushtab("edit t" + places_, "EDITOR='sed -i s/80/8x/'");
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_THAT(bad.err,
              HasSubstr("your text is in " + (directory_.path() / ".t.edited.toml").string()));
  EXPECT_THAT(read_file(directory_.path() / ".t.edited.toml"), HasSubstr("8x"));
  EXPECT_EQ(text(), before);
  EXPECT_THAT(bushtab("edit t" + places_, "EDITOR=false").err, HasSubstr("nothing was changed"));
}

TEST_F(BushtabEdit, ScaleAndResampleSayWhatRoundingMadeOfIt) {
  const Outcome coarse = run("resample t --time-unit 40us");
  EXPECT_EQ(coarse.exit_code, 0);
  EXPECT_EQ(
      coarse.err,
      "delays are rounded up to whole time units: speeds are up to 37.5 % lower than asked\n");
  EXPECT_THAT(text(), HasSubstr("accel = [3, 2, 2] # fast\n"));
  EXPECT_THAT(run("scale t --speed 1.5").err,
              HasSubstr("the time unit is 2 ns now, as whole numbers of 40000 ns do not tell "
                        "these delays well"));
  const std::string before = text();
  for (const char* command : {"scale t --speed 1e9", "resample t --time-unit 1s"}) {
    const Outcome refused = run(command);
    EXPECT_EQ(refused.exit_code, 1) << command;
    EXPECT_THAT(refused.err, HasSubstr("time units; allowed: 1 or more"));
  }
  EXPECT_EQ(text(), before);
  EXPECT_THAT(run("resample t --time-unit 1us").err, HasSubstr("lower than asked"));
  EXPECT_THAT(run("scale t --speed 0.5").err, IsEmpty());
}

// The finest unit, which "new" takes, has no room for a slower start.
TEST_F(BushtabEdit, TableOfNewIsScaledDownAndUpAgain) {
  ASSERT_EQ(
      run("new stage --law constant --start 800Hz --max 16kHz --acceleration 150kHz/s").exit_code,
      0);
  const Outcome slower = run("scale stage --speed 0.8");
  EXPECT_EQ(slower.exit_code, 0);
  EXPECT_THAT(slower.out, HasSubstr("stage.toml: revision 2\n"));
  EXPECT_THAT(slower.err, HasSubstr("the time unit is 25 ns now"));
  EXPECT_THAT(run("show stage").out, HasSubstr(", 640..12800 steps/s"));
  EXPECT_THAT(run("scale stage --speed 0.01").err, HasSubstr("the time unit is 2500 ns now"));
  EXPECT_THAT(run("show stage").out, HasSubstr(", 6.4..128 steps/s"));
  EXPECT_THAT(run("scale stage --speed 125").err, HasSubstr("the time unit is 20 ns now"));
  EXPECT_THAT(run("diff stage@1 stage").out, StartsWith("the same content"));
  EXPECT_THAT(run("log stage").out, HasSubstr("speeds times 0.8\n"));
}

TEST_F(BushtabEdit, ScaleThatFitsTheTimeUnitKeepsIt) {
  EXPECT_THAT(run("scale t --speed 0.002").err, IsEmpty());
  EXPECT_THAT(text(), HasSubstr("time_unit_ns = 1000\naccel = [45000, 35000, 25000] # fast\n"));
}

TEST_F(BushtabEdit, NumbersOutOfRangeAreAnsweredWithTheRange) {
  const Outcome code = run("set t 0 99999");
  EXPECT_EQ(code.exit_code, 2);
  EXPECT_THAT(code.err,
              StartsWith("CODE: 99999 is out of range; allowed: 1 to 65535, as a code has "
                         "16 bits. For longer delays take a longer time unit first: "
                         "bushtab resample TABLE --time-unit T\n"));
  EXPECT_THAT(run("insert t 0 -1").err,
              StartsWith("CODE: -1 is out of range; allowed: 1 to 65535"));
  EXPECT_THAT(run("set t 0 5.5").err, StartsWith("CODE: 5.5 is not a whole number; allowed: 1 to"));
  EXPECT_THAT(run("set t 99999999999999999999 5").err,
              StartsWith("INDEX: 99999999999999999999 is out of range; allowed: 0 to 65534\n"));
  EXPECT_THAT(run("resample t --codes 99999999999").err,
              StartsWith("--codes: 99999999999 is out of range; allowed: 1 to 65535\n"));
}

TEST_F(BushtabEdit, TextThatWasKeptIsToldAndNotWrittenOver) {
  const std::string kept = directory_.path() / ".t.edited.toml";
  directory_.write(".t.edited.toml", "my evening's work\n");
  const Outcome good = bushtab("edit t" + places_, "EDITOR='sed -i s/90/80/'");
  EXPECT_THAT(good.out, HasSubstr("revision 2"));
  EXPECT_THAT(good.err, HasSubstr("never saved is in " + kept));
  const Outcome bad = bushtab("edit t" + places_, "EDITOR='sed -i s/80/8x/'");
  EXPECT_THAT(bad.err,
              HasSubstr("your text is in " + (directory_.path() / ".t.edited-2.toml").string()));
  EXPECT_EQ(read_file(kept), "my evening's work\n");
}

TEST_F(BushtabEdit, TextOfAnEditorThatFailsAfterWritingIsKept) {
  const std::string before = text();
  const Outcome outcome =
      bushtab("edit t" + places_, "EDITOR='f() { sed -i s/90/80/ \"$1\"; false; }; f'");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("your text is in "));
  EXPECT_THAT(outcome.err, HasSubstr("failed; nothing was changed"));
  EXPECT_THAT(read_file(directory_.path() / ".t.edited.toml"), HasSubstr("80"));
  EXPECT_EQ(text(), before);
}

TEST_F(BushtabEdit, CopyHasANameAndAHistoryOfItsOwn) {
  EXPECT_EQ(run("copy t other").exit_code, 0);
  EXPECT_THAT(read_file(directory_.path() / "other.toml"),
              StartsWith("# mine\nname = \"other\"\nrevision = 1\n"));
  EXPECT_THAT(run("copy bushd2-constant t").err, HasSubstr("is there already"));
  EXPECT_THAT(run("list").out, HasSubstr("other                      1  "));
  EXPECT_THAT(run("list").out,
              StartsWith("TABLE                    REV  HASH        START..MAX     STEPS/S  "
                         "DESCRIPTION\n"));
}

TEST_F(BushtabEdit, TimesAndDifferencesAreThoseOfTheDelays) {
  // 90 + 70 + 50 + 70 + 90 us
  EXPECT_THAT(run("time t --steps 5 --json").out, HasSubstr("\"time_ns\": 370000"));
  EXPECT_EQ(run("time t --steps 5").out,
            "         5 steps           0.370 ms  up to 20000 steps/s\n");
  ASSERT_EQ(run("set t 1 71").exit_code, 0);
  EXPECT_THAT(run("diff t@1 t").out, StartsWith("2 delays differ\n"
                                                "  start speed       11111.1 steps/s in both\n"
                                                "  top speed           20000 steps/s in both\n"
                                                "  acceleration         0.21 to 0.211 ms (+0.5 %)\n"
                                                "                          3 codes in both\n"));
  EXPECT_THAT(run("diff t@1 t").out, HasSubstr("accel      1         70.000         71.000\n"));
  EXPECT_THAT(run("diff t@1 t --json").out, HasSubstr("\"delays_that_differ\": 2"));
  EXPECT_THAT(run("diff t@1 t@1").out, HasSubstr("the same content"));
  EXPECT_THAT(run("diff t@1 t --json").out, HasSubstr("\"after_us\": 71.0"));
}

TEST_F(BushtabEdit, PlotFitsTheWidthAndHasNoColoursInAFile) {
  const Outcome plot = bushtab("plot bushd2-constant bushd2-scurve" + places_, "COLUMNS=50");
  EXPECT_EQ(plot.exit_code, 0) << plot.err;
  EXPECT_THAT(plot.out, Not(HasSubstr("\033")));
  EXPECT_THAT(plot.out, HasSubstr("     2500 │"));
  EXPECT_THAT(plot.out, HasSubstr("        0 │"));
  EXPECT_THAT(plot.out, HasSubstr("bushd2-scurve\n"));
  std::istringstream lines(plot.out);
  int longest = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto columns = std::count_if(line.begin(), line.end(), [](char c) {
      return (static_cast<unsigned char>(c) & 0xC0) != 0x80;  // first bytes of UTF-8 only
    });
    longest = std::max(longest, static_cast<int>(columns));
  }
  EXPECT_EQ(longest, 50);
}

TEST_F(BushtabEdit, BushdImagesGoOutAndComeBack) {
  const std::string image = directory_.path() / "image";
  EXPECT_THAT(run("export-bushd bushd2-constant " + image + " --page 3 --steps 1000").out,
              HasSubstr("page 3, 1000 steps; set F_start to 100 Hz"));
  EXPECT_EQ(run("export-bushd bushd2-scurve " + image + " --page 0 --steps 9").exit_code, 0);
  EXPECT_EQ(std::filesystem::file_size(image), 1024U);
  EXPECT_EQ(run("import-bushd " + image + " back --page 3 --start 100Hz").exit_code, 0);
  EXPECT_THAT(run("diff back bushd2-constant").out, HasSubstr("the same content"));
  EXPECT_THAT(run("import-bushd " + image + " none --page 1 --start 100Hz").err,
              HasSubstr("Is there a program in this page?"));
  EXPECT_THAT(run("export-bushd micro16-standard " + image + " --steps 9").err,
              HasSubstr("F_start"));
  EXPECT_THAT(run("export-bushd micro16-standard " + image + " --steps 9 --resample").out,
              HasSubstr("top speed 2500 instead of 20000 steps/s"));
  EXPECT_THAT(run("export-bushd bushd2-constant " + image + " --steps 65536").err,
              HasSubstr("a page counts up to 65535"));
}

TEST_F(BushtabEdit, ShippedTableIsToBeCopiedFirst) {
  for (const char* command : {"set bushd2-constant 0 200", "scale bushd2-constant --speed 0.5",
                              "edit bushd2-constant", "tag bushd2-constant good"}) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 1) << command;
    EXPECT_THAT(outcome.err, HasSubstr("is a shipped table, which stays as it is; copy it first: "
                                       "\"bushtab copy bushd2-constant NEW\""));
  }
  EXPECT_THAT(run("set nosuch 0 200").err, Not(HasSubstr("shipped")));
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
