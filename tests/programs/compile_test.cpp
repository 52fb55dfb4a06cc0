// Programs as bytes: every byte by hand, and what no MCU could carry out.
#include "engine/program.h"
#include "programs/program_places.h"

namespace bushd::test {
namespace {

class CompiledPrograms : public ProgramPlaces {};

TEST_F(CompiledPrograms, HaveTheirBytes) {
  programs::Program program = parsed(R"(
[[frame]]
move_to = { theta = 2.5 }
speed = 2
[[frame]]
line_by = [[3, -1], [-3, 0.5]]
[[frame]]
wait_input = 3
longest_s = 1
[[frame]]
repeat = 513
[[frame]]
pulse_us = 258
[[frame]]
next = true
)");
  program.without_host = true;
  const auto bytes = good(compile(program));
  const std::vector<std::uint8_t> expected = {
      1,    1,    0x24, 0,                                // motors 2 and 5
      3,    0x78, 0xEC, 0xFF, 0xFF, 0x70, 0x17, 0,    0,  // theta first: its output is lower
      1,    0x78, 0xEC, 0xFF, 0xFF, 0x70, 0x17, 0,    0,  //
      1,    4,    0,    0xE8, 3,    0,    0,    32,   0,  // 1000 steps; 800 steps/s are 31.25 units
      4,    0x24, 0,    7,    0,    0,    2,    0,        //
      0x70, 0xFE, 0xFF, 0xFF, 3,    0,    0,    0,        // -400, 3
      200,  0,    0,    0,    0xFD, 0xFF, 0xFF, 0xFF,     //
      6,    3,    1,    0x40, 0x42, 0x0F, 0,              //
      8,    1,    2,                                      //
      7,    2,    1,    0,    0,                          //
      9,                                                  //
      0};
  EXPECT_EQ(bytes, expected);
  bushd_program read;
  EXPECT_EQ(bushd_program_check(bytes.data(), bytes.size(), 0x24, &read), BUSHD_OK);
}

TEST_F(CompiledPrograms, AMoveMayEndByAnInput) {
  const auto bytes = good(compile(
      parsed("[[frame]]\nmove_by = { theta = -2 }\nuntil_input = \"trigger\"\nactive = false\n"
             "after = 0.5\nspeed = 2\n[[frame]]\nmove_by = { x = 7 }\nuntil_input = 3\n")));
  const std::vector<std::uint8_t> expected = {
      11, 4,    0, 19, 0, 200, 0, 0, 0, 0xE0, 0xFC, 0xFF, 0xFF, 32, 0,  //
      11, 0x20, 0, 3,  1, 0,   0, 0, 0, 7,    0,    0,    0,    0,  0,  //
      0};
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin() + 22, bytes.end()), expected);
  bushd_program read;
  EXPECT_EQ(bushd_program_check(bytes.data(), bytes.size(), 0x24, &read), BUSHD_OK);
}

TEST_F(CompiledPrograms, TellTheLawOfALineAndItsFeed) {
  const std::string line = "[[frame]]\nline_by = [[3, 1]]\nlaw = \"elementary\"\n";
  const std::size_t at = 4 + 18 + 3;
  auto bytes = compile(parsed(line));
  ASSERT_TRUE(bytes);
  EXPECT_EQ((*bytes)[at], 0x87);
  EXPECT_EQ((*bytes)[at + 1], 0);
  programs::Program in_steps = parsed(line + "feed = 100\n");
  in_steps.steps = true;
  bytes = compile(in_steps);
  ASSERT_TRUE(bytes);
  EXPECT_EQ((*bytes)[at + 1], 250) << "10 ms are so many units of 40 us";
  EXPECT_THAT(
      error_of(compile(parsed(line + "feed = 1\n"))),
      HasSubstr("400 per deg for motor \"theta\" and 1 per steps for motor \"x\": use speed"));
  motors_[0].coordinates = motors_[1].coordinates;
  bytes = compile(parsed(line + "feed = 1\n"));
  ASSERT_TRUE(bytes);
  EXPECT_EQ((*bytes)[at + 1], 63) << "400 steps/s";
  mcu_.elementary = false;
  EXPECT_THAT(error_of(compile(parsed(line))),
              HasSubstr("MCU 3 makes no lines by the elementary law"));
}

TEST_F(CompiledPrograms, KeepTheSpeedLimitsOfTheirMotors) {
  motors_[0].shortest_delay_ns = 5'000'001;  // 125 units, and a bit
  const auto bytes =
      compile(parsed("[[frame]]\nmove_by = { x = 1 }\n[[frame]]\nline_by = [[1, 1]]\n"));
  ASSERT_TRUE(bytes);
  EXPECT_EQ((*bytes)[4 + 18 + 3 + 4], 126);
  EXPECT_EQ((*bytes)[4 + 18 + 9 + 4], 126) << "of the line";
}

TEST_F(CompiledPrograms, MayBeInSteps) {
  programs::Program program = parsed("[[frame]]\nmove_to = [7, 9]\n");
  program.steps = true;
  const auto bytes = compile(program);
  ASSERT_TRUE(bytes);
  EXPECT_EQ((*bytes)[4 + 18 + 3], 9) << "theta";
  EXPECT_EQ((*bytes)[4 + 18 + 9], 7);
}

TEST_F(CompiledPrograms, AreRefusedWithTheFigure) {
  const auto refusal = [this](const std::string& frames, bool steps = false) {
    programs::Program program = parsed(frames);
    program.steps = steps;
    return error_of(compile(program));
  };
  const auto says = [](const std::string& text, const char* what) {
    EXPECT_THAT(text, HasSubstr(what));
  };
  says(refusal("[[frame]]\nmove_to = [1.5, 0]\n", true), "p.toml:2: motor \"x\": not a whole");
  says(refusal("[[frame]]\nmove_to = [1, 1e9]\n"), "p.toml:2: motor \"theta\"");
  says(refusal("[[frame]]\nmove_to = [1, 1]\nspeed = 0.0001\n"), "delays up to 65535");
  mcu_.line_table = nullptr;
  says(refusal("[[frame]]\nline_to = [[1, 1]]\n"), "no table bank left");
  mcu_.lines = false;
  says(refusal("[[frame]]\nline_to = [[1, 1]]\n"), "MCU 3 makes no lines");
  mcu_.memory = 30;
  says(refusal("[[frame]]\nmove_to = [1, 1]\n"), "has 38 bytes, but MCU 3 has memory for 30");
}

TEST_F(CompiledPrograms, ThatBeginAtPowerOnHaveRangesOfDistances) {
  const auto of_range = [&](const char* range) {
    auto program =
        parse(std::string("motors = [\"x\", \"theta\"]\nwithout_host = true\nkept = true\n"
                          "at_power_on = true\nrange = ") +
              range + "\n[[frame]]\nmove_by = [1, 1]\n");
    EXPECT_TRUE(program) << program.error().text();
    return compile(*program);
  };
  motors_[0].coordinates = *units::Coordinates::make(
      {.unit = "mm", .steps_per_unit = {10, 1}, .negative = true, .offset = 3});
  auto bytes = of_range("{ theta = [-2, 3], x = [-1, 5] }");
  ASSERT_TRUE(bytes) << bytes.error().text();
  bushd_program read;
  ASSERT_EQ(bushd_program_check(bytes->data(), bytes->size(), 0x24, &read), BUSHD_OK);
  EXPECT_EQ(read.flags,
            BUSHD_PROGRAM_WITHOUT_HOST | BUSHD_PROGRAM_KEPT | BUSHD_PROGRAM_AT_POWER_ON);
  const bushd_program_motor theta = bushd_program_part(&read, 0);
  EXPECT_EQ(theta.least_steps, -800);
  EXPECT_EQ(theta.most_steps, 1200);
  const bushd_program_motor x = bushd_program_part(&read, 1);
  EXPECT_EQ(x.least_steps, -50) << "its scale is turned, and an offset is none of a distance";
  EXPECT_EQ(x.most_steps, 10);
  bytes = of_range("{ theta = [-20, 20], x = [0, 0] }");  // 16000 steps
  EXPECT_THAT(error_of(bytes), HasSubstr("wider than the way between its soft limits"));
}

}  // namespace
}  // namespace bushd::test
