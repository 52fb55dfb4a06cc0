// Requests over the control socket.
#include "daemon/fronts/socket_front.h"

#include <filesystem>
#include <memory>

#include "client/link.h"
#include "daemon/fronts.h"
#include "tables/temp_directory.h"

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class SocketFrontTest : public FrontsTest {
 protected:
  SocketFrontTest() {
    server_ = std::move(*control::Server::open(path_, ""));
    serve(publishing_);
  }
  // From now on nothing else may publish: what is served then has a front that is gone.
  void serve(Publishing& publishing) {
    front_.reset();
    front_ = std::make_unique<SocketFront>(*server_, kRunOfFronts, reception_, publishing, unix_us);
    publishing.add(*front_);
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
  void ask(Client& client, std::int64_t number, const api::Request& request,
           const std::string& name = "scan") {
    send(client, number, request, name);
    settle();
    listen(client);
  }
  // It is read later.
  static void send(Client& client, std::int64_t number, const api::Request& request,
                   const std::string& name = "scan") {
    EXPECT_TRUE(client.link->send(*lcm::encode(0, {.client_id = name, .number = number}, request)));
  }
  static void listen(Client& client) {
    client.heard.clear();
    client.ended =
        !client.link->handle([&client](const auto& message) { client.heard.push_back(message); });
  }

  // How many messages, until there are no more.
  std::size_t hear_all(Client& client) {
    std::size_t messages = 0;
    do {
      listen(client);
      messages += client.heard.size();
      settle();
    } while (!client.heard.empty());
    return messages;
  }

  test::TempDirectory directory_;
  std::string path_ = (directory_.path() / "control").string();
  std::unique_ptr<control::Server> server_;
  std::unique_ptr<SocketFront> front_;
};

TEST_F(SocketFrontTest, AConnectionIsASessionAndOnlyItIsAnswered) {
  Client scan = connect();
  Client other = connect();
  ask(scan, 8, api::Move{});
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

// 16384 motors: all is told at once, who asked reads it afterwards, and who hears what is published
// too. Who does not read is closed, as where there are few.
TEST_F(SocketFrontTest, AStatusOfThousandsOfMotorsIsWhole) {
  constexpr std::size_t kMcus = 1024;
  Publishing many(kRunOfFronts, kMcus, 1,
                  {.now_us = [this] { return now_us_; }, .unix_us = unix_us});
  serve(many);
  Client asks = connect();
  Client watches = connect();
  Client deaf = connect();
  say(watches, lcm::encode(lcm::Subscription{.state = true, .description = true}));
  EXPECT_TRUE(deaf.link->send(*lcm::encode(lcm::Subscription{.state = true})));
  settle();
  const std::string name(31, 'm');
  const api::StateSnapshot state{
      .bus = "hall", .mcu = "hall:1", .motors = std::vector<api::MotorState>(16, {.name = name})};
  const api::Description description{
      .bus = "hall",
      .mcu = "hall:1",
      .motors = std::vector<api::MotorDescription>(16, {.name = name, .group = name})};
  for (std::size_t mcu = 0; mcu < kMcus; ++mcu) {
    many.publish(McuId{mcu}, state);
    many.publish(McuId{mcu}, description);
  }
  EXPECT_GT(many.newest_bytes(), 2 * control::Limits().unread_bytes);
  EXPECT_TRUE(
      asks.link->send(*lcm::encode(0, {.client_id = "scan", .number = 4}, lcm::GetStatus{})));
  settle();
  EXPECT_EQ(hear_all(watches), 2 * kMcus);
  EXPECT_EQ(hear_all(asks), 2 * kMcus + 1);
  EXPECT_EQ(server_->connections(), 3u);
  for (int i = 0; i < 10; ++i) {
    now_us_ += Publishing::kRestingPeriodUs;
    for (std::size_t mcu = 0; mcu < kMcus; ++mcu) many.publish(McuId{mcu}, state);
    EXPECT_EQ(hear_all(watches), kMcus);
  }
  EXPECT_EQ(server_->connections(), 2u);
  hear_all(deaf);
  EXPECT_TRUE(deaf.ended);
  front_.reset();  // before what it serves
}

TEST_F(SocketFrontTest, AConnectionKeepsItsName) {
  Client scan = connect();
  ask(scan, 1, api::Stop{});
  ask(scan, 2, api::Stop{}, "other");
  ask(scan, 3, api::Stop{}, "");
  EXPECT_THAT(carried_out_, ElementsAre("stop"));
  EXPECT_EQ(front_->dropped(), 1u) << "a name that is none cannot be answered";
}

TEST_F(SocketFrontTest, AnotherNameOnAConnectionIsRefusedWithAnAnswer) {
  Client scan = connect();
  ask(scan, 1, api::Enable{});
  ask(scan, 7, api::Enable{}, "other");
  ASSERT_EQ(scan.heard.size(), 1u);
  const auto& reply = std::get<lcm::ReplyMessage>(scan.heard[0]);
  EXPECT_EQ(reply.id.client_id, "other");
  EXPECT_EQ(reply.id.number, 7);
  EXPECT_THAT(std::get<api::Refused>(reply.reply).reason,
              HasSubstr("this connection is that of client_id scan"));
  EXPECT_EQ(carried_out_.size(), 1u);
  EXPECT_EQ(front_->dropped(), 0u);
}

// Stops are read first, and the kernel says what came first.
TEST_F(SocketFrontTest, AMoveThatCameBeforeAStopIsAfterNoneThoughItIsReadLater) {
  Client scan = connect();
  Client panel = connect();
  Client late = connect();
  for (Client* client : {&scan, &panel, &late}) {
    say(*client, lcm::encode(lcm::Subscription{}));  // all are accepted
  }
  send(scan, 1, api::Move{});
  send(scan, 2, api::Home{});
  send(panel, 1, api::Stop{});
  send(panel, 2, api::Arm{});
  send(late, 1, api::Enable{});
  settle();
  EXPECT_EQ(carried_out_.front(), "stop");
  const std::map<std::string, std::uint64_t> expected{
      {"stop", 1}, {"move", 0}, {"home", 0}, {"arm", 1}, {"enable", 1}};
  EXPECT_EQ(arrivals(), expected);
}

// bushctl connects for each command: both may be there when the daemon looks.
TEST_F(SocketFrontTest, WhatWasSentBeforeTheConnectionWasAcceptedIsBeforeAStop) {
  Client panel = connect();
  say(panel, lcm::encode(lcm::Subscription{}));
  Client scan = connect();
  send(scan, 1, api::Move{});
  Client other = connect();
  send(other, 1, api::Pause{});
  send(other, 2, api::Resume{});
  send(panel, 1, api::Stop{});
  settle();
  Client late = connect();
  send(late, 1, api::Enable{});
  settle();
  auto after = arrivals();
  EXPECT_EQ(after["move"], 0u) << "before both";
  EXPECT_EQ(after["resume"], 0u) << "it may have been";
  EXPECT_EQ(after["enable"], 2u) << "connected after both";
  // A resume that was sent behind its own pause is not ended by that.
  Client alone = connect();
  send(alone, 1, api::Pause{});
  send(alone, 2, api::Resume{});
  carried_out_.clear();
  after_.clear();
  settle();
  EXPECT_THAT(carried_out_, ElementsAre("pause", "resume"));
  EXPECT_THAT(after_, ElementsAre(3u, 3u));
}

TEST_F(SocketFrontTest, WhatComesAfterItsClientHasGoneIsNobodys) {
  Client scan = connect();
  api::Asker asker;
  StopCount stops;
  Reception keep(stops, [&asker](const api::Asker& who, const api::Request&) { asker = who; });
  front_ = nullptr;
  SocketFront front(*server_, kRunOfFronts, keep, publishing_, unix_us);
  send(scan, 1, api::Stop{});
  while (readable(server_->fd())) front.handle();
  scan.link.reset();
  while (readable(server_->fd())) front.handle();
  ASSERT_TRUE(asker.session);
  asker.answer(api::Accepted{});
}

// Everybody can still stop motors when a program has taken all places.
TEST_F(SocketFrontTest, WithoutAPlaceAClientMayStopAndIsToldWhoHasThem) {
  std::vector<Client> greedy;
  const std::size_t all = control::Places::Limits().of_process;
  for (std::size_t i = 0; i < all; ++i) {
    greedy.push_back(connect());
    settle();
  }
  Client scan = connect();
  say(scan, lcm::encode(lcm::Subscription{.state = true}));
  ask(scan, 1, api::Move{});
  ASSERT_EQ(scan.heard.size(), 1u);
  const auto& refused = std::get<api::Refused>(std::get<lcm::ReplyMessage>(scan.heard[0]).reply);
  EXPECT_THAT(refused.reason, HasSubstr("may stop motors and no more: process "));
  EXPECT_THAT(refused.reason, HasSubstr(std::to_string(all) + " connections"));
  ask(scan, 2, api::Stop{});
  EXPECT_THAT(carried_out_, ElementsAre("stop"));
  publish_something();
  listen(scan);
  EXPECT_EQ(scan.heard.size(), 1u) << "states are told, for who waits for the end of a stop";
}

TEST_F(SocketFrontTest, LooksForItsFileOnceASecond) {
  std::vector<std::string> logged;
  front_ = nullptr;
  SocketFront front(*server_, kRunOfFronts, reception_, publishing_, unix_us,
                    [&](const std::string& text) { logged.push_back(text); });
  front.step(0);
  std::filesystem::remove(path_);
  front.step(999'999);
  EXPECT_FALSE(server_->in_place());
  std::filesystem::create_directory(path_);  // in the way
  front.step(front.next_wake_us());
  front.step(front.next_wake_us());
  ASSERT_EQ(logged.size(), 1u) << "not each time";
  EXPECT_THAT(logged[0], HasSubstr("cannot be made again"));
  std::filesystem::remove(path_);
  front.step(front.next_wake_us());
  EXPECT_TRUE(server_->in_place());
  ASSERT_EQ(logged.size(), 2u);
  EXPECT_THAT(logged[1], HasSubstr("had been deleted; it is made again"));
}

// Its connection may have been closed by a daemon that lives.
TEST_F(SocketFrontTest, AClientSaysWhetherTheDaemonHasEnded) {
  for (const bool ends : {false, true}) {
    Client client = connect();
    settle();
    for (int i = 0; i < 16; ++i) (void)client.link->send({.channel = "NOTHING", .payload = {}});
    if (ends) {
      front_ = nullptr;
      server_ = nullptr;
    } else {
      settle();
    }
    const auto handled = client.link->handle([](const auto&) {});
    ASSERT_FALSE(handled);
    EXPECT_THAT(handled.error().text(),
                HasSubstr(ends ? "the daemon has ended" : "bushd has closed this connection"));
  }
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
