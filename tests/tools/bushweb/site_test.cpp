// Who is told what, and when. The pages are of a site without daemons: what goes out is "alive".
#include "tools/bushweb/site.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace bushweb {
namespace {

struct FakeOutlet : Outlet {
  void send(PageId page, const Text& text) override { told[page].push_back(*text); }
  bool is_behind(PageId page) const override { return behind.contains(page); }

  std::map<PageId, std::vector<std::string>> told{};
  std::set<PageId> behind{};
};

struct NoDialer : Dialer {
  void dial(Remote& /*remote*/) override {}
};

class Pages {
 public:
  explicit Pages(PageId count) {
    for (PageId id = 1; id <= count; ++id) {
      site_.open(id,
                 {.method = "GET", .path = "/api/live", .host = "localhost", .peer = "127.0.0.1"});
    }
    outlet_.told.clear();
  }
  // Who is told something by the next tick.
  std::set<PageId> tick() {
    site_.tick();
    std::set<PageId> pages;
    for (const auto& [page, texts] : std::exchange(outlet_.told, {})) pages.insert(page);
    return pages;
  }
  FakeOutlet& outlet() { return outlet_; }

 private:
  Poller poller_{};
  FakeOutlet outlet_{};
  NoDialer dialer_{};
  Site site_{SiteOptions{.version = "test"}, poller_, outlet_, dialer_};
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

}  // namespace
}  // namespace bushweb
