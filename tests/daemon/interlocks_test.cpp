// Who holds a motion back, and the reason that is told.
#include "daemon/model/interlocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/bench.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using testing::HasSubstr;

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
  for (const auto& may :
       {interlocks.may_move(), interlocks.may_move({1}), interlocks.may_begin({1})}) {
    EXPECT_THAT(may.error().text(), HasSubstr("shutting down"));
  }
  bench.installation.shutting_down = false;
  EXPECT_THAT(interlocks.may_begin({1}).error().text(), HasSubstr("MCU hall:1 is offline"));
  bench.installation[MotorId{1}].give_to_mcu(motion::Homing{});
  EXPECT_THAT(interlocks.may_move({1}).error().text(), HasSubstr("being homed"));
}

}  // namespace
}  // namespace bushd::daemon
