// From where a distance counts: where the motor stands, or where somebody has told it to go. Where
// nobody has, it is refused, and nothing changes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

api::Jog m01_at(double steps_per_s) {
  return {.motor = "m01", .per_s = steps_per_s, .in_steps = true, .keepalive_ms = 3000};
}

class Distances : public testing::Test {
 protected:
  explicit Distances(const std::string& toml = hall(1, 2)) : lab(toml) { lab.connect(); }

  // Refused with this reason, and nobody's motion is another one for it.
  void expect_refused(const std::string& why, const std::function<void()>& then = [] {}) {
    EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {10})),
                Ends("refused", "m01: " + why));
    then();
  }

  Lab lab;
};

TEST_F(Distances, AreRefusedOfAMotorThatJogs) {
  const auto first = lab.send(m01_at(500));
  lab.run_for(1);
  expect_refused("it jogs");
  EXPECT_FALSE(lab.has_result(first));
  EXPECT_EQ(lab.motor("m01").target_steps, lab.motor("m01").position_steps)
      << "nobody has said where it is to stand";
  // A position is one, whatever it does.
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {700});
  EXPECT_EQ(lab.wait(first).result, "stopped");
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m01"}, {20}), Ends("reached"));
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), 720);
}

// In the direction of the other way round through rest, and before its first step.
TEST_F(Distances, AreRefusedWhateverTheJogIsAbout) {
  lab.send(m01_at(500));
  expect_refused("it jogs");
  lab.run_for(1);
  lab.send(m01_at(-500));
  expect_refused("it jogs");
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").velocity_steps_per_s < 0; }, 5));
  expect_refused("it jogs");
}

TEST_F(Distances, OfAMotorThatRampsDownCountFromWhereItWillStand) {
  lab.send(m01_at(1000));
  lab.run_for(1);
  const std::int64_t at = lab.shaft_steps("m01");
  lab.send(m01_at(0));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {10}).result, "reached");
  EXPECT_GT(lab.shaft_steps("m01"), at);
  EXPECT_LT(lab.shaft_steps("m01"), at + 300) << "its ramp of some 100 steps, and ten";
}

TEST_F(Distances, AreRefusedOfAPausedMotor) {
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {3000});
  lab.run_for(0.5);
  const auto pause = lab.send(api::Pause{{"m01"}});
  expect_refused("it is paused on its way to 3000");
  EXPECT_EQ(lab.wait(pause).result, "done");
  expect_refused("it is paused on its way to 3000");
  EXPECT_TRUE(lab.motor("m01").paused);
  EXPECT_EQ(lab.ask(api::Resume{{"m01"}}).result, "done");
  EXPECT_EQ(lab.wait(move).result, "reached");
}

TEST_F(Distances, OfAMotorThatMovesCountFromItsTarget) {
  lab.send(Ask::kMoveBy, {"m01"}, {900});
  lab.run_for(0.4);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {100}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 1000);
}

// The leg that it makes leads beyond: that target is nobody's.
class DistancesOfLegs : public Distances {
 protected:
  DistancesOfLegs()
      : Distances(with_keys(hall(1, 2), "m01",
                            "unit = \"mm\"\nsteps_per_unit = 400\nbacklash = 0.1\n")) {}
};

TEST_F(DistancesOfLegs, CountFromTheTargetOfAllLegs) {
  lab.send(Ask::kMoveTo, {"m01"}, {-600});
  lab.run_for(0.4);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {-100}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), -700);
}

// Axes that are computed from motors: the others of their motors keep to where they are.
class DistancesOfAxes : public Distances {
 protected:
  static std::string with_axes() {
    const std::string mm = "unit = \"mm\"\nsteps_per_unit = 400\n";
    return with_keys(with_keys(hall(1, 2), "m01", mm), "m02", mm) +
           "[[pseudo]]\nname = [\"gap\", \"centre\"]\nunit = \"mm\"\n"
           "motors = [\"m01\", \"m02\"]\nkind = \"slit\"\n";
  }
  DistancesOfAxes() : Distances(with_axes()) {}
  Answer move_center(api::Move::Kind kind) {
    return lab.last_reply(
        lab.send(api::Move{.kind = kind, .motors = {{"centre", api::UserUnits{10}}}}));
  }
};

TEST_F(DistancesOfAxes, AreRefusedWhileOneOfItsMotorsJogs) {
  lab.send(m01_at(500));
  lab.run_for(1);
  for (const auto kind : {api::Move::Kind::kRelative, api::Move::Kind::kAbsolute}) {
    EXPECT_THAT(move_center(kind), Ends("refused", "m01: it jogs"));
  }
}

}  // namespace
}  // namespace bushd::test
