#include "daemon/services/position_compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using test::LiveBench;
using testing::HasSubstr;

struct CompareBench : LiveBench {
  CompareBench() { connect(compare); }
  PositionCompare compare{installation};
};

TEST(PositionCompareService, IsDoneWhenTheMcuHasConfirmedIt) {
  CompareBench bench;
  api::PositionCompare request{.motor = "m01",
                               .position = 40,
                               .arrivals = {.positive = true, .negative = false},
                               .delay_us = 10,
                               .width_us = 500};
  bench.compare.request(bench.now_us(), bench.asker(1), request);
  EXPECT_FALSE(bench.is_completed(1));
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kDone);
  request.arrivals = {};
  bench.compare.request(bench.now_us(), bench.asker(2), request);
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kDone) << "switched off";
}

TEST(PositionCompareService, WhatNoMcuCanDoIsRefusedWithItsFigure) {
  CompareBench bench;
  const api::PositionCompare good{.motor = "m01",
                                  .position = 40,
                                  .arrivals = {.positive = true, .negative = true},
                                  .delay_us = 10,
                                  .width_us = 500};
  std::int64_t number = 0;
  const auto refusal = [&](const api::PositionCompare& request) {
    bench.compare.request(bench.now_us(), bench.asker(++number), request);
    return bench.refusal(number);
  };
  api::PositionCompare bad = good;
  bad.position = motion::Motor::kMaxPosition + 1;
  EXPECT_THAT(refusal(bad), HasSubstr("positions lie within +-2147483647"));
  bad.position = INT64_MIN;
  EXPECT_THAT(refusal(bad), HasSubstr("positions lie within +-2147483647"));
  bad = good;
  bad.delay_us = 1'500'001;
  EXPECT_THAT(refusal(bad), HasSubstr("1500000"));
  bad = good;
  bad.width_us = 0;
  EXPECT_THAT(refusal(bad), HasSubstr("1000000"));
  bad = good;
  bad.motor = "m99";
  EXPECT_THAT(refusal(bad), HasSubstr("there is no motor"));
}

TEST(PositionCompareService, OfAnMcuThatIsOfflineIsRefused) {
  Bench bench;
  PositionCompare compare(bench.installation);
  compare.request(0, bench.asker(), {.motor = "m01", .position = 1});
  EXPECT_THAT(bench.refusal(), HasSubstr("MCU hall:1 is offline"));
}

}  // namespace
}  // namespace bushd::daemon
