// Both front ends with a core made up here: requests reach it once, answers go to who asked.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/link.h"
#include "daemon/core/request_log.h"
#include "daemon/fronts/lcm_front.h"
#include "daemon/fronts/socket_front.h"
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
    after_.push_back(asker.after_stops);
    who_.push_back(asker.session->text());
    asker.answer(api::Accepted{});
    asker.answer(api::Completed{.outcome = api::Outcome::kDone,
                                .reason = "the " + std::to_string(carried_out_.size()) + ".",
                                .detail = {}});
  }
  // After how many stops each request has arrived, by its name.
  std::map<std::string, std::uint64_t> arrivals() const {
    std::map<std::string, std::uint64_t> after;
    for (std::size_t i = 0; i < after_.size(); ++i) after[carried_out_[i]] = after_[i];
    return after;
  }
  void publish_something() {
    publishing_.publish(McuId{0}, api::StateSnapshot{.bus = "hall", .mcu = "hall:1"});
    publishing_.publish(McuId{0}, api::Description{.bus = "hall", .mcu = "hall:1"});
    publishing_.publish(BusId{0}, api::HealthSnapshot{.bus = "hall"});
  }

  std::vector<std::string> carried_out_;
  std::vector<std::string> who_;
  std::vector<std::uint64_t> after_;  // how many stops each has arrived
  std::int64_t now_us_ = 1'000'000;
  StopCount stops_;
  Reception reception_{stops_, [this](const api::Asker& asker, const api::Request& request) {
                         carry_out(asker, request);
                       }};
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
      EXPECT_TRUE(transport_->subscribe(
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
    EXPECT_TRUE(transport_->publish("LAB_" + packet->channel, packet->payload));
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

// The network changes their order: the numbers say what was asked first.
TEST_F(LcmFrontTest, AMoveThatWasAskedForBeforeAStopIsAfterNone) {
  const std::int64_t number = session("scan");
  const auto id = [number](std::int64_t n) {
    return lcm::RequestId{.session = number, .client_id = "scan", .number = n};
  };
  EXPECT_EQ(ask(id(2), api::Stop{}), "the 1.");
  EXPECT_EQ(ask(id(1), api::Move{}), "the 2.");
  EXPECT_EQ(ask(id(3), api::Move{}), "the 3.");
  EXPECT_THAT(carried_out_, ElementsAre("stop", "move", "move"));
  EXPECT_THAT(after_, ElementsAre(1u, 0u, 1u));
  EXPECT_EQ(ask(id(1), api::Move{}), "the 2.") << "as often as it is repeated";
  EXPECT_EQ(ask(id(2), api::Stop{}), "the 1.");
  EXPECT_EQ(carried_out_.size(), 3u);
}

// bushctl stops without a session, and repeats that until it is answered, and while it waits.
TEST_F(LcmFrontTest, AStopWithoutASessionIsRepeatedWithoutEffect) {
  const auto stop_at = [this](std::int64_t utime_us) {
    heard_.clear();
    say(lcm::encode(utime_us, {.client_id = "bushctl", .number = 1}, api::Request(api::Stop{})));
    const auto& reply = std::get<lcm::ReplyMessage>(heard_.back());
    EXPECT_EQ(reply.id, (lcm::RequestId{.session = 0, .client_id = "bushctl", .number = 1}));
    return api::reason_of(reply.reply);
  };
  EXPECT_EQ(stop_at(1'000'000), "the 1.");
  EXPECT_EQ(stop_at(1'000'000), "the 1.");
  EXPECT_EQ(stop_at(2'000'000), "the 2.") << "another one";
  EXPECT_EQ(stop_at(0), "the 3.") << "of a client without a clock";
  EXPECT_EQ(stop_at(0), "the 4.");
}

// They have a transport of their own, which is read first.
TEST_F(LcmFrontTest, AMoveThatCameBeforeAStopIsAfterNoneThoughItIsReadLater) {
  const auto stops = std::move(*lcm::Transport::open("memq://"));
  StopCount counted;
  std::vector<std::string> taken;
  Reception reception(counted, [&](const api::Asker& asker, const api::Request& request) {
    taken.push_back(std::string(api::name_of(request)) + " after " +
                    std::to_string(asker.after_stops));
  });
  LcmFront front({.transport = *transport_, .stops = stops.get(), .prefix = "OTHER", .run = 1},
                 reception, publishing_, [] { return std::int64_t{1}; });
  EXPECT_TRUE(front.subscribe());
  const auto jog = [](double per_s) {
    return api::Request(api::Jog{.motor = "m", .per_s = per_s});
  };
  const auto say_on = [](lcm::Transport& transport, const lcm::RequestId& id,
                         const api::Request& request) {
    const auto packet = lcm::encode(1, id, request);
    EXPECT_TRUE(transport.publish("OTHER_" + packet->channel, packet->payload));
  };
  say_on(*transport_, {.client_id = "a", .number = 2}, api::Request(api::ListTables{}));
  say_on(*stops, {.client_id = "b", .number = 1}, jog(0));
  say_on(*stops, {.client_id = "b", .number = 2}, api::Request(api::Pause{}));
  say_on(*stops, {.client_id = "b", .number = 3}, api::Request(api::Stop{}));
  front.handle();
  while (!reception.idle()) reception.carry_out_next();
  EXPECT_THAT(taken,
              ElementsAre("jog after 1", "pause after 2", "stop after 3", "list tables after 0"));
}

// The beginning of a jog comes on both transports, as its end does.
TEST_F(LcmFrontTest, AJogDoesNotOvertakeWhatItsSessionAskedForBefore) {
  const auto stops = std::move(*lcm::Transport::open("memq://"));
  StopCount counted;
  std::vector<std::string> taken;
  Reception reception(counted, [&](const api::Asker& asker, const api::Request& request) {
    taken.push_back(std::string(api::name_of(request)) + " " + std::to_string(asker.number) +
                    " after " + std::to_string(asker.after_stops));
  });
  LcmFront front(
      {.transport = *transport_, .stops = stops.get(), .prefix = "OTHER", .run = 1, .seed = 9},
      reception, publishing_, [] { return std::int64_t{1}; });
  EXPECT_TRUE(front.subscribe());
  const auto say_other = [&](const lcm::Packet& packet, bool on_both = false) {
    for (lcm::Transport* to : {transport_.get(), stops.get()}) {
      if (to == stops.get() && !on_both) continue;
      EXPECT_TRUE(to->publish("OTHER_" + packet.channel, packet.payload));
    }
  };
  const auto carry_out = [&] {
    while (readable(transport_->fd()) || readable(stops->fd())) front.handle();
    while (!reception.idle()) reception.carry_out_next();
    return std::exchange(taken, {});
  };
  say_other(*lcm::encode(0, lcm::Hello{.client_id = "scan", .nonce = 1}));
  carry_out();
  // As the front has opened it.
  const std::int64_t session = api::Sessions(9).open("scan", 1);
  const auto say = [&](std::int64_t number, const api::Request& request, bool on_both = false) {
    say_other(*lcm::encode(1, {.session = session, .client_id = "scan", .number = number}, request),
              on_both);
  };
  const auto jog = [](double per_s) {
    return api::Request(api::Jog{.motor = "m", .per_s = per_s});
  };
  say(1, api::Move{});
  say(2, jog(5), true);
  EXPECT_THAT(carry_out(), ElementsAre("move 1 after 0", "jog 2 after 0"));
  say(3, api::Move{});
  say(4, jog(0), true);
  EXPECT_THAT(carry_out(), ElementsAre("jog 4 after 1", "move 3 after 0"));
  // A stop by a number that is another request's is none of its session: its time counts.
  say(5, api::Move{});
  say(4, api::Stop{}, true);
  EXPECT_THAT(carry_out(), ElementsAre("stop 4 after 2", "move 5 after 1"));
}

TEST_F(LcmFrontTest, WhatIsNoMessageIsCounted) {
  EXPECT_TRUE(transport_->publish("LAB_MOVE", std::vector<std::uint8_t>(20, 0xFF)));
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
    serve(publishing_);
  }
  // From now on nothing else may publish: what is served then has a front that is gone.
  void serve(Publishing& publishing) {
    front_.reset();
    front_ = std::make_unique<SocketFront>(*server_, kRunOfFronts, reception_, publishing,
                                           [] { return std::int64_t{1}; });
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

// 16384 motors: all is told at once, who asked reads it afterwards, and who hears what is published
// too. Who does not read is closed, as where there are few.
TEST_F(SocketFrontTest, AStatusOfThousandsOfMotorsIsWhole) {
  constexpr std::size_t kMcus = 1024;
  Publishing many(
      kRunOfFronts, kMcus, 1,
      {.now_us = [this] { return now_us_; }, .unix_us = [] { return std::int64_t{1}; }});
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
  say(scan, lcm::encode(0, {.client_id = "scan", .number = 1}, api::Request(api::Stop{})));
  say(scan, lcm::encode(0, {.client_id = "other", .number = 2}, api::Request(api::Stop{})));
  say(scan, lcm::encode(0, {.client_id = "", .number = 3}, api::Request(api::Stop{})));
  EXPECT_THAT(carried_out_, ElementsAre("stop"));
  EXPECT_EQ(front_->dropped(), 1u) << "a name that is none cannot be answered";
}

TEST_F(SocketFrontTest, AnotherNameOnAConnectionIsRefusedWithAnAnswer) {
  Client scan = connect();
  say(scan, lcm::encode(0, {.client_id = "scan", .number = 1}, api::Request(api::Enable{})));
  say(scan, lcm::encode(0, {.client_id = "other", .number = 7}, api::Request(api::Enable{})));
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
  const auto send = [](Client& client, std::int64_t number, const api::Request& request) {
    EXPECT_TRUE(client.link->send(*lcm::encode(0, {.client_id = "c", .number = number}, request)));
  };
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
  const auto send = [](Client& client, std::int64_t number, const api::Request& request) {
    EXPECT_TRUE(client.link->send(*lcm::encode(0, {.client_id = "c", .number = number}, request)));
  };
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
  SocketFront front(*server_, kRunOfFronts, keep, publishing_, [] { return std::int64_t{1}; });
  EXPECT_TRUE(scan.link->send(
      *lcm::encode(0, {.client_id = "scan", .number = 1}, api::Request(api::Stop{}))));
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
  say(scan, lcm::encode(0, {.client_id = "scan", .number = 1}, api::Request(api::Move{})));
  ASSERT_EQ(scan.heard.size(), 1u);
  const auto& refused = std::get<api::Refused>(std::get<lcm::ReplyMessage>(scan.heard[0]).reply);
  EXPECT_THAT(refused.reason, HasSubstr("may stop motors and no more: process "));
  EXPECT_THAT(refused.reason, HasSubstr(std::to_string(all) + " connections"));
  say(scan, lcm::encode(0, {.client_id = "scan", .number = 2}, api::Request(api::Stop{})));
  EXPECT_THAT(carried_out_, ElementsAre("stop"));
  publish_something();
  listen(scan);
  EXPECT_EQ(scan.heard.size(), 1u) << "states are told, for who waits for the end of a stop";
}

TEST_F(SocketFrontTest, LooksForItsFileOnceASecond) {
  std::vector<std::string> logged;
  front_ = nullptr;
  SocketFront front(
      *server_, kRunOfFronts, reception_, publishing_, [] { return std::int64_t{1}; },
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
