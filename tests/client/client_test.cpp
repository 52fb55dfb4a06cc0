// Requests of a client to a daemon that loses messages, falls silent or restarts.
#include "api/session.h"
#include "api/sessions.h"
#include "client/client_fixture.h"

namespace bushd::client {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

TEST_F(ClientTest, ReturnsTheResultAndShowsEachReplyOnce) {
  daemon_ = [this] {
    reply(api::Accepted{});
    reply(api::Accepted{});
    reply(result(api::Outcome::kReached));
    reply(result(api::Outcome::kReached));
  };
  EXPECT_EQ(end_of(move()), "reached");
  EXPECT_EQ(heard_, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(requests_[0].id.session, kSession);
  EXPECT_TRUE(api::is_client_id(requests_[0].id.client_id));
}

TEST_F(ClientTest, IsContentWithAcceptedWhenAskedTo) {
  daemon_ = [this] { reply(api::Accepted{}); };
  EXPECT_EQ(end_of(move(Client::Until::kAnswered)), "accepted");
}

TEST_F(ClientTest, RefusedEndsIt) {
  daemon_ = [this] { reply(api::Refused{"no"}); };
  EXPECT_EQ(end_of(move()), "refused: no");
}

TEST_F(ClientTest, RepeatsHelloAndRequestUntilAnswered) {
  lost_hellos_ = 2;
  daemon_ = [this] {
    if (requests_.size() == 3) reply(result(api::Outcome::kReached));
  };
  ASSERT_EQ(end_of(move()), "reached");
  EXPECT_EQ(hellos_, 3);
  ASSERT_EQ(requests_.size(), 3u);
  EXPECT_EQ(requests_[0].id, requests_[2].id);
}

TEST_F(ClientTest, CountsItsRequestsUpInOneSession) {
  daemon_ = [this] { reply(result(api::Outcome::kReached)); };
  ASSERT_TRUE(move());
  ASSERT_TRUE(move());
  EXPECT_EQ(hellos_, 1);
  EXPECT_EQ(requests_[1].id.number, requests_[0].id.number + 1);
}

TEST_F(ClientTest, OpensANewSessionAfterItsWasForgotten) {
  daemon_ = [this] { reply(api::Refused{std::string(api::kUnknownSession) + ": ..."}); };
  const auto refused = move();
  ASSERT_TRUE(refused);
  EXPECT_EQ(requests_.size(), 1u) << "it may have been carried out earlier";
  session_ = 78;
  daemon_ = [this] { reply(result(api::Outcome::kReached)); };
  EXPECT_EQ(end_of(move()), "reached");
  EXPECT_EQ(requests_.back().id.session, 78);
}

TEST_F(ClientTest, StopsWithoutASession) {
  lost_hellos_ = 1'000'000;
  daemon_ = [this] { reply(result(api::Outcome::kDone)); };
  EXPECT_TRUE(run(api::EmergencyStop{}, Client::Until::kResult));
  EXPECT_EQ(requests_.at(0).id.session, 0);
}

TEST_F(ClientTest, RepliesToOthersAreNotItsOwn) {
  daemon_ = [this] {
    lcm::ReplyMessage other{.id = requests_.back().id, .reply = result(api::Outcome::kFault)};
    other.id.client_id = "somebody-else";
    link_->say(other);
    other.id = requests_.back().id;
    ++other.id.session;
    link_->say(other);
    reply(result(api::Outcome::kReached));
  };
  EXPECT_EQ(end_of(move()), "reached");
}

TEST_F(ClientTest, GivesUpWhenNobodyAnswersAndSaysWhatToLookAt) {
  open(true, milliseconds(50));
  EXPECT_THAT(end_of(move()), HasSubstr("no bushd answers"));
  EXPECT_GT(requests_.size(), 1u);
}

TEST_F(ClientTest, AsksAgainForALostResultWhileTheDaemonLives) {
  keep_publishing_states();
  daemon_ = [this] {
    reply(api::Accepted{});
    if (requests_.size() > 1) reply(result(api::Outcome::kReached));
  };
  EXPECT_EQ(end_of(move()), "reached");
  EXPECT_EQ(requests_.size(), 2u);
}

TEST_F(ClientTest, NoticesADaemonThatHasRestarted) {
  daemon_ = [this] {
    state(900);
    reply(api::Accepted{});
    ++run_;
    state(1);
  };
  EXPECT_THAT(end_of(move()), HasSubstr("restarted"));
  EXPECT_EQ(requests_.size(), 1u);
}

TEST_F(ClientTest, ARestartBeforeTheRequestDoesNotMatter) {
  state(900);
  ++run_;
  state(1);
  daemon_ = [this] { reply(result(api::Outcome::kReached)); };
  EXPECT_EQ(end_of(move()), "reached");
}

TEST_F(ClientTest, NoticesADaemonThatFallsSilent) {
  open(true, milliseconds(50));
  daemon_ = [this] { reply(api::Accepted{}); };
  EXPECT_THAT(end_of(move()), HasSubstr("silent"));
}

TEST_F(ClientTest, SaysThatADaemonLivesAndDoesNotAnswer) {
  open(true, milliseconds(50));
  keep_publishing_states();
  EXPECT_EQ(end_of(move()),
            "bushd sends its state but has not answered for 0.05 s; it may still carry this out");
}

TEST_F(ClientTest, SaysThatNothingWasAskedOfADaemonThatGivesNoSession) {
  open(true, milliseconds(50));
  lost_hellos_ = 1'000'000;
  keep_publishing_states();
  EXPECT_THAT(end_of(move()), HasSubstr("nothing was asked of it"));
  EXPECT_TRUE(requests_.empty());
}

TEST_F(ClientTest, ARefusalOfWhatWasAcceptedIsNoResult) {
  daemon_ = [this] {
    reply(api::Accepted{});
    reply(api::Refused{"who are you"});
  };
  const auto ended = move();
  ASSERT_FALSE(ended) << end_of(ended);
  EXPECT_THAT(ended.error().text(), HasSubstr("who are you"));
  EXPECT_EQ(heard_, (std::vector<std::size_t>{0})) << "not accepted and refused both";
}

TEST_F(ClientTest, DoesNotCommandWhereTwoDaemonsWelcomeIt) {
  daemon_ = [this] { reply(result(api::Outcome::kDone)); };
  link_->on_send = [this](const lcm::ClientMessage& message) {
    on_send(message);
    if (!std::holds_alternative<lcm::Hello>(message.content)) return;
    ++run_;
    ++session_;
    on_send(message);
  };
  EXPECT_THAT(end_of(move()), HasSubstr("two daemons"));
  EXPECT_TRUE(requests_.empty());
  EXPECT_TRUE(run(api::Stop{}, Client::Until::kResult)) << "a stop is for both";
  EXPECT_TRUE(run(api::EmergencyStop{}, Client::Until::kResult));
  EXPECT_EQ(requests_.size(), 2u);
}

TEST_F(ClientTest, DoesNotCommandWhereTwoDaemonsSendTheirStates) {
  daemon_ = [this] { reply(result(api::Outcome::kReached)); };
  for (const std::int64_t run : {5, 6, 5}) {
    run_ = run;
    state(1);
  }
  EXPECT_THAT(end_of(move()), HasSubstr("two daemons"));
  EXPECT_TRUE(requests_.empty());
}

TEST_F(ClientTest, IsInterruptedThroughItsDescriptor) {
  ASSERT_EQ(eventfd_write(interrupt_, 1), 0);
  EXPECT_FALSE(move());
  EXPECT_TRUE(client_->interrupted());
}

// A request that is to end the first one follows it, for it might overtake it; then the first one's
// result counts.
TEST_F(ClientTest, InterruptedSendsWhatEndsTheRequestAndAwaitsItsResult) {
  for (const bool loses : {true, false}) {
    open(loses);
    int interrupted = 0;
    on_interrupt_ = [&]() -> std::optional<api::Request> {
      eventfd_t count = 0;
      eventfd_read(interrupt_, &count);
      ++interrupted;
      reply(api::Accepted{});
      return api::Stop{{"theta"}};
    };
    std::optional<lcm::RequestId> first;
    bool stopped = false;
    daemon_ = [&] {
      const auto& request = std::get<api::Request>(requests_.back().content);
      if (std::holds_alternative<api::Move>(request)) {
        if (!first) eventfd_write(interrupt_, 1);
        first = requests_.back().id;
        return;
      }
      EXPECT_TRUE(first) << "the stop came first";
      EXPECT_EQ(std::get<api::Stop>(request).motors, api::MotorNames{"theta"});
      reply(result(api::Outcome::kDone));  // of the stop, which nobody waits for
      if (std::exchange(stopped, true)) return;
      link_->say(lcm::ReplyMessage{.id = *first, .reply = result(api::Outcome::kStopped)});
    };
    const auto moved = move();
    EXPECT_EQ(end_of(moved), "stopped");
    EXPECT_TRUE(stopped);
    EXPECT_EQ(interrupted, 1);
    EXPECT_FALSE(client_->interrupted());
  }
}

TEST_F(ClientTest, SendsRequestsBesideTheOneThatIsAwaited) {
  for (const bool loses : {true, false}) {
    open(loses);
    std::optional<lcm::RequestId> first;
    int renewed = 0;
    daemon_ = [&] {
      const auto* jog = std::get_if<api::Jog>(&std::get<api::Request>(requests_.back().content));
      ASSERT_TRUE(jog != nullptr);
      reply(api::Accepted{});
      if (!first) first = requests_.back().id;
      if (!jog->renew) return;
      reply(result(api::Outcome::kDone));  // of the renewal, which nobody waits for
      if (++renewed < 3) return;
      link_->say(lcm::ReplyMessage{.id = *first, .reply = result(api::Outcome::kLimit)});
    };
    const auto jogged =
        client_->run(api::Jog{.motor = "theta", .per_s = 1}, Client::Until::kResult,
                     {.beside = [] { return std::optional<api::Request>(api::Jog{.renew = true}); },
                      .beside_every = std::chrono::milliseconds(1)});
    EXPECT_EQ(end_of(jogged), "limit");
    EXPECT_EQ(renewed, 3);
  }
}

// Whoever presses a key does not wait for the next sign of life.
TEST_F(ClientTest, InputIsTakenAtOnceAndMayEndTheRequest) {
  for (const bool loses : {true, false}) {
    open(loses);
    const int input = eventfd(0, EFD_CLOEXEC);
    std::optional<lcm::RequestId> first;
    int beside = 0;
    bool pressed = false;
    daemon_ = [&] {
      const auto& request = std::get<api::Request>(requests_.back().content);
      reply(api::Accepted{});
      if (!first) first = requests_.back().id;
      if (const auto* jog = std::get_if<api::Jog>(&request); jog != nullptr && jog->renew) {
        eventfd_write(input, 1);
      } else if (std::holds_alternative<api::Stop>(request)) {
        link_->say(lcm::ReplyMessage{.id = *first, .reply = result(api::Outcome::kStopped)});
      }
    };
    const auto jogged = client_->run(
        api::Jog{.motor = "theta", .per_s = 1}, Client::Until::kResult,
        {.beside = [&]() -> std::optional<api::Request> {
           if (++beside == 1) return api::Jog{.renew = true};
           eventfd_t count = 0;
           eventfd_read(input, &count);
           pressed = true;
           return std::nullopt;
         },
         .beside_every = std::chrono::hours(1),
         .beside_fd = input,
         .end = [&] { return pressed ? std::optional<api::Request>(api::Stop{}) : std::nullopt; }});
    close(input);
    EXPECT_EQ(end_of(jogged), "stopped");
    EXPECT_EQ(beside, 2);
  }
}

TEST_F(ClientTest, InterruptedASecondTimeNoLongerWaits) {
  on_interrupt_ = [&]() -> std::optional<api::Request> { return api::Stop{}; };  // readable still
  daemon_ = [this] {
    reply(api::Accepted{});
    eventfd_write(interrupt_, 1);
  };
  EXPECT_FALSE(move());
  EXPECT_TRUE(client_->interrupted());
}

TEST_F(ClientTest, ShowsTheStateWhileARequestRuns) {
  std::vector<std::int64_t> shown;
  on_state_ = [&](const Status& status) {
    shown.push_back(status.sequence());
    reply(result(api::Outcome::kReached));
  };
  daemon_ = [this] {
    reply(api::Accepted{});
    description(1);
    state(2);
  };
  EXPECT_EQ(end_of(move()), "reached");
  EXPECT_EQ(shown, std::vector<std::int64_t>{2});
}

TEST_F(ClientTest, OverALinkThatLosesNothingSaysEverythingOnce) {
  open(false);
  int handled = 0;
  link_->on_handled = [this, &handled](const lcm::DaemonMessage&) {
    // The result comes later than any time to repeat.
    if (++handled < 200) return state(handled);
    reply(result(api::Outcome::kReached));
  };
  daemon_ = [this] { reply(api::Accepted{}); };
  EXPECT_EQ(end_of(move()), "reached");
  EXPECT_EQ(requests_.size(), 1u);
  EXPECT_EQ(hellos_, 0);
}

TEST_F(ClientTest, TheEndOfTheLinkIsTheEndOfTheDaemon) {
  open(false);
  daemon_ = [this] {
    reply(api::Accepted{});
    link_->end();
  };
  EXPECT_FALSE(client_->ended());
  EXPECT_THAT(end_of(move()), HasSubstr("ended"));
  EXPECT_TRUE(client_->ended()) << "whoever goes on asking would do so for ever";
}

TEST_F(ClientTest, AResultBeforeTheEndOfTheLinkCounts) {
  open(false);
  daemon_ = [this] {
    reply(api::Accepted{});
    reply(result(api::Outcome::kReached));
    link_->end();
  };
  EXPECT_EQ(end_of(move()), "reached");
}

}  // namespace
}  // namespace bushd::client
