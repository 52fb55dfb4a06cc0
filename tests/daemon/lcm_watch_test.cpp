// Trouble on LCM, told once when it begins and once when it is over.
#include "daemon/fronts/lcm_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kRun = 99;

class LcmWatchTest : public testing::Test {
 protected:
  LcmWatchTest() { EXPECT_TRUE(front_.subscribe()); }
  // One who has this run describes itself at this time.
  void describe(std::int64_t run, std::int64_t now_us) {
    const auto packet = lcm::encode({.run = run}, api::Description{.bus = "ha\x1bll"});
    EXPECT_TRUE(transport_->publish("LAB_" + packet->channel, packet->payload));
    front_.handle();
    watch_.step(now_us);
  }

  std::unique_ptr<lcm::Transport> transport_ = std::move(*lcm::Transport::open("memq://"));
  StopCount stops_;
  Reception reception_{stops_, [](const api::Asker&, const api::Request&) {}};
  Publishing publishing_{
      kRun,
      1,
      1,
      {.now_us = [] { return std::int64_t{1}; }, .unix_us = [] { return std::int64_t{1}; }}};
  LcmFront front_{{.transport = *transport_, .prefix = "LAB", .run = kRun, .seed = 5},
                  reception_,
                  publishing_,
                  [] { return std::int64_t{1}; }};
  std::vector<std::string> log_;
  LcmWatch watch_{front_, publishing_, "LAB",
                  [this](LogLevel, const std::string& text) { log_.push_back(text); }};
};

TEST_F(LcmWatchTest, AnotherDaemonIsToldOnceAndWhenItIsGone) {
  std::int64_t now_us = 5'000'000;
  describe(kRun, now_us);
  EXPECT_THAT(log_, ElementsAre()) << "its own";
  for (int i = 0; i < 20; ++i) describe(kRun + 1, now_us += 3'000'000);
  EXPECT_THAT(log_, ElementsAre(HasSubstr("another bushd, with a bus \"ha\\x1bll\", sends its "
                                          "state on channels LAB_...")));
  watch_.step(now_us + LcmWatch::kGoneAfterUs);
  EXPECT_EQ(log_.size(), 1u);
  watch_.step(now_us + LcmWatch::kGoneAfterUs + 1);
  EXPECT_THAT(log_.back(), HasSubstr("is not heard any more"));
  describe(kRun + 1, now_us + 60'000'000);
  EXPECT_EQ(log_.size(), 3u);
}

}  // namespace
}  // namespace bushd::daemon
