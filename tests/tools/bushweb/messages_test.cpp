// What a page may say, and what is said to it.
#include "tools/bushweb/messages.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/fields_from_json.h"
#include "base/fields_json.h"

namespace bushweb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string ask_text(const std::string& request, const std::string& fields) {
  return fmt::format(R"({{"kind":"ask","id":7,"daemon":"hall","request":"{}","fields":{}}})",
                     request, fields);
}

api::Request request_of(const std::string& request, const std::string& fields) {
  const FromPage message = parse(ask_text(request, fields));
  const auto* asked = std::get_if<Ask>(&message.what);
  EXPECT_NE(asked, nullptr) << (asked == nullptr ? std::get<Wrong>(message.what).why : "");
  return asked == nullptr ? api::Request() : asked->request;
}

std::string why_wrong(const std::string& text) {
  const FromPage message = parse(text);
  const auto* wrong = std::get_if<Wrong>(&message.what);
  return wrong == nullptr ? "it is right" : wrong->why;
}

TEST(PageMessages, ARequestHasTheFieldsOfItsType) {
  const auto move = std::get<api::Move>(request_of(
      "move",
      R"({"kind":2,"speed":3.5,"motors":[{"motor":"a","in_steps":false,"user":1.25},{"motor":"b","in_steps":true,"steps":-4}]})"));
  EXPECT_EQ(move.kind, api::Move::Kind::kAbsolute);
  EXPECT_EQ(move.motors,
            (std::vector<api::MotorAmount>{{"a", api::UserUnits{1.25}}, {"b", std::int64_t{-4}}}));
  EXPECT_EQ(move.speed->per_s, 3.5);
  const auto jog =
      std::get<api::Jog>(request_of("jog", R"({"motor":"a","speed":-2,"renew":true})"));
  EXPECT_EQ(jog.per_s, -2);
  EXPECT_TRUE(jog.renew);
  EXPECT_EQ(jog.keepalive_ms, 500);  // its default
  EXPECT_TRUE(std::get<api::Stop>(request_of("stop", "{}")).motors.empty());
}

TEST(PageMessages, WhatATypeTellsItReadsAgain) {
  const api::MovePath path{.motors = {"a", "b"},
                           .rows = 2,
                           .positions = {0.5, 1, 2, 3},
                           .speeds = {0, 4},
                           .corners = api::MovePath::Corners::kExact,
                           .dry_run = true,
                           .speed = api::Speed{.per_s = 5, .in_steps = true}};
  const auto told = json::parse(bushd::json_of(path).dump());
  const auto read = bushd::from_json<api::MovePath>(told);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(json::parse(bushd::json_of(*read).dump()), told);

  const api::TableFile table{.content = {.name = "t",
                                         .time_unit_ns = 1000,
                                         .accel = {9, 8},
                                         .decel = std::vector<std::uint16_t>{8, 10},
                                         .cruise = 7,
                                         .description = "d",
                                         .revision = 3},
                             .hash = "h"};
  const auto table_read =
      bushd::from_json<api::TableFile>(json::parse(bushd::json_of(table).dump()));
  ASSERT_TRUE(table_read) << table_read.error().text();
  EXPECT_EQ(*table_read, table);
}

TEST(PageMessages, AnErrorNamesThePlace) {
  EXPECT_EQ(why_wrong(ask_text("move", R"({"motors":[{"motor":"a"},{"motor":5}]})")),
            "move: motors[1].motor: a text is expected");
  EXPECT_EQ(why_wrong(ask_text("move", R"({"kind":3})")), "move: kind: this value is not allowed");
  EXPECT_EQ(why_wrong(ask_text("move", R"({"kind":1.0})")),
            "move: kind: a whole number in its range is expected");
  EXPECT_EQ(why_wrong(ask_text("move", R"({"kind":257})")),
            "move: kind: a whole number in its range is expected");
  EXPECT_EQ(why_wrong(ask_text("move", R"({"speeed":1})")), "move: speeed: there is no such field");
  EXPECT_EQ(why_wrong(ask_text("jog", R"({"speed":"fast"})")), "jog: speed: a number is expected");
  EXPECT_EQ(why_wrong(ask_text("stop", "[]")), "stop: an object is expected");
  EXPECT_EQ(why_wrong(ask_text("stop", R"({"motors":"a"})")), "stop: motors: a list is expected");
  EXPECT_THAT(why_wrong(ask_text("camac", "{}")), HasSubstr("no request 'camac'"));
  EXPECT_THAT(why_wrong(R"({"kind":"ask","id":1,"daemon":"hall"})"), HasSubstr("\"request\""));
  EXPECT_THAT(why_wrong(R"({"kind":"\u001b[2J","id":1})"), HasSubstr(R"('\x1b[2J')"));
}

TEST(PageMessages, WithoutANumberNothingCanBeAnswered) {
  for (const char* text : {"", "null", "[]", "{}", "\"x\"", R"({"kind":"ask","id":0})",
                           R"({"kind":"ask","id":"1"})", R"({"kind":"ask","id":1e400})"}) {
    EXPECT_EQ(parse(text).id, 0) << text;
    EXPECT_NE(why_wrong(text), "it is right") << text;
  }
  EXPECT_EQ(parse(std::string(100'000, '[')).id, 0);
}

TEST(PageMessages, WhatOnlyReadsAndWhatStops) {
  EXPECT_TRUE(only_reads(api::ListTables{}));
  EXPECT_TRUE(only_reads(api::GetHistory{}));
  EXPECT_TRUE(only_reads(api::Configure{.kind = api::Configure::Kind::kShow}));
  EXPECT_FALSE(only_reads(api::Configure{.kind = api::Configure::Kind::kChange}));
  EXPECT_FALSE(only_reads(api::Stop{}));
  EXPECT_FALSE(only_reads(api::Move{.dry_run = true}));
  EXPECT_TRUE(is_stop(api::Stop{}));
  EXPECT_TRUE(is_stop(api::EmergencyStop{}));
  EXPECT_FALSE(is_stop(api::Pause{}));
}

TEST(PageMessages, AReplyHasItsDetailByName) {
  const json told = json::parse(*reply(
      3,
      api::Completed{.outcome = api::Outcome::kReached,
                     .reason = "all reached",
                     .detail = std::vector<api::MotorResult>{
                         {.motor = "a", .outcome = api::Outcome::kReached, .position_steps = 5}}}));
  EXPECT_EQ(told["phase"], "result");
  EXPECT_EQ(told["outcome"], "reached");
  EXPECT_EQ(told["detail"]["motors"][0]["position_steps"], 5);
  EXPECT_EQ(json::parse(*reply(4, api::Accepted{}))["phase"], "accepted");
  const json refused = json::parse(*reply(5, api::Refused{.reason = "no \xff"}));
  EXPECT_EQ(refused["reason"], "no \xEF\xBF\xBD");  // what is no UTF-8
  EXPECT_TRUE(refused["detail"].is_null());
}

TEST(PageMessages, HelloSaysWhatThePageMay) {
  const json told = json::parse(
      *hello("1.2", {.user = "anna", .may_command = true, .may_stop = true}, {"hall", "hutch"}));
  EXPECT_EQ(told["user"], "anna");
  EXPECT_EQ(told["daemons"], json({"hall", "hutch"}));
  EXPECT_TRUE(json::parse(*hello("1.2", {}, {}))["user"].is_null());
}

}  // namespace
}  // namespace bushweb
