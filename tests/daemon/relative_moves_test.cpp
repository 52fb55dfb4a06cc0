// Distances that are no whole numbers of steps: what is asked for adds up, as long as the motor is
// where it was told to go, or on its way there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "daemon/on_line.h"

namespace bushd::test {
namespace {

const std::string kTenPerMm = "unit = \"mm\"\nsteps_per_unit = 10\n";

struct RelativeLab : Lab {
  explicit RelativeLab(const std::string& keys = kTenPerMm, const std::string& more = {})
      : Lab(with_keys(with_keys(hall(1, 2), "m01", keys), "m02", keys) + more) {
    keep_positions();
    connect();
  }
  static api::Request by(double distance, const std::string& name = "m01") {
    return api::Move{.motors = {{name, api::UserUnits{distance}}}};
  }
  static api::Request to(double position) {
    return api::Move{.kind = api::Move::Kind::kAbsolute,
                     .motors = {{"m01", api::UserUnits{position}}}};
  }
  void reach(const api::Request& request) { EXPECT_EQ(ask(request).result, "reached"); }
  void reach_by(double distance) { reach(by(distance)); }
  void restart() {
    run_for(0.2);
    restart_daemon();
    ready();
  }
  void ready() {
    run_for(0.1);
    ASSERT_TRUE(run_until([this] { return all_ready(); }, 20));
    run_for(0.3);
  }
};

TEST(RelativeMoves, AddUpThoughNoneIsAStep) {
  RelativeLab lab;
  for (int i = 0; i < 100; ++i) lab.reach_by(0.04);
  EXPECT_EQ(lab.shaft_steps("m01"), 40);
  for (int i = 0; i < 100; ++i) lab.reach_by(-0.04);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(RelativeMoves, AddUpToTheNearestStep) {
  RelativeLab lab("unit = \"deg\"\nsteps_per_unit = \"400/360\"\ndirection = \"negative\"\n");
  for (int i = 0; i < 100; ++i) lab.reach_by(1.3);
  EXPECT_EQ(lab.shaft_steps("m01"), -144);  // 130 deg are 144.44 steps
}

// In hundredths of a step, which are integers.
TEST(RelativeMoves, AreNeverFartherOffThanHalfAStep) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    RelativeLab lab;
    std::int64_t asked = 0;
    for (int i = 0; i < 60; ++i) {
      const auto amount = static_cast<std::int64_t>(random() % 400) - 200;
      const bool absolute = random() % 5 == 0;
      const bool meanwhile = random() % 3 == 0;
      asked = absolute ? amount : asked + amount;
      const double mm = static_cast<double>(amount) / 1000;
      const auto move = lab.send(absolute ? RelativeLab::to(mm) : RelativeLab::by(mm));
      // What is asked for in motion counts from where the motor is bound for.
      if (!meanwhile) lab.wait(move);
    }
    ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m01").moving; }));
    lab.run_for(0.5);
    EXPECT_LE(std::abs(100 * lab.shaft_steps("m01") - asked), 50);
  }
}

// After what ends it, the next distance counts from where the motor stands.
TEST(RelativeMoves, CountFromWhereItStandsWhenItIsElsewhereOrSet) {
  const std::vector<std::pair<const char*, std::function<void(RelativeLab&)>>> ends{
      {"set",
       [](RelativeLab& lab) {
         EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "done");
       }},
      {"set in mm",
       [](RelativeLab& lab) {
         EXPECT_EQ(lab.ask(api::SetPosition{.motors = {{"m01", api::UserUnits{7}}}}).result,
                   "done");
       }},
      {"jog",
       [](RelativeLab& lab) {
         const auto jog =
             lab.send(api::Jog{.motor = "m01", .per_s = 50, .in_steps = true, .keepalive_ms = 200});
         lab.wait(jog);
         lab.reach(
             api::Move{.kind = api::Move::Kind::kAbsolute, .motors = motor_steps({"m01"}, {0})});
       }},
      {"stop elsewhere",
       [](RelativeLab& lab) {
         const auto move = lab.send(RelativeLab::by(200));
         lab.run_for(0.5);
         lab.ask(Ask::kStop, {"m01"});
         EXPECT_EQ(lab.last_reply(move).result, "stopped");
         const std::int64_t stands = lab.shaft_steps("m01");
         lab.reach_by(0.04);
         EXPECT_EQ(lab.shaft_steps("m01"), stands);
         lab.reach(
             api::Move{.kind = api::Move::Kind::kAbsolute, .motors = motor_steps({"m01"}, {0})});
       }},
  };
  for (const auto& [name, end] : ends) {
    SCOPED_TRACE(name);
    RelativeLab lab;
    lab.reach_by(0.04);
    end(lab);
    ASSERT_EQ(lab.shaft_steps("m01"), 0);
    lab.reach_by(0.04);
    EXPECT_EQ(lab.shaft_steps("m01"), 0) << "0.4 steps, not 0.8";
    lab.reach_by(0.04);
    EXPECT_EQ(lab.shaft_steps("m01"), 1);
  }
}

TEST(RelativeMoves, AddUpOverRestartsAndPowerCuts) {
  RelativeLab lab;
  for (int i = 0; i < 10; ++i) {
    lab.reach_by(0.04);
    lab.run_for(0.2);
    if (i % 3 == 0) lab.restart();
    if (i % 3 == 1) {
      lab.bus(0).reboot(0);
      lab.cut_pc_power();
      lab.ready();
    }
    if (i % 3 == 2) {
      lab.bus(0).reboot(0);
      lab.ready();
    }
  }
  EXPECT_EQ(lab.shaft_steps("m01"), 4);
}

TEST(RelativeMoves, AlongALineAddUpForEachOfItsMotors) {
  RelativeLab lab;
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(lab.ask(api::MoveLine{.motors = {{"m01", api::UserUnits{0.04}},
                                               {"m02", api::UserUnits{-0.13}}}})
                  .result,
              "reached");
  }
  EXPECT_EQ(lab.shaft_steps("m01"), 20);
  EXPECT_EQ(lab.shaft_steps("m02"), -65);
}

TEST(RelativeMoves, OfAComputedAxisAddUpInItsMotors) {
  RelativeLab lab(kTenPerMm,
                  "[[pseudo]]\nkind = \"slit\"\nname = [\"gap\", \"centre\"]\nunit = \"mm\"\n"
                  "motors = [\"m01\", \"m02\"]\n");
  for (int i = 0; i < 100; ++i) lab.reach(RelativeLab::by(0.02, "gap"));
  EXPECT_EQ(lab.shaft_steps("m01"), -10);
  EXPECT_EQ(lab.shaft_steps("m02"), 10);
  for (int i = 0; i < 100; ++i) lab.reach(RelativeLab::by(0.03, "centre"));
  EXPECT_EQ(lab.shaft_steps("m01"), 20);
  EXPECT_EQ(lab.shaft_steps("m02"), 40);
}

}  // namespace
}  // namespace bushd::test
