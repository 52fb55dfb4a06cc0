#include <gmock/gmock.h>

#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::loaded;
using testing::HasSubstr;

const std::string kPort =
    "[[bus]]\n"
    "name = \"com1\"\n"
    "kind = \"serial-pulse\"\n"
    "port = \"/dev/no-such-port\"\n"
    "direction_line = \"rts\"\n"
    "inputs = { home = \"cd\", positive = { line = \"dsr\", active = \"off\" } }\n"
    "[[group]]\n"
    "name = \"slits\"\n"
    "table = \"own\"\n"
    "[[motor]]\n"
    "name = \"x\"\n"
    "mcu = \"com1\"\n"
    "group = \"slits\"\n";

std::string refusal(const std::string& from, const std::string& to) {
  return test::error_of(test::replaced(kPort, from, to));
}

TEST(SerialPulse, IsABusWithOneMotor) {
  const auto config = loaded(kPort);
  EXPECT_EQ(config.buses[0].kind, BusKind::kSerialPulse);
  EXPECT_TRUE(config.buses[0].serial_pulse.rts);
  EXPECT_EQ(config.buses[0].tick_us, 2560u);
  ASSERT_EQ(config.mcus.size(), 1u);
  EXPECT_EQ(config.mcus[0].id, "com1");
  const Motor& motor = config.motors[0];
  EXPECT_EQ(motor.output.value, 0);
  EXPECT_EQ(motor.inputs.home, Input{.number = 0});
  EXPECT_EQ(motor.inputs.positive, (Input{.number = 1, .active_open = true}));
  EXPECT_FALSE(motor.inputs.negative);
}

TEST(SerialPulse, IsRefusedWithCauseAndRemedy) {
  EXPECT_THAT(refusal("\"rts\"", "\"txd\""), HasSubstr("is \"txd\"; allowed: \"dtr\" or \"rts\""));
  EXPECT_THAT(refusal("direction_line = \"rts\"\n", ""), HasSubstr("direction_line: is missing"));
  EXPECT_THAT(refusal("direction_line", "baud = 9600\ndirection_line"), HasSubstr("unknown key"));
  EXPECT_THAT(refusal("home = \"cd\"", "home = \"rxd\""), HasSubstr("is \"rxd\"; allowed: \"cd\""));
  EXPECT_THAT(refusal("home = \"cd\"", "home = 3"), HasSubstr("\"cd\", \"dsr\", \"cts\", \"ri\""));
  EXPECT_THAT(refusal("home = \"cd\"", "home = \"dsr\""), HasSubstr("the other level"));
  EXPECT_THAT(refusal("mcu = \"com1\"\n", "mcu = \"com1\"\noutput = 0\n"),
              HasSubstr("does not apply to the motor of bus \"com1\""));
  EXPECT_THAT(refusal("mcu = \"com1\"\n", "mcu = \"com1\"\nlimit = \"both\"\n"),
              HasSubstr("switches are named by `inputs` of the bus"));
  EXPECT_THAT(refusal("[[group]]", "[[mcu]]\nbus = \"com1\"\naddress = 1\n[[group]]"),
              HasSubstr("which has no MCU; remove this section"));
  EXPECT_THAT(refusal("[[motor]]\n",
                      "[[motor]]\nname = \"y\"\nmcu = \"com1\"\ngroup = \"slits\"\n[[motor]]\n"),
              HasSubstr("the one motor of bus \"com1\" is already taken in line 12"));
  EXPECT_EQ(refusal("home = \"cd\", ", ""), "no error");
  EXPECT_EQ(refusal("mcu = \"com1\"\n", "mcu = \"com1\"\n"), "no error");
  EXPECT_THAT(
      refusal("home = \"cd\", positive = { line = \"dsr\", active = \"off\" } }\n[[group]]\n"
              "name = \"slits\"\ntable = \"own\"\n[[motor]]\n",
              "positive = \"dsr\" }\n[[group]]\nname = \"slits\"\ntable = \"own\"\n"
              "[[motor]]\nhome = { direction = \"negative\", most_steps = 10 }\n"),
      HasSubstr("needs a home switch; add inputs = { home = \"cd\" } to bus \"com1\""));
}

TEST(SerialPulse, DirectionLineMayBeOffInThePositiveDirection) {
  const auto with = [](const std::string& line) {
    return test::replaced(kPort, "direction_line = \"rts\"", "direction_line = " + line);
  };
  for (const bool off : {false, true}) {
    const auto config =
        loaded(with(std::string("{ line = \"dtr\", active = \"") + (off ? "off" : "on") + "\" }"));
    EXPECT_FALSE(config.buses[0].serial_pulse.rts);
    EXPECT_EQ(config.buses[0].serial_pulse.positive_off, off);
  }
  EXPECT_THAT(
      refusal("direction_line = \"rts\"", "direction_line = \"rts\"\nemergency_stop = \"disable\""),
      HasSubstr("nothing on a bus of this kind can disable drivers"));
  EXPECT_THAT(
      refusal("direction_line = \"rts\"", "direction_line = { line = \"dtr\", active = \"low\" }"),
      HasSubstr("direction_line.active: is \"low\"; allowed: \"on\" or \"off\""));
  EXPECT_THAT(refusal("group = \"slits\"\n", "group = \"slits\"\ndirection_active = \"low\"\n"),
              HasSubstr("direction_line = { line = \"dtr\", active = \"off\" }"));
}

}  // namespace
}  // namespace bushd::config
