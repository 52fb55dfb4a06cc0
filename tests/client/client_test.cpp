// The client against a daemon that loses messages, falls silent or restarts.
#include "client/client.h"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <functional>
#include <vector>

#include "api/session.h"
#include "api/sessions.h"
#include "client/fake_link.h"

namespace bushd::client {
namespace {

using std::chrono::milliseconds;

constexpr std::int64_t kSession = 77;

class ClientTest : public testing::Test {
 protected:
  void SetUp() override { open(true, std::chrono::minutes(5)); }
  ~ClientTest() override { close(interrupt_); }

  // Patient where patience must not matter, so that a busy machine fails no test.
  void open(bool loses, milliseconds patience) {
    auto link = std::make_unique<test::FakeLink>(loses);
    link_ = link.get();
    link_->on_send = [this](const lcm::ClientMessage& message) { on_send(message); };
    client_ = std::make_unique<Client>(std::move(link),
                                       ClientOptions{.program = "test",
                                                     .interrupt_fd = interrupt_,
                                                     .resend_every = milliseconds(3),
                                                     .answer_within = patience,
                                                     .ask_again_every = milliseconds(10),
                                                     .silence_limit = patience,
                                                     .others_answer_within = milliseconds(1)});
  }

  void on_send(const lcm::ClientMessage& message) {
    if (const auto* hello = std::get_if<lcm::Hello>(&message.content)) {
      if (++hellos_ > lost_hellos_) {
        link_->say(lcm::Welcome{.hello = *hello, .run = run_, .session = session_});
      }
    } else if (std::holds_alternative<api::Request>(message.content)) {
      requests_.push_back(message);
      if (daemon_) daemon_();
    } else if (std::holds_alternative<lcm::GetStatus>(message.content)) {
      ++status_asked_;
      if (on_status_) on_status_();
    }
  }

  void reply(const api::Reply& reply) {
    link_->say(lcm::ReplyMessage{.id = requests_.back().id, .reply = reply});
  }
  static api::Reply result(api::Outcome outcome) {
    return api::Completed{.outcome = outcome, .reason = "because", .detail = {}};
  }
  void state(std::int64_t sequence, std::int32_t part = 0, std::int32_t parts = 1) {
    lcm::StateMessage message;
    message.part = {.run = run_, .sequence = sequence, .part = part, .parts = parts};
    message.snapshot.mcu = "hall:" + std::to_string(part + 1);
    message.snapshot.tick = sequence;
    link_->say(message);
  }
  void description(std::int64_t sequence, std::int32_t part = 0, std::int32_t parts = 1) {
    link_->say(lcm::DescriptionMessage{
        .part = {.run = run_, .sequence = sequence, .part = part, .parts = parts}, .snapshot = {}});
  }
  void health(std::int64_t sequence) {
    link_->say(
        lcm::HealthMessage{.part = {.sequence = sequence, .part = 0, .parts = 1}, .snapshot = {}});
  }
  // A message that makes the next one: something goes on as long as the client handles messages.
  void keep_publishing_states() {
    link_->on_handled = [this](const lcm::DaemonMessage& heard) {
      if (const auto* message = std::get_if<lcm::StateMessage>(&heard)) {
        state(message->part.sequence + 1);
      }
    };
    state(1);
  }
  Result<api::Reply> run(const api::Request& request, Client::Until until) {
    return client_->run(
        request, until,
        {.on_reply = [this](const api::Reply& heard) { heard_.push_back(heard.index()); },
         .on_state = on_state_,
         .on_interrupt = on_interrupt_});
  }
  Result<api::Reply> move(Client::Until until = Client::Until::kResult) {
    return run(api::Move{.motors = {{"theta", -400}}}, until);
  }
  static bool reached(const Result<api::Reply>& reply) {
    const auto* completed = reply ? std::get_if<api::Completed>(&*reply) : nullptr;
    return completed != nullptr && completed->outcome == api::Outcome::kReached;
  }

  int interrupt_ = eventfd(0, EFD_CLOEXEC);
  test::FakeLink* link_ = nullptr;
  std::unique_ptr<Client> client_;
  std::function<void()> daemon_;
  std::function<void()> on_status_;
  std::function<void(const Status&)> on_state_;
  std::function<std::optional<api::Request>()> on_interrupt_;
  std::vector<lcm::ClientMessage> requests_;
  std::vector<std::size_t> heard_;
  std::int64_t run_ = 5;
  std::int64_t session_ = kSession;
  int hellos_ = 0;
  int lost_hellos_ = 0;
  int status_asked_ = 0;
};

TEST_F(ClientTest, ReturnsTheResultAndShowsEachReplyOnce) {
  daemon_ = [this] {
    reply(api::Accepted{});
    reply(api::Accepted{});
    reply(result(api::Outcome::kReached));
    reply(result(api::Outcome::kReached));
  };
  const auto result = move();
  EXPECT_TRUE(reached(result));
  EXPECT_EQ(heard_, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(requests_[0].id.session, kSession);
  EXPECT_TRUE(api::is_client_id(requests_[0].id.client_id));
}

TEST_F(ClientTest, IsContentWithAcceptedWhenAskedTo) {
  daemon_ = [this] { reply(api::Accepted{}); };
  const auto answer = move(Client::Until::kAnswered);
  ASSERT_TRUE(answer);
  EXPECT_TRUE(std::holds_alternative<api::Accepted>(*answer));
}

TEST_F(ClientTest, RefusedEndsIt) {
  daemon_ = [this] { reply(api::Refused{"no"}); };
  const auto answer = move();
  ASSERT_TRUE(answer);
  EXPECT_TRUE(std::holds_alternative<api::Refused>(*answer));
}

TEST_F(ClientTest, RepeatsHelloAndRequestUntilAnswered) {
  lost_hellos_ = 2;
  daemon_ = [this] {
    if (requests_.size() == 3) reply(result(api::Outcome::kReached));
  };
  ASSERT_TRUE(reached(move()));
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
  EXPECT_TRUE(reached(move()));
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
  EXPECT_TRUE(reached(move()));
}

TEST_F(ClientTest, GivesUpWhenNobodyAnswersAndSaysWhatToLookAt) {
  open(true, milliseconds(50));
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("no bushd answers"), std::string::npos);
  EXPECT_GT(requests_.size(), 1u);
}

TEST_F(ClientTest, AsksAgainForALostResultWhileTheDaemonLives) {
  keep_publishing_states();
  daemon_ = [this] {
    reply(api::Accepted{});
    if (requests_.size() > 1) reply(result(api::Outcome::kReached));
  };
  EXPECT_TRUE(reached(move()));
  EXPECT_EQ(requests_.size(), 2u);
}

TEST_F(ClientTest, NoticesADaemonThatHasRestarted) {
  daemon_ = [this] {
    state(900);
    reply(api::Accepted{});
    ++run_;
    state(1);
  };
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("restarted"), std::string::npos);
  EXPECT_EQ(requests_.size(), 1u);
}

TEST_F(ClientTest, ARestartBeforeTheRequestDoesNotMatter) {
  state(900);
  ++run_;
  state(1);
  daemon_ = [this] { reply(result(api::Outcome::kReached)); };
  EXPECT_TRUE(reached(move()));
}

TEST_F(ClientTest, NoticesADaemonThatFallsSilent) {
  open(true, milliseconds(50));
  daemon_ = [this] { reply(api::Accepted{}); };
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("silent"), std::string::npos);
}

TEST_F(ClientTest, SaysThatADaemonLivesAndDoesNotAnswer) {
  open(true, milliseconds(50));
  keep_publishing_states();
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(),
            "bushd sends its state but has not answered for 0.05 s; it may still carry this out");
}

TEST_F(ClientTest, SaysThatNothingWasAskedOfADaemonThatGivesNoSession) {
  open(true, milliseconds(50));
  lost_hellos_ = 1'000'000;
  keep_publishing_states();
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("nothing was asked of it"), std::string::npos);
  EXPECT_TRUE(requests_.empty());
}

TEST_F(ClientTest, ARefusalOfWhatWasAcceptedIsNoResult) {
  daemon_ = [this] {
    reply(api::Accepted{});
    reply(api::Refused{"who are you"});
  };
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("who are you"), std::string::npos);
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
  const auto moved = move();
  ASSERT_FALSE(moved);
  EXPECT_NE(moved.error().text().find("two daemons"), std::string::npos);
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
  const auto moved = move();
  ASSERT_FALSE(moved);
  EXPECT_NE(moved.error().text().find("two daemons"), std::string::npos);
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
    open(loses, std::chrono::minutes(5));
    requests_.clear();
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
    ASSERT_TRUE(moved) << moved.error().text();
    EXPECT_EQ(std::get<api::Completed>(*moved).outcome, api::Outcome::kStopped);
    EXPECT_TRUE(stopped);
    EXPECT_EQ(interrupted, 1);
    EXPECT_FALSE(client_->interrupted());
  }
}

TEST_F(ClientTest, SendsRequestsBesideTheOneThatIsAwaited) {
  for (const bool loses : {true, false}) {
    open(loses, std::chrono::minutes(5));
    requests_.clear();
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
    ASSERT_TRUE(jogged) << jogged.error().text();
    EXPECT_EQ(std::get<api::Completed>(*jogged).outcome, api::Outcome::kLimit);
    EXPECT_EQ(renewed, 3);
  }
}

// Whoever presses a key does not wait for the next sign of life.
TEST_F(ClientTest, InputIsTakenAtOnceAndMayEndTheRequest) {
  for (const bool loses : {true, false}) {
    open(loses, std::chrono::minutes(5));
    requests_.clear();
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
    ASSERT_TRUE(jogged) << jogged.error().text();
    EXPECT_EQ(std::get<api::Completed>(*jogged).outcome, api::Outcome::kStopped);
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
  EXPECT_TRUE(reached(move()));
  EXPECT_EQ(shown, std::vector<std::int64_t>{2});
}

TEST_F(ClientTest, OverALinkThatLosesNothingSaysEverythingOnce) {
  open(false, std::chrono::minutes(5));
  int handled = 0;
  link_->on_handled = [this, &handled](const lcm::DaemonMessage&) {
    // The result comes later than any time to repeat.
    if (++handled < 200) return state(handled);
    reply(result(api::Outcome::kReached));
  };
  daemon_ = [this] { reply(api::Accepted{}); };
  EXPECT_TRUE(reached(move()));
  EXPECT_EQ(requests_.size(), 1u);
  EXPECT_EQ(hellos_, 0);
}

TEST_F(ClientTest, TheEndOfTheLinkIsTheEndOfTheDaemon) {
  open(false, std::chrono::minutes(5));
  daemon_ = [this] {
    reply(api::Accepted{});
    link_->end();
  };
  EXPECT_FALSE(client_->ended());
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("ended"), std::string::npos);
  EXPECT_TRUE(client_->ended()) << "whoever goes on asking would do so for ever";
}

TEST_F(ClientTest, AResultBeforeTheEndOfTheLinkCounts) {
  open(false, std::chrono::minutes(5));
  daemon_ = [this] {
    reply(api::Accepted{});
    reply(result(api::Outcome::kReached));
    link_->end();
  };
  EXPECT_TRUE(reached(move()));
}

TEST_F(ClientTest, StatusIsAskedForAndNewerThanWhatWaited) {
  state(1);
  description(2);
  health(3);
  on_status_ = [this] {
    state(11);
    description(12);
    health(13);
  };
  const auto status = client_->status(std::chrono::minutes(5));
  ASSERT_TRUE(status);
  EXPECT_EQ(status->sequence(), 11);
  EXPECT_EQ(status->descriptions.size(), 1u);
  EXPECT_EQ(status->healths.at(0).part.sequence, 13);
}

TEST_F(ClientTest, StatusIsAskedForAgainUntilItIsComplete) {
  on_status_ = [this] {
    state(2 * status_asked_, status_asked_ % 2, 2);
    description(2 * status_asked_ + 1, status_asked_ % 2, 2);
    health(status_asked_);
  };
  const auto status = client_->status(std::chrono::minutes(5));
  ASSERT_TRUE(status);
  EXPECT_EQ(status->states.size(), 2u);
  EXPECT_GE(status_asked_, 2);
}

// The answer takes some times `resend_every`.
TEST_F(ClientTest, StatusIsAskedForOnceOverALinkThatLosesNothing) {
  open(false, std::chrono::minutes(5));
  const auto whole_at = std::chrono::steady_clock::now() + milliseconds(30);
  link_->on_handled = [this, whole_at](const lcm::DaemonMessage& heard) {
    const auto* message = std::get_if<lcm::StateMessage>(&heard);
    if (message == nullptr) return;
    if (std::chrono::steady_clock::now() < whole_at) return state(message->part.sequence + 1);
    description(1);
    health(1);
  };
  on_status_ = [this] { state(1); };
  ASSERT_TRUE(client_->status(std::chrono::minutes(5)));
  EXPECT_EQ(status_asked_, 1);
}

// What a daemon of many MCUs publishes before this client subscribes was not for it.
TEST_F(ClientTest, AGapBehindAStatusIsALossOnlyWhereTheLinkLoses) {
  for (const bool loses : {true, false}) {
    open(loses, std::chrono::minutes(5));
    on_status_ = [this] {
      state(1);
      description(2);
      health(3);
    };
    ASSERT_TRUE(client_->status(milliseconds(60'000)));
    state(20);
    const auto status = client_->next_state(milliseconds(60'000));
    ASSERT_TRUE(status) << status.error().text();
    EXPECT_EQ(status->lost, loses ? 16u : 0u);
  }
}

TEST_F(ClientTest, StatusThatNeverCompletesIsAnError) {
  state(1, 0, 2);
  EXPECT_FALSE(client_->status(milliseconds(1)));
}

TEST_F(ClientTest, StatusOfWhatArrivedSaysThatMoreIsMissing) {
  on_status_ = [this] {
    state(1, 1, 3);
    description(2, 1, 3);
    description(3, 2, 3);
    health(4);
  };
  const auto status = client_->status(milliseconds(20));
  ASSERT_TRUE(status);
  EXPECT_EQ(status->states.size(), 1u);
  EXPECT_EQ(status->missing_mcus.count, 2u);
  EXPECT_EQ(status->missing_buses.count, 0u);
  EXPECT_FALSE(status->answered) << "it came by itself";
}

TEST_F(ClientTest, NextStateKeepsWhatHasNotChanged) {
  on_status_ = [this] {
    for (std::int32_t part = 0; part < 2; ++part) {
      state(part + 1, part, 2);
      description(part + 1, part, 2);
    }
    health(1);
  };
  ASSERT_TRUE(client_->status(std::chrono::minutes(5)));
  EXPECT_FALSE(client_->next_state(milliseconds(1)));
  EXPECT_FALSE(client_->next_health(milliseconds(1)));
  state(9, 1, 2);
  const auto next = client_->next_state(std::chrono::minutes(5));
  ASSERT_TRUE(next);
  EXPECT_EQ(next->states.at(0).part.sequence, 1);
  EXPECT_EQ(next->states.at(1).part.sequence, 9);
  EXPECT_FALSE(client_->next_state(milliseconds(1)));
}

TEST_F(ClientTest, WatchingASocketSubscribesOnce) {
  open(false, std::chrono::minutes(5));
  state(1);
  description(1);
  EXPECT_TRUE(client_->next_state(std::chrono::minutes(5)));
  state(2);
  EXPECT_TRUE(client_->next_state(std::chrono::minutes(5)));
  ASSERT_EQ(link_->sent.size(), 1u);
  EXPECT_TRUE(std::get<lcm::Subscription>(link_->sent[0].content).state);
}

}  // namespace
}  // namespace bushd::client
