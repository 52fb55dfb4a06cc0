// What a page may ask, how it is answered, and what ends with it.
#include "tools/bushweb/page.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace bushweb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

struct FakeLine : Connection {
  FakeLine(std::vector<api::Request>& requests, const bool& is_full)
      : sent(requests), full(is_full) {}
  bushd::Result<std::int64_t> send(const api::Request& request) override {
    if (full) return bushd::fail("the daemon does not take messages");
    sent.push_back(request);
    return static_cast<std::int64_t>(sent.size());
  }
  std::vector<api::Request>& sent;
  const bool& full;
};

struct FakeSite : Surroundings {
  void tell(const Text& text) override { told.push_back(json::parse(*text)); }
  bool has_daemon(const std::string& daemon) const override { return daemon == "hall"; }
  bushd::Result<std::unique_ptr<Connection>> connect(const std::string& /*daemon*/,
                                                     const std::string& link,
                                                     const std::string& program) override {
    programs.push_back(program);
    if (!why_no_daemon.empty()) return bushd::fail(why_no_daemon);
    return std::make_unique<FakeLine>(sent, link == "hall" ? full : empty);
  }
  void run_doctor(const std::string& daemon, std::int64_t id) override {
    examined.emplace_back(daemon, id);
  }

  std::vector<json> told;
  std::vector<std::string> programs;
  std::vector<api::Request> sent;
  std::vector<std::pair<std::string, std::int64_t>> examined;
  std::string why_no_daemon;
  bool full = false;  // the connection for what is no stop
  const bool empty = false;
};

const Rights kMayCommand{.user = "anna", .may_command = true, .may_stop = true};
const Rights kMayStop{.may_stop = true};

std::string ask(int id, const std::string& request, const std::string& fields = "{}",
                const std::string& daemon = "hall") {
  return fmt::format(R"({{"kind":"ask","id":{},"daemon":"{}","request":"{}","fields":{}}})", id,
                     daemon, request, fields);
}

TEST(OpenPage, AsksInItsOwnNameAndIsAnsweredByItsOwnNumbers) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  page.hear(ask(41, "home", R"({"motors":["a"]})"), 0);
  page.hear(ask(40, "pause"), 0);
  EXPECT_EQ(site.programs, (std::vector<std::string>{"web:anna"}));  // one connection
  ASSERT_EQ(site.sent.size(), 2U);
  page.on_reply("hall", 2, api::Completed{.outcome = api::Outcome::kDone, .reason = "done"});
  page.on_reply("hall", 1, api::Accepted{});
  page.on_reply("hall", 9, api::Accepted{});  // nobody has asked
  ASSERT_EQ(site.told.size(), 2U);
  EXPECT_EQ(site.told[0]["id"], 40);
  EXPECT_EQ(site.told[1]["id"], 41);
  page.on_reply("hall", 2, api::Accepted{});  // after its end
  EXPECT_EQ(site.told.size(), 2U);
}

TEST(OpenPage, WithoutATokenReadsAndStops) {
  FakeSite site;
  Page page(site, kMayStop, 0);
  page.hear(ask(1, "move", R"({"motors":[{"motor":"a","in_steps":true,"steps":1}]})"), 0);
  page.hear(ask(2, "hold"), 0);
  EXPECT_TRUE(site.sent.empty());
  ASSERT_EQ(site.told.size(), 2U);
  EXPECT_THAT(site.told[0]["reason"].get<std::string>(), HasSubstr("bushctl web-token"));
  page.hear(ask(3, "list tables"), 0);
  page.hear(ask(4, "stop"), 0);
  page.hear(ask(5, "emergency stop"), 0);
  EXPECT_EQ(site.sent.size(), 3U);
  EXPECT_EQ(site.programs, (std::vector<std::string>{"web:*"}));
}

TEST(OpenPage, WhereStopsNeedATokenItReadsOnly) {
  FakeSite site;
  Page page(site, {}, 0);
  page.hear(ask(1, "stop"), 0);
  EXPECT_TRUE(site.sent.empty());
  EXPECT_THAT(site.told[0]["reason"].get<std::string>(), HasSubstr("may not stop"));
}

TEST(OpenPage, TooManyMessagesAreRefusedButWhatEndsMotion) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  for (int i = 1; i <= Page::kBurst; ++i) page.hear(R"({"id":1,"kind":"x"})", 0);
  site.told.clear();
  page.hear(ask(1, "list tables"), 0);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("too many messages"));
  page.hear(ask(2, "stop"), 0);
  page.hear(ask(3, "jog", R"({"motor":"a","speed":0})"), 0);
  EXPECT_EQ(site.sent.size(), 2U);
  page.hear(ask(4, "list tables"), 10'000);  // a hundredth of a second later
  EXPECT_EQ(site.sent.size(), 3U);
}

TEST(OpenPage, TooManyRequestsUnderWayAreRefusedButWhatEndsMotion) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  std::int64_t now_us = 0;
  for (std::size_t i = 1; i <= Page::kMostOpen; ++i) {
    page.hear(ask(static_cast<int>(i), "list tables"), now_us += 10'000);
  }
  EXPECT_EQ(site.sent.size(), Page::kMostOpen);
  page.hear(ask(1000, "list tables"), now_us += 10'000);
  EXPECT_EQ(site.sent.size(), Page::kMostOpen);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("under way"));
  page.hear(ask(1001, "stop"), now_us += 10'000);
  EXPECT_EQ(site.sent.size(), Page::kMostOpen + 1);
}

TEST(OpenPage, AStopDoesNotWaitBehindWhatThePageHasAskedBefore) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  site.full = true;
  page.hear(ask(1, "list tables"), 0);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("does not take messages"));
  page.hear(ask(2, "stop"), 0);
  EXPECT_EQ(site.sent.size(), 1U);
  page.on_reply("hall\n", 1, api::Completed{.outcome = api::Outcome::kDone, .reason = "done"});
  EXPECT_EQ(site.told.back()["id"], 2);
}

TEST(OpenPage, WhatANetworkHasHeldBackBeginsNoMotion) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  const auto late_by = [&](const std::string& request, std::int64_t us) {
    json message = json::parse(ask(1, request));
    message["heard"] = 5'000'000;
    page.hear(message.dump(), 5'000'000 + us);
  };
  late_by("home", Page::kLateUs);
  EXPECT_EQ(site.sent.size(), 1U);
  late_by("home", Page::kLateUs + 1);
  EXPECT_EQ(site.sent.size(), 1U);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("came late"));
  late_by("stop", 100 * Page::kLateUs);
  EXPECT_EQ(site.sent.size(), 2U);
}

TEST(OpenPage, LargeMessagesAreForWhoMayCommandAndHaveARateInBytes) {
  const std::string large = R"({"id":1,"kind":"x","y":")" + std::string(400'000, ' ') + "\"}";
  FakeSite site;
  Page looks(site, kMayStop, 0);
  looks.hear(large, 0);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("above 4 KiB"));
  EXPECT_EQ(site.told.back()["id"], 0);  // it was not even read
  Page commands(site, kMayCommand, 0);
  for (int i = 0; i < 4; ++i) commands.hear(large, 0);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("no message of the kind"));
  commands.hear(large, 0);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("too many messages"));
  commands.hear(ask(2, "stop"), 0);
  EXPECT_EQ(site.sent.size(), 1U);
}

TEST(OpenPage, ADaemonThatIsNotThereIsNamed) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  page.hear(ask(1, "stop", "{}", "another"), 0);
  EXPECT_EQ(site.told.back()["reason"], "there is no such daemon");
  site.why_no_daemon = "bushd is not running";
  page.hear(ask(2, "stop"), 0);
  EXPECT_EQ(site.told.back()["reason"], "bushd is not running");
  site.why_no_daemon.clear();
  page.hear(ask(3, "stop"), 0);  // it is tried again
  EXPECT_EQ(site.sent.size(), 1U);
}

TEST(OpenPage, WhatWasUnderWayIsAnsweredWhenTheDaemonEnds) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  page.hear(ask(1, "home", R"({"motors":["a"]})"), 0);
  page.hear(ask(2, "pause"), 0);
  page.on_reply("hall", 2, api::Completed{});
  site.told.clear();
  page.on_end("hall", "the daemon has ended");
  ASSERT_EQ(site.told.size(), 1U);
  EXPECT_EQ(site.told[0]["id"], 1);
  EXPECT_EQ(site.told[0]["reason"], "the daemon has ended");
  page.hear(ask(3, "pause"), 0);
  EXPECT_EQ(site.programs.size(), 2U);
}

TEST(OpenPage, RightsThatEndEndTheConnection) {
  FakeSite site;
  Page page(site, kMayCommand, 0);
  page.hear(ask(1, "jog", R"({"motor":"a","speed":1})"), 0);
  page.set_rights(kMayStop);
  EXPECT_THAT(site.told.back()["reason"].get<std::string>(), HasSubstr("rights of this page"));
  page.hear(ask(2, "jog", R"({"motor":"a","renew":true})"), 0);
  EXPECT_EQ(site.sent.size(), 1U);
  page.hear(ask(3, "stop"), 0);
  EXPECT_EQ(site.programs, (std::vector<std::string>{"web:anna", "web:*"}));
}

TEST(OpenPage, ChecksTablesAndRunsTheDoctor) {
  FakeSite site;
  Page page(site, {}, 0);
  page.hear(R"({"kind":"check","id":1,"table":{"name":"t","time_unit_ns":1000,"accel":[0]}})", 0);
  EXPECT_EQ(site.told.back()["detail"]["diagnostics"][0]["severity"], "error");
  page.hear(R"({"kind":"doctor","id":2,"daemon":"hall"})", 0);
  EXPECT_EQ(site.examined, (std::vector<std::pair<std::string, std::int64_t>>{{"hall", 2}}));
}

}  // namespace
}  // namespace bushweb
