#include "daemon/services/open_moves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/bench.h"

namespace bushd::daemon {
namespace {

using test::Bench;

TEST(OpenMoves, AMoveIsAnsweredOnceWhenItsLastMotorHasEnded) {
  Bench bench;
  OpenMoves moves(bench.installation);
  moves.open(bench.asker(5), {{0}, {3}});
  EXPECT_TRUE(moves.together({0}, {3}));
  ASSERT_NE(moves.asker_of({3}), nullptr);
  EXPECT_EQ(text_of(*moves.asker_of({3})), "command 5 of test");
  moves.end({3}, api::Outcome::kLimit, "met its switch");
  moves.end({3}, api::Outcome::kReached, "again");
  moves.end({1}, api::Outcome::kReached, "of no move");
  EXPECT_TRUE(bench.client->answers.empty());
  moves.end({0}, api::Outcome::kReached, "stands at its target");
  ASSERT_EQ(bench.client->answers.size(), 1u);
  EXPECT_EQ(bench.client->answers[0].first, 5);
  EXPECT_EQ(bench.completed().outcome, api::Outcome::kLimit);
  EXPECT_EQ(bench.completed().reason, "m04: met its switch");
  const auto results = std::get<std::vector<api::MotorResult>>(bench.completed().detail);
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[0].motor, "m01");
  EXPECT_EQ(results[1].outcome, api::Outcome::kLimit);
  EXPECT_EQ(results[1].table.name, "bushd2-constant");
  EXPECT_TRUE(moves.empty());
}

}  // namespace
}  // namespace bushd::daemon
