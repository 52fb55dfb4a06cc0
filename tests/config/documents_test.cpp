// Errors that docs/configuration.md shows, as they are.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "config/config_file.h"
#include "source_path.h"

namespace bushd::config {
namespace {

std::string page() {
  std::ifstream file(test::source_path("docs/configuration.md"));
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(ConfigurationPage, ShowsTheLoadOfALineAsItIsToldAndTheTickThatHelps) {
  std::string text =
      "[[bus]]\nname = \"hall\"\nport = \"/dev/no-such-port\"\nbaud = 230400\ntick_us = 2560\n"
      "format = \"fine\"\n";
  for (int address : {1, 2})
    text += fmt::format("[[mcu]]\nbus = \"hall\"\naddress = {}\n", address);
  text += "[[group]]\nname = \"axes\"\ntable = \"bushd2-constant\"\n";
  for (int motor = 0; motor < 32; ++motor) {
    text +=
        fmt::format("[[motor]]\nname = \"m{}\"\nmcu = \"hall:{}\"\noutput = {}\ngroup = \"axes\"\n",
                    motor, motor / 16 + 1, motor % 16);
  }
  const test::ConfigFile file(text);
  const auto config = file.load();
  ASSERT_FALSE(config);
  EXPECT_THAT(page(), testing::HasSubstr(config.error().key + ": " + config.error().message));
}

}  // namespace
}  // namespace bushd::config
