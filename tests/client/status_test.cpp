#include "client/status.h"

#include <gtest/gtest.h>

namespace bushd::client {
namespace {

lcm::StateMessage state(std::int64_t run, std::int64_t sequence, std::int32_t part,
                        std::int32_t parts) {
  lcm::StateMessage message;
  message.part = {.run = run, .sequence = sequence, .part = part, .parts = parts};
  return message;
}

lcm::HealthMessage health(std::int64_t sequence, std::int32_t part, std::int32_t parts) {
  return {.part = {.sequence = sequence, .part = part, .parts = parts}, .snapshot = {}};
}

TEST(StatusCollector, IsCompleteWithTheLastPartInAnyOrder) {
  StatusCollector collector;
  collector.add(state(1, 5, 2, 3));
  collector.add(state(1, 3, 0, 3));
  EXPECT_FALSE(collector.has_states());
  EXPECT_TRUE(collector.status().states.empty());
  collector.add(state(1, 4, 1, 3));
  ASSERT_TRUE(collector.has_states());
  const Status status = collector.status();
  EXPECT_EQ(status.states.at(0).part.part, 0);
  EXPECT_EQ(status.states.at(2).part.part, 2);
  EXPECT_EQ(status.sequence(), 5);
}

TEST(StatusCollector, KeepsTheNewestOfEachPart) {
  StatusCollector collector;
  collector.add(state(1, 5, 0, 1));
  collector.add(state(1, 7, 0, 1));
  collector.add(state(1, 6, 0, 1));
  EXPECT_EQ(collector.status().sequence(), 7);
}

TEST(StatusCollector, AnotherRunBeginsAnew) {
  StatusCollector collector;
  collector.add(state(1, 900, 0, 2));
  collector.add(state(1, 901, 1, 2));
  collector.add(state(2, 1, 0, 2));
  EXPECT_FALSE(collector.has_states());
  collector.add(state(2, 2, 1, 2));
  EXPECT_EQ(collector.status().sequence(), 2);
}

TEST(StatusCollector, HealthThatCountsAnewIsAnotherDaemons) {
  StatusCollector collector;
  collector.add(health(900, 0, 2));
  collector.add(health(901, 1, 2));
  EXPECT_TRUE(collector.has_health());
  collector.add(health(1, 0, 2));
  EXPECT_FALSE(collector.has_health());
}

TEST(StatusCollector, HostilePartsAreNotKept) {
  StatusCollector collector;
  collector.add(state(1, 1, -1, 2));
  collector.add(state(1, 1, 2, 2));
  collector.add(state(1, 1, 0, 0));
  collector.add(state(1, 1, 5000, 100'000));
  collector.add(state(1, 1, INT32_MIN, INT32_MIN));
  EXPECT_TRUE(collector.status().states.empty());
  collector.add(state(1, 1, 0, 1));
  EXPECT_TRUE(collector.has_states());
}

}  // namespace
}  // namespace bushd::client
