#include "lcm/snapshot.h"

#include <gtest/gtest.h>

#include "lcm/messages.h"

namespace bushd::lcm {
namespace {

using test::state_part;

TEST(Snapshot, IsCompleteWithItsLastPartInAnyOrder) {
  SnapshotCollector collector;
  EXPECT_FALSE(collector.add(state_part(7, 2, 3)));
  EXPECT_FALSE(collector.add(state_part(7, 0, 3)));
  const auto snapshot = collector.add(state_part(7, 1, 3));
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->sequence, 7);
  ASSERT_EQ(snapshot->mcus.size(), 3u);
  for (std::int32_t i = 0; i < 3; ++i)
    EXPECT_EQ(snapshot->mcus[static_cast<std::size_t>(i)].part, i);
}

TEST(Snapshot, MissesOneWhosePartWasLostAndTakesTheNext) {
  SnapshotCollector collector;
  EXPECT_FALSE(collector.add(state_part(7, 0, 2)));
  EXPECT_FALSE(collector.add(state_part(8, 0, 2)));
  const auto snapshot = collector.add(state_part(8, 1, 2));
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->sequence, 8);
}

TEST(Snapshot, GoesOnAfterTheDaemonRestarted) {
  SnapshotCollector collector;
  EXPECT_TRUE(collector.add(state_part(1000, 0, 1)));
  EXPECT_TRUE(collector.add(state_part(1, 0, 1)));
}

TEST(Snapshot, IgnoresPartsThatCannotBe) {
  SnapshotCollector collector;
  EXPECT_FALSE(collector.add(state_part(1, 0, 2)));
  EXPECT_FALSE(collector.add(state_part(1, -1, 2)));
  EXPECT_FALSE(collector.add(state_part(1, 2, 2)));
  EXPECT_FALSE(collector.add(state_part(1, 0, 0)));
  EXPECT_FALSE(collector.add(state_part(1, 0, INT32_MAX)));
  EXPECT_TRUE(collector.add(state_part(1, 1, 2)));
}

TEST(Snapshot, Of512MotorsIs32Messages) {
  SnapshotCollector collector;
  for (std::int32_t part = 0; part < 31; ++part) {
    EXPECT_FALSE(collector.add(state_part(1, part, 32, 16, 63)));
  }
  const auto snapshot = collector.add(state_part(1, 31, 32, 16, 63));
  ASSERT_TRUE(snapshot);
  std::size_t motors = 0;
  for (const state_t& mcu : snapshot->mcus) motors += mcu.motors.size();
  EXPECT_EQ(motors, 512u);
}

TEST(Health, IsCompleteWithItsLastBus) {
  HealthCollector collector;
  EXPECT_FALSE(collector.add(test::health_part(3, 0, 2, 1, "hall")));
  const auto health = collector.add(test::health_part(3, 1, 2, 2, "roof"));
  ASSERT_TRUE(health);
  EXPECT_EQ(health->sequence, 3);
  ASSERT_EQ(health->buses.size(), 2u);
  EXPECT_EQ(health->buses[1].mcus[1].mcu, "roof:2");
}

}  // namespace
}  // namespace bushd::lcm
