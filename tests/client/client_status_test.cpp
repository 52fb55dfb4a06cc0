// What a client knows of the state of a daemon, whose messages may be lost.
#include "client/client_fixture.h"

namespace bushd::client {
namespace {

using std::chrono::milliseconds;

TEST_F(ClientTest, StatusIsAskedForAndNewerThanWhatWaited) {
  state(1);
  description(2);
  health(3);
  on_status_ = [this] {
    state(11);
    description(12);
    health(13);
  };
  const auto status = client_->status(kPatient);
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
  const auto status = client_->status(kPatient);
  ASSERT_TRUE(status);
  EXPECT_EQ(status->states.size(), 2u);
  EXPECT_GE(status_asked_, 2);
}

// The answer takes some times `resend_every`.
TEST_F(ClientTest, StatusIsAskedForOnceOverALinkThatLosesNothing) {
  open(false);
  const auto whole_at = std::chrono::steady_clock::now() + milliseconds(30);
  link_->on_handled = [this, whole_at](const lcm::DaemonMessage& heard) {
    const auto* message = std::get_if<lcm::StateMessage>(&heard);
    if (message == nullptr) return;
    if (std::chrono::steady_clock::now() < whole_at) return state(message->part.sequence + 1);
    description(1);
    health(1);
  };
  on_status_ = [this] { state(1); };
  ASSERT_TRUE(client_->status(kPatient));
  EXPECT_EQ(status_asked_, 1);
}

// What a daemon of many MCUs publishes before this client subscribes was not for it.
TEST_F(ClientTest, AGapBehindAStatusIsALossOnlyWhereTheLinkLoses) {
  for (const bool loses : {true, false}) {
    open(loses);
    on_status_ = [this] {
      state(1);
      description(2);
      health(3);
    };
    ASSERT_TRUE(client_->status(kPatient));
    state(20);
    const auto status = client_->next_state(kPatient);
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
  ASSERT_TRUE(client_->status(kPatient));
  EXPECT_FALSE(client_->next_state(milliseconds(1)));
  EXPECT_FALSE(client_->next_health(milliseconds(1)));
  state(9, 1, 2);
  const auto next = client_->next_state(kPatient);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->states.at(0).part.sequence, 1);
  EXPECT_EQ(next->states.at(1).part.sequence, 9);
  EXPECT_FALSE(client_->next_state(milliseconds(1)));
}

TEST_F(ClientTest, WatchingASocketSubscribesOnce) {
  open(false);
  state(1);
  description(1);
  EXPECT_TRUE(client_->next_state(kPatient));
  state(2);
  EXPECT_TRUE(client_->next_state(kPatient));
  ASSERT_EQ(link_->sent.size(), 1u);
  EXPECT_TRUE(std::get<lcm::Subscription>(link_->sent[0].content).state);
}

}  // namespace
}  // namespace bushd::client
