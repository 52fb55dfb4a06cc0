// The client against a daemon that loses datagrams, falls silent or restarts; both within one
// in-process LCM.
#include "lcm/client.h"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <functional>
#include <vector>

#include "lcm/messages.h"

namespace bushd::lcm {
namespace {

using std::chrono::milliseconds;

class ClientTest : public testing::Test {
 protected:
  void SetUp() override { open(std::chrono::minutes(5)); }
  ~ClientTest() override { close(interrupt_); }

  // Patient where patience must not matter, so that a busy machine fails no test.
  void open(milliseconds patience) {
    client_ = std::move(Client::open({.url = "memq://",
                                      .program = "test",
                                      .interrupt_fd = interrupt_,
                                      .resend_every = milliseconds(3),
                                      .answer_within = patience,
                                      .ask_again_every = milliseconds(10),
                                      .silence_limit = patience})
                            .value());
    transport().subscribe<command_t>("BUSHD_COMMAND", [this](const command_t& command) {
      commands_.push_back(command);
      if (daemon_) daemon_(command);
    });
  }

  Transport& transport() { return client_->transport(); }

  void reply(std::int8_t phase, const std::string& result = "", const std::string& client_id = "") {
    reply_t reply{};
    reply.client_id = client_id.empty() ? client_->id() : client_id;
    reply.number = commands_.back().number;
    reply.phase = phase;
    reply.result = result;
    reply.reason = "because";
    ASSERT_TRUE(transport().publish("BUSHD_REPLY", reply));
  }
  void state(std::int64_t sequence, std::int32_t part = 0, std::int32_t parts = 1) {
    ASSERT_TRUE(transport().publish("BUSHD_STATE", test::state_part(sequence, part, parts)));
  }
  // A message that makes the next one: something goes on as long as the client handles messages.
  void keep_publishing_states() {
    transport().subscribe<state_t>("BUSHD_STATE",
                                   [this](const state_t& heard) { state(heard.sequence + 1); });
    state(1);
  }
  Result<reply_t> move(Client::Until until = Client::Until::kResult) {
    command_t command{};
    command.kind = command_t::MOVE_RELATIVE;
    command.motors = {"theta"};
    command.steps = {-400};
    return client_->run(command, until,
                        [this](const reply_t& heard) { heard_.push_back(heard.phase); });
  }

  int interrupt_ = eventfd(0, EFD_CLOEXEC);
  std::unique_ptr<Client> client_;
  std::function<void(const command_t&)> daemon_;
  std::vector<command_t> commands_;
  std::vector<int> heard_;
};

TEST_F(ClientTest, ReturnsTheResultAndShowsEachReplyOnce) {
  daemon_ = [this](const command_t&) {
    reply(reply_t::ACCEPTED);
    reply(reply_t::ACCEPTED);
    reply(reply_t::RESULT, "reached");
    reply(reply_t::RESULT, "reached");
  };
  const auto result = move();
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_EQ(result->result, "reached");
  EXPECT_EQ(heard_, (std::vector<int>{reply_t::ACCEPTED, reply_t::RESULT}));
  EXPECT_EQ(commands_[0].motor_count, 1);
  EXPECT_LE(commands_[0].client_id.size(), 64u);
}

TEST_F(ClientTest, IsContentWithAcceptedWhenAskedTo) {
  daemon_ = [this](const command_t&) { reply(reply_t::ACCEPTED); };
  const auto answer = move(Client::Until::kAnswered);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->phase, reply_t::ACCEPTED);
}

TEST_F(ClientTest, RefusedEndsIt) {
  daemon_ = [this](const command_t&) { reply(reply_t::REFUSED, "refused"); };
  const auto answer = move();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->phase, reply_t::REFUSED);
}

TEST_F(ClientTest, RepeatsTheSameCommandUntilAnswered) {
  daemon_ = [this](const command_t&) {
    if (commands_.size() == 3) reply(reply_t::RESULT, "reached");
  };
  ASSERT_TRUE(move());
  ASSERT_EQ(commands_.size(), 3u);
  EXPECT_EQ(commands_[0].number, commands_[2].number);
  EXPECT_EQ(commands_[0].client_id, commands_[2].client_id);
}

TEST_F(ClientTest, CountsItsCommandsUp) {
  daemon_ = [this](const command_t&) { reply(reply_t::RESULT, "reached"); };
  ASSERT_TRUE(move());
  ASSERT_TRUE(move());
  EXPECT_EQ(commands_[1].number, commands_[0].number + 1);
}

TEST_F(ClientTest, RepliesToOthersAreNotItsOwn) {
  daemon_ = [this](const command_t&) {
    reply(reply_t::RESULT, "fault", "somebody-else");
    reply(reply_t::RESULT, "reached");
  };
  const auto result = move();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->result, "reached");
}

TEST_F(ClientTest, GivesUpWhenNobodyAnswersAndSaysWhatToLookAt) {
  open(milliseconds(50));
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("Start `bushd --config FILE`"), std::string::npos);
  EXPECT_GT(commands_.size(), 1u);
}

TEST_F(ClientTest, AsksAgainForALostResultWhileTheDaemonLives) {
  keep_publishing_states();
  daemon_ = [this](const command_t&) {
    reply(reply_t::ACCEPTED);
    if (commands_.size() > 1) reply(reply_t::RESULT, "reached");
  };
  const auto result = move();
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_EQ(commands_.size(), 2u);
}

TEST_F(ClientTest, NeverRepeatsACommandToADaemonThatHasRestarted) {
  daemon_ = [this](const command_t&) {
    state(900);
    reply(reply_t::ACCEPTED);
    state(1);
  };
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("restarted"), std::string::npos);
  EXPECT_EQ(commands_.size(), 1u);
}

TEST_F(ClientTest, ARestartBeforeTheCommandDoesNotMatter) {
  state(900);
  state(1);
  daemon_ = [this](const command_t&) { reply(reply_t::RESULT, "reached"); };
  EXPECT_TRUE(move());
}

TEST_F(ClientTest, NoticesADaemonThatFallsSilent) {
  open(milliseconds(50));
  daemon_ = [this](const command_t&) { reply(reply_t::ACCEPTED); };
  const auto result = move();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("silent"), std::string::npos);
  EXPECT_EQ(commands_.size(), 1u);
}

TEST_F(ClientTest, IsInterruptedThroughItsDescriptor) {
  ASSERT_EQ(eventfd_write(interrupt_, 1), 0);
  EXPECT_FALSE(move());
  EXPECT_TRUE(client_->interrupted());
}

TEST_F(ClientTest, SnapshotIsNewerThanWhatWaited) {
  keep_publishing_states();
  const auto snapshot = client_->snapshot(std::chrono::minutes(5));
  ASSERT_TRUE(snapshot);
  EXPECT_GT(snapshot->sequence, 1);
}

TEST_F(ClientTest, SnapshotThatNeverCompletesIsAnError) {
  state(1, 0, 2);
  EXPECT_FALSE(client_->snapshot(milliseconds(1)));
}

TEST_F(ClientTest, HealthIsThatOfAllBuses) {
  // The second part of one makes both of the next.
  transport().subscribe<health_t>("BUSHD_HEALTH", [this](const health_t& heard) {
    for (std::int32_t part = 0; heard.part == 1 && part < 2; ++part) {
      ASSERT_TRUE(
          transport().publish("BUSHD_HEALTH", test::health_part(heard.sequence + 1, part, 2)));
    }
  });
  ASSERT_TRUE(transport().publish("BUSHD_HEALTH", test::health_part(1, 1, 2)));
  const auto health = client_->health(std::chrono::minutes(5));
  ASSERT_TRUE(health);
  EXPECT_GT(health->sequence, 1);
  EXPECT_EQ(health->buses.size(), 2u);
}

}  // namespace
}  // namespace bushd::lcm
