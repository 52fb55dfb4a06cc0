// What services find in an installation.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

#include "bus/rs485/mcu_fit.h"
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

// What an MCU has no room for is told with file, line and key of the configuration.
TEST(Installation, AnMcusSetupKnowsWhereItsKeysStand) {
  Bench bench;
  const config::Config& config = bench.installation.config();
  const link::McuSetup setup = bench.installation.setup_of({1});  // with motors 2 and 3
  using enum link::SetupKey;
  for (const auto& [key, number, name] :
       std::initializer_list<std::tuple<link::SetupKey, unsigned, const char*>>{
           {kAddress, 0, "mcu[1].address"},
           {kFormat, 0, "bus[0].format"},
           {kTick, 0, "bus[0].tick_us"},
           {kOutput, 1, "motor[3].output"},
           {kTable, 0, "motor[2].group"},
           {kInput, 1, "motor[3].output"},
           {kCurrents, 1, "motor[3].currents"}}) {
    const Error& place = setup.places.at({key, number});
    EXPECT_EQ(place.key, name);
    EXPECT_EQ(place.file, config.path) << name;
    EXPECT_GT(place.line, 0) << name;
  }
  bushd_identity identity{};
  identity.protocol_version = BUSHD_PROTOCOL_VERSION;
  identity.capabilities = BUSHD_CAN_FINE;
  identity.motors = 1;
  const auto fits = link::check_fit({.tick_ns = 2'560'000, .format = BUSHD_FORMAT_FINE, .mcus = {}},
                                    setup, identity);
  ASSERT_FALSE(fits);
  EXPECT_THAT(fits.error().text(), HasSubstr("output 1 is configured: connect the motor to another "
                                             "one (" +
                                             config.path + ":"));
  EXPECT_THAT(fits.error().text(), HasSubstr(": motor[3].output)"));
}

}  // namespace
}  // namespace bushd::daemon
