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

lcm::DescriptionMessage description(std::int64_t run, std::int64_t sequence, std::int32_t part,
                                    std::int32_t parts) {
  return {.part = {.run = run, .sequence = sequence, .part = part, .parts = parts}, .snapshot = {}};
}

TEST(StatusCollector, APartialStatusIsOfWhatIsThereAndCountsWhatIsMissing) {
  StatusCollector collector;
  EXPECT_TRUE(collector.empty());
  for (const std::int32_t part : {0, 2, 3}) collector.add(state(1, 5 + part, part, 4));
  for (const std::int32_t part : {1, 2, 3}) collector.add(description(1, 9 + part, part, 4));
  collector.add(health(20, 1, 2));
  EXPECT_FALSE(collector.empty());
  const Status status = collector.partial_status();
  ASSERT_EQ(status.states.size(), 2u);
  ASSERT_EQ(status.descriptions.size(), 2u);
  EXPECT_EQ(status.states[0].part.part, 2);
  EXPECT_EQ(status.descriptions[0].part.part, 2);
  EXPECT_EQ(status.missing_mcus.count, 2u);
  EXPECT_EQ(status.missing_mcus.of, 4u);
  EXPECT_EQ(status.missing_buses.count, 1u);
  EXPECT_EQ(status.missing_buses.of, 2u);
}

TEST(StatusCollector, CountsTheMessagesThatGaveNoSignOfThemselves) {
  StatusCollector collector;
  // On request: with the numbers that they had when they were sent first.
  collector.add(description(1, 7, 0, 1));
  collector.add(health(40, 0, 1));
  collector.add(state(1, 31, 0, 1));
  EXPECT_EQ(collector.status().lost, 0u);
  collector.expect_no_gaps();
  collector.add(state(1, 41, 0, 1));
  collector.add(description(1, 42, 0, 1));
  collector.add(description(1, 42, 0, 1));
  collector.add(health(43, 0, 1));
  EXPECT_EQ(collector.status().lost, 0u);
  collector.add(state(1, 47, 0, 1));
  EXPECT_EQ(collector.status().lost, 3u);
  collector.add(state(1, 49, 0, 1));
  EXPECT_EQ(collector.status().lost, 4u);
  // Another daemon begins anew.
  collector.add(state(2, 1000, 0, 1));
  collector.add(state(2, 2000, 0, 1));
  EXPECT_EQ(collector.status().lost, 0u);
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
