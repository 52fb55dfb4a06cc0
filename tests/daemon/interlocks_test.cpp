// Who holds a motion back, and the reason that is told.
#include "daemon/interlocks.h"

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
  EXPECT_THAT(interlocks.may_move().error().text(), HasSubstr("shutting down"));
  bench.installation[MotorId{1}].home();
  EXPECT_THAT(interlocks.may_move({1}).error().text(), HasSubstr("being homed"));
}

}  // namespace
}  // namespace bushd::daemon
