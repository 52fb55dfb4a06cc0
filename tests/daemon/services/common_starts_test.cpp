#include "daemon/services/common_starts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr MotorId kA{0};
constexpr MotorId kB{1};
constexpr MotorId kC{2};

class OfThree : public testing::Test {
 protected:
  OfThree() { starts.begin({kA, kB, kC}); }
  void expect(const testing::Matcher<const std::vector<MotorId>&>& again,
              const testing::Matcher<const std::vector<MotorId>&>& end) {
    const CommonStarts::Decision decision = starts.decide();
    EXPECT_THAT(decision.again, again);
    EXPECT_THAT(decision.end, end);
  }
  CommonStarts starts{4};
};

TEST_F(OfThree, NothingIsDecidedBeforeAllAreHeardOf) {
  starts.misses(kA);
  expect(IsEmpty(), IsEmpty());
  starts.misses(kC);
  expect(IsEmpty(), IsEmpty());
  starts.misses(kB);
  expect(UnorderedElementsAre(kA, kB, kC), IsEmpty());
  expect(IsEmpty(), IsEmpty());
  EXPECT_TRUE(starts.waits(kA));
}

TEST_F(OfThree, OneThatBeginsEndsThoseThatHaveMissedIt) {
  starts.misses(kA);
  starts.begins(kB);
  EXPECT_FALSE(starts.waits(kB));
  expect(IsEmpty(), ElementsAre(kA));
  starts.misses(kC);
  expect(IsEmpty(), ElementsAre(kC));
}

TEST_F(OfThree, OneThatLeavesIsNotWaitedFor) {
  starts.misses(kA);
  starts.misses(kB);
  starts.leaves(kC);
  expect(UnorderedElementsAre(kA, kB), IsEmpty());
}

TEST_F(OfThree, OneThatBeginsWithOthersLeavesThese) {
  starts.misses(kA);
  starts.misses(kB);
  starts.begin({kC});
  expect(UnorderedElementsAre(kA, kB), IsEmpty());
  starts.misses(kC);
  expect(ElementsAre(kC), IsEmpty());
}

TEST_F(OfThree, OneThatIsLateAndLeavesDoesNotBeginAgain) {
  starts.misses(kA);
  starts.leaves(kA);
  starts.misses(kB);
  starts.misses(kC);
  expect(UnorderedElementsAre(kB, kC), IsEmpty());
}

TEST_F(OfThree, HasAFewTries) {
  for (unsigned i = 1; i < CommonStarts::kMostTries; ++i) {
    for (const MotorId motor : {kA, kB, kC}) starts.misses(motor);
    expect(UnorderedElementsAre(kA, kB, kC), IsEmpty());
  }
  for (const MotorId motor : {kA, kB, kC}) starts.misses(motor);
  expect(IsEmpty(), UnorderedElementsAre(kA, kB, kC));
}

}  // namespace
}  // namespace bushd::daemon
