#include "daemon/services/stops.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using test::LiveBench;
using testing::HasSubstr;

struct StopsBench : LiveBench {
  StopsBench() { connect(stops); }
  Stops stops{installation, moves, homing, travels, programs, local_inputs, open_moves};
};

TEST(Stops, RampDownTheMotorsThatAreNamed) {
  StopsBench bench;
  bench.move(1, "m01", 5000);
  bench.move(2, "m03", 300);
  bench.run_for(0.4);
  bench.stops.request(bench.now_us(), bench.asker(3), api::Stop{{"m01", "m02"}});
  EXPECT_TRUE(bench.of("m01").axis().stopping());
  EXPECT_EQ(bench.result(3).outcome, api::Outcome::kDone);
  EXPECT_TRUE(bench.of("m01").is<motion::Resting>());
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kStopped);
  EXPECT_GT(bench.shaft_steps("m01"), 0);
  EXPECT_LT(bench.shaft_steps("m01"), 5000);
  EXPECT_EQ(bench.of("m01").position_steps(), bench.shaft_steps("m01"));
  EXPECT_FALSE(bench.of("m01").trust().uncertain_reason()) << "a ramp loses no step";
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kReached) << "not named";
}

TEST(Stops, ANewTargetMeanwhileIsTold) {
  StopsBench bench;
  bench.move(1, "m01", 5000);
  bench.run_for(0.4);
  bench.stops.request(bench.now_us(), bench.asker(2), {});
  bench.move(3, "m01", 700);
  const api::Completed stopped = bench.result(2);
  EXPECT_EQ(stopped.outcome, api::Outcome::kDone);
  EXPECT_THAT(stopped.reason, HasSubstr("m01 was given a new target by command 3 of test"));
  EXPECT_EQ(bench.result(3).outcome, api::Outcome::kReached);
}

TEST(Stops, OfMotorsAtRestAreDoneAtOnce) {
  StopsBench bench;
  bench.stops.request(bench.now_us(), bench.asker(1), {});
  bench.stops.step(bench.now_us());
  EXPECT_TRUE(bench.is_completed(1));
  bench.stops.request(bench.now_us(), bench.asker(2), api::Stop{{"m17"}});
  EXPECT_THAT(bench.refusal(2), HasSubstr("there is no motor \"m17\""));
}

TEST(Stops, AFloodIsCarriedOutAndItsMemoryIsBounded) {
  StopsBench bench;
  bench.move(1, "m01", 5000);
  bench.run_for(0.4);
  constexpr std::int64_t kMore = 10;
  const auto last = std::int64_t{kMostAwaited} + kMore + 1;
  for (std::int64_t i = 2; i <= last; ++i) {
    bench.stops.request(bench.now_us(), bench.asker(i), {});
  }
  EXPECT_TRUE(bench.is_completed(2)) << "the oldest are not waited for any more";
  EXPECT_TRUE(bench.is_completed(1 + kMore));
  EXPECT_FALSE(bench.is_completed(2 + kMore));
  EXPECT_EQ(bench.result(last).reason, "done");
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kStopped);
}

}  // namespace
}  // namespace bushd::daemon
