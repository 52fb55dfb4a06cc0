// Program files: what they say, and what is refused, with its place.
#include "programs/program_places.h"

namespace bushd::test {
namespace {

using programs::Line;
using programs::Move;
using programs::Pulse;
using programs::Repeat;
using programs::Wait;
using programs::WaitInput;

class ProgramFiles : public ProgramPlaces {};

TEST_F(ProgramFiles, SayWhatAProgramDoes) {
  const auto program = good(parse(R"(
motors = ["x", "theta"]
without_host = true

[[frame]]
move_to = [10, -2.5]
speed = 3

[[frame]]
repeat = 3

[[frame]]
move_by = { theta = 0.5 }

[[frame]]
line_to = [[1, 0], [0, 1.25]]

[[frame]]
pulse_us = 50

[[frame]]
wait_s = 0.25

[[frame]]
wait_input = "trigger"
active = false
longest_s = 10

[[frame]]
next = true

[[frame]]
line_by = "points.csv"
)",
                                  [](const std::string& file) -> Result<std::string> {
                                    EXPECT_EQ(file, "points.csv");
                                    return "# mm\ntheta\n1\n2.5\n";
                                  }));
  EXPECT_TRUE(program.without_host);
  EXPECT_FALSE(program.steps);
  ASSERT_EQ(program.frames.size(), 9u);
  const auto& move = std::get<Move>(program.frames[0].what);
  EXPECT_FALSE(move.relative);
  EXPECT_EQ(move.to, (programs::Point{10.0, -2.5}));
  EXPECT_EQ(move.speed, 3.0);
  EXPECT_EQ(program.frames[0].place, "p.toml:5");
  EXPECT_EQ(std::get<Repeat>(program.frames[1].what).count, 3);
  EXPECT_EQ(std::get<Move>(program.frames[2].what).to, (programs::Point{std::nullopt, 0.5}));
  EXPECT_TRUE(std::get<Move>(program.frames[2].what).relative);
  EXPECT_EQ(std::get<Line>(program.frames[3].what).points[1], (programs::Point{0.0, 1.25}));
  EXPECT_EQ(std::get<Pulse>(program.frames[4].what).us, 50u);
  EXPECT_EQ(std::get<Wait>(program.frames[5].what).us, 250'000u);
  const auto& wait = std::get<WaitInput>(program.frames[6].what);
  EXPECT_EQ(wait.input, 19);
  EXPECT_FALSE(wait.active);
  EXPECT_EQ(wait.longest_us, 10'000'000u);
  const auto& file = std::get<Line>(program.frames[8].what);
  EXPECT_EQ(file.points, (std::vector<programs::Point>{{std::nullopt, 1.0}, {std::nullopt, 2.5}}));
}

TEST_F(ProgramFiles, AreRefusedWithPlaceAndRemedy) {
  const std::string head = "motors = [\"x\", \"theta\"]\n";
  const struct {
    const char* what;
    std::string text;
    const char* says;
  } kCases[] = {
      {"no motors", "[[frame]]\nwait_s = 1\n", "motors"},
      {"none", "motors = []\n", "allowed: 1 to 16"},
      {"one twice", "motors = [\"x\", \"x\"]\n", "named twice"},
      {"no frames", head, "frame"},
      {"an unknown key", head + "speed = 3\n[[frame]]\nwait_s = 1\n", "speed"},
      {"a unit", head + "unit = \"mm\"\n[[frame]]\nwait_s = 1\n", "\"user\" or \"steps\""},
      {"no frame", head + "[[frame]]\n", "one of move_to"},
      {"two frames in one", head + "[[frame]]\nwait_s = 1\nnext = true\n", "next"},
      {"too few numbers", head + "[[frame]]\nmove_to = [1]\n", "one for each of `motors`"},
      {"another motor", head + "[[frame]]\nmove_to = { y = 1 }\n", "\"y\" is not in `motors`"},
      {"nobody", head + "[[frame]]\nmove_to = { }\n", "one or more of `motors`"},
      {"no number", head + "[[frame]]\nmove_to = [1, \"2\"]\n", "move_to[1]"},
      {"not finite", head + "[[frame]]\nmove_to = [1, inf]\n", "move_to[1]"},
      {"no speed", head + "[[frame]]\nmove_to = [1, 2]\nspeed = 0\n", "above 0"},
      {"no point", head + "[[frame]]\nline_to = []\n", "1 to 65535"},
      {"a number as point", head + "[[frame]]\nline_to = [1, 2]\n", "a list of numbers"},
      {"too long", head + "[[frame]]\nwait_s = 3601\n", "0.000001 to 3600 s"},
      {"too short", head + "[[frame]]\nwait_s = 1e-7\n", "0.000001 to 3600 s"},
      {"not finite", head + "[[frame]]\nwait_s = nan\n", "wait_s"},
      {"input 16", head + "[[frame]]\nwait_input = 16\n", "0..15"},
      {"an unknown input", head + "[[frame]]\nwait_input = \"home\"\n", "\"trigger\""},
      {"an end of a move to a place", head + "[[frame]]\nmove_to = { x = 1 }\nuntil_input = 1\n",
       "until_input"},
      {"an end of two motors", head + "[[frame]]\nmove_by = [1, 1]\nuntil_input = 1\n",
       "one motor"},
      {"an end by no input", head + "[[frame]]\nmove_by = { x = 1 }\nuntil_input = 16\n", "0..15"},
      {"what follows no end", head + "[[frame]]\nmove_by = { x = 1 }\nafter = 1\n",
       "add until_input, or remove it"},
      {"a level of no input", head + "[[frame]]\nmove_by = { x = 1 }\nactive = true\n",
       "add until_input, or remove it"},
      {"back after the end", head + "[[frame]]\nmove_by = { x = 1 }\nuntil_input = 1\nafter = -1\n",
       "0 or more"},
      {"a pulse of two seconds", head + "[[frame]]\npulse_us = 2000000\n", "1000000"},
      {"too often", head + "[[frame]]\nrepeat = 65536\n", "65535"},
      {"next without repeat", head + "[[frame]]\nnext = true\n", "p.toml:2: `next` without"},
      {"repeat without next", head + "[[frame]]\nrepeat = 2\n", "has no `next`"},
      {"not next", head + "[[frame]]\nnext = false\n", "allowed: true"},
      {"no TOML", head + "[[frame]\n", "p.toml:2"},
      {"no such law", head + "[[frame]]\nline_by = [[1, 1]]\nlaw = \"printed\"\n",
       "allowed: \"leading\", \"elementary\""},
      {"a feed of the other law", head + "[[frame]]\nline_by = [[1, 1]]\nfeed = 2\n",
       "is of lines with law = \"elementary\""},
      {"no feed", head + "[[frame]]\nline_by = [[1, 1]]\nlaw = \"elementary\"\nfeed = 0\n",
       "allowed: a feed above 0"},
      {"a law of a move", head + "[[frame]]\nmove_by = [1, 1]\nlaw = \"leading\"\n", "law"},
      {"a file that is away", head + "[[frame]]\nline_to = \"a.csv\"\n", "no file"},
  };
  for (const auto& one : kCases) {
    SCOPED_TRACE(one.what);
    const auto program = parse(one.text);
    EXPECT_THAT(error_of(program), HasSubstr(one.says));
  }
  std::string deep = head;
  for (int i = 0; i < 5; ++i) deep += "[[frame]]\nrepeat = 2\n";
  for (int i = 0; i < 5; ++i) deep += "[[frame]]\nnext = true\n";
  EXPECT_THAT(error_of(parse(deep)), HasSubstr("p.toml:10: more than 4"));
}

TEST_F(ProgramFiles, MayBeginAtPowerOn) {
  const std::string head = "motors = [\"x\", \"theta\"]\nwithout_host = true\nkept = true\n";
  const std::string frame = "[[frame]]\nmove_by = [1, 2]\n";
  const auto program =
      good(parse(head + "at_power_on = true\nrange = { theta = [-0.5, 3], x = [0, 1] }\n" + frame));
  EXPECT_TRUE(program.kept);
  EXPECT_TRUE(program.at_power_on);
  ASSERT_EQ(program.range.size(), 2u);
  EXPECT_EQ(program.range[0].most, 1.0);
  EXPECT_EQ(program.range[1].least, -0.5);
  EXPECT_TRUE(parse(head + frame)) << "one that is only kept";
  const std::string power = "at_power_on = true\n";
  const std::string range = "range = { theta = [-1, 1], x = [-1, 1] }\n";
  const struct {
    std::string text;
    const char* error;
  } refused[] = {
      {head + power + frame, "p.toml:4:15: at_power_on: needs a range"},
      {head + range + frame, "p.toml:4:9: range: is for at_power_on = true"},
      {head + power + "range = { theta = [-1, 1] }\n" + frame, "\"x\" has no two distances"},
      {head + power + "range = { theta = [-1, 1], x = [1, 2] }\n" + frame,
       "that of \"x\" does not have 0"},
      {head + power + "range = { theta = [-1, 1], x = [1] }\n" + frame,
       "\"x\" has no two distances"},
      {head + power + "range = { theta = [-1, 1], x = [-1, 1], y = [0, 0] }\n" + frame,
       "\"y\" is not in `motors`"},
      {head + power + range + "[[frame]]\nmove_to = [1, 2]\n", "p.toml:6: a position"},
      {head + power + range + "[[frame]]\nline_to = [[1, 2]]\n", "p.toml:6: a position"},
      {"motors = [\"x\", \"theta\"]\nkept = true\n" + power + range + frame,
       "true wants without_host = true as well"},
      {"motors = [\"x\", \"theta\"]\nwithout_host = true\n" + power + range + frame,
       "true wants kept = true as well"},
  };
  for (const auto& one : refused) {
    const auto parsed = parse(one.text);
    EXPECT_THAT(error_of(parsed), HasSubstr(one.error));
  }
}

}  // namespace
}  // namespace bushd::test
