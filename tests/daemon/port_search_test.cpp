// A port that is a pattern: which of its matches is opened, with ptys of the kernel, in simulated
// time.
#include "daemon/shell/port_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <limits>
#include <vector>

#include "daemon/shell/bus_port.h"
#include "tables/temp_directory.h"

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

TEST(PortOrder, BeginsAtAPathOrBehindItAndGoesRound) {
  const std::vector<std::string> all = {"tty0", "tty1", "tty2"};
  EXPECT_THAT(in_order(all, {}), ElementsAre("tty0", "tty1", "tty2"));
  EXPECT_THAT(in_order(all, {.path = "tty1", .behind = false}),
              ElementsAre("tty1", "tty2", "tty0"));
  EXPECT_THAT(in_order(all, {.path = "tty1", .behind = true}), ElementsAre("tty2", "tty0"));
  EXPECT_THAT(in_order(all, {.path = "tty2", .behind = true}), ElementsAre("tty0", "tty1"));
  // It has been unplugged meanwhile.
  EXPECT_THAT(in_order({"tty0", "tty2"}, {.path = "tty1", .behind = true}),
              ElementsAre("tty2", "tty0"));
  EXPECT_THAT(in_order({"tty0"}, {.path = "tty0", .behind = true}), ElementsAre());
}

TEST(PortSearch, APortGetsItsTimeAndOneThatIsFoundIsKept) {
  PortSearch search("/dev/ttyUSB*", 2);
  const std::int64_t time = PortSearch::kBootUs + 2 * PortSearch::kMcuUs;
  EXPECT_EQ(search.due_us(), kNever) << "nothing is open";
  search.opened(1'000, "/dev/ttyUSB0");
  EXPECT_FALSE(search.due(1'000 + time - 1));
  EXPECT_TRUE(search.due(1'000 + time));
  search.no_other(1'000 + time);
  EXPECT_EQ(search.due_us(), 1'000 + 2 * time);
  search.found();
  EXPECT_EQ(search.due_us(), kNever);
  EXPECT_EQ(search.first().path, "/dev/ttyUSB0");
  search.lost();
  EXPECT_EQ(search.due_us(), kNever);
  EXPECT_EQ(search.first().path, "/dev/ttyUSB0") << "where it was is looked at first";
}

TEST(PortSearch, APathThatIsNoPatternIsTheOnlyOne) {
  PortSearch search("/dev/bushd/hall", 1);
  search.opened(0, "/dev/bushd/hall");
  EXPECT_EQ(search.due_us(), kNever);
}

TEST(PortSearch, WhatIsWrongIsToldOnceUntilTheBusIsFound) {
  PortSearch search("/dev/ttyUSB*", 1);
  EXPECT_TRUE(search.is_news("trying /dev/ttyUSB1"));
  EXPECT_TRUE(search.is_news("trying /dev/ttyUSB0"));
  EXPECT_FALSE(search.is_news("trying /dev/ttyUSB1"));
  search.found();
  EXPECT_TRUE(search.is_news("trying /dev/ttyUSB1"));
}

// Three devices: at tty0 and tty1 foreign ones, the bus at tty2.
class Devices : public testing::Test {
 protected:
  static constexpr std::size_t kBusAt = 2;

  void SetUp() override {
    for (std::size_t i = 0; i < 3; ++i) {
      std::array<char, 128> name;
      ASSERT_EQ(::openpty(&masters_[i], &slaves_[i], name.data(), nullptr, nullptr), 0);
      std::filesystem::create_symlink(name.data(), path(i));
    }
    bus_.port = (directory_.path() / "tty[0-9]").string();
    bus_.baud = 115200;
  }
  void TearDown() override {
    for (const int fd : slaves_) ::close(fd);
    for (const int fd : masters_) ::close(fd);
  }
  std::string path(std::size_t i) const {
    return (directory_.path() / ("tty" + std::to_string(i))).string();
  }
  // As the loop does it, for so long: which ports were open, in turn.
  std::vector<std::string> search_for(std::int64_t us, const std::vector<PortInUse>& in_use) {
    std::vector<std::string> tried;
    PortSearch search(bus_.port, 1);
    std::unique_ptr<BusPort> port;
    const auto take = [&](std::int64_t now, const PortOrder& order) {
      auto opened = open_first_port(bus_, order, in_use);
      if (!opened) return search.no_other(now);
      port = std::move(*opened);
      search.opened(now, port->path());
      tried.push_back(port->path());
    };
    take(0, search.first());
    for (std::int64_t now = 0; now < us && port; now += 100'000) {
      if (port->path() == path(kBusAt)) search.found();
      if (search.due(now)) take(now, search.next());
    }
    return tried;
  }

  test::TempDirectory directory_;
  std::array<int, 3> masters_{-1, -1, -1};
  std::array<int, 3> slaves_{-1, -1, -1};
  config::Bus bus_{};
};

TEST_F(Devices, MatchesAreTriedUntilTheBusIsFound) {
  EXPECT_THAT(search_for(60'000'000, {}), ElementsAre(path(0), path(1), path(2)));
}

TEST_F(Devices, WithoutTheBusTheyAreTriedRoundAndRound) {
  std::filesystem::remove(path(kBusAt));
  EXPECT_THAT(search_for(18'000'000, {}), ElementsAre(path(0), path(1), path(0), path(1), path(0)));
}

TEST_F(Devices, TheOnlyOneIsNotClosedForNothing) {
  std::filesystem::remove(path(kBusAt));
  std::filesystem::remove(path(1));
  EXPECT_THAT(search_for(60'000'000, {}), ElementsAre(path(0)));
}

TEST_F(Devices, WhatAnotherBusHasOpenIsPassedOverUnderWhateverName) {
  const std::string other_name = (directory_.path() / "by-id").string();
  std::filesystem::create_symlink(std::filesystem::read_symlink(path(0)), other_name);
  EXPECT_THAT(search_for(60'000'000, {{.path = other_name, .user = "bus roof"}}),
              ElementsAre(path(1), path(2)));
  bus_.port = (directory_.path() / "tty[0]").string();
  const auto none = open_first_port(bus_, {}, {{.path = other_name, .user = "bus roof"}});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().text(), HasSubstr("tty0: is open for bus roof"));
}

}  // namespace
}  // namespace bushd::daemon
