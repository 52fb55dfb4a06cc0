// Keys about switches, the emergency input, the supply current and EN.
#include <gtest/gtest.h>

#include <string>

#include "config/config.h"
#include "config/config_file.h"
#include "config/refused_keys.h"

namespace bushd::config {
namespace {

using test::kGood;
using test::loaded;
using test::of_slit;
using test::replaced;

std::string with_mcu(const std::string& keys) {
  return replaced(kGood, "address = 255\n", "address = 255\n" + keys);  // from line 22 on
}

TEST(ConfigInputs, NothingIsWatchedUnlessItIsAskedFor) {
  const auto config = loaded(kGood);
  const Mcu& mcu = config.mcus[0];
  EXPECT_EQ(mcu.emergency_input, BUSHD_EMERGENCY_INPUT_IGNORED);
  EXPECT_FALSE(mcu.emergency_active_open);
  EXPECT_EQ(mcu.debounce_ticks, 1);
  EXPECT_EQ(mcu.overcurrent, 0);
  EXPECT_EQ(mcu.enable_after_reset, EnableAfterReset::kReady);
  EXPECT_FALSE(mcu.idle_disable_s);
  EXPECT_EQ(mcu.enable_settle_ms, 0u);
  EXPECT_FALSE(config.motors[0].never_disable);
  const Motor& motor = config.motors[0];
  EXPECT_FALSE(motor.inputs.positive || motor.inputs.negative || motor.inputs.home ||
               motor.inputs.step);
  EXPECT_EQ(motor.inputs.own, (Input{.number = motor.output.value}));
  EXPECT_EQ(motor.limit_action, BUSHD_STOP_RAMP);
}

TEST(ConfigInputs, AnMcuHasItsOwn) {
  const auto config =
      loaded(with_mcu("emergency_input = \"immediate\"\nemergency_active = \"open\"\n"
                      "debounce_ticks = 15\novercurrent = 1023\n"
                      "enable_after_reset = \"at_once\"\n"));
  const Mcu& mcu = config.mcus[1];
  EXPECT_EQ(mcu.emergency_input, BUSHD_EMERGENCY_INPUT_IMMEDIATE);
  EXPECT_TRUE(mcu.emergency_active_open);
  EXPECT_EQ(mcu.debounce_ticks, 15);
  EXPECT_EQ(mcu.overcurrent, 1023);
  EXPECT_EQ(mcu.enable_after_reset, EnableAfterReset::kAtOnce);
  EXPECT_EQ(config.mcus[0].emergency_input, BUSHD_EMERGENCY_INPUT_IGNORED);
}

TEST(ConfigInputs, AnEmergencyMayDisableDrivers) {
  const auto config =
      loaded(replaced(with_mcu("emergency_input = \"disable\"\n"), "format = \"fine\"\n",
                      "format = \"fine\"\nemergency_stop = \"disable\"\n"));
  EXPECT_EQ(config.mcus[1].emergency_input, BUSHD_EMERGENCY_INPUT_DISABLE);
  EXPECT_EQ(config.buses[0].emergency_stop, BUSHD_STOP_DISABLE);
}

TEST(ConfigInputs, DriversAreDisabledAtRest) {
  const auto config = loaded(replaced(with_mcu("idle_disable_s = 2.5\nenable_settle_ms = 300\n"),
                                      "output = 15\n", "output = 15\nnever_disable = true\n"));
  EXPECT_EQ(config.mcus[1].idle_disable_s, 2.5);
  EXPECT_EQ(config.mcus[1].enable_settle_ms, 300u);
  EXPECT_TRUE(config.motors[1].never_disable);
  const auto at_once = loaded(with_mcu("idle_disable_s = 0\n"));
  EXPECT_EQ(at_once.mcus[1].idle_disable_s, 0);
}

TEST(ConfigInputs, AMotorHasALimitAtEitherEndOrAtBoth) {
  for (const auto& [word, positive, negative] :
       {std::tuple{"positive", true, false}, {"negative", false, true}, {"both", true, true}}) {
    const auto config = loaded(of_slit("limit = \"" + std::string(word) +
                                       "\"\nlimit_action = \"immediate\"\n"
                                       "input_active = \"open\"\n"));
    const Motor& motor = config.motors[1];
    const Input own{.number = 15, .active_open = true};
    EXPECT_EQ(motor.inputs.positive, positive ? std::optional(own) : std::nullopt) << word;
    EXPECT_EQ(motor.inputs.negative, negative ? std::optional(own) : std::nullopt) << word;
    EXPECT_EQ(motor.limit_action, BUSHD_STOP_IMMEDIATE);
    EXPECT_EQ(motor.inputs.own, own);
    EXPECT_FALSE(config.motors[0].inputs.positive);
  }
}

TEST(ConfigInputs, WhatCannotBeIsRefusedWithItsLineAndKey) {
  const test::RefusedKey bad[] = {
      {with_mcu("emergency_input = \"stop\"\n"), 22,
       "mcu[1].emergency_input: is \"stop\"; allowed: \"ignore\", \"ramp\", \"immediate\" or "
       "\"disable\""},
      {with_mcu("emergency_active = \"open\"\n"), 22,
       "mcu[1].emergency_active: says nothing while the input is ignored; allowed: beside "
       "emergency_input = \"ramp\", \"immediate\" or \"disable\""},
      {with_mcu("emergency_input = \"ignore\"\nemergency_active = \"open\"\n"), 23,
       "mcu[1].emergency_active: says nothing while the input is ignored"},
      {with_mcu("emergency_active = 1\n"), 22,
       "mcu[1].emergency_active: is 1; allowed: \"closed\""},
      {with_mcu("debounce_ticks = 16\n"), 22, "mcu[1].debounce_ticks: is 16; allowed: a whole"},
      {with_mcu("overcurrent = 1024\n"), 22, "mcu[1].overcurrent: is 1024; allowed: a whole"},
      {with_mcu("enable_after_reset = true\n"), 22,
       "mcu[1].enable_after_reset: is true; allowed: \"ready\", \"at_once\" or \"no\""},
      {with_mcu("ready = \"later\"\n"), 22,
       "mcu[1].ready: is \"later\"; allowed: \"at-once\" or \"after-homing\""},
      {with_mcu("ready = \"after-homing\"\n"), 22,
       "mcu[1].ready: is \"after-homing\", but no motor of MCU \"roof:255\" has a home"},
      {replaced(with_mcu("ready = \"after-homing\"\nprograms_without_host = true\n"
                         "programs_at_power_on = true\n"),
                "output = 15\n",
                "output = 15\ninputs = { home = 3 }\n"
                "home = { direction = \"negative\", most_steps = 9 }\n"),
       22, "mcu[1].ready: is \"after-homing\", and programs_at_power_on lets a program of MCU"},
      {with_mcu("idle_disable_s = -1\n"), 22,
       "mcu[1].idle_disable_s: is -1; allowed: a number 0..1000000 s; 0: at once"},
      {with_mcu("enable_settle_ms = -1\n"), 22, "mcu[1].enable_settle_ms: is -1; allowed: a whole"},
      {of_slit("never_disable = 1\n"), 37, "motor[1].never_disable: is 1; allowed: true or false"},
      {replaced(with_mcu("idle_disable_s = 0\n"), "output = 15\n", "output = 15\nlocal = true\n"),
       38, "motor[1].local: is true, but MCU \"roof:255\" has idle_disable_s"},
      {replaced(with_mcu("idle_disable_s = 1\n"), "output = 15\n", "output = 15\nlocal = true\n"),
       38, "motor[1].local: is true, but MCU \"roof:255\" has idle_disable_s"},
      {of_slit("limit = \"left\"\n"), 37,
       "motor[1].limit: is \"left\"; allowed: \"positive\", \"negative\" or \"both\""},
      {of_slit("limit = \"both\"\nlimit_action = \"halt\"\n"), 38,
       "motor[1].limit_action: is \"halt\"; allowed: \"ramp\" or \"immediate\""},
      {of_slit("limit_action = \"immediate\"\n"), 37,
       "motor[1].limit_action: applies only with a limit"},
      {of_slit("input_active = \"low\"\n"), 37,
       "motor[1].input_active: is \"low\"; allowed: \"closed\" or \"open\""},
  };
  test::expect_refused(bad);
}

}  // namespace
}  // namespace bushd::config
