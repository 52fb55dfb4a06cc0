// What services do without a bus; with one they are tested by what they are for (homing_test.cpp,
// trigger_test.cpp, tables_test.cpp, ...).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/bench.h"
#include "daemon/confirmation.h"
#include "daemon/interlocks.h"
#include "daemon/services/emergency_stop.h"
#include "daemon/services/homing_queue.h"
#include "daemon/services/journal.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/state_publisher.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using testing::HasSubstr;

TEST(Installation, FindsMotorsByName) {
  Bench bench;
  const api::MotorNames names = {"m03", "m01"};
  const auto found = bench.installation.find(names);
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, (std::vector<MotorId>{{2}, {0}}));
  EXPECT_EQ(bench.installation.mcus_of(*found), (std::vector<McuId>{{0}, {1}}));
  EXPECT_THAT(bench.installation.find(api::MotorNames{"m09"}).error().text(), HasSubstr("\"m09\""));
  EXPECT_THAT(bench.installation.find(api::MotorNames{"m01", "m01"}).error().text(),
              HasSubstr("named twice"));
  EXPECT_THAT(bench.installation.find(api::MotorNames{}).error().text(), HasSubstr("no motor"));
  EXPECT_EQ(bench.installation.find_or_all({})->size(), 4u);
}

TEST(Interlocks, TheFirstReasonIsTold) {
  Bench bench;
  Interlocks interlocks(bench.installation);
  EXPECT_TRUE(interlocks.may_move());
  EXPECT_THAT(interlocks.may_move({1}).error().text(), HasSubstr("MCU hall:1 is offline"));
  bool held = true;
  interlocks.add([&]() -> Result<void> { return held ? fail("held back") : Result<void>(); });
  EXPECT_EQ(interlocks.may_move().error().text(), "held back");
  held = false;
  EXPECT_TRUE(interlocks.may_move());
  bench.installation.shutting_down = true;
  EXPECT_THAT(interlocks.may_move().error().text(), HasSubstr("shutting down"));
  bench.installation[MotorId{1}].home();
  EXPECT_THAT(interlocks.may_move({1}).error().text(), HasSubstr("being homed"));
}

TEST(Confirmation, AnMcuThatDoesNotAnswerEndsItInTime) {
  Bench bench;
  Confirmation confirmation(bench.asker(7), {McuId{0}, McuId{1}}, 1000);
  ASSERT_EQ(bench.client->answers.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<api::Accepted>(bench.client->answers[0].second));
  const auto good = [](const Mcu&) { return Result<void>(); };
  EXPECT_FALSE(confirmation.follow(2000, nullptr, bench.installation, good));
  // One has nothing to answer any more, and reports.
  EXPECT_FALSE(confirmation.follow(3000, &bench.installation[McuId{0}], bench.installation, good));
  EXPECT_FALSE(confirmation.awaits({0}));
  EXPECT_TRUE(confirmation.awaits({1}));
  const auto ended = confirmation.follow(10'000'000, nullptr, bench.installation, good);
  ASSERT_TRUE(ended);
  confirmation.answer(*ended);
  EXPECT_EQ(bench.completed().outcome, api::Outcome::kFault);
  EXPECT_THAT(bench.completed().reason, HasSubstr("MCU hall:2 did not confirm"));
}

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

TEST(EmergencyStop, AFloodIsCarriedOutAndItsMemoryIsBounded) {
  Bench bench;
  Interlocks interlocks(bench.installation);
  OpenMoves moves(bench.installation);
  HomingQueue homing(bench.installation, interlocks, moves, bench);
  EmergencyStop emergency_stop(bench.installation, interlocks, homing, bench);
  constexpr std::size_t kMore = 10;
  for (std::size_t i = 0; i < EmergencyStop::kMaxOpen + kMore; ++i) {
    emergency_stop.request(0, bench.asker(static_cast<std::int64_t>(i)), {});
  }
  EXPECT_TRUE(emergency_stop.under_way());
  std::size_t given_up = 0;
  for (const auto& [number, reply] : bench.client->answers) {
    if (std::holds_alternative<api::Completed>(reply)) ++given_up;
  }
  EXPECT_EQ(given_up, kMore) << "the oldest are not waited for any more";
  emergency_stop.step(1);
  EXPECT_FALSE(emergency_stop.under_way());
  EXPECT_EQ(bench.completed().outcome, api::Outcome::kDone);
}

TEST(Journal, AMoveAndItsEndHaveOneId) {
  Bench bench;
  Journal journal(bench.installation, bench);
  bench.installation[MotorId{2}].start(40, 100);
  journal.started({2}, 40, 100, 0, false);
  journal.changed({2}, {.at = 120, .target_steps = {}});
  journal.ended({2}, "stopped");
  ASSERT_EQ(bench.lines.size(), 3u);
  const auto begun = nlohmann::json::parse(bench.lines[0]);
  EXPECT_EQ(begun["event"], "move");
  EXPECT_EQ(begun["motor"], "m03");
  EXPECT_EQ(begun["address"], 2);
  EXPECT_EQ(begun["steps"], 40);
  EXPECT_GT(begun["id"], 1'000'000) << "another daemon's ids are not used again";
  EXPECT_EQ(nlohmann::json::parse(bench.lines[1])["event"], "stop");
  EXPECT_EQ(nlohmann::json::parse(bench.lines[2])["id"], begun["id"]);
}

TEST(StatePublisher, PublishesOnChangeButNotMoreOftenThanItMay) {
  Bench bench;
  StatePublisher publisher(bench.installation, bench);
  publisher.step(0);
  EXPECT_EQ(bench.states.size(), 2u) << "one for each MCU";
  EXPECT_EQ(bench.descriptions.size(), 2u);
  publisher.step(1000);
  EXPECT_EQ(bench.states.size(), 2u);
  bench.installation.changed = true;
  EXPECT_EQ(publisher.next_wake_us(), StatePublisher::kMinPeriodUs);
  publisher.step(1000);
  EXPECT_EQ(bench.states.size(), 2u);
  publisher.step(StatePublisher::kMinPeriodUs);
  EXPECT_EQ(bench.states.size(), 4u);
  publisher.step(StatePublisher::kMinPeriodUs + StatePublisher::kPeriodUs);
  EXPECT_EQ(bench.states.size(), 6u);
  EXPECT_EQ(bench.descriptions.size(), 2u) << "they have not changed";
  publisher.step(StatePublisher::kDescriptionPeriodUs);
  EXPECT_EQ(bench.descriptions.size(), 4u);
  EXPECT_EQ(bench.states.back().state, api::McuState::kOffline);
  EXPECT_EQ(bench.states.back().motors.at(0).name, "m03");
}

}  // namespace
}  // namespace bushd::daemon
