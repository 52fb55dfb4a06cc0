#include "motion/move_book.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "engine/properties.h"

namespace bushd::motion {
namespace {

TEST(MoveBook, MoveOfOneMotorEndsWithIt) {
  MoveBook book;
  EXPECT_TRUE(book.empty());
  const auto id = book.open({MotorId{5}});
  EXPECT_FALSE(book.empty());
  EXPECT_EQ(book.move_of({5}), id);
  EXPECT_FALSE(book.move_of({4}));
  const auto result = book.end({{5}, Outcome::kReached, 42, ""});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->move, id);
  EXPECT_EQ(result->outcome, Outcome::kReached);
  ASSERT_EQ(result->motors.size(), 1u);
  EXPECT_EQ(result->motors[0].position_steps, 42);
  EXPECT_TRUE(book.empty());
  EXPECT_FALSE(book.move_of({5}));
}

TEST(MoveBook, WorstOutcomeCountsWithTheReasonOfItsFirstMotor) {
  MoveBook book;
  book.open({{3}, {1}, {2}, {9}});
  EXPECT_FALSE(book.end({{2}, Outcome::kLink, -7, "second of the worst"}));
  EXPECT_FALSE(book.end({{9}, Outcome::kStopped, 1, "asked to"}));
  EXPECT_FALSE(book.end({{3}, Outcome::kReached, 2, ""}));
  const auto result = book.end({{1}, Outcome::kLink, 3, "first of the worst"});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->outcome, Outcome::kLink);
  EXPECT_EQ(result->reason, "first of the worst") << "in the order of open(), not of ending";
  ASSERT_EQ(result->motors.size(), 4u);
  const std::size_t order[] = {3, 1, 2, 9};
  const std::int64_t positions[] = {2, 3, -7, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(result->motors[i].motor, MotorId{order[i]});
    EXPECT_EQ(result->motors[i].position_steps, positions[i]);
  }
}

TEST(MoveBook, AMotorEndsOnce) {
  MoveBook book;
  book.open({{1}, {2}});
  EXPECT_FALSE(book.end({{1}, Outcome::kFault, 0, "first"}));
  EXPECT_FALSE(book.move_of({1})) << "its part is over";
  EXPECT_EQ(book.move_of({2}), 1u);
  EXPECT_FALSE(book.end({{1}, Outcome::kReached, 9, "again"}));
  EXPECT_FALSE(book.end({{7}, Outcome::kReached, 9, "of no move"}));
  const auto result = book.end({{2}, Outcome::kReached, 0, ""});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->motors[0].reason, "first");
  EXPECT_FALSE(book.end({{2}, Outcome::kReached, 0, ""}));
}

TEST(MoveBook, AMotorMayMoveAgainWhileItsOldMoveGoesOn) {
  MoveBook book;
  const auto first = book.open({{1}, {2}});
  EXPECT_FALSE(book.end({{1}, Outcome::kStopped, 5, "of the first"}));
  const auto second = book.open({MotorId{1}});
  EXPECT_NE(first, second);
  const auto ended = book.end({{1}, Outcome::kReached, 6, ""});
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->move, second);
  const auto last = book.end({{2}, Outcome::kReached, 0, ""});
  ASSERT_TRUE(last);
  EXPECT_EQ(last->move, first);
  EXPECT_EQ(last->motors[0].position_steps, 5) << "not touched by the second move";
}

// However moves overlap and motors end: every move has exactly one result, when its last motor has
// ended, and it is the worst.
TEST(MoveBook, EveryMoveEndsExactlyOnce) {
  test::holds("random moves", [] {
    MoveBook book;
    std::map<std::uint64_t, std::pair<std::size_t, Outcome>> open;  // left, worst
    std::map<std::size_t, std::uint64_t> busy;
    for (int i = 0; i < 300; ++i) {
      if (test::between(0, 3) == 0) {
        std::vector<MotorId> motors;
        for (std::size_t m = 0; m < 12; ++m) {
          if (!busy.contains(m) && test::between(0, 2) == 0) motors.push_back({m});
        }
        if (motors.empty()) continue;
        const auto id = book.open(motors);
        RC_ASSERT(open.emplace(id, std::pair{motors.size(), Outcome::kDone}).second);
        for (const MotorId m : motors) busy[m.value] = id;
      } else {
        const auto m = static_cast<std::size_t>(test::between(0, 12));
        const auto outcome = static_cast<Outcome>(test::between(0, 5));
        const auto result = book.end({{m}, outcome, 0, ""});
        const auto of = busy.find(m);
        if (of == busy.end()) {
          RC_ASSERT(!result);
          continue;
        }
        auto& [left, worst] = open.at(of->second);
        worst = std::max(worst, outcome);
        RC_ASSERT(result.has_value() == (--left == 0));
        if (result) {
          RC_ASSERT(result->move == of->second);
          RC_ASSERT(result->outcome == worst);
          open.erase(of->second);
        }
        busy.erase(of);
      }
      RC_ASSERT(book.empty() == open.empty());
      for (std::size_t m = 0; m < 12; ++m) {
        const auto of = busy.find(m);
        RC_ASSERT(book.move_of({m}) ==
                  (of == busy.end() ? std::nullopt : std::optional(of->second)));
      }
    }
  });
}

}  // namespace
}  // namespace bushd::motion
