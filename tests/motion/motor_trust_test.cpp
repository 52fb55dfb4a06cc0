#include "motion/motor_trust.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bushd::motion {
namespace {

using testing::HasSubstr;

PositionTrust judged(const MotorTrust& trust, std::uint16_t boot_number) {
  return trust.judged(boot_number, 42, units::Coordinates());
}

TEST(MotorTrust, NobodyHasSaidWhereItStands) {
  MotorTrust trust("hall:1");
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kUnknown);
  trust.goes_online(3);
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kUncertain);
  trust.is_known();
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kKnown);
  EXPECT_EQ(judged(trust, 4).trust, words::Trust::kUnknown) << "counts of another boot";
  trust.is_unconfirmed();
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kUncertain);
}

TEST(MotorTrust, WhatIsWorseIsTold) {
  MotorTrust trust("hall:1");
  trust.goes_online(3);
  trust.is_restored("it lost power");
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kRestored);
  trust.lose_steps("it was stopped");
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kUncertain);
  EXPECT_TRUE(trust.restored_reason());
  trust.is_uncertain("it was stopped");
  EXPECT_FALSE(trust.restored_reason());
  trust.goes_offline(4711, true);
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kStale);
  EXPECT_EQ(judged(trust, 3).heard_utime_us, 4711);
  EXPECT_THAT(judged(trust, 3).reason, HasSubstr("may have run on; besides, it was stopped"));
  trust.goes_online(3);
  trust.is_known();
  trust.restoring(true);
  EXPECT_EQ(judged(trust, 3).trust, words::Trust::kUnknown)
      << "its counter is not its position yet";
}

}  // namespace
}  // namespace bushd::motion
