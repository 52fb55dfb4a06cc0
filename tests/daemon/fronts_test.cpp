// Both front ends with a core made up here: requests reach it once, answers go to who asked.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/link.h"
#include "daemon/lcm_front.h"
#include "daemon/request_log.h"
#include "daemon/socket_front.h"
#include "tables/temp_directory.h"

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kRunOfFronts = 99;

bool readable(int fd) {
  pollfd polled{.fd = fd, .events = POLLIN, .revents = 0};
  return ::poll(&polled, 1, 0) > 0;
}

class FrontsTest : public testing::Test {
 protected:
  // What the core does with a request: answers it with its number of this kind.
  void carry_out(const api::Asker& asker, const api::Request& request) {
    carried_out_.emplace_back(api::name_of(request));
    who_.push_back(asker.session->text());
    asker.answer(api::Accepted{});
    asker.answer(api::Completed{.outcome = api::Outcome::kDone,
                                .reason = "the " + std::to_string(carried_out_.size()) + ".",
                                .detail = {}});
  }
  void publish_something() {
    publishing_.publish(McuId{0}, api::StateSnapshot{.bus = "hall", .mcu = "hall:1"});
    publishing_.publish(McuId{0}, api::Description{.bus = "hall", .mcu = "hall:1"});
    publishing_.publish(BusId{0}, api::HealthSnapshot{.bus = "hall"});
  }

  std::vector<std::string> carried_out_;
  std::vector<std::string> who_;
  std::int64_t now_us_ = 1'000'000;
  Reception reception_{
      [this](const api::Asker& asker, const api::Request& request) { carry_out(asker, request); }};
  Publishing publishing_{
      kRunOfFronts,
      1,
      1,
      {.now_us = [this] { return now_us_; }, .unix_us = [] { return std::int64_t{1}; }}};
};

class LcmFrontTest : public FrontsTest {
 protected:
  LcmFrontTest() {
    transport_ = std::move(*lcm::Transport::open("memq://"));
    open(true);
    for (const std::string_view channel : lcm::daemon_channels()) {
      EXPECT_TRUE(transport_->subscribe_bytes(
          "LAB_" + std::string(channel), [this, channel](lcm::Payload payload) {
            heard_.push_back(*lcm::decode_daemon_message(channel, payload));
          }));
    }
  }
  void open(bool commands) {
    front_ = std::make_unique<LcmFront>(LcmFront::Setup{.transport = *transport_,
                                                        .prefix = "LAB",
                                                        .commands = commands,
                                                        .run = kRunOfFronts,
                                                        .seed = 5},
                                        reception_, publishing_, [] { return std::int64_t{1}; });
    EXPECT_TRUE(front_->subscribe());
  }
  void settle() {
    while (readable(transport_->fd()) || !reception_.idle()) {
      front_->handle();
      reception_.carry_out_next();
    }
  }
  void say(const Result<lcm::Packet>& packet) {
    EXPECT_TRUE(transport_->publish_bytes("LAB_" + packet->channel, packet->payload));
    settle();
  }
  std::int64_t session(const std::string& client_id, std::int64_t nonce = 1) {
    heard_.clear();
    say(lcm::encode(0, lcm::Hello{.client_id = client_id, .nonce = nonce}));
    const auto welcome = std::get<lcm::Welcome>(heard_.at(0));
    EXPECT_EQ(welcome.hello.nonce, nonce);
    EXPECT_EQ(welcome.run, kRunOfFronts);
    return welcome.session;
  }
  // The last reply to it.
  std::string ask(const lcm::RequestId& id, const api::Request& request) {
    heard_.clear();
    say(lcm::encode(0, id, request));
    if (heard_.empty()) return "no reply";
    const auto reply = std::get<lcm::ReplyMessage>(heard_.back());
    EXPECT_EQ(reply.id, id);
    if (const auto* refused = std::get_if<api::Refused>(&reply.reply)) return refused->reason;
    const auto* completed = std::get_if<api::Completed>(&reply.reply);
    return completed == nullptr ? "accepted" : completed->reason;
  }

  std::unique_ptr<lcm::Transport> transport_;
  std::unique_ptr<LcmFront> front_;
  std::vector<lcm::DaemonMessage> heard_;
};

TEST_F(LcmFrontTest, ARequestIsCarriedOutOnceAndAnsweredAsOften) {
  const lcm::RequestId id{.session = session("scan"), .client_id = "scan", .number = 1};
  EXPECT_EQ(ask(id, api::Move{}), "the 1.");
  EXPECT_EQ(ask(id, api::Move{}), "the 1.");
  EXPECT_THAT(carried_out_, ElementsAre("move"));
  EXPECT_THAT(who_, ElementsAre("scan"));
}

TEST_F(LcmFrontTest, AHelloRepeatedGetsTheSameSession) {
  const std::int64_t first = session("scan", 1);
  EXPECT_EQ(session("scan", 1), first);
  EXPECT_NE(session("scan", 2), first);
}

TEST_F(LcmFrontTest, UnknownSessionsAreRefusedButMayStop) {
  EXPECT_THAT(ask({.session = 3, .client_id = "scan", .number = 1}, api::Move{}),
              HasSubstr("session is unknown"));
  EXPECT_EQ(ask({.session = 0, .client_id = "scan", .number = 1}, api::Stop{}), "the 1.");
  EXPECT_EQ(ask({.session = 0, .client_id = "scan", .number = 1}, api::EmergencyStop{}), "the 2.");
  EXPECT_THAT(carried_out_, ElementsAre("stop", "emergency stop"));
}

TEST_F(LcmFrontTest, WhatIsNoMessageIsCounted) {
  EXPECT_TRUE(transport_->publish_bytes("LAB_MOVE", std::vector<std::uint8_t>(20, 0xFF)));
  settle();
  say(lcm::encode(0, {.client_id = "two words"}, api::Request(api::Stop{})));
  say(lcm::encode(0, lcm::Hello{.client_id = "", .nonce = 1}));
  EXPECT_EQ(front_->dropped(), 3u);
  EXPECT_TRUE(carried_out_.empty());
}

TEST_F(LcmFrontTest, AStatusIsPublishedForAll) {
  publishing_.add(*front_);
  publish_something();
  settle();
  heard_.clear();
  say(lcm::encode(0, {.client_id = "scan", .number = 4}, lcm::GetStatus{}));
  ASSERT_EQ(heard_.size(), 4u);
  EXPECT_TRUE(std::holds_alternative<lcm::DescriptionMessage>(heard_[0]));
  EXPECT_TRUE(std::holds_alternative<lcm::StateMessage>(heard_[1]));
  EXPECT_TRUE(std::holds_alternative<lcm::HealthMessage>(heard_[2]));
  EXPECT_EQ(std::get<lcm::ReplyMessage>(heard_[3]).id.number, 4);
}

class SocketFrontTest : public FrontsTest {
 protected:
  SocketFrontTest() {
    server_ = std::move(*control::Server::open(path_, ""));
    front_ = std::make_unique<SocketFront>(*server_, kRunOfFronts, reception_, publishing_,
                                           [] { return std::int64_t{1}; });
    publishing_.add(*front_);
  }
  void settle() {
    while (readable(server_->fd()) || !reception_.idle()) {
      front_->handle();
      reception_.carry_out_next();
    }
  }
  struct Client {
    std::unique_ptr<client::Link> link;
    std::vector<lcm::DaemonMessage> heard;
    bool ended = false;
  };
  Client connect() { return {.link = std::move(*client::open_socket(path_)), .heard = {}}; }
  void say(Client& client, const Result<lcm::Packet>& packet) {
    EXPECT_TRUE(client.link->send(*packet));
    settle();
    listen(client);
  }
  static void listen(Client& client) {
    client.heard.clear();
    client.ended =
        !client.link->handle([&client](const auto& message) { client.heard.push_back(message); });
  }

  test::TempDirectory directory_;
  std::string path_ = (directory_.path() / "control").string();
  std::unique_ptr<control::Server> server_;
  std::unique_ptr<SocketFront> front_;
};

TEST_F(SocketFrontTest, AConnectionIsASessionAndOnlyItIsAnswered) {
  Client scan = connect();
  Client other = connect();
  say(scan, lcm::encode(0, {.client_id = "scan", .number = 8}, api::Request(api::Move{})));
  listen(other);
  EXPECT_TRUE(other.heard.empty());
  ASSERT_EQ(scan.heard.size(), 2u);
  EXPECT_EQ(std::get<lcm::ReplyMessage>(scan.heard[1]).id.number, 8);
  EXPECT_THAT(who_.at(0), HasSubstr("scan (uid "));
}

TEST_F(SocketFrontTest, OnlyWhoSubscribesHearsStates) {
  Client watch = connect();
  Client quiet = connect();
  say(watch, lcm::encode(lcm::Subscription{.state = true}));
  publish_something();
  listen(watch);
  ASSERT_EQ(watch.heard.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<lcm::StateMessage>(watch.heard[0]));
  listen(quiet);
  EXPECT_TRUE(quiet.heard.empty());
}

TEST_F(SocketFrontTest, AStatusGoesToWhoAsks) {
  publish_something();
  Client asks = connect();
  Client quiet = connect();
  say(asks, lcm::encode(0, {.client_id = "scan", .number = 4}, lcm::GetStatus{}));
  EXPECT_EQ(asks.heard.size(), 4u);
  listen(quiet);
  EXPECT_TRUE(quiet.heard.empty());
}

TEST_F(SocketFrontTest, AConnectionKeepsItsName) {
  Client scan = connect();
  say(scan, lcm::encode(0, {.client_id = "scan", .number = 1}, api::Request(api::Stop{})));
  say(scan, lcm::encode(0, {.client_id = "other", .number = 2}, api::Request(api::Stop{})));
  say(scan, lcm::encode(0, {.client_id = "", .number = 3}, api::Request(api::Stop{})));
  EXPECT_THAT(carried_out_, ElementsAre("stop"));
  EXPECT_EQ(front_->dropped(), 2u);
}

TEST_F(SocketFrontTest, WhatComesAfterItsClientHasGoneIsNobodys) {
  Client scan = connect();
  api::Asker asker;
  Reception keep([&asker](const api::Asker& who, const api::Request&) { asker = who; });
  front_ = nullptr;
  SocketFront front(*server_, kRunOfFronts, keep, publishing_, [] { return std::int64_t{1}; });
  EXPECT_TRUE(scan.link->send(
      *lcm::encode(0, {.client_id = "scan", .number = 1}, api::Request(api::Stop{}))));
  while (readable(server_->fd())) front.handle();
  scan.link.reset();
  while (readable(server_->fd())) front.handle();
  ASSERT_TRUE(asker.session);
  asker.answer(api::Accepted{});
}

TEST_F(SocketFrontTest, RandomPacketsDoNoHarm) {
  std::uint32_t random = 1;
  for (int connection = 0; connection < 30; ++connection) {
    Client client = connect();
    for (int i = 0; i < 20; ++i) {
      lcm::Packet packet{.channel = std::string(lcm::client_channels()[random % 19]),
                         .payload = {}};
      for (random = random * 1664525 + 1013904223; packet.payload.size() < random % 200;) {
        packet.payload.push_back(static_cast<std::uint8_t>(random >> packet.payload.size() % 24));
      }
      (void)client.link->send(packet);
      settle();
    }
    listen(client);
    EXPECT_TRUE(client.ended);
  }
  EXPECT_TRUE(carried_out_.empty());
}

}  // namespace
}  // namespace bushd::daemon
