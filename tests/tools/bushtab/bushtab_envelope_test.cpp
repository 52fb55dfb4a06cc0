// bushtab envelope, from outside: what it writes, what it tells, what it draws, and what it
// refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "run_bushtab.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class BushtabEnvelope : public testing::Test {
 protected:
  BushtabEnvelope() {
    directory_.write("feed.toml",
                     "name = \"feed\"\ntime_unit_ns = 100000\naccel = [80, 60, 50, 40, 30, 25, "
                     "20]\n");
  }
  Outcome run(const std::string& options) {
    return bushtab("--dir " + directory_.path().string() + " envelope " + options, "COLUMNS=60");
  }
  std::string file() { return read_file(directory_.path() / "in.envelope"); }

  const TempDirectory directory_;
  const std::string make_ = "in --table feed --zone 0:200 --zone 10:500 --zone 40:100 --end 50";
};

TEST_F(BushtabEnvelope, IsMadeToldAndDrawn) {
  const Outcome made = run(make_ + " --description 'slow at the end'");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.err, HasSubstr("in.envelope is written"));
  EXPECT_EQ(file(),
            "description = \"slow at the end\"\ntable = \"feed\"\nby = \"distance\"\nzones = [\n"
            "  [0, 200],\n  [10, 500],\n  [40, 100],\n]\nend = 50\n");
  // By hand: 80 + 60 + 8 x 50, then 40 + 30 + 25 + 21 x 20 and 25 .. 80, then 10 x 100 units.
  EXPECT_THAT(made.out, AllOf(HasSubstr("slow at the end"),
                              HasSubstr("by distance, in steps, table feed, 50 steps, 234.000 ms"),
                              HasSubstr("           0          200           10       54.000"),
                              HasSubstr("          10          500           30      134.000"),
                              HasSubstr("          40          100           10      234.000")));
  EXPECT_THAT(made.out, HasSubstr("steps/s over the way\n      500 │"));
  EXPECT_THAT(made.out, HasSubstr("50 steps\nin\n"));
  const Outcome shown = run("in");
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_EQ(shown.out, made.out);
  EXPECT_THAT(shown.err, IsEmpty());
  EXPECT_EQ(bushtab("--dir " + directory_.path().string() + " list").exit_code, 0)
      << "it is no table";
}

TEST_F(BushtabEnvelope, WhatIsGivenIsReplacedAndTheRestIsKept) {
  ASSERT_EQ(run(make_).exit_code, 0);
  const Outcome refused = run("in --end 60");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("exists; with --replace"));
  const Outcome changed = run("in --end 60 --replace --json");
  EXPECT_EQ(changed.exit_code, 0) << changed.err;
  EXPECT_THAT(changed.out, AllOf(HasSubstr("\"steps\": 60"), HasSubstr("\"time_ns\": 334000000"),
                                 HasSubstr("\"peak_steps_per_s\": 500.0")));
  EXPECT_THAT(file(), HasSubstr("  [40, 100],\n]\nend = 60\n"));
}

TEST_F(BushtabEnvelope, PicturesShowSpeedOverStepsAndTime) {
  ASSERT_EQ(run(make_).exit_code, 0);
  const std::string svg = directory_.path() / "in.svg";
  const Outcome drawn =
      run("in --svg " + svg + " --png " + (directory_.path() / "in.png").string());
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(read_file(svg), AllOf(HasSubstr("Envelope by the table feed:"), HasSubstr(">in<"),
                                    HasSubstr("Speed in steps/s over steps"),
                                    HasSubstr("Speed in steps/s over time")));
  EXPECT_THAT(read_file(directory_.path() / "in.png"), StartsWith("\x89PNG"));
  EXPECT_EQ(run("one --table feed --zone 0:100 --end 1 --svg " + svg).exit_code, 0);
}

TEST_F(BushtabEnvelope, WhatCannotBeIsRefusedAndNothingIsWritten) {
  struct Case {
    std::string options;
    std::string why;
    int exit_code = 1;
  };
  for (const Case& one : {
           Case{"in --end 5", "is new; it needs --table, --zone and --end"},
           Case{"in", "in.envelope: cannot be read: No such file"},
           Case{"in --table feed --zone 0:600 --end 50",
                "in.envelope: zones[0]: has 600 steps/s, and the table \"feed\" reaches 500"},
           Case{"in --table none --zone 0:600 --end 50", "none"},
           Case{"in --table feed --zone 5:100 --end 50", "zones[0]: begins at 5"},
           Case{"in --table feed --zone 0:100 --end 0", "end: is 0"},
           Case{"in --table feed --zone 0:100 --zone 0.2:50 --end 9", "zones[0]: has no step"},
           Case{"in --table feed --zone 0 --end 9", "write FROM:SPEED", 2},
           Case{"in --table feed --zone 0:-1 --end 9", "write FROM:SPEED", 2},
           Case{"in --table feed --zone 0:1 --end far", "is not a number", 2},
           Case{"in --table feed --zone 0:1 --end 9 --by time", "--by", 2},
           Case{"in --table feed --zone 0:1 --end 9 --steps-per-unit 0", "above 0", 2},
       }) {
    const Outcome refused = run(one.options);
    EXPECT_EQ(refused.exit_code, one.exit_code) << one.options;
    EXPECT_THAT(refused.err, HasSubstr(one.why)) << one.options;
    EXPECT_FALSE(std::filesystem::exists(directory_.path() / "in.envelope")) << one.options;
  }
}

}  // namespace
}  // namespace bushd::test
