// What is published when.
#include "daemon/fronts/publishing.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "daemon/services/state_publisher.h"

namespace bushd::daemon {
namespace {

constexpr McuId kFirst{0};
constexpr McuId kSecond{1};
constexpr BusId kBus{0};

class PublishingTest : public testing::Test, public Listener {
 protected:
  PublishingTest() { publishing_.add(*this); }
  void hear(Topic topic, const lcm::Packet& packet) override {
    heard_.push_back(topic);
    newest_ = *lcm::decode_daemon_message(packet.channel, packet.payload);
  }
  // How many messages this makes.
  template <class Id, class Snapshot>
  std::size_t publish(Id id, const Snapshot& snapshot) {
    heard_.clear();
    publishing_.publish(id, snapshot);
    return heard_.size();
  }

  std::int64_t now_us_ = 1'000'000;
  std::vector<Topic> heard_;
  lcm::DaemonMessage newest_;
  Publishing publishing_{
      7, 2, 1, {.now_us = [this] { return now_us_; }, .unix_us = [] { return std::int64_t{42}; }}};
  api::StateSnapshot state_{.bus = "hall", .mcu = "hall:1", .motors = {{.name = "theta"}}};
};

TEST_F(PublishingTest, AStateThatRestsIsPublishedTwiceASecond) {
  EXPECT_EQ(publish(kFirst, state_), 1u);
  std::size_t count = 0;
  for (int i = 0; i < 100; ++i) {
    now_us_ += 50'000;
    ++state_.tick;
    count += publish(kFirst, state_);
  }
  EXPECT_EQ(count, 10u);
}

TEST_F(PublishingTest, AChangeIsPublishedAtOnce) {
  publish(kFirst, state_);
  state_.motors[0].input = true;
  EXPECT_EQ(publish(kFirst, state_), 1u);
  EXPECT_EQ(publish(kFirst, state_), 0u);
  state_.detail = "drivers disabled";
  EXPECT_EQ(publish(kFirst, state_), 1u);
  state_.program = "scan waits, frame 3";  // its motors rest
  EXPECT_EQ(publish(kFirst, state_), 1u);
  ++state_.tick;
  EXPECT_EQ(publish(kFirst, state_), 0u);
}

TEST_F(PublishingTest, WhatCannotBeSentIsTold) {
  std::vector<std::string> told;
  publishing_.set_log([&told](const std::string& text) { told.push_back(text); });
  state_.motors[0].name = std::string("a\0b", 3);
  EXPECT_EQ(publish(kFirst, state_), 0u);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].rfind("not published, state: ", 0), 0u) << told[0];
}

TEST_F(PublishingTest, TroubleStandsWhereAnMcuHasNothingToTell) {
  publish(kFirst, state_);
  publishing_.set_trouble("another bushd");
  EXPECT_EQ(publish(kFirst, state_), 1u);
  EXPECT_EQ(std::get<lcm::StateMessage>(newest_).snapshot.detail, "another bushd");
  state_.detail = "drivers disabled";
  publish(kFirst, state_);
  EXPECT_EQ(std::get<lcm::StateMessage>(newest_).snapshot.detail, "drivers disabled");
  state_.detail.clear();
  publishing_.set_trouble("");
  publish(kFirst, state_);
  EXPECT_EQ(std::get<lcm::StateMessage>(newest_).snapshot.detail, "");
}

TEST_F(PublishingTest, OnlyTheMcuThatMovesIsPublishedOften) {
  api::StateSnapshot moving = state_;
  moving.motors[0].moving = true;
  publish(kFirst, state_);
  publish(kSecond, moving);
  for (int i = 0; i < 5; ++i) {
    now_us_ += 50'000;
    EXPECT_EQ(publish(kFirst, state_), 0u);
    EXPECT_EQ(publish(kSecond, moving), 1u);
  }
}

TEST_F(PublishingTest, DroppedMessagesAreToldSoon) {
  publish(kFirst, state_);
  publishing_.set_dropped_messages(3);
  EXPECT_EQ(publish(kFirst, state_), 1u);
  EXPECT_EQ(std::get<lcm::StateMessage>(newest_).dropped_messages, 3);
}

TEST_F(PublishingTest, DescriptionsComeOnChangeAndEveryThreeSeconds) {
  api::Description description{.bus = "hall", .mcu = "hall:1"};
  EXPECT_EQ(publish(kFirst, description), 1u);
  now_us_ += 2'900'000;
  EXPECT_EQ(publish(kFirst, description), 0u);
  now_us_ += 100'000;
  EXPECT_EQ(publish(kFirst, description), 1u);
  description.tick_ns = 5;
  EXPECT_EQ(publish(kFirst, description), 1u);
}

TEST_F(PublishingTest, DescriptionsAreNotPutOffByWhenTheCoreOffersThem) {
  const api::Description description{.bus = "hall", .mcu = "hall:1"};
  std::size_t count = 0;
  for (std::int64_t us = 0; us < 30'000'000; us += StatePublisher::kDescriptionPeriodUs) {
    count += publish(kFirst, description);
    now_us_ += StatePublisher::kDescriptionPeriodUs;
  }
  EXPECT_EQ(count, 10u);
}

TEST_F(PublishingTest, PartsTellTheWholeAndTheRun) {
  publish(kSecond, state_);
  const lcm::Part part = std::get<lcm::StateMessage>(newest_).part;
  EXPECT_EQ(part.part, 1);
  EXPECT_EQ(part.parts, 2);
  EXPECT_EQ(part.run, 7);
  EXPECT_EQ(part.utime_us, 42);
}

TEST_F(PublishingTest, TheNewestOfEachIsKept) {
  EXPECT_TRUE(publishing_.newest().empty());
  publish(kFirst, state_);
  publish(kBus, api::HealthSnapshot{.bus = "hall"});
  state_.tick = 9;
  now_us_ += 1'000'000;
  publish(kFirst, state_);
  EXPECT_EQ(publishing_.newest().size(), 2u);
}

TEST_F(PublishingTest, WhoAsksIsToldTheStateAsItIsNow) {
  publish(kFirst, state_);
  state_.tick = 5;
  state_.motors[0].position_steps = 9;
  publishing_.set_refresh([this] { publishing_.publish(kFirst, state_); });
  const auto newest = publishing_.newest();
  ASSERT_EQ(newest.size(), 1u);
  const auto message = *lcm::decode_daemon_message("STATE", newest[0]->payload);
  EXPECT_EQ(std::get<lcm::StateMessage>(message).snapshot.motors.at(0).position_steps, 9);
}

TEST_F(PublishingTest, AskingForItAgainAndAgainFloodsNobody) {
  publish(kFirst, state_);
  heard_.clear();
  for (int i = 0; i < 1000; ++i) {
    now_us_ += 1000;
    publishing_.publish_newest();
  }
  // A second, and a message each 2 ms.
  EXPECT_LE(heard_.size(), 500u);
  EXPECT_GE(heard_.size(), 499u);
}

// An answer of many messages: at most ten times a second.
TEST_F(PublishingTest, ALargeAnswerIsSentTenTimesASecondAtMost) {
  constexpr std::size_t kParts = 200;
  Publishing large{
      7,
      kParts,
      1,
      {.now_us = [this] { return now_us_; }, .unix_us = [] { return std::int64_t{42}; }}};
  for (std::size_t part = 0; part < kParts; ++part) large.publish(McuId{part}, state_);
  large.add(*this);
  for (int i = 0; i < 1000; ++i) {
    now_us_ += 1000;
    large.publish_newest();
  }
  EXPECT_EQ(heard_.size(), 10 * kParts);
}

// Each who asks gets what was asked for, and as it is after that: whoever is early waits a little.
TEST_F(PublishingTest, WhoAsksSoonAfterAnotherIsAnsweredTooWithoutAskingAgain) {
  publish(kFirst, state_);
  publish(kFirst, api::Description{.bus = "hall", .mcu = "hall:1"});
  publish(kBus, api::HealthSnapshot{.bus = "hall"});
  publishing_.publish_newest();
  EXPECT_EQ(publishing_.next_wake_us(), INT64_MAX);
  heard_.clear();
  const std::int64_t asked_us = now_us_;
  publishing_.publish_newest();
  publishing_.publish_newest();
  EXPECT_TRUE(heard_.empty());
  // Three messages.
  EXPECT_EQ(publishing_.next_wake_us(), asked_us + 6'000);
  now_us_ = asked_us + 5'999;
  publishing_.step();
  EXPECT_TRUE(heard_.empty());
  now_us_ = asked_us + 6'000;
  publishing_.set_refresh([this] {
    state_.motors[0].position_steps = 9;
    publishing_.publish(kFirst, state_);
  });
  publishing_.step();
  EXPECT_EQ(heard_.size(), 4u) << "the state is a new one, and comes with all of them too";
  EXPECT_EQ(publishing_.next_wake_us(), INT64_MAX);
  now_us_ += 1'000'000;
  publishing_.step();
  EXPECT_EQ(heard_.size(), 4u);
}

}  // namespace
}  // namespace bushd::daemon
