// Floods of lines: what is written of them, and that nothing else is lost.
#include "daemon/shell/log_limit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bushd::daemon {
namespace {

using testing::IsEmpty;

constexpr std::int64_t kPeriod = LogLimit::kPeriodUs;

// As many as are written at once.
void fill(LogLimit& limit, std::int64_t now_us) {
  for (std::uint64_t i = 0; i < LogLimit::kAtOnce; ++i) {
    EXPECT_TRUE(limit.take(now_us, "stopped by " + std::to_string(i)));
  }
}

TEST(LogLimit, OfAFloodTheBeginningIsWrittenAndTheRestCounted) {
  LogLimit limit;
  fill(limit, 0);
  for (int i = 0; i < 6900; ++i) EXPECT_FALSE(limit.take(1, "stopped by evil" + std::to_string(i)));
  EXPECT_THAT(limit.due(kPeriod - 1), IsEmpty());
  const auto told = limit.due(kPeriod);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].lines, 6900u);
  EXPECT_EQ(told[0].text(), "6900 more lines in 10 s like: stopped by evil6899");
  EXPECT_THAT(limit.due(2 * kPeriod), IsEmpty());
}

TEST(LogLimit, AFloodThatGoesOnIsALineAPeriod) {
  LogLimit limit;
  fill(limit, 0);
  for (int period = 1; period <= 3; ++period) {
    EXPECT_FALSE(limit.take(period * kPeriod - 1, "stopped by evil"));
    EXPECT_EQ(limit.due(period * kPeriod).size(), 1u);
  }
}

TEST(LogLimit, OtherCausesAreWrittenMeanwhile) {
  LogLimit limit;
  fill(limit, 0);
  EXPECT_FALSE(limit.take(0, "stopped by evil"));
  EXPECT_EQ(limit.take(0, "MCU hall:1 restarted"), "MCU hall:1 restarted");
}

TEST(LogLimit, AfterAQuietPeriodAllIsAsBefore) {
  LogLimit limit;
  fill(limit, 0);
  EXPECT_FALSE(limit.take(0, "stopped by evil"));
  EXPECT_EQ(limit.due(kPeriod).size(), 1u);
  EXPECT_THAT(limit.due(2 * kPeriod), IsEmpty());
  fill(limit, 2 * kPeriod);
}

TEST(LogLimit, NumbersAndWhoAskedMakeNoOtherCause) {
  EXPECT_EQ(LogLimit::cause_of("m07: position set to -12, was 5, by command 3 of me"),
            LogLimit::cause_of("m31: position set to -400, was 17, by command 900 of you"));
  EXPECT_NE(LogLimit::cause_of("MCU hall:1 is ready"), LogLimit::cause_of("MCU hall:1 is offline"));
}

TEST(LogLimit, CausesThatSomebodyMakesUpHaveOneLimit) {
  LogLimit limit;
  std::size_t written = 0;
  for (int i = 0; i < 100'000; ++i) {
    std::string cause = "x";
    for (int n = i; n > 0; n /= 26) cause += static_cast<char>('a' + n % 26);
    written += limit.take(0, cause).has_value() ? 1 : 0;
  }
  EXPECT_LE(written, LogLimit::kCauses * LogLimit::kAtOnce + LogLimit::kAtOnce);
}

}  // namespace
}  // namespace bushd::daemon
