#include "state/keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bushd::state::keeper_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

constexpr MotorId kPhi{0};
constexpr MotorId kTheta{1};

struct Disk : Backend {
  void mark(std::vector<Mark> wanted) override { marks.push_back(std::move(wanted)); }
  void write(Batch batch) override { writes.push_back(std::move(batch)); }
  void history(std::string, int, Told) override {}
  std::vector<std::vector<Mark>> marks;
  std::vector<Batch> writes;
};

struct KeeperTest : testing::Test {
  Disk disk;
  Keeper keeper{{"phi", "theta"}, {}, disk};

  void mark(MotorId motor) {
    ASSERT_TRUE(keeper.want_mark(0, motor));
    keeper.step(0);
    keeper.mark(0, {});
    ASSERT_TRUE(keeper.marked(motor));
  }
  void stand(MotorId motor, std::int64_t steps) {
    keeper.stands(motor, {.steps = steps, .utime_us = 1});
  }
};

TEST_F(KeeperTest, AMotorIsMarkedWhenTheDiskSaysSo) {
  ASSERT_TRUE(keeper.want_mark(0, kTheta));
  ASSERT_TRUE(keeper.want_mark(0, kTheta));
  EXPECT_FALSE(keeper.marked(kTheta));
  keeper.step(0);
  EXPECT_THAT(disk.marks, ElementsAre(ElementsAre(Mark{"theta", 1})));
  EXPECT_FALSE(keeper.marked(kTheta));
  keeper.mark(0, {});
  EXPECT_TRUE(keeper.marked(kTheta));
  EXPECT_FALSE(keeper.marked(kPhi));
}

TEST_F(KeeperTest, WhatComesMeanwhileGoesTogether) {
  ASSERT_TRUE(keeper.want_mark(0, kTheta));
  keeper.step(0);
  ASSERT_TRUE(keeper.want_mark(0, kPhi));
  keeper.step(0);
  EXPECT_THAT(disk.marks, SizeIs(1));
  keeper.mark(0, {});
  keeper.step(0);
  EXPECT_THAT(disk.marks[1], ElementsAre(Mark{"phi", 1}));
  stand(kPhi, 1);
  keeper.step(0);
  stand(kPhi, 2);
  stand(kTheta, 3);
  keeper.step(0);
  ASSERT_THAT(disk.writes, SizeIs(1));
  keeper.write(0, {});
  keeper.step(0);
  ASSERT_THAT(disk.writes, SizeIs(2));
  EXPECT_EQ(disk.writes[1].records.at("phi").steps, 2);
  EXPECT_EQ(disk.writes[1].records.at("theta").steps, 3);
}

// A disk that hangs takes no write and refuses none.
TEST_F(KeeperTest, WhatADiskThatHangsIsToTakeIsBounded) {
  keeper.past({.motor = "phi", .utime_us = -1});
  keeper.step(0);
  for (std::int64_t i = 0; i < 3 * Keeper::kMaxPendingMoves; ++i) {
    keeper.past({.motor = "phi", .utime_us = i});
    keeper.step(0);
  }
  keeper.write(0, {});
  keeper.step(0);
  ASSERT_THAT(disk.writes, SizeIs(2));
  EXPECT_LE(std::ssize(disk.writes[1].moves), Keeper::kMaxPendingMoves);
  EXPECT_GE(std::ssize(disk.writes[1].moves), Keeper::kMaxPendingMoves * 9 / 10);
  EXPECT_EQ(disk.writes[1].moves.back().utime_us, 3 * Keeper::kMaxPendingMoves - 1);
}

TEST_F(KeeperTest, ARestThatHasGoneOutNeedsANewMark) {
  mark(kTheta);
  stand(kTheta, 100);
  keeper.step(0);
  EXPECT_TRUE(disk.writes[0].records.at("theta").at_rest);
  EXPECT_EQ(disk.writes[0].records.at("theta").motion, 1u);
  EXPECT_FALSE(keeper.marked(kTheta));  // it may be on the disk
  keeper.write(0, {});
  EXPECT_FALSE(keeper.marked(kTheta));
  mark(kTheta);
  EXPECT_THAT(disk.marks[1], ElementsAre(Mark{"theta", 2}));
}

TEST_F(KeeperTest, ARestThatHasNotGoneOutIsTakenBack) {
  mark(kTheta);
  stand(kPhi, 1);
  keeper.step(0);  // the disk has to do
  stand(kTheta, 100);
  keeper.step(0);
  EXPECT_TRUE(keeper.marked(kTheta));
  ASSERT_TRUE(keeper.want_mark(0, kTheta));
  EXPECT_TRUE(keeper.marked(kTheta));
  keeper.write(0, {});
  keeper.step(0);
  EXPECT_FALSE(disk.writes[1].records.at("theta").at_rest);
  EXPECT_THAT(disk.marks, SizeIs(1));
}

Record at_output(std::uint8_t output, std::int64_t steps = 0) {
  return {
      .steps = steps, .trust = Trust::kKnown, .unique_id = "0123456789abcdef", .output = output};
}

TEST(Keeper, AMotorIsNotMarkedBeforeTheDiskKnowsItsCounter) {
  Disk disk;
  Keeper keeper({"theta"}, {{"theta", {.record = at_output(1)}}}, disk);
  keeper.moves(MotorId{0}, at_output(2));
  ASSERT_TRUE(keeper.want_mark(0, MotorId{0}));
  keeper.step(0);
  keeper.mark(0, {});
  ASSERT_TRUE(keeper.want_mark(0, MotorId{0}));
  EXPECT_FALSE(keeper.marked(MotorId{0}));
  keeper.write(0, {});
  ASSERT_TRUE(keeper.want_mark(0, MotorId{0}));
  if (!keeper.marked(MotorId{0})) {
    keeper.step(0);
    keeper.mark(0, {});
  }
  EXPECT_TRUE(keeper.marked(MotorId{0}));
  EXPECT_THAT(disk.writes, SizeIs(1));
}

TEST(Keeper, ADiskThatDoesNotTakeItsCounterIsSaid) {
  Disk disk;
  Keeper keeper({"theta"}, {{"theta", {.record = at_output(1)}}}, disk);
  keeper.moves(MotorId{0}, at_output(2));
  ASSERT_TRUE(keeper.want_mark(0, MotorId{0}));
  keeper.step(0);
  keeper.mark(0, {});
  keeper.write(0, fail("disk full"));
  ASSERT_TRUE(keeper.want_mark(Keeper::kPatienceUs - 1, MotorId{0}));
  const auto wanted = keeper.want_mark(Keeper::kPatienceUs, MotorId{0});
  ASSERT_FALSE(wanted);
  EXPECT_EQ(wanted.error().text(), "disk full");
}

TEST(Keeper, AnOutputIsOneMotorsAtATime) {
  Disk disk;
  Keeper keeper({"phi", "theta"},
                {{"phi", {.record = at_output(1)}},
                 {"theta", {.record = at_output(2)}},
                 {"old", {.record = at_output(3, 77)}}},
                disk);
  EXPECT_EQ(keeper.other_at(kPhi, "0123456789abcdef", 3)->motor, "old");
  EXPECT_EQ(keeper.other_at(kPhi, "0123456789abcdef", 3)->record.steps, 77);
  EXPECT_FALSE(keeper.other_at(kPhi, "0123456789abcdef", 1)) << "its own";
  EXPECT_FALSE(keeper.other_at(kPhi, "fedcba9876543210", 3));
  keeper.stands(kTheta, at_output(3));
  EXPECT_FALSE(keeper.other_at(kPhi, "0123456789abcdef", 3));
  keeper.stands(kPhi, at_output(2));
  keeper.step(0);
  ASSERT_THAT(disk.writes, SizeIs(1));
  const auto& records = disk.writes[0].records;
  EXPECT_EQ(records.at("old").trust, Trust::kUncertain);
  EXPECT_EQ(records.at("old").unique_id, "");
  EXPECT_EQ(records.at("theta").output, 3);
  EXPECT_EQ(records.at("phi").output, 2);
}

TEST_F(KeeperTest, NothingNewIsNotWritten) {
  stand(kTheta, 100);
  EXPECT_EQ(keeper.told(), 1u);
  stand(kTheta, 100);
  EXPECT_EQ(keeper.told(), 1u);
  EXPECT_EQ(keeper.kept_up_to(), 0u);
  keeper.step(0);
  keeper.write(0, {});
  EXPECT_EQ(keeper.kept_up_to(), 1u);
  EXPECT_EQ(keeper.next_wake_us(), INT64_MAX);
}

TEST_F(KeeperTest, AMarkThatDoesNotComeIsATrouble) {
  ASSERT_TRUE(keeper.want_mark(0, kTheta));
  keeper.step(0);
  ASSERT_TRUE(keeper.want_mark(999'999, kTheta));
  const auto refused = keeper.want_mark(1'000'000, kTheta);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), HasSubstr("after 1 s"));
  keeper.mark(2'000'000, {});
  EXPECT_TRUE(keeper.marked(kTheta));
}

TEST_F(KeeperTest, WhatFailedIsTriedAgainOnceASecond) {
  ASSERT_TRUE(keeper.want_mark(0, kTheta));
  stand(kPhi, 5);
  keeper.step(0);
  keeper.mark(10, fail("no space left"));
  keeper.write(10, fail("no space left"));
  EXPECT_EQ(keeper.trouble(), "no space left");
  EXPECT_FALSE(keeper.want_mark(20, kTheta));
  stand(kPhi, 6);
  keeper.past({.motor = "phi"});
  keeper.step(20);
  EXPECT_THAT(disk.marks, SizeIs(1));
  EXPECT_THAT(disk.writes, SizeIs(1));
  EXPECT_EQ(keeper.next_wake_us(), 1'000'010);
  keeper.step(1'000'010);
  EXPECT_THAT(disk.marks,
              ElementsAre(ElementsAre(Mark{"theta", 1}), ElementsAre(Mark{"theta", 1})));
  ASSERT_THAT(disk.writes, SizeIs(2));
  EXPECT_EQ(disk.writes[1].records.at("phi").steps, 6);
  EXPECT_THAT(disk.writes[1].moves, SizeIs(1));
  keeper.mark(1'000'020, {});
  keeper.write(1'000'020, {});
  EXPECT_FALSE(keeper.trouble());
  EXPECT_TRUE(keeper.marked(kTheta));
}

TEST_F(KeeperTest, AMotorThatMovedWithoutAMarkDoesNotLookAtRestUntilTheDiskWorksAgain) {
  stand(kTheta, 5);
  EXPECT_TRUE(stood(keeper.kept(kTheta)));
  keeper.give_up_mark(kTheta);
  stand(kTheta, 6);
  EXPECT_TRUE(keeper.kept(kTheta).mark_lost);
  EXPECT_TRUE(keeper.any_unguarded());
  keeper.step(0);
  keeper.write(0, {});
  EXPECT_FALSE(keeper.any_unguarded());
}

TEST_F(KeeperTest, NorIsItForgottenThatItStandsWhereItStood) {
  stand(kTheta, 5);
  keeper.step(0);
  keeper.write(0, {});
  // The disk has just failed, so it is not even asked; the motor comes back to where it was.
  ASSERT_TRUE(keeper.want_mark(0, kPhi));
  keeper.step(0);
  keeper.mark(10, fail("no space left"));
  ASSERT_FALSE(keeper.want_mark(20, kTheta));
  keeper.give_up_mark(kTheta);
  stand(kTheta, 5);
  EXPECT_TRUE(keeper.kept(kTheta).mark_lost);
  keeper.step(1'000'010);
  ASSERT_THAT(disk.writes, SizeIs(2));
  keeper.write(1'000'020, {});
  EXPECT_FALSE(keeper.any_unguarded());
  stand(kTheta, 5);
  EXPECT_FALSE(keeper.kept(kTheta).mark_lost);
}

}  // namespace
}  // namespace bushd::state::keeper_test
