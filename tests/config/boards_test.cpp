// [[bus]] of kind "commutator", and [[keypad]].
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "config/config_file.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

const std::string kBoard =
    "[[bus]]\nname = \"board\"\nkind = \"commutator\"\nport = \"/dev/a\"\nbaud = 9600\n"
    "start_hz = 100\n"
    "[[group]]\nname = \"axes\"\ntable = \"own\"\n"
    "[[motor]]\nname = \"m0\"\nmcu = \"board\"\noutput = 7\ngroup = \"axes\"\n";
const std::string kKeypad = kBoard + "[[keypad]]\nport = \"/dev/b\"\nmotor = \"m0\"\n";

TEST(ConfigBoards, BoardStandsForAnMcuOfItsName) {
  const auto config = loaded(kBoard);
  EXPECT_EQ(config.buses[0].kind, config::BusKind::kCommutator);
  EXPECT_EQ(config.buses[0].start_hz, 100u);
  EXPECT_EQ(config.buses[0].answer_ms, 100u);
  ASSERT_EQ(config.mcus.size(), 1u);
  EXPECT_EQ(config.mcus[0].id, "board");
  EXPECT_TRUE(ConfigFile(kBoard + "limit_action = \"immediate\"\n").load());
}

const std::string kConverter = "converter = { max_hz = 2500, max_code = 250 }\n";

TEST(ConfigBoards, BoardMayHaveAConverterInPlaceOfDelayCodes) {
  const std::string text = replaced(kBoard, "start_hz = 100\n", kConverter);
  const auto config = loaded(text);
  EXPECT_EQ(config.buses[0].converter, (Converter{.max_hz = 2500, .max_code = 250}));
  EXPECT_EQ(config.buses[0].start_hz, 0u);
  EXPECT_EQ(config.buses[0].answer_ms, 100u);
  const auto refused = [&text](const std::string& from, const std::string& to) {
    return error_of(replaced(text, from, to));
  };
  EXPECT_THAT(refused("baud", "start_hz = 100\nbaud"), HasSubstr("Remove one of both lines"));
  EXPECT_THAT(refused(kConverter, "converter = 5\n"),
              HasSubstr("a table such as { max_hz = 2500, max_code = 250 }"));
  EXPECT_THAT(refused("max_hz = 2500, ", ""), HasSubstr("max_hz"));
  EXPECT_THAT(refused("2500", "10001"), HasSubstr("2..10000 Hz"));
  EXPECT_THAT(refused("250 }", "256 }"), HasSubstr("1..255"));
  EXPECT_THAT(refused("250 }", "250, gain = 1 }"), HasSubstr("unknown key"));
  // The table's fastest code is 10 of 40 us.
  EXPECT_THAT(refused("2500", "2499"),
              HasSubstr("has steps 400000 ns apart; allowed: 400161 ns and more, one period at "
                        "max_hz = 2499 of the converter of board \"board\""));
  EXPECT_THAT(
      refused("max_hz = 2500, max_code = 250", "max_hz = 400, max_code = 201"),
      HasSubstr("is 400 Hz, which gives code 1 less than 2 Hz; allowed with max_code = 201: "
                "402 Hz and more. Use a smaller max_code"));
}

TEST(ConfigBoards, WhatABoardDoesNotHaveIsRefused) {
  EXPECT_THAT(error_of(replaced(kBoard, "start_hz = 100\n", "")), HasSubstr("start_hz"));
  EXPECT_THAT(error_of(replaced(kBoard, "= 100\n", "= 101\n")), HasSubstr("1..100 Hz"));
  EXPECT_THAT(
      error_of(replaced(kBoard, "baud", "tick_us = 2560\nbaud")),
      HasSubstr(
          "unknown key; allowed here: name, kind, port, baud, start_hz, converter, answer_ms"));
  EXPECT_THAT(error_of(replaced(kBoard, "output = 7", "output = 8")),
              HasSubstr("is 8; allowed: 0..7 on commutator board \"board\""));
  EXPECT_THAT(error_of(replaced(kBoard, "baud", "emergency_stop = \"disable\"\nbaud")),
              HasSubstr("nothing on a bus of this kind can disable drivers; allowed: \"ramp\""));
  EXPECT_THAT(error_of(kBoard + "limit = \"both\"\n"), HasSubstr("limit switches of its own"));
  EXPECT_THAT(error_of(kBoard + "home = { direction = \"negative\", most_steps = 5 }\n"),
              HasSubstr("motor[0].home"));
  EXPECT_THAT(error_of("[[mcu]]\nbus = \"board\"\naddress = 1\n" + kBoard),
              HasSubstr("Remove this section; its motors have mcu = \"board\""));
  // The table's fastest code is 10 of 40 us.
  EXPECT_EQ(error_of(replaced(kBoard, "= 100\n", "= 10\n")), "no error");
  EXPECT_THAT(error_of(replaced(kBoard, "= 100\n", "= 9\n")),
              HasSubstr("has steps 400000 ns apart; allowed: 444444 ns and more"));
  EXPECT_THAT(error_of(replaced(kBoard, "\"commutator\"", "\"can\"")),
              HasSubstr("allowed: \"rs485\", \"serial-pulse\" or \"commutator\""));
}

TEST(ConfigKeypads, KeysHaveDefaults) {
  const auto config = loaded(kKeypad);
  ASSERT_EQ(config.keypads.size(), 1u);
  const config::Keypad& keypad = config.keypads[0];
  EXPECT_EQ(keypad.baud, 625u);
  EXPECT_FALSE(keypad.latched);
  EXPECT_EQ(keypad.delay_us, 3'000u);
  EXPECT_EQ(keypad.keepalive_ms, 500u);
  EXPECT_TRUE(ConfigFile(kKeypad + "mode = \"latch\"\n").load()->keypads[0].latched);
}

TEST(ConfigKeypads, WhatCannotBeIsRefused) {
  EXPECT_THAT(error_of(replaced(kKeypad, "motor = \"m0\"", "motor = \"m1\"")),
              HasSubstr("keypad[0].motor: is \"m1\"; allowed: the name of a motor"));
  EXPECT_THAT(error_of(replaced(kKeypad, "/dev/b", "/dev/a")), HasSubstr("is already taken"));
  for (const char* spelling : {"/dev/../dev/a", "//dev/./a"}) {
    EXPECT_THAT(error_of(replaced(kKeypad, "/dev/b", spelling)),
                HasSubstr("is already taken: it is, or may be, \"/dev/a\" of bus \"board\""))
        << spelling;
  }
  EXPECT_THAT(
      error_of(replaced(replaced(kKeypad, "/dev/a", "/dev/tty[ab]"), "/dev/b", "/dev/ttya")),
      HasSubstr("is already taken: it is, or may be, \"/dev/tty[ab]\""));
  EXPECT_THAT(error_of(kKeypad + "[[keypad]]\nport = \"/dev/../dev/b\"\nmotor = \"m0\"\n"),
              HasSubstr("\"/dev/b\" of another [[keypad]]"));
  EXPECT_THAT(error_of(kKeypad + "mode = \"toggle\"\n"),
              HasSubstr("allowed: \"hold\" or \"latch\""));
  EXPECT_THAT(error_of(kKeypad + "baud = 1\n"), HasSubstr("50..4000000"));
  EXPECT_THAT(error_of(kKeypad + "keepalive_ms = 49\n"), HasSubstr("50..10000"));
  EXPECT_THAT(error_of(kKeypad + "slowest_us = 2000\n"),
              HasSubstr("slowest_us = 2000 is below delay_us = 3000"));
  EXPECT_THAT(error_of(kKeypad + "speed = 3\n"), HasSubstr("unknown key"));
}

}  // namespace
}  // namespace bushd::test
