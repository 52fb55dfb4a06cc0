// Values of keys that may be changed in operation, as texts and back.
#include "config/setting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace bushd::config {
namespace {

using testing::HasSubstr;

Settings blade() {
  return {.coordinates = units::Coordinates::make({"mm", {400, 1}, false, 10, 3}).value(),
          .soft_limits = units::SoftLimits{-5, 5.5}};
}

TEST(Setting, KeysHaveTheNamesOfTheFile) {
  for (const SettingKey key : kSettingKeys) EXPECT_EQ(setting_key_of(name_of(key)), key);
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
