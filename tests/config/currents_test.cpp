// `currents` of a motor: peak currents of its windings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "config/config.h"
#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::error_of;
using test::loaded;
using test::of_mcu;
using test::of_motor;
using testing::HasSubstr;

// Currents of "theta", on an MCU with this emission; on line 33.
std::string with(const std::string& currents, const std::string& steps = "phases") {
  return of_mcu("steps = \"" + steps + "\"\n", of_motor("currents = " + currents + "\n"));
}

TEST(Currents, AreReadOfAMotorWithPhases) {
  const auto config =
      loaded(with("{ ramp_ma = 1500, cruise_ma = 1000, hold_ma = 300, decay = \"fast\" }"));
  const auto& currents = config.motors[0].drive.currents;
  ASSERT_TRUE(currents);
  EXPECT_EQ(currents->ramp_ma, 1500);
  EXPECT_EQ(currents->cruise_ma, 1000);
  EXPECT_EQ(currents->hold_ma, 300);
  EXPECT_TRUE(currents->fast_decay);
  EXPECT_FALSE(config.motors[1].drive.currents);
}

TEST(Currents, WhatIsWrongIsNamed) {
  EXPECT_THAT(error_of(with("{ ramp_ma = 1, cruise_ma = 1, hold_ma = 1 }", "even")),
              HasSubstr("33:12: motor[0].currents: says nothing of a driver with STEP and DIR; "
                        "allowed: only with steps = \"phases\" of its MCU"));
  EXPECT_THAT(error_of(with("{ ramp_ma = 1500, cruise_ma = 1000 }")), HasSubstr("hold_ma"));
  EXPECT_THAT(error_of(with("{ ramp_ma = 5111, cruise_ma = 1, hold_ma = 1 }")),
              HasSubstr("ramp_ma: is 5111; allowed: a whole number 1..5110 mA"));
  EXPECT_THAT(error_of(with("{ ramp_ma = 9, cruise_ma = 1, hold_ma = 1, decay = \"mixed\" }")),
              HasSubstr("decay: is \"mixed\"; allowed: \"slow\" or \"fast\""));
}

}  // namespace
}  // namespace bushd::config
