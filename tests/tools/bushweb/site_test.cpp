// Who is told what, and when. A site without daemons tells "alive".
#include "tools/bushweb/site.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace bushweb {
namespace {

struct FakeOutlet : Outlet {
  void send(PageId page, const Text& text) override { told[page].push_back(*text); }
  bool is_behind(PageId page) const override { return behind.contains(page); }

  std::map<PageId, std::vector<std::string>> told{};
  std::set<PageId> behind{};
};

struct NoDialer : Dialer {
  void dial(Remote& remote) override { dialled = &remote; }
  Remote* dialled = nullptr;
};

class Pages {
 public:
  explicit Pages(PageId count, std::vector<RemoteName> remotes = {})
      : site_(SiteOptions{.version = "test", .remotes = std::move(remotes)}, poller_, outlet_,
              dialer_) {
    for (PageId id = 1; id <= count; ++id) open(id);
    outlet_.told.clear();
  }
  void open(PageId id) {
    site_.open(id,
               {.method = "GET", .path = "/api/live", .host = "localhost", .peer = "127.0.0.1"});
  }
  // Who is told something by the next tick.
  std::set<PageId> tick(const std::function<void()>& look = [] {}) {
    site_.tick();
    look();
    std::set<PageId> pages;
    for (const auto& [page, texts] : std::exchange(outlet_.told, {})) pages.insert(page);
    return pages;
  }
  FakeOutlet& outlet() { return outlet_; }
  Remote& remote() { return *dialer_.dialled; }

 private:
  Poller poller_{};
  FakeOutlet outlet_{};
  NoDialer dialer_{};
  Site site_;
};

TEST(Site, TellsAFifthOfThePagesAtATimeAndEachTenTimesASecond) {
  Pages pages(10);
  std::map<PageId, int> times;
  for (int tick = 0; tick < Site::kTicksPerSecond; ++tick) {
    const std::set<PageId> told = pages.tick();
    EXPECT_EQ(told.size(), 2);
    for (const PageId page : told) ++times[page];
  }
  EXPECT_EQ(times.size(), 10);
  for (const auto& [page, count] : times) EXPECT_EQ(count, 10) << page;
}

TEST(Site, TellsNothingToAPageThatIsBehind) {
  Pages pages(2);
  pages.outlet().behind = {1};
  std::set<PageId> told;
  for (int tick = 0; tick < Site::kTurns; ++tick) told.merge(pages.tick());
  EXPECT_EQ(told, std::set<PageId>{2});
  pages.outlet().behind = {};
  told.clear();
  for (int tick = 0; tick < Site::kTurns; ++tick) told.merge(pages.tick());
  EXPECT_EQ(told, (std::set<PageId>{1, 2}));
}

// What a daemon says of one motor, as another bushd-web tells it.
class FarMotor {
 public:
  std::vector<Text> at(std::int64_t steps) {
    bushd::lcm::StateMessage message;
    message.part = {.utime_us = ++number_, .run = 3, .sequence = number_, .part = 0, .parts = 1};
    message.snapshot.mcu = "hall:1";
    message.snapshot.motors = {{.name = "theta", .position_steps = steps}};
    mirror_.hear(message);
    return mirror_.news();
  }
  FarMotor() { mirror_.connect(); }

 private:
  Mirror mirror_{"far"};
  std::int64_t number_ = 0;
};

int states_in(const std::vector<std::string>& texts) {
  return static_cast<int>(std::ranges::count_if(
      texts, [](const std::string& text) { return text.starts_with(R"({"kind":"state")"); }));
}

TEST(Site, APageThatHasJustBeenToldEverythingIsToldNoOlderNews) {
  Pages pages(1, {*remote_name("far=http://pc:80/")});
  for (int tick = 0; tick < Site::kTurns; ++tick) pages.tick();  // it is dialled
  FarMotor motor;
  pages.remote().on_open();
  pages.remote().on_text(*hello("1", {}, {"far"}));
  for (const Text& text : motor.at(100)) pages.remote().on_text(*text);
  // In this round page 1 is told of 100.
  pages.tick();
  while (!pages.tick().contains(1)) {
  }
  for (const Text& text : motor.at(200)) pages.remote().on_text(*text);
  pages.open(3);
  EXPECT_EQ(states_in(pages.outlet().told[3]), 1) << "200";
  pages.outlet().told.clear();
  int states = 0;
  for (int tick = 0; tick < 2 * Site::kTurns; ++tick) {
    pages.tick([&] { states += states_in(pages.outlet().told[3]); });
  }
  EXPECT_EQ(states, 1) << "only those of the next round";
}

}  // namespace
}  // namespace bushweb
