// Travels, and codes as they are written, in programs: from the text to the bytes and the dry run.
#include "engine/program.h"
#include "programs/program_places.h"

namespace bushd::test {
namespace {

const std::string kCodes =
    "codes = { time_unit_ns = 50000, accel = [300, 100, 200], cruise = 90, decel = [400] }\n";

class TravelFiles : public ProgramPlaces {
 protected:
  std::string refusal(const std::string& text) {
    const auto program = parse(text);
    if (!program) return program.error().text();
    const auto bytes = programs::compile(*program, mcu_, std::span(motors_).first(1));
    if (!bytes) return bytes.error().text();
    return error_of(programs::rehearse(*program, mcu_, std::span(motors_).first(1), *bytes));
  }
};

TEST_F(TravelFiles, ATravelHasItsBytes) {
  const auto bytes = good(compile(
      parsed("[[frame]]\ntravel_by = { x = -60 }\nafter_edge_s = 0.15\nreturn_s = 0.3\n[[frame]]\n"
             "travel_by = { theta = 1 }\n")));
  const std::vector<std::uint8_t> expected = {
      10, 0x20, 0, 1, 1, 0xF0, 0x49, 2, 0, 0xE0, 0x93, 4, 0, 0xC4, 0xFF, 0xFF, 0xFF,  //
      10, 4,    0, 3, 0, 0,    0,    0, 0, 50,   0,    0, 0, 0x90, 1,    0,    0,     //
      0};
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin() + 22, bytes.end()), expected);
  bushd_program read;
  EXPECT_EQ(bushd_program_check(bytes.data(), bytes.size(), 0x24, &read), BUSHD_OK);
}

TEST_F(TravelFiles, ADryRunGoesThereAndBack) {
  const auto told = good(rehearse("[[frame]]\ntravel_by = { x = 3 }\nreturn_s = 0.0256\n"));
  // Delays 250, 200, 240 units of 40 us are 27.6 ms.
  EXPECT_EQ(told.ticks, 2u * 11 + 10);
  EXPECT_EQ(told.motors[0].most_steps, 3);
  EXPECT_EQ(told.motors[0].end_steps, 0);
  EXPECT_EQ(told.motors[0].edges, 6u);
  EXPECT_FALSE(told.endless);
  const auto edges = good(rehearse("[[frame]]\ntravel_by = { x = 3 }\nafter_edge_s = 0.0256\n"));
  EXPECT_TRUE(edges.endless);
  EXPECT_TRUE(edges.waits_for_inputs);
  EXPECT_THAT(error_of(rehearse("[[frame]]\ntravel_by = { x = 6001 }\n")),
              HasSubstr("may go from"));
}

TEST_F(TravelFiles, CodesAreMadeAsTheyAreWritten) {
  Law law;
  law.accel = {300, 100, 200};
  law.decel = {400};
  law.cruise = 90;
  law.unit_ns = 50'000;
  const TestTable written(law, true);
  mcu_.line_table = written.view();
  mcu_.line_bank = 8;
  const auto program = good(parse("motors = [\"x\"]\n" + kCodes +
                                  "[[frame]]\nline_by = [[-6]]\n[[frame]]\ntravel_by = [4]\n"));
  const auto one = std::span(motors_).first(1);
  const auto bytes = good(programs::compile(program, mcu_, one));
  const std::vector<std::uint8_t> expected = {
      4,  0x20, 0, 8, 0, 0, 1, 0, 0xFA, 0xFF, 0xFF, 0xFF,                 //
      10, 0x20, 0, 8, 0, 0, 0, 0, 0,    50,   0,    0,    0, 4, 0, 0, 0,  //
      0};
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin() + 13, bytes.end()), expected);
  const auto told = good(programs::rehearse(program, mcu_, one, bytes));
  // 300 + 100 + 200 + 90 + 90 + 400 units are 59 ms; 300 + 100 + 200 + 400 there and back, 50 ms.
  EXPECT_EQ(told.ticks, 24u + 2 * 20 + 1);
}

TEST_F(TravelFiles, CodesOfATableHaveItsRule) {
  const auto told = [this](const char* steps) {
    const auto program =
        parse(std::string(
                  "motors = [\"x\"]\ncodes = { time_unit_ns = 40000, accel = [250, 200, 150, 110], "
                  "cruise = 100, decel = [160, 240] }\n[[frame]]\nline_by = [[") +
              steps + "]]\n");
    EXPECT_TRUE(program) << program.error().text();
    const auto one = std::span(motors_).first(1);
    const auto bytes = programs::compile(*program, mcu_, one);
    return programs::rehearse(*program, mcu_, one, *bytes)->ticks;
  };
  // 250 + 200 + 240 and 250 + 200 + 150 + 110 + 3 x 100 + 160 + 240 units of 40 us.
  EXPECT_EQ(told("3"), 11u);
  EXPECT_EQ(told("9"), 23u);
}

TEST_F(TravelFiles, AreRefusedWithPlaceAndRemedy) {
  const std::string one = "motors = [\"x\"]\n";
  const std::string two = "motors = [\"x\", \"theta\"]\n";
  const std::string line = "[[frame]]\nline_by = [[4]]\n";
  const auto with = [&](const char* codes) { return one + "codes = " + codes + "\n" + line; };
  const struct {
    std::string text;
    const char* says;
  } kCases[] = {
      {two + "[[frame]]\ntravel_by = [1, 2]\n", "allowed: one, by its name"},
      {one + "[[frame]]\ntravel_by = [0]\n", "travels by no step"},
      {one + "[[frame]]\ntravel_by = [1]\nreturn_s = 2\n", "0.00005 to 1.65 s"},
      {one + "[[frame]]\ntravel_by = [1]\nspeed = 2\n", "speed"},
      {two + kCodes + line, "programs of one motor"},
      {with("{ time_unit_ns = 1000, accel = [3, 0], decel = [1] }"), "1..65535"},
      {with("{ time_unit_ns = 0, accel = [3, 1], decel = [1] }"), "time_unit_ns"},
      {with("{ time_unit_ns = 1000, accel = [3, 4] }"), "decel"},
      {with("{ time_unit_ns = 1000, accel = [3, 4], decel = [4], last = 1 }"), "last"},
      {one + kCodes + "[[frame]]\nline_by = [[3]]\n", "3 steps, but `codes` has 4 delays"},
      {one + kCodes + "[[frame]]\ntravel_by = [3]\n", "3 steps, but `codes` has 4 delays"},
      {one + kCodes + "[[frame]]\nline_by = [[4]]\nspeed = 4\n", "no `speed` beside `codes`"},
  };
  Law law;
  law.accel = {300, 100, 200};
  law.decel = {400};
  law.cruise = 90;
  law.unit_ns = 50'000;
  const TestTable written(law, true);
  mcu_.line_table = written.view();
  for (const auto& one_case : kCases) {
    EXPECT_THAT(refusal(one_case.text), HasSubstr(one_case.says))
        << one_case.text << refusal(one_case.text);
  }
  mcu_.has_trigger = false;
  EXPECT_THAT(refusal(one + "[[frame]]\ntravel_by = [1]\nafter_edge_s = 1\n"),
              HasSubstr("no trigger input"));
  mcu_.line_table = nullptr;
  EXPECT_THAT(refusal(one + kCodes + "[[frame]]\ntravel_by = [4]\n"),
              HasSubstr("no table bank left"));
  mcu_.travels = false;
  EXPECT_THAT(refusal(one + "[[frame]]\ntravel_by = [1]\n"), HasSubstr("does not travel"));
}

}  // namespace
}  // namespace bushd::test
