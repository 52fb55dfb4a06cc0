#include "config/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "config/config_file.h"
#include "source_path.h"
#include "tables/temp_directory.h"

namespace bushd::config {
namespace {

using test::ConfigFile;
using test::error_of;
using test::kGood;
using test::kTable;
using test::loaded;
using test::replaced;
using testing::HasSubstr;

TEST(Config, GoodFileIsReadInItsOrder) {
  const ConfigFile file(kGood);
  const auto config = file.load();
  ASSERT_TRUE(config.has_value()) << config.error().text();
  EXPECT_EQ(config->path, file.path());
  EXPECT_EQ(config->lcm.url, "memq://");
  EXPECT_EQ(config->lcm.prefix, "TEST");
  ASSERT_EQ(config->buses.size(), 2u);
  EXPECT_EQ(config->buses[0].name, "hall");
  EXPECT_EQ(config->buses[0].port, "/dev/no-such-port-a");
  EXPECT_EQ(config->buses[0].baud, 500000u);
  EXPECT_EQ(config->buses[0].tick_ns(), 2'560'000u);
  EXPECT_EQ(config->buses[0].format, BUSHD_FORMAT_FINE);
  EXPECT_EQ(config->buses[1].format, BUSHD_FORMAT_COARSE);
  ASSERT_EQ(config->mcus.size(), 2u);
  EXPECT_EQ(config->mcus[1].bus, BusId{1});
  EXPECT_EQ(config->mcus[1].address, McuAddress{255});
  EXPECT_EQ(config->mcus[1].id, "roof:255");
  ASSERT_EQ(config->groups.size(), 2u);
  EXPECT_EQ(config->groups[0].table->name(), "bushd2-constant");
  ASSERT_EQ(config->motors.size(), 2u);
  const Motor& slit = config->motors[1];
  EXPECT_EQ(slit.name, "slit");
  EXPECT_EQ(slit.output, Output{15});
  EXPECT_EQ(config->mcu_of(slit).id, "roof:255");
  EXPECT_EQ(config->bus_of(slit).name, "roof");
  EXPECT_EQ(config->group_of(slit).name, "slits");
  EXPECT_EQ(config->table_of(slit).name(), "t");
}

TEST(Config, AFileThatIsTooLargeIsNotMeasuredByTables) {
  const test::TempDirectory directory;
  const auto path = directory.write("bushd.toml", std::string(3 * 1024 * 1024, '\n'));
  const auto config = load(path);
  EXPECT_THAT(error_of(config), HasSubstr("larger than 2097152 bytes, and a configuration"));
}

TEST(Config, MannersOfABusHaveDefaults) {
  const auto plain = loaded(kGood);
  EXPECT_FALSE(plain.buses[0].table_runs);
  EXPECT_TRUE(plain.buses[0].table_ticks);
  EXPECT_EQ(plain.buses[0].emergency_stop, BUSHD_STOP_RAMP);
  const auto chosen = loaded(replaced(kGood, "format = \"fine\"\n",
                                      "format = \"fine\"\nmoves = \"table\"\n"
                                      "frames = \"ticks\"\nemergency_stop = \"immediate\"\n"));
  EXPECT_TRUE(chosen.buses[0].table_runs);
  EXPECT_FALSE(chosen.buses[0].table_ticks);
  EXPECT_EQ(chosen.buses[0].emergency_stop, BUSHD_STOP_IMMEDIATE);
  EXPECT_FALSE(chosen.buses[1].table_runs) << "of this bus only";
}

TEST(Config, MotorsMayHaveASwitchAndButtons) {
  const auto config = loaded(
      replaced(kGood, "output = 0\n",
               "output = 0\nlocal = true\nhome = { direction = \"positive\", position_steps = -7, "
               "most_steps = "
               "9000, slow_steps_per_s = 50, slow_most_steps = 400, at_start = true }\n"));
  const config::Motor& motor = config.motors[0];
  ASSERT_TRUE(motor.home);
  EXPECT_TRUE(motor.home->positive);
  EXPECT_EQ(motor.home->position_steps, -7);
  EXPECT_EQ(motor.home->most_steps, 9000u);
  EXPECT_EQ(motor.home->slow_steps_per_s, 50u);
  EXPECT_EQ(motor.home->slow_most_steps, 400u);
  EXPECT_TRUE(motor.home->at_start);
  EXPECT_TRUE(motor.drive.local);
  EXPECT_FALSE(motor.drive.keypad);
  EXPECT_FALSE(config.motors[1].home);
  EXPECT_FALSE(config.motors[1].drive.local);
  const auto keypad =
      loaded(replaced(replaced(kGood, "output = 0\n", "output = 0\nkeypad = true\n"),
                      "address = 1\n", "address = 1\nkeypad_ms = 0\n"));
  EXPECT_TRUE(keypad.motors[0].drive.keypad);
  EXPECT_EQ(keypad.mcus[0].keypad_ms, 0u);
  EXPECT_EQ(config.mcus[0].keypad_ms, 500u);
  const auto little = loaded(replaced(kGood, "output = 0\n",
                                      "output = 0\nhome = { direction = \"negative\", most_steps "
                                      "= 9 }\n"));
  EXPECT_FALSE(little.motors[0].home->positive);
  EXPECT_EQ(little.motors[0].home->position_steps, 0);
  EXPECT_EQ(little.motors[0].home->slow_steps_per_s, 100u);
  EXPECT_FALSE(little.motors[0].home->slow_most_steps);
  EXPECT_FALSE(little.motors[0].home->at_start);
  EXPECT_EQ(little.motors[0].home->order, 1);
  EXPECT_FALSE(little.motors[0].home->speed);
  EXPECT_FALSE(little.motors[0].home->then);
}

TEST(Config, HomedMotorsMayMoveOnWithinTheirSoftLimits) {
  const auto load = [](const std::string& then) {
    return ConfigFile(
               replaced(kGood, "output = 0\n",
                        "output = 0\nunit = \"mm\"\nsteps_per_unit = 400\ndirection = "
                        "\"negative\"\nsoft_limits = [-5, 3]\nhome = { direction = \"negative\", "
                        "most_steps = 9, order = 2, speed = 1.5, then = " +
                            then + " }\n"))
        .load();
  };
  const auto config = load("4.5");
  ASSERT_TRUE(config.has_value()) << config.error().text();
  EXPECT_EQ(config->motors[0].home->order, 2);
  EXPECT_EQ(config->motors[0].home->speed, 1.5);
  EXPECT_EQ(config->motors[0].home->then, 4.5);
  const auto beyond = load("5.5");
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().key, "motor[0].home.then");
  EXPECT_THAT(beyond.error().message,
              testing::HasSubstr("beyond the soft limits; allowed: -3.0000 mm to 5.0000 mm"));
}

TEST(Config, PortsMayBePatterns) {
  const auto config = loaded(replaced(replaced(kGood, "no-such-port-a", "no-such-port-a*"),
                                      "no-such-port-b", "no-such-port-b[0-9]"));
  EXPECT_EQ(config.buses[0].port, "/dev/no-such-port-a*");
}

TEST(Config, LcmHasDefaults) {
  const auto config = loaded(kGood.substr(kGood.find("[[bus]]")));
  EXPECT_EQ(config.lcm.url, "udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(config.lcm.prefix, "BUSHD");
  EXPECT_TRUE(config.lcm.commands);
}

TEST(Config, TheControlSocketIsWhereTheFileSays) {
  const auto plain = loaded(kGood);
  EXPECT_FALSE(plain.control.path);
  EXPECT_EQ(plain.control.group, "");
  const auto named = loaded("[control]\npath = \"/run/lab/control\"\ngroup = \"lab\"\n" + kGood);
  EXPECT_EQ(named.control.path, "/run/lab/control");
  EXPECT_EQ(named.control.group, "lab");
  const auto none = loaded("[control]\npath = \"\"\n" + kGood);
  EXPECT_EQ(none.control.path, "");
}

TEST(Config, PositionsAreKeptWhereTheFileSays) {
  const auto plain = loaded(kGood);
  EXPECT_FALSE(plain.state.path);
  EXPECT_TRUE(plain.state.required);
  EXPECT_FALSE(plain.motors[1].restored_refused);
  const auto named = loaded("[state]\npath = \"/srv/positions\"\nrequired = false\n" + kGood +
                            "restored = \"refuse\"\n");
  EXPECT_EQ(named.state.path, "/srv/positions");
  EXPECT_FALSE(named.state.required);
  EXPECT_TRUE(named.motors[1].restored_refused);
}

TEST(Config, LcmMayOnlyPublish) {
  const auto config = loaded(replaced(kGood, "url =", "commands = false\nurl ="));
  EXPECT_FALSE(config.lcm.commands);
}

TEST(Config, WithoutAMotorThereIsNothingToDo) {
  const std::string bus =
      "[[bus]]\nname='b'\nport='p'\nbaud=500000\ntick_us=20000\nformat='coarse'\n"
      "[[mcu]]\nbus='b'\naddress=1\n";
  EXPECT_THAT(error_of(bus), HasSubstr("motor"));
  const auto one = loaded(bus +
                          "[[group]]\nname='g'\ntable='own'\n"
                          "[[motor]]\nname='m'\nmcu='b:1'\noutput=0\ngroup='g'\n");
  EXPECT_EQ(one.motors.size(), 1u);
}

TEST(Config, GroupsWithTheSameTableShareIt) {
  const auto config = loaded(replaced(kGood, "\"bushd2-constant\"", "\"own\""));
  EXPECT_EQ(config.groups[0].table, config.groups[1].table);
}

TEST(Config, TablesAreLookedUpBesideTheFileThenInItsTablesThenAmongTheShipped) {
  const ConfigFile file(kGood);
  EXPECT_EQ(file.load()->groups[0].table->path(), test::source_path("tables/bushd2-constant.toml"));
  const auto below = file.directory().write("tables/bushd2-constant.toml", kTable);
  EXPECT_EQ(file.load()->groups[0].table->path(), below.string());
  const auto beside = file.directory().write("bushd2-constant.toml", kTable);
  EXPECT_EQ(file.load()->groups[0].table->path(), beside.string());
}

// A shipped table of that name would be taken for the one that somebody has put there.
TEST(Config, ATableThatCannotBeLookedAtIsNotPassedOver) {
  const ConfigFile file(kGood);
  const auto& folder = file.directory().path();
  std::filesystem::create_symlink("nowhere", folder / "tables");
  EXPECT_THAT(file.error(), HasSubstr("is a link to nothing"));
  std::filesystem::remove(folder / "tables");
  file.directory().write("tables", "a file");
  EXPECT_THAT(file.error(), HasSubstr("is no folder"));
  std::filesystem::remove(folder / "tables");
  std::filesystem::create_symlink("nowhere.toml", folder / "bushd2-constant.toml");
  EXPECT_THAT(file.error(), HasSubstr("is a link to nothing"));
  std::filesystem::remove(folder / "bushd2-constant.toml");
  std::filesystem::create_symlink("loop", folder / "loop");
  std::filesystem::create_symlink("loop", folder / "tables");
  EXPECT_THAT(file.error(), HasSubstr("cannot be read"));
}

TEST(Config, ExampleOfTheDocumentationIsGood) {
  std::ifstream page(test::source_path("docs/configuration.md"));
  const std::string text{std::istreambuf_iterator<char>(page), std::istreambuf_iterator<char>()};
  const std::size_t from = text.find("```toml\n") + 8;
  const auto config = loaded(text.substr(from, text.find("```", from) - from));
  EXPECT_EQ(config.motors.size(), 1u);
}

struct Refusal {
  const char* what;
  std::string text;
  int line;
  const char* key;
  const char* message;
};

void PrintTo(const Refusal& refusal, std::ostream* out) {
  *out << refusal.what;
}

class ConfigRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(ConfigRefusal, NamesFileLineKeyAndWhatIsAllowed) {
  const ConfigFile file(GetParam().text);
  const auto config = file.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().file, file.path());
  EXPECT_EQ(config.error().line, GetParam().line) << config.error().text();
  EXPECT_EQ(config.error().key, GetParam().key) << config.error().text();
  EXPECT_THAT(config.error().message, HasSubstr(GetParam().message));
}

Refusal change(const char* what, const std::string& from, const std::string& to, int line,
               const char* key, const char* message) {
  return {what, replaced(kGood, from, to), line, key, message};
}

const auto kNames = [](const auto& tested) { return std::string(tested.param.what); };

Refusal state(const char* what, const std::string& lines, const char* key, const char* message) {
  return {what, "[state]\n" + lines + "\n" + kGood, 2, key, message};
}

INSTANTIATE_TEST_SUITE_P(
    State, ConfigRefusal,
    testing::Values(state("UnknownKey", "folder = 1", "state.folder",
                          "allowed here: path, required"),
                    state("RelativePath", "path = \"state\"", "state.path", "an absolute path"),
                    state("RequiredIsWord", "required = \"yes\"", "state.required", "allowed"),
                    Refusal{"Value", "state = 3\n", 1, "state", "one [state]"},
                    Refusal{"Restored", kGood + "restored = \"yes\"\n", 38, "motor[1].restored",
                            "\"allow\" or \"refuse\""}),
    kNames);

INSTANTIATE_TEST_SUITE_P(
    Lcm, ConfigRefusal,
    testing::Values(change("UnknownKey", "url =", "uri =", 2, "lcm.uri",
                           "unknown key; allowed here: url, prefix, commands"),
                    change("UrlIsNumber", "\"memq://\"", "7667", 2, "lcm.url",
                           "is 7667; allowed: a URL"),
                    change("UrlOfUnknownProvider", "memq://", "http://x", 2, "lcm.url", "udpm://"),
                    change("Prefix", "\"TEST\"", "\"A B\"", 3, "lcm.prefix", "1..48 characters"),
                    change("Commands", "url =", "commands = 1\nurl =", 2, "lcm.commands",
                           "is 1; allowed: true or false"),
                    change("Array", "[lcm]", "[[lcm]]", 1, "lcm", "one [lcm]"),
                    Refusal{"Value", "lcm = 3\n", 1, "lcm", "one [lcm]"}),
    kNames);

Refusal control(const char* what, const std::string& lines, const char* key, const char* message) {
  return {what, "[control]\n" + lines + "\n" + kGood, 2, key, message};
}

INSTANTIATE_TEST_SUITE_P(
    Control, ConfigRefusal,
    testing::Values(control("UnknownKey", "mode = 438", "control.mode",
                            "unknown key; allowed here: path, group"),
                    control("RelativePath", "path = \"control\"", "control.path",
                            "allowed: an absolute path"),
                    control("LongPath", "path = \"/" + std::string(107, 'x') + "\"", "control.path",
                            "up to 107 characters"),
                    control("GroupIsNumber", "group = 5", "control.group", "is 5; allowed"),
                    Refusal{"Value", "control = 3\n", 1, "control", "one [control]"}),
    kNames);

Refusal home(const char* what, const std::string& value, const char* key, const char* message) {
  return change(what, "output = 0\n", "output = 0\nhome = " + value + "\n", 32, key, message);
}

INSTANTIATE_TEST_SUITE_P(
    Home, ConfigRefusal,
    testing::Values(
        home("Word", "\"negative\"", "motor[0].home", "allowed: a table such as"),
        home("DirectionMissing", "{ most_steps = 5 }", "motor[0].home.direction", "is missing"),
        home("Direction", "{ direction = \"left\", most_steps = 5 }", "motor[0].home.direction",
             "is \"left\"; allowed: negative, positive"),
        home("StepsMissing", "{ direction = \"negative\" }", "motor[0].home.most_steps",
             "is missing; allowed: a whole number 1..1073741823 steps"),
        home("UnknownKey", "{ direction = \"negative\", most_steps = 5, pace = 3 }",
             "motor[0].home.pace", "unknown key"),
        home("Speed", "{ direction = \"negative\", most_steps = 5, slow_steps_per_s = 1 }",
             "motor[0].home.slow_steps_per_s", "2..5000 steps/s"),
        home("AtStart", "{ direction = \"negative\", most_steps = 5, at_start = 1 }",
             "motor[0].home.at_start", "is 1; allowed: true or false"),
        home("Order", "{ direction = \"negative\", most_steps = 5, order = 0 }",
             "motor[0].home.order", "is 0; allowed: a whole number 1..1000"),
        home("FastSpeed", "{ direction = \"negative\", most_steps = 5, speed = 0 }",
             "motor[0].home.speed", "is 0; allowed: a number above 0"),
        home("Then", "{ direction = \"negative\", most_steps = 5, then = true }",
             "motor[0].home.then", "allowed: a position"),
        home("ThenBetweenSteps", "{ direction = \"negative\", most_steps = 5, then = 1.5 }",
             "motor[0].home.then", "is 1.5; allowed: a whole number of steps"),
        change("Local", "output = 0\n", "output = 0\nlocal = 1\n", 32, "motor[0].local",
               "is 1; allowed: true or false")),
    kNames);

INSTANTIATE_TEST_SUITE_P(
    Bus, ConfigRefusal,
    testing::Values(
        Refusal{"Missing", "", 1, "bus", "is missing; allowed: sections [[bus]]"},
        Refusal{"Single", "[bus]\nname = \"b\"\n", 1, "bus",
                "is a table; allowed: sections [[bus]]"},
        Refusal{"Empty", "bus = []\n", 1, "bus", "is empty"},
        Refusal{"Numbers", "bus = [1]\n", 1, "bus[0]", "is 1; allowed: sections [[bus]]"},
        change("UnknownSection", "[[mcu]]", "[[motors]]", 16, "motors",
               "unknown key; allowed here: lcm, control, state, bus, mcu, group, motor"),
        change("UnknownKey", "tick_us", "tick_ms", 8, "bus[0].tick_ms",
               "unknown key; allowed here: name, kind, port, baud, tick_us, format, moves, frames, "
               "streams, emergency_stop"),
        change("KindUnknown", "tick_us", "kind = \"can\"\ntick_us", 8, "bus[0].kind",
               "is \"can\"; allowed: \"rs485\""),
        change("NameMissing", "name = \"hall\"\n", "", 4, "bus[0].name", "is missing"),
        change("NameBad", "\"hall\"", "\"ha:ll\"", 5, "bus[0].name",
               "is \"ha:ll\"; allowed: 1..63 characters of A-Z a-z 0-9 _ . -"),
        change("NameEmpty", "\"hall\"", "\"\"", 5, "bus[0].name", "1..63"),
        change("NameLong", "\"hall\"", "\"" + std::string(64, 'x') + "\"", 5, "bus[0].name",
               "1..63"),
        change("NameTwice", "\"roof\"", "\"hall\"", 11, "bus[1].name", "already taken in line 5"),
        change("PortMissing", "port = \"/dev/no-such-port-a\"\n", "", 4, "bus[0].port",
               "is missing"),
        change("PortEmpty", "\"/dev/no-such-port-a\"", "\"\"", 6, "bus[0].port", "serial port"),
        change("PortTwice", "no-such-port-b", "no-such-port-a", 12, "bus[1].port",
               "of bus \"hall\"; allowed: one bus a port"),
        change("BaudMissing", "baud = 500000\n", "", 4, "bus[0].baud", "is missing"),
        change("BaudString", "500000", "\"500000\"", 7, "bus[0].baud", "is the string \"500000\""),
        change("BaudNotFixed", "500000", "250000", 7, "bus[0].baud",
               "is 250000; allowed: 50, 75, 110"),
        change("BaudTooHigh", "500000", "12000000", 7, "bus[0].baud", "50..4000000"),
        change("TickMissing", "tick_us = 2560\n", "", 4, "bus[0].tick_us", "is missing"),
        change("TickShort", "2560", "199", 8, "bus[0].tick_us",
               "is 199; allowed: a whole number 200..20000"),
        change("TickLong", "2560", "20001", 8, "bus[0].tick_us", "200..20000"),
        change("TickFloat", "2560", "2560.0", 8, "bus[0].tick_us", "floating-point"),
        change("FormatMissing", "format = \"fine\"\n", "", 4, "bus[0].format", "is missing"),
        change("FormatUnknown", "\"fine\"", "\"medium\"", 9, "bus[0].format",
               "is \"medium\"; allowed: \"fine\" or \"coarse\""),
        change("PortPatternsOfTwoBuses", "no-such-port-b", "no-such-*", 12, "bus[1].port",
               "may be the same port; allowed: one bus a port. Write more of the names"),
        change("PortNul", "no-such-port-a", "a\\u0000b*", 6, "bus[0].port", "serial port"),
        change("MovesUnknown", "format = \"fine\"\n", "format = \"fine\"\nmoves = \"whole\"\n", 10,
               "bus[0].moves", "is \"whole\"; allowed: \"stream\" or \"table\""),
        change("MovesIsBool", "format = \"fine\"\n", "format = \"fine\"\nmoves = true\n", 10,
               "bus[0].moves", "allowed: \"stream\" or \"table\""),
        change("FramesUnknown", "format = \"fine\"\n", "format = \"fine\"\nframes = \"\"\n", 10,
               "bus[0].frames", "is \"\"; allowed: \"auto\" or \"ticks\""),
        change("FramesIsArray", "format = \"fine\"\n", "format = \"fine\"\nframes = [\"ticks\"]\n",
               10, "bus[0].frames", "allowed: \"auto\" or \"ticks\""),
        change("EmergencyStopUnknown", "format = \"fine\"\n",
               "format = \"fine\"\nemergency_stop = \"Immediate\"\n", 10, "bus[0].emergency_stop",
               "is \"Immediate\"; allowed: \"ramp\", \"immediate\" or \"disable\""),
        change("EmergencyStopIsNumber", "format = \"fine\"\n",
               "format = \"fine\"\nemergency_stop = 1\n", 10, "bus[0].emergency_stop",
               "is 1; allowed: \"ramp\", \"immediate\" or \"disable\"")),
    kNames);

INSTANTIATE_TEST_SUITE_P(
    Mcu, ConfigRefusal,
    testing::Values(
        change("UnknownKey", "address = 1\n", "address = 1\nmotors = 16\n", 19, "mcu[0].motors",
               "unknown key"),
        change("BusMissing", "bus = \"hall\"\n", "", 16, "mcu[0].bus",
               "is missing; allowed: \"hall\", \"roof\""),
        change("BusUnknown", "bus = \"hall\"", "bus = \"cellar\"", 17, "mcu[0].bus",
               "is \"cellar\"; allowed: \"hall\", \"roof\""),
        change("AddressMissing", "address = 1\n", "", 16, "mcu[0].address", "is missing"),
        change("AddressZero", "address = 1", "address = 0", 18, "mcu[0].address",
               "is 0; allowed: a whole number 1..255"),
        change("AddressHigh", "address = 255", "address = 256", 21, "mcu[1].address", "1..255"),
        change("AddressTwice", "bus = \"roof\"\naddress = 255", "bus = \"hall\"\naddress = 1", 21,
               "mcu[1].address", "address 1 of bus \"hall\" is already taken in line 18")),
    kNames);

INSTANTIATE_TEST_SUITE_P(Group, ConfigRefusal,
                         testing::Values(change("UnknownKey", "table = \"own\"", "tables = \"own\"",
                                                27, "group[1].tables", "unknown key"),
                                         change("NameMissing", "name = \"slits\"\n", "", 25,
                                                "group[1].name", "is missing"),
                                         change("NameTwice", "\"slits\"", "\"goniometer\"", 26,
                                                "group[1].name", "already taken in line 23"),
                                         change("TableMissing", "table = \"own\"\n", "", 25,
                                                "group[1].table",
                                                "is missing; allowed: the name of a table"),
                                         change("TableUnknown", "\"own\"", "\"owl\"", 27,
                                                "group[1].table", "there is no table \"owl\""),
                                         change("TableOutside", "\"own\"", "\"../own\"", 27,
                                                "group[1].table", "is not a table's name")),
                         kNames);

INSTANTIATE_TEST_SUITE_P(
    Motor, ConfigRefusal,
    testing::Values(
        change("UnknownKey", "output = 0", "pin = 0", 31, "motor[0].pin",
               "unknown key; allowed here: name, mcu, output, group"),
        change("NameMissing", "name = \"theta\"\n", "", 28, "motor[0].name", "is missing"),
        change("NameLikeAnOption", "\"theta\"", "\"--to\"", 29, "motor[0].name",
               "the first one no -"),
        change("NameLikeSteps", "\"theta\"", "\"-5\"", 29, "motor[0].name", "the first one no -"),
        change("NameTwiceToPeople", "\"slit\"", "\"Theta\"", 34, "motor[1].name",
               "but for upper and lower case, is already taken in line 29"),
        change("NameBad", "\"theta\"", "\"θ\"", 29, "motor[0].name", "1..63 characters"),
        change("NameTwice", "\"slit\"", "\"theta\"", 34, "motor[1].name",
               "already taken in line 29"),
        change("McuMissing", "mcu = \"hall:1\"\n", "", 28, "motor[0].mcu",
               "is missing; allowed: \"hall:1\", \"roof:255\""),
        change("McuUnknown", "\"hall:1\"", "\"hall:2\"", 30, "motor[0].mcu",
               "is \"hall:2\"; allowed: \"hall:1\", \"roof:255\""),
        change("McuIsNumber", "\"hall:1\"", "1", 30, "motor[0].mcu", "is 1; allowed: \"hall:1\""),
        change("OutputMissing", "output = 0\n", "", 28, "motor[0].output", "is missing"),
        change("OutputHigh", "output = 15", "output = 16", 36, "motor[1].output",
               "is 16; allowed: a whole number 0..15"),
        change("OutputNegative", "output = 0", "output = -1", 31, "motor[0].output", "0..15"),
        change("OutputTwice", "mcu = \"roof:255\"\noutput = 15", "mcu = \"hall:1\"\noutput = 0", 36,
               "motor[1].output", "output 0 of MCU \"hall:1\" is already taken in line 31"),
        change("GroupMissing", "group = \"goniometer\"\n", "", 28, "motor[0].group", "is missing"),
        change("GroupUnknown", "group = \"slits\"", "group = \"slots\"", 37, "motor[1].group",
               "is \"slots\"; allowed: \"goniometer\", \"slits\""),
        Refusal{"TableTooFastForTheTick",
                replaced(replaced(kGood, "\"own\"", "\"micro16-standard\""), "tick_us = 5000",
                         "tick_us = 10000"),
                37, "motor[1].group",
                "makes up to 201 steps in the 10000 us tick of bus \"roof\"; allowed: 127. Use a "
                "slower table or tick_us = 6349 or less"}),
    kNames);

}  // namespace
}  // namespace bushd::config
