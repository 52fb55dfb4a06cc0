// What only shows when all sections are known, and errors beyond the file itself.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <tuple>

#include "config/config.h"
#include "config/config_file.h"
#include "config/host_check.h"

namespace bushd::config {
namespace {

using test::ConfigFile;
using test::kGood;
using test::kTable;
using test::replaced;
using test::TempDirectory;
using testing::HasSubstr;
using testing::StartsWith;

// A bus, `mcus` MCUs with 16 motors each, and as many groups and tables as asked for.
std::string wide(int mcus, int baud, int tick_us, const char* format, int groups = 1) {
  std::string text = fmt::format(
      "[[bus]]\nname = \"hall\"\nport = \"p\"\nbaud = {}\ntick_us = {}\nformat = \"{}\"\n", baud,
      tick_us, format);
  for (int g = 0; g < groups; ++g) {
    text += fmt::format("[[group]]\nname = \"g{}\"\ntable = \"t{}\"\n", g, g);
  }
  for (int m = 1; m <= mcus; ++m) text += fmt::format("[[mcu]]\nbus = \"hall\"\naddress = {}\n", m);
  for (int m = 0; m < mcus * 16; ++m) {
    text +=
        fmt::format("[[motor]]\nname = \"m{}\"\nmcu = \"hall:{}\"\noutput = {}\ngroup = \"g{}\"\n",
                    m, m / 16 + 1, m % 16, m % groups);
  }
  return text;
}

ConfigFile wide_file(int mcus, int baud, int tick_us, const char* format, int groups = 1) {
  return ConfigFile(wide(mcus, baud, tick_us, format, groups));
}

void write_tables(const ConfigFile& file, int count) {
  for (int t = 0; t < count; ++t) file.directory().write(fmt::format("t{}.toml", t), kTable);
}

// Where streams are admitted when they are asked for, polls alone have to fit.
TEST(ConfigTogether, LineOfManyMcusNeedsRoomForPolls) {
  const auto load = [](int baud, const std::string& keys) {
    std::string text = wide(16, baud, 2560, "fine");
    text.insert(text.find("[[group]]"), keys);
    const ConfigFile file(text);
    write_tables(file, 1);
    return file.load();
  };
  const auto fit = load(1152000, "");
  ASSERT_FALSE(fit.has_value());
  EXPECT_THAT(fit.error().message, HasSubstr("streams = \"refuse\" or \"queue\""));
  EXPECT_TRUE(load(1152000, "streams = \"refuse\"\n").has_value());
  EXPECT_TRUE(load(1152000, "moves = \"table\"\n").has_value());
  EXPECT_FALSE(load(1152000, "moves = \"table\"\nstreams = \"fit\"\n").has_value());
  const auto polls = load(500000, "streams = \"queue\"\n");
  ASSERT_FALSE(polls.has_value());
  EXPECT_EQ(polls.error().key, "bus[0].baud");
  EXPECT_THAT(polls.error().message, HasSubstr("is 500000: polls and sync would take "));
  EXPECT_THAT(polls.error().message, HasSubstr("Use baud = "));
  EXPECT_FALSE(load(4000000, "streams = \"all\"\n").has_value());
}

TEST(ConfigTogether, LineThatCannotCarryItsTicksIsRefusedWithLoadAndRemedy) {
  const ConfigFile file = wide_file(2, 230400, 2560, "fine");
  write_tables(file, 1);
  const auto config = file.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().file, file.path());
  EXPECT_EQ(config.error().line, 5);
  EXPECT_EQ(config.error().key, "bus[0].tick_us");
  EXPECT_THAT(config.error().message,
              HasSubstr("% of the bus at 230400 baud; allowed: 85 %. Use baud = "));
  EXPECT_THAT(config.error().message, HasSubstr("or more, or tick_us = "));
}

TEST(ConfigTogether, RemediesForTheLineHelp) {
  const ConfigFile refused = wide_file(2, 230400, 2560, "fine");
  write_tables(refused, 1);
  const std::string message = refused.load().error().message;
  const auto number_after = [&](const std::string& text) {
    return std::stoi(message.substr(message.find(text) + text.size()));
  };
  const int baud = number_after("Use baud = ");
  const int tick_us = number_after("tick_us = ");
  for (const auto& [remedy_baud, remedy_tick_us, good] :
       {std::tuple{baud, 2560, true}, std::tuple{230400, tick_us, true},
        std::tuple{230400, tick_us - 1, false}}) {
    const ConfigFile file = wide_file(2, remedy_baud, remedy_tick_us, "fine");
    write_tables(file, 1);
    EXPECT_EQ(file.load().has_value(), good) << remedy_baud << ' ' << remedy_tick_us;
  }
}

TEST(ConfigTogether, NinthTableOfAnMcuIsRefused) {
  const ConfigFile eight = wide_file(1, 500000, 2560, "fine", 8);
  write_tables(eight, 8);
  EXPECT_TRUE(eight.load().has_value());
  const ConfigFile nine = wide_file(1, 500000, 2560, "fine", 9);
  write_tables(nine, 9);
  const auto config = nine.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().key, "motor[8].group");
  EXPECT_EQ(config.error().line, 6 + 9 * 3 + 3 + 9 * 5);
  EXPECT_THAT(config.error().message,
              HasSubstr("one table too many for MCU \"hall:1\"; allowed: 8"));
}

TEST(ConfigTogether, OnePortUnderTwoNamesIsRefused) {
  const TempDirectory directory;
  const auto port = directory.write("port", "");
  const auto link = directory.path() / "link";
  std::filesystem::create_symlink(port, link);
  const ConfigFile file(
      replaced(replaced(kGood, "/dev/no-such-port-a", port), "/dev/no-such-port-b", link));
  const auto config = file.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().line, 12);
  EXPECT_EQ(config.error().key, "bus[1].port");
}

TEST(ConfigTogether, OnePortUnderTwoSpellingsIsRefusedBeforeItIsThere) {
  const TempDirectory directory;
  std::filesystem::create_directory(directory.path() / "sub");
  const std::string port = directory.path() / "nox";
  const std::string other = directory.path() / "sub" / ".." / "." / "nox";
  const ConfigFile file(
      replaced(replaced(kGood, "/dev/no-such-port-a", port), "/dev/no-such-port-b", other));
  const auto config = file.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().line, 12);
  EXPECT_EQ(config.error().key, "bus[1].port");
}

// Its target is unplugged: the port is absent, and still the same as the target.
TEST(ConfigTogether, APortBehindADanglingLinkIsItsTarget) {
  const TempDirectory directory;
  const std::string port = directory.path() / "ttyUSB0";
  const auto link = directory.path() / "by-id";
  std::filesystem::create_symlink("ttyUSB0", link);
  std::filesystem::create_symlink(link, directory.path() / "hall");
  EXPECT_TRUE(ConfigFile(replaced(kGood, "/dev/no-such-port-a", link)).load().has_value());
  const ConfigFile file(replaced(replaced(kGood, "/dev/no-such-port-a", port),
                                 "/dev/no-such-port-b", (directory.path() / "hall").string()));
  const auto config = file.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().key, "bus[1].port");
  // Links that lead to themselves lead nowhere.
  std::filesystem::create_symlink("b", directory.path() / "a");
  std::filesystem::create_symlink("a", directory.path() / "b");
  EXPECT_TRUE(ConfigFile(replaced(kGood, "/dev/no-such-port-a", (directory.path() / "a").string()))
                  .load()
                  .has_value());
}

std::string host_error(const std::string& text) {
  return test::error_of(check_host(test::loaded(text)));
}

TEST(ConfigHost, AConsoleIsNoPort) {
  const TempDirectory directory;
  const auto link = directory.path() / "panel";
  std::filesystem::create_symlink("/dev/tty", link);
  for (const std::string& console : {std::string("/dev/tty"), std::string("/dev/../dev/tty"),
                                     std::string("/dev/tt[y]"), link.string()}) {
    EXPECT_THAT(host_error(replaced(kGood, "/dev/no-such-port-b", console)),
                HasSubstr(":12:8: bus[1].port: \"" + console + "\" is a console; allowed: "))
        << console;
  }
  EXPECT_EQ(host_error(kGood), "no error") << "an adapter may be unplugged";
  EXPECT_EQ(host_error(replaced(kGood, "/dev/no-such-port-b", "/dev/null")), "no error");
}

TEST(ConfigHost, AGroupOfUsersHasToBeThere) {
  EXPECT_EQ(host_error("[control]\ngroup = \"root\"\n" + kGood), "no error");
  EXPECT_EQ(host_error("[control]\ngroup = \"\"\n" + kGood), "no error");
  EXPECT_EQ(host_error("[control]\npath = \"\"\ngroup = \"no-such-group\"\n" + kGood), "no error")
      << "no socket, nobody's";
  EXPECT_THAT(host_error("[control]\ngroup = \"no-such-group\"\n" + kGood),
              HasSubstr(":2:9: control.group: is \"no-such-group\", and this PC has no such group "
                        "of users; allowed: "));
}

TEST(ConfigTogether, BusWithoutMcuIsRefused) {
  const ConfigFile file(kGood +
                        "[[bus]]\nname='cellar'\nport='p'\nbaud=9600\ntick_us=20000\n"
                        "format='coarse'\n");
  const auto config = file.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().line, 39);
  EXPECT_EQ(config.error().key, "bus[2].name");
  EXPECT_THAT(config.error().message, HasSubstr("bus = \"cellar\""));
}

TEST(ConfigTogether, BrokenTableIsNamedWithTheGroupThatUsesIt) {
  const ConfigFile file(kGood);
  const auto table =
      file.directory().write("own.toml", "name = \"own\"\ntime_unit_ns = 1\naccel = [1, 2]\n");
  const auto config = file.load();
  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().file, table);
  EXPECT_EQ(config.error().line, 3);
  EXPECT_EQ(config.error().key, "accel[1]");
  EXPECT_THAT(config.error().message,
              HasSubstr("(the table of group \"slits\", " + file.path() + ":27)"));
}

TEST(ConfigTogether, MissingFileAndBrokenTomlAreRefused) {
  const TempDirectory directory;
  const std::string missing = directory.path() / "none.toml";
  EXPECT_THAT(load(missing).error().text(), StartsWith(missing + ": cannot be read: "));
  const std::string broken = directory.write("broken.toml", "[[bus]]\nname = hall\n");
  EXPECT_THAT(load(broken).error().text(), StartsWith(broken + ":2:"));
}

}  // namespace
}  // namespace bushd::config
