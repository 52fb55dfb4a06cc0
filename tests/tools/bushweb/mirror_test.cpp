// What pages are told of a daemon: everything, and then what is new.
#include "tools/bushweb/mirror.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

namespace bushweb {
namespace {

namespace lcm = bushd::lcm;
using nlohmann::json;

constexpr std::int64_t kRun = 5;

lcm::StateMessage state_of(std::int32_t part, const std::vector<std::int64_t>& positions,
                           std::int64_t run = kRun, std::int32_t parts = 2) {
  lcm::StateMessage message;
  message.part = {.utime_us = 1000, .run = run, .part = part, .parts = parts};
  message.snapshot.mcu = "hall:" + std::to_string(part);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    message.snapshot.motors.push_back(
        {.name = message.snapshot.mcu + "-" + std::to_string(i), .position_steps = positions[i]});
  }
  return message;
}

lcm::DescriptionMessage description_of(std::int32_t part, std::int64_t run = kRun) {
  lcm::DescriptionMessage message;
  message.part = {.run = run, .part = part, .parts = 2};
  message.snapshot.mcu = "hall:" + std::to_string(part);
  return message;
}

std::vector<json> parsed(const std::vector<Text>& texts) {
  std::vector<json> out;
  for (const Text& text : texts) out.push_back(json::parse(*text));
  return out;
}

// The state among them; null: there is none.
json state_in(const std::vector<Text>& texts) {
  for (const json& message : parsed(texts)) {
    if (message["kind"] == "state") return message;
  }
  return nullptr;
}

std::set<std::string> motors_in(const json& state) {
  std::set<std::string> names;
  for (const json& mcu : state["mcus"]) {
    for (const json& motor : mcu["motors"]) names.insert(motor["name"]);
  }
  return names;
}

Mirror connected_mirror() {
  Mirror mirror("hall");
  mirror.connect();
  mirror.hear(state_of(0, {1, 2}));
  mirror.hear(state_of(1, {3}));
  mirror.hear(description_of(0));
  mirror.hear(lcm::HealthMessage{.part = {.part = 0}, .snapshot = {.bus = "b"}});
  return mirror;
}

TEST(Mirror, TellsEverythingFirst) {
  Mirror mirror = connected_mirror();
  const auto told = parsed(mirror.news());
  ASSERT_EQ(told.size(), 4U);
  EXPECT_EQ(told[0]["kind"], "daemon");
  EXPECT_TRUE(told[0]["connected"]);
  EXPECT_EQ(told[1]["kind"], "description");
  EXPECT_EQ(told[2]["kind"], "state");
  EXPECT_EQ(told[2]["full"], true);
  EXPECT_EQ(told[2]["mcus"][0]["motors"][1]["position_steps"], 2);
  EXPECT_EQ(told[3]["kind"], "health");
  EXPECT_TRUE(mirror.news().empty());
}

TEST(Mirror, ThenMotorsThatChangedOfMcusThatWereHeard) {
  Mirror mirror = connected_mirror();
  mirror.news();
  mirror.hear(state_of(0, {1, 7}));
  const auto news = mirror.news();
  ASSERT_EQ(news.size(), 1U);
  const json state = state_in(news);
  EXPECT_EQ(state["full"], false);
  EXPECT_EQ(state["mcus"].size(), 1U);
  EXPECT_EQ(motors_in(state), (std::set<std::string>{"hall:0-1"}));

  mirror.hear(state_of(1, {3}));  // heard, and nothing is new
  const json heard = state_in(mirror.news());
  EXPECT_EQ(heard["mcus"][0]["mcu"], "hall:1");
  EXPECT_TRUE(heard["mcus"][0]["motors"].empty());
}

TEST(Mirror, WhoComesLaterIsToldAllThatOthersKnow) {
  Mirror mirror = connected_mirror();
  mirror.news();
  mirror.hear(state_of(0, {8, 9}));
  mirror.news();
  const json state = state_in(mirror.everything());
  EXPECT_EQ(state["full"], true);
  EXPECT_EQ(motors_in(state), (std::set<std::string>{"hall:0-0", "hall:0-1", "hall:1-0"}));
  EXPECT_EQ(state["mcus"][0]["motors"][0]["position_steps"], 8);
}

TEST(Mirror, NothingOfADaemonBeforeIsLeft) {
  Mirror mirror = connected_mirror();
  mirror.news();
  mirror.hear(state_of(0, {4}, kRun + 1, 1));
  const json state = state_in(mirror.news());
  EXPECT_EQ(state["full"], true);
  EXPECT_EQ(motors_in(state), (std::set<std::string>{"hall:0-0"}));
  // Descriptions come before states when a client asks.
  mirror.hear(description_of(0, kRun + 2));
  mirror.hear(state_of(0, {4}, kRun + 2));
  EXPECT_EQ(mirror.status().states.size(), 0U);  // the second MCU has not told its state
  mirror.hear(state_of(1, {4}, kRun + 2));
  EXPECT_EQ(mirror.status().states.size(), 2U);
}

TEST(Mirror, SaysOnceThatADaemonIsLostAndWhy) {
  Mirror mirror = connected_mirror();
  mirror.news();
  mirror.lose("it has ended");
  mirror.hear(state_of(0, {99, 99}));
  const auto told = parsed(mirror.news());
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0]["connected"], false);
  EXPECT_EQ(told[0]["why"], "it has ended");
  mirror.lose("it has ended");
  EXPECT_TRUE(mirror.news().empty());
  mirror.connect();
  mirror.hear(state_of(0, {5, 6}));
  EXPECT_EQ(state_in(mirror.news())["full"], true);
}

TEST(Mirror, NamesFromOutsideStayText) {
  Mirror mirror("a\"b");
  mirror.connect();
  auto message = state_of(0, {1});
  message.snapshot.detail = "quote \" and \xff";
  mirror.hear(message);
  const json state = state_in(mirror.news());
  EXPECT_EQ(state["daemon"], "a\"b");
  EXPECT_EQ(state["mcus"][0]["detail"], "quote \" and \xEF\xBF\xBD");
}

}  // namespace
}  // namespace bushweb
