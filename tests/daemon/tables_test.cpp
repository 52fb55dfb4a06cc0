// Which table a group has, and who is told of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;

constexpr const char* kGlacier = R"(name = "glacier"
revision = 3
time_unit_ns = 40000
accel = [250, 200, 150, 100]
)";

// SHA-256 of "40000 100 4 250 200 150 100 100 150 200 250 ", its first 8 digits.
constexpr const char* kGlacierHash = "4259a0ec";

TEST(TableInService, IsToldByStateAndResultWithRevisionAndHash) {
  Lab lab(hall(1, 2, "fine", "glacier"), kGlacier);
  lab.connect();
  const motor_state_t motor = lab.motor("m01");
  EXPECT_EQ(motor.table.name, "glacier");
  EXPECT_EQ(motor.table.revision, 3);
  EXPECT_EQ(motor.table.hash, kGlacierHash);
  const reply_t result = lab.wait(lab.send(command_t::MOVE_RELATIVE, {"m01", "m02"}, {5, 0}));
  EXPECT_THAT(result.table_of_motor, ElementsAre(0, 0));
  ASSERT_EQ(result.tables.size(), 1u);
  EXPECT_EQ(result.tables[0].name, "glacier");
  EXPECT_EQ(result.tables[0].revision, 3);
  EXPECT_EQ(result.tables[0].hash, kGlacierHash);
}

}  // namespace
}  // namespace bushd::test
