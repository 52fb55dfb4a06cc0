// Values of keys that may be changed in operation, as texts and back.
#include "config/setting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "engine/message.h"

namespace bushd::config {
namespace {

using testing::HasSubstr;

Settings blade() {
  return {.coordinates = units::Coordinates::make({"mm", {400, 1}, false, 10, 3}).value(),
          .soft_limits = units::SoftLimits{-5, 5.5}};
}

TEST(Setting, KeysHaveTheNamesOfTheFile) {
  for (const SettingKey key : kSettingKeys) {
    EXPECT_EQ(setting_key_of(name_of(key)), key);
    EXPECT_THAT(help_of(key), testing::StartsWith(std::string(name_of(key)) + "="));
  }
  EXPECT_FALSE(setting_key_of("unit"));
  EXPECT_FALSE(setting_key_of(""));
}

TEST(Setting, AValueHasOneText) {
  EXPECT_EQ(text_of(blade(), SettingKey::kOffset), "10");
  EXPECT_EQ(text_of(blade(), SettingKey::kDirection), "positive");
  EXPECT_EQ(text_of(blade(), SettingKey::kSoftLimits), "[-5, 5.5]");
  const auto same = [](SettingKey key, const char* typed) {
    return text_of(with(blade(), key, typed).value(), key);
  };
  EXPECT_EQ(same(SettingKey::kOffset, " 2.50 "), "2.5");
  EXPECT_EQ(same(SettingKey::kOffset, "-0"), "0");
  EXPECT_EQ(same(SettingKey::kDirection, "negative"), "negative");
  EXPECT_EQ(same(SettingKey::kSoftLimits, "-1,2"), "[-1, 2]");
  EXPECT_EQ(same(SettingKey::kSoftLimits, "[ -1.0 ,2]"), "[-1, 2]");
  EXPECT_EQ(same(SettingKey::kSoftLimits, "none"), "none");
}

Settings unipolar() {
  Settings settings = blade();
  settings.phases = settings.has_mcu = settings.drive.local = true;
  return settings;
}

TEST(Setting, VelocityAndCurrentsHaveOneTextAndReadBack) {
  const auto same = [](SettingKey key, const char* typed) {
    return text_of(with(unipolar(), key, typed).value(), key);
  };
  const std::string velocity =
      "{ min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = 500 }";
  for (const char* typed : {"100,1500,500", " { 100, 1500 ,500}", velocity.c_str(),
                            "steps_per_s2=500, max_steps_per_s=1500, min_steps_per_s=100"}) {
    EXPECT_EQ(same(SettingKey::kVelocity, typed), velocity) << typed;
  }
  const std::string currents =
      "{ ramp_ma = 1500, cruise_ma = 1000, hold_ma = 300, decay = \"fast\" }";
  for (const char* typed : {"1500,1000,300,fast", currents.c_str()}) {
    EXPECT_EQ(same(SettingKey::kCurrents, typed), currents) << typed;
  }
  EXPECT_EQ(same(SettingKey::kCurrents, "1,2,3"),
            "{ ramp_ma = 1, cruise_ma = 2, hold_ma = 3, decay = \"slow\" }");
  for (const SettingKey key : {SettingKey::kVelocity, SettingKey::kCurrents}) {
    EXPECT_EQ(same(key, "none"), "none");
    EXPECT_FALSE(applies(blade(), key));
    EXPECT_FALSE(with(blade(), key, "none"));
  }
}

TEST(Setting, HelpSaysWhatMayBeNone) {
  Settings settings = unipolar();
  settings.has_one_input = true;
  for (const SettingKey key : kSettingKeys) {
    const bool says = help_of(key).ends_with(", or none");
    EXPECT_EQ(says, with(settings, key, "none").has_value()) << name_of(key);
  }
}

TEST(Setting, TheLevelOfAnInputIsAWord) {
  Settings settings = blade();
  EXPECT_THAT(with(settings, SettingKey::kInputActive, "open").error().message,
              HasSubstr("it needs a motor without `inputs`"));
  settings.has_one_input = true;
  EXPECT_EQ(text_of(settings, SettingKey::kInputActive), "closed");
  EXPECT_FALSE(is_reported(settings, SettingKey::kInputActive));
  settings = with(settings, SettingKey::kInputActive, "open").value();
  EXPECT_EQ(text_of(settings, SettingKey::kInputActive), "open");
  EXPECT_TRUE(is_reported(settings, SettingKey::kInputActive));
  EXPECT_THAT(with(settings, SettingKey::kInputActive, "none").error().message,
              HasSubstr("allowed: closed, open"));
}

TEST(Setting, PeopleMoveAMotorWhereItsMcuLetsThem) {
  Settings settings = blade();
  for (const SettingKey key : {SettingKey::kLocal, SettingKey::kKeypad}) {
    EXPECT_THAT(with(settings, key, "true").error().message, HasSubstr("its bus has no MCU with"));
  }
  settings.has_mcu = true;
  EXPECT_FALSE(is_reported(settings, SettingKey::kLocal));
  for (const SettingKey key : {SettingKey::kLocal, SettingKey::kKeypad}) {
    EXPECT_EQ(text_of(settings, key), "false");
    const Settings moved = with(settings, key, " true ").value();
    EXPECT_EQ(text_of(moved, key), "true");
    EXPECT_TRUE(is_reported(moved, key));
    EXPECT_TRUE(applies(moved, SettingKey::kVelocity));
    EXPECT_EQ(text_of(with(moved, key, "false").value(), key), "false");
    for (const char* text : {"", "1", "True", "none", "yes"}) {
      EXPECT_THAT(with(settings, key, text).error().message, HasSubstr("allowed: true, false"));
    }
    Settings held = settings;
    held.max_speed = 5;
    EXPECT_THAT(with(held, key, "true").error().message, HasSubstr("may be faster than max_speed"));
    EXPECT_TRUE(with(held, key, "false"));
    Settings idle = settings;
    idle.idle_disabled = true;
    EXPECT_THAT(with(idle, key, "true").error().message, HasSubstr("idle_disable_s"));
  }
}

TEST(Setting, AGreatestSpeedIsANumberAboveZeroOfAMotorThatPeopleDoNotMove) {
  const auto key = SettingKey::kMaxSpeed;
  EXPECT_TRUE(applies(Settings{}, key)) << "without a unit too";
  EXPECT_FALSE(is_reported(blade(), key));
  EXPECT_EQ(text_of(blade(), key), "none");
  const Settings held = with(blade(), key, " 2.50").value();
  EXPECT_EQ(text_of(held, key), "2.5");
  EXPECT_TRUE(is_reported(held, key));
  EXPECT_EQ(text_of(with(held, key, "none").value(), key), "none");
  for (const char* text : {"", "0", "-1", "nan", "inf", "2 mm", "fast"}) {
    EXPECT_THAT(with(held, key, text).error().message, HasSubstr("above 0")) << text;
  }
  // An hour a step is 1 / 400 mm in 3600 s.
  EXPECT_TRUE(with(held, key, "7e-7"));
  EXPECT_THAT(with(held, key, "6e-7").error().message, HasSubstr("up to an hour a step"));
  EXPECT_THAT(with(unipolar(), key, "2").error().message, HasSubstr("set local=false"));
  EXPECT_TRUE(with(unipolar(), key, "none"));
  EXPECT_TRUE(goes_first(key, "none"));
  EXPECT_FALSE(goes_first(key, "2"));
}

TEST(Setting, AnAccelerationIsAShareOfThatOfTheTable) {
  const auto key = SettingKey::kAcceleration;
  EXPECT_TRUE(applies(Settings{}, key));
  EXPECT_EQ(text_of(blade(), key), "1");
  EXPECT_FALSE(is_reported(blade(), key));
  const Settings half = with(blade(), key, " 0.50").value();
  EXPECT_EQ(text_of(half, key), "0.5");
  EXPECT_TRUE(is_reported(half, key));
  for (const char* text : {"", "0", "-1", "1.001", "nan", "none", "50 %"}) {
    EXPECT_THAT(with(half, key, text).error().message, HasSubstr("above 0 and at most 1")) << text;
  }
}

TEST(Setting, ASequenceOfPhasesIsOneForTheSameWindings) {
  const auto key = SettingKey::kPhaseSequence;
  EXPECT_FALSE(applies(blade(), key));
  EXPECT_TRUE(is_of_mcu(key));
  Settings settings = unipolar();
  settings.drive.phase_sequence = BUSHD_PHASES_FULL;
  EXPECT_TRUE(is_reported(settings, key));
  EXPECT_EQ(text_of(settings, key), "full");
  const Settings half = with(settings, key, " half ").value();
  EXPECT_EQ(half.drive.phase_sequence, BUSHD_PHASES_HALF);
  EXPECT_EQ(text_of(with(half, key, "wave").value(), key), "wave");
  for (const char* text : {"", "quarter", "none", "\"half\"", "three-phase"}) {
    EXPECT_THAT(with(half, key, text).error().message, HasSubstr("allowed: wave, full, half"))
        << text;
  }
  Settings three = settings;
  three.drive.phase_sequence = BUSHD_PHASES_THREE;
  EXPECT_FALSE(with(three, key, "half"));
  EXPECT_TRUE(with(three, key, "three-phase"));
}

TEST(Setting, AnyTextOfVelocityAndCurrentsIsTakenWholeOrRefused) {
  for (const char* text : {"", "{}", "{", "100", "100,1500", "100,1500,500,1", "0,1500,500",
                           "200,100,500", "1,40001,5", "1,2,0", "1,2,8388608", "1.5,2,3", "1,,3",
                           "1,2,3,", "-1,2,3", "min_steps_per_s=1,min_steps_per_s=2,steps_per_s2=3",
                           "speed=1,max_steps_per_s=2,steps_per_s2=3"}) {
    const auto changed = with(unipolar(), SettingKey::kVelocity, text);
    ASSERT_FALSE(changed) << text;
    EXPECT_THAT(changed.error().message, HasSubstr("velocity: is \"")) << text;
  }
  for (const char* text : {"", "1500,1000", "0,1,1", "1,1,5111", "1,1,1,mixed", "1,1,1,fast,1"}) {
    EXPECT_FALSE(with(unipolar(), SettingKey::kCurrents, text)) << text;
  }
}

TEST(Setting, ATextReadsBackAsItsValue) {
  std::mt19937_64 random(20040518);
  std::uniform_real_distribution<double> number(-1e6, 1e6);
  for (int i = 0; i < 1000; ++i) {
    Settings settings = blade();
    units::Scale scale = settings.coordinates.scale();
    scale.offset = number(random);
    scale.negative = i % 2 == 0;
    settings.coordinates = units::Coordinates::make(scale).value();
    const double low = number(random);
    settings.soft_limits = units::SoftLimits{low, low + 1};
    Settings back = blade();
    for (const SettingKey key : kSettingKeys) {
      if (!applies(back, key)) continue;
      back = with(std::move(back), key, text_of(settings, key)).value();
    }
    EXPECT_EQ(back.coordinates.scale(), settings.coordinates.scale());
    EXPECT_EQ(back.soft_limits, settings.soft_limits);
  }
}

TEST(Setting, WhatIsNoValueIsRefused) {
  const auto why = [](SettingKey key, const char* text) {
    const auto changed = with(blade(), key, text);
    return changed ? std::string("taken") : changed.error().message;
  };
  for (const char* text : {"", " ", "x", "1 2", "inf", "nan", "1e999", "0x10", "+1", "1,5"}) {
    EXPECT_THAT(why(SettingKey::kOffset, text), HasSubstr("offset: ")) << text;
  }
  for (const char* text : {"", "Negative", "-1"}) {
    EXPECT_THAT(why(SettingKey::kDirection, text), HasSubstr("allowed: negative, positive"));
  }
  for (const char* text : {"", "1", "[1]", "[1,2,3]", "1,", ",", "[1,2", "nan,1", "[]", "["}) {
    EXPECT_THAT(why(SettingKey::kSoftLimits, text), HasSubstr("soft_limits: ")) << text;
  }
  EXPECT_THAT(why(SettingKey::kSoftLimits, "0.0005, 0.0006"), HasSubstr("has no step"));
  EXPECT_THAT(why(SettingKey::kOffset, "1e300"), HasSubstr("2^50 steps"));
}

TEST(Setting, AMotorWithoutAUnitHasSoftLimitsOnly) {
  const Settings plain;
  EXPECT_FALSE(applies(plain, SettingKey::kOffset));
  EXPECT_TRUE(applies(plain, SettingKey::kSoftLimits));
  EXPECT_THAT(with(plain, SettingKey::kDirection, "negative").error().message,
              HasSubstr("direction: it has no unit"));
  EXPECT_TRUE(with(plain, SettingKey::kSoftLimits, "-10,10"));
}

}  // namespace
}  // namespace bushd::config
