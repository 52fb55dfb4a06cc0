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
  moves.open(bench.asker(5), {{0}, {3}}, OpenMoves::Purpose::kMove);
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
  EXPECT_EQ(results[1].who, "command 5 of test");
  EXPECT_TRUE(moves.empty());
}

TEST(OpenMoves, OfOneThatWasStoppedTheReasonSaysByWhom) {
  Bench bench;
  OpenMoves moves(bench.installation);
  std::vector<std::string> told;
  moves.set_listener([&](const OpenMoves::Ended& ended) { told.push_back(ended.reason); });
  moves.stopped_by({MotorId{0}}, "nobody, as it was in no move then");
  const auto reason_of = [&](api::Outcome outcome) {
    moves.end({0}, outcome, "ended");
    EXPECT_EQ(bench.completed().reason, "m01: " + told.back());
    return told.back();
  };
  moves.open(bench.asker(1), {{0}}, OpenMoves::Purpose::kMove);
  EXPECT_EQ(reason_of(api::Outcome::kStopped), "ended");
  moves.open(bench.asker(2), {{0}}, OpenMoves::Purpose::kMove);
  moves.stopped_by({MotorId{0}}, "command 7 of test");
  EXPECT_EQ(reason_of(api::Outcome::kStopped), "ended, asked for by command 7 of test");
  moves.open(bench.asker(3), {{0}}, OpenMoves::Purpose::kMove);
  moves.stopped_by({MotorId{0}}, "command 8 of test");
  EXPECT_EQ(reason_of(api::Outcome::kReached), "ended") << "it came too late";
  moves.open(bench.asker(4), {{0}}, OpenMoves::Purpose::kMove);
  EXPECT_EQ(reason_of(api::Outcome::kStopped), "ended") << "that was of the one before";
  moves.open(bench.asker(5), {{0}}, OpenMoves::Purpose::kMove);
  moves.stopped_by({MotorId{0}}, "command 9 of test");
  moves.not_stopped({0});
  EXPECT_EQ(reason_of(api::Outcome::kStopped), "ended");
}

}  // namespace
}  // namespace bushd::daemon
