// A daemon as another bushd-web shows it: what that one tells is told again.
#include "tools/bushweb/remote.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace bushweb {
namespace {

namespace lcm = bushd::lcm;
using nlohmann::json;
using testing::HasSubstr;

struct FakeDialer : Dialer {
  void dial(Remote& /*remote*/) override { ++dialled; }
  int dialled = 0;
};

// What its pages are told of the daemon here.
class There {
 public:
  There() { mirror_.connect(); }
  lcm::StateMessage state(std::int32_t part, std::int64_t first, std::int64_t second) {
    lcm::StateMessage message;
    message.part = {.utime_us = 7, .run = 3, .sequence = ++sequence_, .part = part, .parts = 2};
    message.snapshot.mcu = "hall:" + std::to_string(part);
    message.snapshot.state = api::McuState::kReady;
    message.snapshot.motors = {{.name = message.snapshot.mcu + "-0", .position_steps = first},
                               {.name = message.snapshot.mcu + "-1",
                                .position_steps = second,
                                .line = api::MotorState::Line{.fraction = 0.5, .left_us = 9}}};
    return message;
  }
  lcm::DescriptionMessage description(std::int32_t part) {
    lcm::DescriptionMessage message;
    message.part = {.run = 3, .sequence = ++sequence_, .part = part, .parts = 2};
    message.snapshot = {.mcu = "hall:" + std::to_string(part), .address = 1};
    message.snapshot.motors = {
        {.name = message.snapshot.mcu + "-0", .soft_limits = bushd::units::SoftLimits{-1, 2}},
        {.name = message.snapshot.mcu + "-1"}};
    return message;
  }
  lcm::HealthMessage health() {
    lcm::HealthMessage message;
    message.part = {.sequence = ++sequence_};
    message.snapshot.bus = "b";
    message.snapshot.latency = {{1000, 4}, {std::numeric_limits<std::int64_t>::max(), 5}};
    return message;
  }
  Mirror& mirror() { return mirror_; }

 private:
  Mirror mirror_{"bushd"};
  std::int64_t sequence_ = 0;
};

void pass(const std::vector<Text>& texts, Remote& remote) {
  for (const Text& text : texts) remote.on_text(*text);
}

// As far as both tell it of the daemon itself.
std::vector<json> told_by(const Mirror& mirror) {
  std::vector<json> out;
  for (const Text& text : mirror.everything()) {
    json told = json::parse(*text);
    told.erase("daemon");
    out.push_back(std::move(told));
  }
  return out;
}

Remote remote_to(Dialer& dialer) {
  return {*remote_name("hutch=http://pc:80/"), dialer};
}

TEST(RemoteDaemon, IsShownAsItsOwnPageShowsIt) {
  FakeDialer dialer;
  There there;
  Remote remote = remote_to(dialer);
  remote.on_open();
  remote.on_text(*hello("1", {}, {"bushd", "another"}));
  there.mirror().hear(there.description(0));
  there.mirror().hear(there.description(1));
  there.mirror().hear(there.state(0, 1, 2));
  there.mirror().hear(there.state(1, 3, 4));
  there.mirror().hear(there.health());
  pass(there.mirror().everything(), remote);
  there.mirror().news();
  EXPECT_TRUE(told_by(remote.mirror()) == told_by(there.mirror()));
  EXPECT_EQ(remote.mirror().status().descriptions.size(), 2U);

  there.mirror().hear(there.state(1, 3, 9));  // one motor is told
  pass(there.mirror().news(), remote);
  EXPECT_TRUE(told_by(remote.mirror()) == told_by(there.mirror()));

  there.mirror().lose("it has ended");
  pass(there.mirror().news(), remote);
  EXPECT_FALSE(remote.mirror().connected());
  const json told = json::parse(*remote.mirror().everything()[0]);
  EXPECT_THAT(told["why"].get<std::string>(), HasSubstr("http://pc:80/: it has ended"));
}

TEST(RemoteDaemon, OthersOfThatPageAreNotMixedIn) {
  FakeDialer dialer;
  Remote remote(*remote_name("hutch=https://pc:80/?daemon=second"), dialer);
  remote.on_text(*hello("1", {}, {"bushd", "second"}));
  There there;
  there.mirror().hear(there.state(0, 1, 2));
  pass(there.mirror().everything(), remote);
  EXPECT_FALSE(remote.mirror().connected());
}

TEST(RemoteDaemon, WhatItSaysMayBeAnything) {
  FakeDialer dialer;
  Remote remote = remote_to(dialer);
  for (const char* text :
       {"", "x", "[]", R"({"kind":"hello","daemons":[5]})", R"({"kind":"hello","daemons":["d"]})",
        R"({"kind":"daemon","daemon":"d","connected":1})",
        R"({"kind":"state","daemon":"d","parts":-5,"mcus":[1,{"part":1e99},{"motors":7}]})",
        R"({"kind":"state","daemon":"d","mcus":[{"part":9999999999,"motors":[{"name":5}]}]})",
        R"({"kind":"description","daemon":"d","mcus":[{"motors":[{"steps_per_unit":"0"}]}]})",
        R"({"kind":"health","daemon":"d","buses":[[],{"latency":[{}]}]})"}) {
    remote.on_text(text);
  }
  EXPECT_FALSE(remote.mirror().connected());
}

TEST(RemoteDaemon, IsTriedAgainAndGivenUpWhenSilent) {
  FakeDialer dialer;
  Remote remote = remote_to(dialer);
  remote.tick(0);
  remote.tick(100'000);
  EXPECT_EQ(dialer.dialled, 1);
  remote.on_end("refused");
  remote.tick(200'000);
  EXPECT_EQ(dialer.dialled, 1);
  remote.tick(Remote::kTryAgainUs);
  EXPECT_EQ(dialer.dialled, 2);
  remote.on_open();
  remote.tick(Remote::kTryAgainUs + Remote::kSilentUs);
  EXPECT_FALSE(remote.is_silent());
  remote.on_text("{}");
  remote.tick(Remote::kTryAgainUs + 2 * Remote::kSilentUs + 1);
  EXPECT_TRUE(remote.is_silent());
}

TEST(RemoteDaemon, AUrlThatIsNoneIsRefused) {
  const auto good = remote_name("a=https://hutch.lab:8260/?daemon=x");
  ASSERT_TRUE(good);
  EXPECT_EQ(good->host, "hutch.lab");
  EXPECT_EQ(good->port, 8260);
  EXPECT_TRUE(good->tls);
  EXPECT_EQ(good->daemon, "x");
  for (const char* told :
       {"", "a", "=http://h:1", "a=h:1", "a=ftp://h:1", "a=http://h", "a=http://:1", "a=http://h:0",
        "a=http://h:65536", "a=http://h:1x", "a=http://h:1/x"}) {
    EXPECT_FALSE(remote_name(told)) << told;
  }
}

}  // namespace
}  // namespace bushweb
