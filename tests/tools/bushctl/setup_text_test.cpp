// The configuration that setup writes is one that the daemon takes, whatever was found.
#include "tools/bushctl/setup_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config.h"
#include "results.h"

namespace bushctl {
namespace {

using bushd::test::good;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

Found mcu_found(std::uint8_t address, std::uint8_t id, std::uint8_t motors = 16) {
  Found found{.address = address};
  found.identity.protocol_version = BUSHD_PROTOCOL_VERSION;
  found.identity.unique_id[7] = id;
  found.identity.motors = motors;
  return found;
}

FoundBus bus(std::string port, std::vector<Found> mcus, std::uint32_t baud = 500'000) {
  return {.port = std::move(port), .baud = baud, .mcus = std::move(mcus)};
}

bushd::Result<bushd::config::Config> parsed(const std::vector<FoundBus>& buses,
                                            std::uint32_t tick_us = 2560) {
  return bushd::config::parse(configuration_text(buses, tick_us, "/etc/bushd/bushd.toml"),
                              "/etc/bushd/bushd.toml");
}

TEST(Setup, EachMcuHasAMotorAndLcmTakesNoCommands) {
  const auto config = good(parsed({bus("/dev/a", {mcu_found(2, 1), mcu_found(1, 2, 4)})}));
  ASSERT_EQ(config.mcus.size(), 2u);
  EXPECT_EQ(config.buses[0].port, "/dev/a");
  EXPECT_EQ(config.motors[0].name, "m1-0");
  EXPECT_EQ(config.mcus[1].id, "bus1:2");
  EXPECT_FALSE(config.lcm.commands);
}

TEST(Setup, SeveralBusesHaveMotorsOfDifferentNames) {
  const auto config =
      good(parsed({bus("/dev/a", {mcu_found(1, 1)}), bus("/dev/b", {mcu_found(1, 2)}, 1'000'000)}));
  EXPECT_EQ(config.motors[0].name, "bus1-m1-0");
  EXPECT_EQ(config.motors[1].name, "bus2-m1-0");
  EXPECT_EQ(config.buses[1].baud, 1'000'000u);
}

TEST(Setup, ASlowLineAndManyMcusFitWithLongerTicks) {
  std::vector<Found> many;
  for (std::uint8_t address = 1; address <= 32; ++address)
    many.push_back(mcu_found(address, address));
  EXPECT_FALSE(parsed({bus("/dev/a", many, 115'200)}, 2560));
  const auto fits = parsed({bus("/dev/a", many, 2'000'000)}, 10'240);
  EXPECT_TRUE(fits) << fits.error().text();
  EXPECT_TRUE(parsed({bus("/dev/a", {mcu_found(1, 1)}, 115'200)}, 5120));
}

TEST(Setup, McusThatCannotBeNamedAreComments) {
  Found old = mcu_found(7, 9);
  old.identity.protocol_version = 1;
  const FoundBus found = bus("/dev/a", {mcu_found(1, 0xAA), mcu_found(1, 0xBB), old});
  const auto config = good(parsed({found}));
  EXPECT_EQ(config.mcus.size(), 1u);
  const std::string text = configuration_text({found}, 2560, "x");
  EXPECT_THAT(text, AllOf(HasSubstr("# address 1 is that of another MCU too: 'bushctl address PORT "
                                    "00000000000000bb NEW --baud B' gives it another"),
                          HasSubstr("# address 7 speaks protocol version 1")));
  EXPECT_THAT(found_lines(found),
              ElementsAre(HasSubstr("00000000000000aa"), HasSubstr("00000000000000bb"),
                          HasSubstr("protocol version 1")));
  EXPECT_FALSE(has_usable_mcu(bus("/dev/a", {old})));
}

TEST(Setup, NamesOfPortsAreQuoted) {
  const auto config = good(parsed({bus("/dev/a\"b\\c", {mcu_found(1, 1)})}));
  EXPECT_EQ(config.buses[0].port, "/dev/a\"b\\c");
}

TEST(Setup, WithNothingFoundItSaysWhatToLookAtAndOffersTheSimulatedBus) {
  EXPECT_THAT(nothing_found_lines({}),
              ElementsAre(HasSubstr("no serial adapter"), HasSubstr("bushd-sim@demo")));
  EXPECT_THAT(nothing_found_lines({"/dev/a"}),
              ElementsAre(AllOf(HasSubstr("no MCU"), Not(HasSubstr("adapter"))),
                          HasSubstr("bushd-sim@demo")));
}

}  // namespace
}  // namespace bushctl
