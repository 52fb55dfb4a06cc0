// The keys of [[mcu]] that say how steps get to the pins.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::ConfigFile;
using test::error_of;
using test::loaded;
using test::of_mcu;
using test::replaced;
using testing::EndsWith;
using testing::HasSubstr;

bushd_emission settings_of(const std::string& keys) {
  return loaded(of_mcu(keys)).mcus[0].emission.settings;
}

TEST(EmissionKeys, EvenIsTheDefault) {
  const bushd_emission settings = settings_of("");
  EXPECT_EQ(settings.mode, BUSHD_EMISSION_EVEN);
  EXPECT_EQ(settings.dir_setup_us, 0);
  EXPECT_EQ(settings.pulse_us, 0);
}

TEST(EmissionKeys, EachModeHasItsKeys) {
  const bushd_emission burst = settings_of("steps = \"burst\"\nstep_us = 300\npulse_us = 3\n");
  EXPECT_EQ(burst.mode, BUSHD_EMISSION_BURST);
  EXPECT_EQ(burst.step_us, 300);
  EXPECT_EQ(burst.pulse_us, 3);
  EXPECT_EQ(burst.dir_setup_us, 5) << "DIR must not change together with the first step";
  const bushd_emission common =
      settings_of("direction = \"common\"\nsteps = \"burst\"\nstep_us = 300\ndir_setup_us = 5\n");
  EXPECT_EQ(common.mode, BUSHD_EMISSION_COMMON_DIR);
  EXPECT_EQ(common.dir_setup_us, 5);
  const bushd_emission staggered = settings_of("steps = \"staggered\"\nstep_us = 300\n");
  EXPECT_EQ(staggered.mode, BUSHD_EMISSION_STAGGERED);
  EXPECT_EQ(staggered.settle_us, BUSHD_SETTLE_UNKNOWN);
  EXPECT_EQ(settings_of("steps = \"staggered\"\nstep_us = 300\nsettle_us = 518\n").settle_us, 518);
  const bushd_emission both = settings_of(
      "direction = \"common\"\nsteps = \"staggered\"\nstep_us = 300\nsettle_us = 518\n");
  EXPECT_EQ(both.mode, BUSHD_EMISSION_COMMON_STAGGERED);
  EXPECT_EQ(both.settle_us, 518);
  EXPECT_EQ(both.dir_setup_us, 0) << "DIR changes half a slot before the pulses";
  EXPECT_EQ(settings_of("direction = \"own\"\nsteps = \"staggered\"\nstep_us = 300\n").mode,
            BUSHD_EMISSION_STAGGERED);
  EXPECT_EQ(settings_of("direction = \"own\"\n").mode, BUSHD_EMISSION_EVEN);
  const bushd_emission phases = settings_of("steps = \"phases\"\n");
  EXPECT_EQ(phases.sequence, BUSHD_PHASES_FULL);
  EXPECT_TRUE(phases.hold_current);
  const bushd_emission three =
      settings_of("steps = \"phases\"\nphase_sequence = \"three-phase\"\nhold_current = false\n");
  EXPECT_EQ(three.sequence, BUSHD_PHASES_THREE);
  EXPECT_FALSE(three.hold_current);
}

// A step of a motor measures it: nothing but its name asks for that.
TEST(EmissionKeys, TheSettlingTimeIsMeasuredWhereThatIsAskedFor) {
  const std::string staggered = "steps = \"staggered\"\nstep_us = 300\n";
  const auto measures = [](const std::string& keys) {
    const auto config = ConfigFile(of_mcu(keys)).load();
    return config && config->mcus[0].emission.measures();
  };
  EXPECT_TRUE(measures(staggered + "settle_us = \"measured\"\n"));
  EXPECT_FALSE(measures(staggered));
  EXPECT_FALSE(measures(staggered + "settle_us = 65535\n"));
  EXPECT_FALSE(measures(staggered + "settle_us = 0\n")) << "none is said";
  EXPECT_THAT(error_of(of_mcu(staggered + "settle_us = -1\n")),
              HasSubstr("21:13: mcu[0].settle_us: is -1; allowed: a whole number 0..65535 us or "
                        "\"measured\""));
  EXPECT_THAT(error_of(of_mcu(staggered + "settle_us = \"yes\"\n")),
              HasSubstr("21:13: mcu[0].settle_us: is \"yes\"; allowed: a whole number 0..65535 us "
                        "or \"measured\""));
}

TEST(EmissionKeys, WhatIsWrongIsNamedWithItsLine) {
  EXPECT_THAT(error_of(of_mcu("steps = \"odd\"\n")),
              EndsWith("19:9: mcu[0].steps: is \"odd\"; allowed: \"even\", \"burst\", "
                       "\"staggered\" or \"phases\""));
  EXPECT_THAT(error_of(of_mcu("steps = \"burst\"\n")),
              HasSubstr("16:1: mcu[0].step_us: is missing; allowed: a whole number 1..65535 us"));
  EXPECT_THAT(error_of(of_mcu("pulse_us = 2.5\n")),
              HasSubstr("19:12: mcu[0].pulse_us: is the floating-point number 2.5; allowed: a "
                        "whole number 0..65535 us"));
  EXPECT_THAT(error_of(of_mcu("steps = \"phases\"\nhold_current = 1\n")),
              HasSubstr("20:16: mcu[0].hold_current: is 1; allowed: true or false"));
  EXPECT_THAT(error_of(of_mcu("steps = \"phases\"\nphase_sequence = \"four\"\n")),
              HasSubstr("20:18: mcu[0].phase_sequence: is \"four\"; allowed: \"wave\", \"full\", "
                        "\"half\" or \"three-phase\""));
}

TEST(EmissionKeys, OneDirForAllNeedsStepsThatBeginWithTheTick) {
  EXPECT_THAT(error_of(of_mcu("direction = \"left\"\n")),
              EndsWith("19:13: mcu[0].direction: is \"left\"; allowed: \"own\" or \"common\""));
  EXPECT_THAT(error_of(of_mcu("direction = \"common\"\n")),
              EndsWith("19:13: mcu[0].direction: is \"common\" with steps = \"even\"; allowed: "
                       "\"common\" only with steps = \"burst\", \"staggered\""));
  for (const std::string direction : {"own", "common"}) {
    EXPECT_THAT(
        error_of(of_mcu("steps = \"phases\"\ndirection = \"" + direction + "\"\n")),
        EndsWith("20:13: mcu[0].direction: is \"" + direction +
                 "\" with steps = \"phases\"; allowed: only with drivers, which have STEP and "
                 "DIR; remove it"));
  }
}

TEST(EmissionKeys, TheKeyOfBeforeIsRefusedWithTheKeysThatSayTheSame) {
  const auto said = [](const std::string& value) {
    return error_of(of_mcu("emission = " + value + "\nstep_us = 300\n"));
  };
  EXPECT_THAT(said("\"common-dir\""),
              EndsWith("19:12: mcu[0].emission: is not a key; write steps = \"burst\" with "
                       "direction = \"common\" in place of it"));
  EXPECT_THAT(said("\"staggered\""), EndsWith("write steps = \"staggered\" in place of it"));
  EXPECT_THAT(said("3"), EndsWith("write steps and direction in place of it"));
}

TEST(EmissionKeys, KeysThatSayNothingInThisModeAreRefused) {
  EXPECT_THAT(error_of(of_mcu("step_us = 300\n")),
              HasSubstr("19:11: mcu[0].step_us: says nothing with steps = \"even\"; allowed: only "
                        "with \"burst\", \"staggered\""));
  EXPECT_THAT(error_of(of_mcu("steps = \"burst\"\nstep_us = 9\nsettle_us = 5\n")),
              HasSubstr("mcu[0].settle_us: says nothing"));
  EXPECT_THAT(error_of(of_mcu("steps = \"phases\"\npulse_us = 5\n")),
              HasSubstr("mcu[0].pulse_us: says nothing"));
  EXPECT_THAT(error_of(of_mcu("hold_current = true\n")),
              HasSubstr("mcu[0].hold_current: says nothing"));
}

TEST(EmissionKeys, StepPeriodMustHaveRoomForWhatTheTablesMake) {
  // The table makes up to seven steps in a tick.
  EXPECT_EQ(settings_of("steps = \"burst\"\nstep_us = 365\n").step_us, 365);
  EXPECT_THAT(
      error_of(of_mcu("steps = \"burst\"\nstep_us = 366\n")),
      HasSubstr("20:11: mcu[0].step_us: is 366: room for 6 steps in the 2560 us tick of bus "
                "\"hall\", but motor \"theta\" makes up to 7 by table \"bushd2-constant\"; "
                "allowed: 365 or less. Or use a slower table"));
}

TEST(EmissionKeys, PhasesHaveFourOutputsAMotor) {
  const std::string phases = of_mcu("steps = \"phases\"\n");
  EXPECT_EQ(error_of(replaced(phases, "output = 0\n", "output = 3\n")), "no error");
  EXPECT_THAT(
      error_of(replaced(phases, "output = 0\n", "output = 4\n")),
      HasSubstr("32:10: motor[0].output: is 4; allowed: 0..3 on MCU \"hall:1\", where phases "
                "take 4 outputs a motor"));
}

// bushd2-constant begins with 10 ms. The first step of a line may come after half of that.
TEST(EmissionKeys, NoStepOfATableWaitsForDir) {
  EXPECT_EQ(settings_of("dir_setup_us = 2400\n").dir_setup_us, 2400);
  const auto with_first_delay = [](int us, int dir_setup_us) {
    const ConfigFile file(replaced(of_mcu("dir_setup_us = " + std::to_string(dir_setup_us) + "\n"),
                                   "table = \"bushd2-constant\"", "table = \"fast\""));
    file.directory().write("fast.toml", "name = \"fast\"\ntime_unit_ns = 1000\naccel = [" +
                                            std::to_string(us) + ", 200]\n");
    return file.error();
  };
  EXPECT_THAT(
      with_first_delay(200, 1000),
      HasSubstr("mcu[0].dir_setup_us: is 1000 us, but motor \"theta\" makes the first step of "
                "table \"fast\" 200 us after DIR, in a line after half of that: steps that wait "
                "for DIR would come closer together than the table says; allowed: 100 us or "
                "less. Or begin more slowly"));
  EXPECT_EQ(with_first_delay(200, 100), "no error");
  EXPECT_THAT(with_first_delay(200, 101), HasSubstr("allowed: 100 us"));
  EXPECT_EQ(with_first_delay(2000, 1000), "no error");
}

// What no MCU can do is found before one is asked.
TEST(EmissionKeys, WhatNoMcuCanDoIsRefused) {
  EXPECT_THAT(error_of(of_mcu("dir_setup_us = 65535\n")),
              HasSubstr("19:16: mcu[0].dir_setup_us: is 65535 us; allowed: less than the length of "
                        "the 2560 us tick of bus \"hall\", 2520 us at most"));
  EXPECT_THAT(error_of(of_mcu("dir_setup_us = 2560\n")), HasSubstr("is 2560 us"));
  EXPECT_EQ(settings_of("dir_setup_us = 2400\n").dir_setup_us, 2400);
  // Half a slot is 2520 / 256 us.
  EXPECT_THAT(
      error_of(of_mcu("pulse_us = 10\n")),
      HasSubstr("mcu[0].pulse_us: is 10 us; allowed: half a slot of the 2560 us tick of bus "
                "\"hall\", 9 us at most. Use a longer tick_us"));
  EXPECT_EQ(settings_of("pulse_us = 9\n").pulse_us, 9);
  EXPECT_THAT(
      error_of(
          of_mcu("direction = \"common\"\nsteps = \"burst\"\nstep_us = 300\ndir_setup_us = 10\n")),
      HasSubstr(
          "mcu[0].dir_setup_us: is 10 us; allowed: less than half a slot of the 2560 us tick"));
  EXPECT_THAT(error_of(of_mcu("steps = \"burst\"\nstep_us = 2560\n")),
              HasSubstr("mcu[0].step_us: is 2560"));
}

}  // namespace
}  // namespace bushd::config
