// Units and soft limits, from the request to the shaft.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// Two motors on one MCU; `keys` are of m01.
std::string lab_with(const std::string& keys) {
  return with_keys(hall(1, 2), "m01", keys);
}

constexpr const char* kBlade =
    "unit = \"mm\"\nsteps_per_unit = 400\ndirection = \"negative\"\noffset = 10\n"
    "soft_limits = [-5, 5.5]\n";

api::Request to(double user) {
  return api::Move{.kind = api::Move::Kind::kAbsolute, .motors = {{"m01", api::UserUnits{user}}}};
}
api::Request by(double user) {
  return api::Move{.motors = {{"m01", api::UserUnits{user}}}};
}
api::Request set(double user, bool dial = false) {
  return api::SetPosition{.motors = {{"m01", api::UserUnits{user}}}, .dial = dial};
}

TEST(Units, MovesGoToTheNearestStepOnTheUsersScale) {
  ReadyLab lab(lab_with(kBlade));
  const Answer moved = lab.ask(to(8.0014));  // dial 1.9986: 799.44 steps
  EXPECT_EQ(moved.result, "reached") << moved.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 799);
  const api::MotorState state = lab.motor("m01");
  EXPECT_EQ(state.position_steps, 799);
  EXPECT_EQ(state.dial, 1.9975);
  EXPECT_EQ(state.user, 8.0025);
  EXPECT_EQ(state.user_target, 8.0025);
  // Forward on the user's scale is backward on the dial.
  EXPECT_EQ(lab.ask(by(1)).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 399);
  // In steps, and of a motor without a unit.
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {400}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 400);
  EXPECT_EQ(lab.ask(api::Move{.motors = {{"m02", api::UserUnits{-7}}}}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m02"), -7);
  EXPECT_EQ(lab.motor("m02").user, -7);
}

TEST(Units, WhatIsNoNumberIsRefused) {
  ReadyLab lab(lab_with(kBlade));
  for (const double number : {std::nan(""), HUGE_VAL, 1e300}) {
    EXPECT_EQ(lab.ask(to(number)).result, "refused");
    EXPECT_EQ(lab.ask(by(number)).result, "refused");
    EXPECT_EQ(lab.ask(set(number)).result, "refused");
    EXPECT_EQ(lab.ask(set(number, true)).result, "refused");
  }
  EXPECT_THAT(lab.ask(api::Move{.motors = {{"m02", api::UserUnits{0.5}}}}),
              Ends("refused", "m02: 0.5 is no whole number of steps"));
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(Units, TheDescriptionTellsScaleAndLimits) {
  ReadyLab lab(lab_with(kBlade));
  lab.run_for(4);
  const api::MotorDescription blade = lab.description("m01");
  EXPECT_EQ(blade.scale, (units::Scale{"mm", {400, 1}, true, 10, 4}));
  EXPECT_EQ(blade.soft_limits, (units::SoftLimits{-5, 5.5}));
  EXPECT_EQ(lab.description("m02").scale.unit, "steps");
  EXPECT_FALSE(lab.description("m02").soft_limits);
}

TEST(Units, SetChangesTheOffsetAndSetDialThePosition) {
  ReadyLab lab(lab_with(kBlade));
  ASSERT_EQ(lab.ask(to(9)).result, "reached");  // 400 steps
  EXPECT_EQ(lab.ask(set(100.5)).result, "done");
  lab.run_for(0.2);
  EXPECT_EQ(lab.motor("m01").user, 100.5);
  EXPECT_EQ(lab.motor("m01").position_steps, 400);
  EXPECT_THAT(lab.move_lines().back(), HasSubstr("\"event\":\"offset\""));
  EXPECT_EQ(lab.ask(to(100)).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 600);
  EXPECT_EQ(lab.ask(set(2, true)).result, "done");
  lab.run_for(0.2);
  EXPECT_EQ(lab.motor("m01").position_steps, 800);
  EXPECT_EQ(lab.motor("m01").dial, 2);
  EXPECT_EQ(lab.motor("m01").user, 99.5);
  // Whether it moves makes a difference.
  const auto move = lab.send(by(2));
  lab.run_for(0.05);
  EXPECT_THAT(lab.ask(set(0)), Ends("refused", "at rest"));
  lab.wait(move);
}

TEST(Units, AnOffsetSaysNothingOfAPositionThatIsUncertain) {
  ReadyLab lab(lab_with(kBlade));
  lab.bus(0).reboot(0, 50'000'000);
  lab.run_until([&] { return lab.motor("m01").trust == api::Trust::kUncertain; });
  lab.connect();
  const Answer refused = lab.ask(set(3));
  EXPECT_THAT(refused, Ends("refused", "--dial"));
  EXPECT_EQ(lab.ask(set(3, true)).result, "done");
  lab.run_for(0.2);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.motor("m01").user, 7);
}

TEST(SoftLimits, ATargetBeyondIsRefusedWithFigures) {
  ReadyLab lab(lab_with(kBlade));
  const Answer refused = lab.ask(to(4));  // dial 6
  EXPECT_EQ(refused.result, "refused");
  EXPECT_EQ(refused.reason,
            "m01: target 4.0000 mm is beyond the soft limit at 4.5000 mm; allowed: 4.5000 mm to "
            "15.0000 mm");
  EXPECT_EQ(lab.ask(to(4.5)).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 2200);
  EXPECT_EQ(lab.ask(by(-0.0025)).result, "refused") << "one step";
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {2201}).result, "refused") << "in steps too";
  EXPECT_EQ(lab.ask(to(15.0025)).result, "refused");
  EXPECT_EQ(lab.ask(to(15)).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), -2000);
}

TEST(SoftLimits, HoldForNewTargetsAndForDryRuns) {
  ReadyLab lab(lab_with(kBlade));
  const auto move = lab.send(to(5));
  lab.run_for(0.1);
  EXPECT_EQ(lab.ask(to(4)).result, "refused");
  EXPECT_EQ(lab.ask(api::Move{.kind = api::Move::Kind::kAbsolute,
                              .motors = {{"m01", api::UserUnits{4}}, {"m02", 5}},
                              .dry_run = true})
                .result,
            "refused");
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 2000);
}

TEST(SoftLimits, WhoStandsBeyondMayMoveTowardsThem) {
  ReadyLab lab(lab_with(kBlade));
  ASSERT_EQ(lab.ask(set(8, true)).result, "done");  // dial 8, the limit is 5.5
  EXPECT_EQ(lab.ask(to(1.9)).result, "refused") << "farther out";
  EXPECT_EQ(lab.ask(to(3)).result, "reached") << "dial 7, still outside";
  EXPECT_EQ(lab.ask(to(2.5)).result, "refused") << "out again";
  EXPECT_EQ(lab.ask(to(15.1)).result, "refused") << "through to the other side";
  EXPECT_EQ(lab.ask(to(10)).result, "reached");
}

// The rules of the documents in integers alone: positions of a thousandth of a unit, 7 steps a
// unit.
struct Model {
  std::int64_t steps = 0;
  std::int64_t asked = 0;   // where it was told to go, thousandths of a step
  std::int64_t offset = 0;  // thousandths
  int sign = 1;

  static std::int64_t nearest(std::int64_t above, std::int64_t below) {
    const std::int64_t magnitude = (2 * std::abs(above) + below) / (2 * below);
    return above < 0 ? -magnitude : magnitude;
  }
  std::int64_t steps_of_user(std::int64_t user) const {
    return nearest(sign * (user - offset) * 7, 1000);
  }
  static bool allowed(std::int64_t target, std::int64_t from) {
    constexpr std::int64_t kLow = -700;  // -100.05 units: the step within
    constexpr std::int64_t kHigh = 630;
    return target >= std::min(kLow, from) && target <= std::max(kHigh, from);
  }
};

TEST(Units, RandomRequestsAgreeWithTheModel) {
  const auto seed = std::random_device{}();
  std::printf("seed %u\n", seed);
  std::mt19937_64 random(seed);
  const auto between = [&random](std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(random);
  };
  for (const int sign : {1, -1}) {
    ReadyLab lab(lab_with("unit = \"deg\"\nsteps_per_unit = 7\nsoft_limits = [-100.05, 90]\n" +
                          std::string(sign < 0 ? "direction = \"negative\"\n" : "")));
    Model model{.sign = sign};
    std::int64_t turned = 0;  // what setting the dial has hidden from the shaft
    for (int i = 0; i < 150; ++i) {
      const std::int64_t number = between(-130'000, 130'000);
      const double user = static_cast<double>(number) / 1000;
      const std::int64_t before = model.steps;
      switch (between(0, 9)) {
        case 0:  // Only offsets of whole thousandths: the model has no others.
          if (model.steps % 7 != 0) break;
          ASSERT_EQ(lab.ask(set(user)).result, "done");
          model.offset = number - sign * model.steps / 7 * 1000;
          model.asked = model.steps * 1000;
          break;
        case 1:
          ASSERT_EQ(lab.ask(set(user, true)).result, "done");
          model.steps = Model::nearest(number * 7, 1000);
          turned += model.steps - before;
          model.asked = model.steps * 1000;
          break;
        case 2:
        case 3: {
          const std::int64_t asked = model.asked + sign * number * 7;
          if (std::abs(asked) % 1000 == 500) break;  // either way
          const std::int64_t target = Model::nearest(asked, 1000);
          const bool allowed = Model::allowed(target, before);
          ASSERT_EQ(lab.ask(by(user)).result, allowed ? "reached" : "refused") << i;
          if (!allowed) break;
          model.steps = target;
          model.asked = asked;
          break;
        }
        default: {
          const std::int64_t target = model.steps_of_user(number);
          const bool allowed = Model::allowed(target, before);
          ASSERT_EQ(lab.ask(to(user)).result, allowed ? "reached" : "refused") << i;
          if (!allowed) break;
          model.steps = target;
          model.asked = sign * (number - model.offset) * 7;
        }
      }
      lab.run_for(0.1);
      ASSERT_EQ(lab.motor("m01").position_steps, model.steps) << i;
      ASSERT_EQ(lab.shaft_steps("m01") + turned, model.steps) << i;
      // Seven steps a unit: doubles are off by less than their spacing at 400.
      ASSERT_NEAR(
          lab.motor("m01").user,
          static_cast<double>(sign * model.steps) / 7 + static_cast<double>(model.offset) / 1000,
          1e-12);
    }
  }
}

}  // namespace
}  // namespace bushd::test
