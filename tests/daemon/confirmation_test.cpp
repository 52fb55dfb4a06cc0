// Requests that MCUs confirm.
#include "daemon/model/confirmation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/bench.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using testing::HasSubstr;

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

}  // namespace
}  // namespace bushd::daemon
