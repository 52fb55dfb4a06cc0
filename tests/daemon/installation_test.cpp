// What services find in an installation.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/bench.h"

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

}  // namespace
}  // namespace bushd::daemon
