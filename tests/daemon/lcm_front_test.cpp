// Requests by LCM.
#include "daemon/fronts/lcm_front.h"

#include <memory>
#include <utility>

#include "api/sessions.h"
#include "daemon/fronts.h"

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

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
                                        reception_, publishing_, unix_us);
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
    say(lcm::encode(utime_us, {.client_id = "bushctl", .number = 1}, api::Stop{}));
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

// What another session asked for is another stop: so it is with two programs of one name, and with
// one whose clock stands.
TEST_F(LcmFrontTest, AStopOfAnotherUnknownSessionIsNoRepetition) {
  const auto stop_in = [this](std::int64_t session) {
    heard_.clear();
    say(lcm::encode(1'000'000, {.session = session, .client_id = "scan", .number = 1},
                    api::Stop{}));
    return api::reason_of(std::get<lcm::ReplyMessage>(heard_.back()).reply);
  };
  EXPECT_EQ(stop_in(0), "the 1.");
  EXPECT_EQ(stop_in(7), "the 2.");
  EXPECT_EQ(stop_in(8), "the 3.");
  EXPECT_EQ(stop_in(7), "the 2.") << "a repetition";
  EXPECT_EQ(stop_in(0), "the 1.");
  // A session of another client is as unknown.
  EXPECT_EQ(stop_in(session("other")), "the 4.");
  EXPECT_THAT(carried_out_, ElementsAre("stop", "stop", "stop", "stop"));
  EXPECT_THAT(after_, ElementsAre(1u, 2u, 3u, 4u)) << "each counts itself";
}

// Another front, with a transport of its own for what ends motion, which is read first.
class UrgentFrontTest : public LcmFrontTest {
 protected:
  UrgentFrontTest() { EXPECT_TRUE(urgent_.subscribe()); }
  static void say_on(lcm::Transport& transport, const lcm::Packet& packet) {
    EXPECT_TRUE(transport.publish("OTHER_" + packet.channel, packet.payload));
  }
  static void say_on(lcm::Transport& transport, const lcm::RequestId& id,
                     const api::Request& request) {
    say_on(transport, *lcm::encode(1, id, request));
  }
  static api::Request jog(double per_s) { return api::Jog{.motor = "m", .per_s = per_s}; }
  // "jog 2 after 1": its number, and how many stops had arrived.
  std::vector<std::string> carry_out() {
    while (readable(transport_->fd()) || readable(stops_only_->fd())) urgent_.handle();
    while (!urgent_reception_.idle()) urgent_reception_.carry_out_next();
    return std::exchange(taken_, {});
  }

  static constexpr std::uint64_t kSeed = 9;
  std::unique_ptr<lcm::Transport> stops_only_ = std::move(*lcm::Transport::open("memq://"));
  StopCount counted_;
  std::vector<std::string> taken_;
  Reception urgent_reception_{
      counted_, [this](const api::Asker& asker, const api::Request& request) {
        taken_.push_back(std::string(api::name_of(request)) + " " + std::to_string(asker.number) +
                         " after " + std::to_string(asker.after_stops));
      }};
  LcmFront urgent_{{.transport = *transport_,
                    .stops = stops_only_.get(),
                    .prefix = "OTHER",
                    .run = 1,
                    .seed = kSeed},
                   urgent_reception_,
                   publishing_,
                   unix_us};
};

TEST_F(UrgentFrontTest, AMoveThatCameBeforeAStopIsAfterNoneThoughItIsReadLater) {
  say_on(*transport_, {.client_id = "a", .number = 4}, api::ListTables{});
  say_on(*stops_only_, {.client_id = "b", .number = 1}, jog(0));
  say_on(*stops_only_, {.client_id = "b", .number = 2}, api::Pause{});
  say_on(*stops_only_, {.client_id = "b", .number = 3}, api::Stop{});
  EXPECT_THAT(carry_out(), ElementsAre("jog 1 after 1", "pause 2 after 2", "stop 3 after 3",
                                       "list tables 4 after 0"));
}

// The beginning of a jog comes on both transports, as its end does.
TEST_F(UrgentFrontTest, AJogDoesNotOvertakeWhatItsSessionAskedForBefore) {
  say_on(*transport_, *lcm::encode(0, lcm::Hello{.client_id = "scan", .nonce = 1}));
  carry_out();
  // As the front has opened it.
  const std::int64_t session = api::Sessions(kSeed).open("scan", 1);
  const auto say_one = [&](std::int64_t number, const api::Request& request) {
    say_on(*transport_, {.session = session, .client_id = "scan", .number = number}, request);
  };
  const auto say_both = [&](std::int64_t number, const api::Request& request) {
    say_one(number, request);
    say_on(*stops_only_, {.session = session, .client_id = "scan", .number = number}, request);
  };
  say_one(1, api::Move{});
  say_both(2, jog(5));
  EXPECT_THAT(carry_out(), ElementsAre("move 1 after 0", "jog 2 after 0"));
  say_one(3, api::Move{});
  say_both(4, jog(0));
  EXPECT_THAT(carry_out(), ElementsAre("jog 4 after 1", "move 3 after 0"));
  // A stop by a number that is another request's is none of its session: its time counts.
  say_one(5, api::Move{});
  say_both(4, api::Stop{});
  EXPECT_THAT(carry_out(), ElementsAre("stop 4 after 2", "move 5 after 1"));
}

TEST_F(LcmFrontTest, WhatIsNoMessageIsCounted) {
  EXPECT_TRUE(transport_->publish("LAB_MOVE", std::vector<std::uint8_t>(20, 0xFF)));
  settle();
  say(lcm::encode(0, {.client_id = "two words"}, api::Stop{}));
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

}  // namespace
}  // namespace bushd::daemon
