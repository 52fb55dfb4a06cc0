// Positions are counted up to +-2147483647. What an MCU moves by itself keeps within that, or its
// position is uncertain: it is never one of the other end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kMost = INT32_MAX;

class CountsLab : public ReadyLab {
 public:
  explicit CountsLab(const std::string& keys)
      : ReadyLab(with_keys(hall(1, 2), "m01", keys + "\n")) {}
  void stand_at(std::int64_t steps) {
    ASSERT_EQ(ask(Ask::kSetPosition, {"m01"}, {steps}).result, "done");
  }
  void hold(std::uint8_t buttons) { bus(0).mcu(0).set_inputs({0, buttons}); }
  std::int64_t position() const { return motor("m01").position_steps; }
};

TEST(Counts, HomingThatCouldLeaveThemIsRefused) {
  for (const std::int64_t sign : {-1, 1}) {
    SCOPED_TRACE(sign);
    CountsLab lab("home = { direction = \"negative\", most_steps = 5000, slow_most_steps = 200 }");
    lab.stand_at(sign * (kMost - 1000));
    const Answer refused = lab.ask(Ask::kHome, {"m01"});
    EXPECT_THAT(refused, Ends("refused", "m01: "));
    EXPECT_THAT(refused.reason, HasSubstr("'bushctl set"));
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
    // As far as there is room for all that it may make.
    lab.stand_at(sign * (kMost - 5300));
    EXPECT_EQ(lab.ask(Ask::kHome, {"m01"}).result, "fault") << "there is no switch";
    EXPECT_EQ(lab.position(), sign * (kMost - 5300) - 5000);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  }
}

TEST(Counts, LocalInputsMoveNoFurtherThanTheyReach) {
  for (const std::int64_t sign : {-1, 1}) {
    SCOPED_TRACE(sign);
    CountsLab lab("local = true");
    lab.stand_at(sign * (kMost - 1000));
    lab.hold(sign > 0 ? BUSHD_INPUT_FORWARD : BUSHD_INPUT_REVERSE);
    lab.run_for(4);
    EXPECT_EQ(lab.shaft_steps("m01"), sign * 1000);
    EXPECT_EQ(lab.position(), sign * kMost);
    lab.hold(0);
    lab.run_for(0.5);
    EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    lab.hold(sign > 0 ? BUSHD_INPUT_REVERSE : BUSHD_INPUT_FORWARD);
    lab.run_for(0.5);
    EXPECT_LT(sign * lab.position(), kMost) << "back it goes";
  }
}

constexpr const char* kByVelocity =
    "local = true\nvelocity = { min_steps_per_s = 200, max_steps_per_s = 1000, "
    "steps_per_s2 = 2000 }";

TEST(Counts, WhoPassesTheirEndIsUncertain) {
  CountsLab lab(kByVelocity);
  lab.stand_at(kMost - 500);
  lab.hold(BUSHD_INPUT_FORWARD);
  lab.run_for(2);
  lab.hold(0);
  lab.run_for(2);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_THAT(lab.motor("m01").uncertain_reason, HasSubstr("2147483647"));
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {5})).result, "refused");
  lab.stand_at(0);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

// The daemon does not see it.
TEST(Counts, WhoPassesTheirEndUnseenIsUncertain) {
  for (const bool new_daemon : {false, true}) {
    SCOPED_TRACE(new_daemon);
    CountsLab lab(kByVelocity);
    lab.keep_positions();
    lab.connect();
    lab.stand_at(kMost - 500);
    lab.run_for(0.5);
    lab.unplug(0);
    lab.hold(BUSHD_INPUT_FORWARD);
    lab.run_for(2);
    lab.hold(0);
    lab.run_for(2);
    lab.plug(0);
    if (new_daemon) lab.restart_daemon();
    ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
    lab.run_for(0.5);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
    EXPECT_THAT(lab.motor("m01").uncertain_reason, HasSubstr("2147483647"));
  }
}

// A position that is set, or found by homing, is no motion.
TEST(Counts, ToBeSetFromOneEndToTheOtherIsNoMotion) {
  CountsLab lab("local = true");
  for (const std::int64_t steps : {kMost, -kMost, kMost}) {
    lab.stand_at(steps);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    EXPECT_EQ(lab.position(), steps);
  }
}

}  // namespace
}  // namespace bushd::test
