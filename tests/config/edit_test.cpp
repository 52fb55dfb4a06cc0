// Changes of bushd.toml that keep everything else in it to the letter.
#include "config/edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::kGood;
using test::replaced;
using testing::HasSubstr;

constexpr SettingKey kOffset = SettingKey::kOffset;
constexpr SettingKey kDirection = SettingKey::kDirection;
constexpr SettingKey kSoftLimits = SettingKey::kSoftLimits;

// `keys` behind those that motor "theta" has in any case; "slit" follows.
std::string with_theta(const std::string& keys) {
  const std::string group = "group = \"goniometer\"\n";
  return replaced(replaced(kGood, "table = \"own\"", "table = \"bushd2-constant\""), group,
                  group + "unit = \"mm\"\nsteps_per_unit = 400\n" + keys);
}

std::string after(const std::string& text, const std::vector<Edit>& edits) {
  const auto out = edited(text, edits, "/nonexistent/bushd.toml");
  return out ? *out : "error: " + out.error().text();
}

void expect(const std::string& before, const std::vector<Edit>& edits, const std::string& keys) {
  EXPECT_EQ(after(with_theta(before), edits), with_theta(keys));
}

TEST(Edit, AValueIsReplacedWhereItStands) {
  expect("  offset=10 # since µ-day\n# end\n", {{"theta", kOffset, "2.5"}},
         "  offset=2.5 # since µ-day\n# end\n");
  expect("direction = 'positive'\n\n", {{"theta", kDirection, "negative"}},
         "direction = \"negative\"\n\n");
  expect("soft_limits = [ # low\n  -5, # high\n  5 ]# all\n", {{"theta", kSoftLimits, "[1, 2]"}},
         "soft_limits = [1, 2]# all\n");
}

TEST(Edit, WordsHaveQuotesAndTruthHasNone) {
  expect("", {{"theta", SettingKey::kInputActive, "open"}}, "input_active = \"open\"\n");
  expect("input_active = \"open\" # NC\n", {{"theta", SettingKey::kInputActive, "closed"}},
         "input_active = \"closed\" # NC\n");
  expect("local = true\n", {{"theta", SettingKey::kLocal, "false"}}, "local = false\n");
  expect("", {{"theta", SettingKey::kKeypad, "true"}}, "keypad = true\n");
}

TEST(Edit, VelocityAndCurrentsAreInlineTables) {
  expect("local = true\nvelocity = { min_steps_per_s=1, max_steps_per_s=2, steps_per_s2=3 } # v\n",
         {{"theta", SettingKey::kVelocity, "100,1500,500"}},
         "local = true\nvelocity = { min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = "
         "500 } # v\n");
  expect("local = true\n", {{"theta", SettingKey::kVelocity, "100,1500,500"}},
         "local = true\nvelocity = { min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = "
         "500 }\n");
  expect("local = true\nvelocity = { min_steps_per_s=1, max_steps_per_s=2, steps_per_s2=3 }\n",
         {{"theta", SettingKey::kVelocity, "none"}}, "local = true\n");
  EXPECT_THAT(after(with_theta(""), {{"theta", SettingKey::kCurrents, "1,2,3"}}),
              HasSubstr("its MCU does not drive it by phases"));
}

TEST(Edit, ASequenceOfPhasesIsAKeyOfTheMcu) {
  const std::string address = "address = 1\n";
  const auto with_mcu = [&](const std::string& keys) {
    return replaced(with_theta(""), address, address + keys);
  };
  const SettingKey key = SettingKey::kPhaseSequence;
  EXPECT_EQ(after(with_mcu("steps = \"phases\"\n"), {{"theta", key, "half"}}),
            replaced(with_mcu("steps = \"phases\"\n"), "steps = \"phases\"\n",
                     "steps = \"phases\"\nphase_sequence = \"half\"\n"));
  const std::string full = "phase_sequence = \"full\" # of the stage\nsteps = \"phases\"\n";
  const std::string wave = "phase_sequence = \"wave\" # of the stage\nsteps = \"phases\"\n";
  EXPECT_EQ(after(with_mcu(full), {{"theta", key, "wave"}}), with_mcu(wave));
}

TEST(Edit, AGreatestSpeedIsANumberOrHasNoKey) {
  constexpr SettingKey kMaxSpeed = SettingKey::kMaxSpeed;
  expect("max_speed = 5 # mm/s\n", {{"theta", kMaxSpeed, "2.50"}}, "max_speed = 2.5 # mm/s\n");
  expect("", {{"theta", kMaxSpeed, "2"}}, "max_speed = 2\n");
  expect("max_speed = 5\n", {{"theta", kMaxSpeed, "none"}}, "");
  expect("", {{"theta", SettingKey::kAcceleration, "0.5"}}, "acceleration = 0.5\n");
  // A motor has one of the two, whatever it had.
  expect("max_speed = 5\n", {{"theta", SettingKey::kLocal, "true"}, {"theta", kMaxSpeed, "none"}},
         "local = true\n");
  expect("local = true\n", {{"theta", kMaxSpeed, "2"}, {"theta", SettingKey::kLocal, "false"}},
         "local = false\nmax_speed = 2\n");
}

// Who moves it and how fast, as 'bushctl config --save' writes them together.
TEST(Edit, AValueMayNeedAnotherOneOfTheSameTime) {
  const std::string velocity =
      "{ min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = 500 }";
  const std::string both = "local = true\nvelocity = " + velocity + "\n";
  expect("", {{"theta", SettingKey::kLocal, "true"}, {"theta", SettingKey::kVelocity, velocity}},
         both);
  expect("", {{"theta", SettingKey::kVelocity, velocity}, {"theta", SettingKey::kLocal, "true"}},
         both);
}

TEST(Edit, AKeyThatIsMissingStandsBehindTheOthersOfItsMotor) {
  expect("", {{"theta", kOffset, "-1"}, {"theta", kSoftLimits, "[1, 2]"}},
         "offset = -1\nsoft_limits = [1, 2]\n");
  expect("\n# of the other motor\n", {{"theta", kOffset, "-1"}},
         "offset = -1\n\n# of the other motor\n");
  expect("home = { direction = \"negative\", most_steps = 5 } # h\n",
         {{"theta", kDirection, "negative"}},
         "home = { direction = \"negative\", most_steps = 5 } # h\ndirection = \"negative\"\n");
  expect(
      "description = \"\"\"\\\n  µ = two lines\"\"\"\n[motor.home]\ndirection = "
      "\"negative\"\nmost_steps = 5\n",
      {{"theta", kOffset, "3"}},
      "description = \"\"\"\\\n  µ = two lines\"\"\"\noffset = 3\n[motor.home]\ndirection = "
      "\"negative\"\nmost_steps = 5\n");
}

TEST(Edit, SoftLimitsThatAreNoneGoAndTheirCommentsStay) {
  expect("soft_limits = [-5, 5]\noffset = 1\n", {{"theta", kSoftLimits, "none"}}, "offset = 1\n");
  expect("soft_limits = [-5, # low\n 5] # beware\noffset = 1\n", {{"theta", kSoftLimits, "none"}},
         "# low\n# beware\noffset = 1\n");
  expect("offset = 1\n", {{"theta", kSoftLimits, "none"}}, "offset = 1\n");
}

TEST(Edit, EachKeyIsReadBackAsItIsWritten) {
  const std::string path = "/nonexistent/bushd.toml";
  const std::string address = "address = 1\n";
  const std::string all_apply =
      replaced(with_theta("local = true\n"), address, address + "steps = \"phases\"\n");
  for (const SettingKey key : kSettingKeys) {
    SCOPED_TRACE(name_of(key));
    const auto value_in = [&](const std::string& text) {
      const Config config = parse(text, path).value();
      const Motor& theta = config.motors.front();
      return text_of(settings_of(theta, config.mcu_of(theta)), key);
    };
    const std::string value = value_in(all_apply);
    const std::string out = after(all_apply, {{"theta", key, value}});
    const std::string written = std::string(name_of(key)) + " = ";
    EXPECT_EQ(out.find(written) != std::string::npos, value != "none") << out;
    EXPECT_EQ(value_in(out), value);
  }
}

TEST(Edit, TheEndOfAFileAndItsNewlinesStay) {
  const std::string text = with_theta("") + "unit = \"mm\"\nsteps_per_unit = 1\noffset = 4";
  EXPECT_EQ(after(text, {{"slit", kOffset, "5"}}),
            with_theta("") + "unit = \"mm\"\nsteps_per_unit = 1\noffset = 5");
  EXPECT_EQ(after(text, {{"slit", kDirection, "negative"}}), text + "\ndirection = \"negative\"\n");
  std::string crlf;
  for (const char c : text) crlf += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(after(crlf, {{"slit", kDirection, "negative"}}),
            crlf + "\r\ndirection = \"negative\"\r\n");
}

TEST(Edit, MotorsInOneLineAreChangedIfTheirKeyIsThere) {
  const std::string text =
      replaced(with_theta("") + "unit = \"mm\"\nsteps_per_unit = 1\n",
               "[[motor]]\nname = \"theta\"", "[[motor]]\nlocal = false\nname = \"theta\"");
  ASSERT_THAT(after(text, {{"theta", kOffset, "1"}}), HasSubstr("offset = 1"));
  const std::string head = text.substr(0, text.find("[[motor]]"));
  const std::string inline_motors =
      "motor = [{ name = \"a\", mcu = \"hall:1\", output = 0, group = \"goniometer\", unit = "
      "\"mm\", steps_per_unit = 4, offset = 3 }, { name = \"b\", mcu = \"roof:255\", output = 0, "
      "group = \"slits\"}]\n";
  EXPECT_EQ(after(inline_motors + head, {{"a", kOffset, "1"}}),
            replaced(inline_motors, "offset = 3", "offset = 1") + head);
  EXPECT_THAT(after(inline_motors + head, {{"a", kSoftLimits, "[1, 2]"}}),
              HasSubstr("cannot be changed in place"));
}

TEST(Edit, WhatDoesNotFitIsRefused) {
  EXPECT_THAT(after(with_theta(""), {{"phi", kOffset, "1"}}), HasSubstr("has no motor \"phi\""));
  EXPECT_THAT(after(with_theta(""), {{"theta", kOffset, "1\nlocal = true"}}),
              HasSubstr("theta: offset: is"));
  EXPECT_THAT(after(with_theta(""), {{"slit", kOffset, "1"}}), HasSubstr("it has no unit"));
  EXPECT_THAT(after("[[motor]\n", {{"slit", kOffset, "1"}}), HasSubstr("error"));
}

}  // namespace
}  // namespace bushd::config
