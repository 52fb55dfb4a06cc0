#include "config/port_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tables/temp_directory.h"

namespace bushd::config {
namespace {

using test::TempDirectory;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(PortPattern, NoPatternIsItselfEvenIfItIsMissing) {
  EXPECT_THAT(ports_matching("/dev/no-such-port"), ElementsAre("/dev/no-such-port"));
  EXPECT_THAT(ports_matching(""), ElementsAre(""));
}

TEST(PortPattern, MatchesAreThoseThatAreThereNow) {
  const TempDirectory directory;
  const std::string b = directory.write("ttyUSB1", "").string();
  const std::string pattern = b.substr(0, b.size() - 1) + "*";
  EXPECT_THAT(ports_matching(pattern), ElementsAre(b));
  const std::string a = directory.write("ttyUSB0", "").string();
  directory.write("ttyACM0", "");
  EXPECT_THAT(ports_matching(pattern), ElementsAre(a, b));
  EXPECT_THAT(ports_matching(pattern + "*/x"), IsEmpty());
}

TEST(PortPattern, OnePortForTwoBusesIsSeenThroughPatterns) {
  EXPECT_FALSE(patterns_may_meet("/dev/ttyUSB0", "/dev/ttyUSB0")) << "none is a pattern";
  EXPECT_TRUE(patterns_may_meet("/dev/ttyUSB*", "/dev/ttyUSB0"));
  EXPECT_TRUE(patterns_may_meet("/dev/ttyUSB0", "/dev/ttyUSB[01]"));
  EXPECT_FALSE(patterns_may_meet("/dev/ttyUSB2", "/dev/ttyUSB[01]"));
  EXPECT_FALSE(patterns_may_meet("/dev/ttyUSB*", "/dev/usb/ttyUSB0")) << "* does not match /";
  EXPECT_TRUE(patterns_may_meet("/dev/tty*", "/dev/ttyUSB?"));
  EXPECT_FALSE(patterns_may_meet("/dev/ttyACM*", "/dev/ttyUSB*"));
  EXPECT_FALSE(patterns_may_meet("/by-id/*-hall", "/by-id/*-roof"));
  EXPECT_TRUE(patterns_may_meet("/by-id/*-hall", "/by-id/*-[hr]*"));
}

TEST(PortPattern, OnePortUnderTwoNamesIsOneDevice) {
  const TempDirectory directory;
  const std::string link = (directory.path() / "by-id").string();
  std::filesystem::create_symlink("/dev/null", link);
  EXPECT_TRUE(is_same_port("/dev/null", link)) << "a device";
  EXPECT_FALSE(is_same_port("/dev/zero", link));
  const std::string file = directory.write("port", "").string();
  EXPECT_TRUE(is_same_port(file, directory.path() / "." / "port"));
  EXPECT_FALSE(is_same_port(file, link));
  EXPECT_FALSE(is_same_port("/dev/no-such-port", "/dev/no-such-port")) << "neither is there";
}

TEST(PortPattern, OddCharactersAreNoPatternOrHarmless) {
  for (const char* odd : {"[", "]", "a[b", "\\*", "**", "[!]", "[]]", "{a,b}", "~", "$HOME"}) {
    EXPECT_THAT(ports_matching(std::string("/no-such-folder/") + odd + "*"), IsEmpty()) << odd;
  }
  EXPECT_FALSE(is_pattern("{a,b}~$]"));
}

}  // namespace
}  // namespace bushd::config
