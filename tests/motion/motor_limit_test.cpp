// A limit switch that a motor meets on its last steps: a ramp of its MCU's own leads it to its
// target, where it settles as without the switch.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/tables.h"
#include "motion/motor.h"
#include "motion/ramp.h"

namespace bushd::motion::motor_limit_test {
namespace {

using test::kTickNs;

constexpr Tick kStart = 100;
constexpr std::int64_t kSteps = 400;

class Settling {
 public:
  explicit Settling(Tick settle_ticks)
      : motor({.name = "theta", .mcu = "hall:1", .output = Output{0}, .settle_ticks = settle_ticks},
              Axis(*table_.view(), kTickNs, BUSHD_FORMAT_FINE)) {
    mcu_.motor_count = 16;
    motor.goes_online(mcu_, true, false);
    motor.trust().is_known();
    motor.start(kSteps, kStart);
    mcu_.forbidden_positive = 1;
  }
  Tick planned_end() const { return motor.axis().end_tick(); }
  std::vector<Event> report(Tick tick, std::int64_t position, bool moving) {
    mcu_.tick = static_cast<std::uint32_t>(tick);
    mcu_.moving = moving ? 1 : 0;
    mcu_.motor[0].position_steps = static_cast<std::int32_t>(position);
    return motor.report(
        {.of_mcu = mcu_, .tick = tick, .requests_open = false, .emergency_stop_open = false});
  }
  static bool is_dropped(const std::vector<Event>& events) {
    return events.size() == 1 && std::holds_alternative<event::Drop>(events[0]);
  }
  static bool is_reached(const std::vector<Event>& events) {
    const auto* ended = events.empty() ? nullptr : std::get_if<event::Ended>(&events.back());
    return ended != nullptr && ended->outcome == Outcome::kReached;
  }

 private:
  test::TestTable table_{test::ramp(), true};
  bushd_report mcu_{};

 public:
  Motor motor;
};

enum class Meanwhile { kNothing, kPause, kOthersStop, kStop };

class SettlingAtALimit : public testing::TestWithParam<Meanwhile> {};
INSTANTIATE_TEST_SUITE_P(All, SettlingAtALimit,
                         testing::Values(Meanwhile::kNothing, Meanwhile::kPause,
                                         Meanwhile::kOthersStop, Meanwhile::kStop));

// Its own ramp took a step longer than its plan.
TEST_P(SettlingAtALimit, LastsFromWhenItStands) {
  Settling of(50);
  const Tick end = of.planned_end();
  EXPECT_TRUE(of.is_dropped(of.report(end, kSteps - 1, true)));
  EXPECT_FALSE(of.motor.reach().may_move_to(0)) << "it is being stopped";
  EXPECT_TRUE(of.report(end + 1, kSteps, false).empty()) << "it has just come to rest";
  EXPECT_EQ(of.motor.axis().velocity_steps_per_s(), 0);
  EXPECT_TRUE(of.motor.reach().may_move_to(0)) << "away from the switch";
  EXPECT_FALSE(of.motor.reach().may_move_to(kSteps + 1));
  if (GetParam() == Meanwhile::kPause) of.motor.pause();
  if (GetParam() == Meanwhile::kStop || GetParam() == Meanwhile::kOthersStop) of.motor.stop();
  if (GetParam() == Meanwhile::kOthersStop) of.motor.is_stopped_by_others();
  const auto events = of.report(end + 50, kSteps, false);
  if (GetParam() == Meanwhile::kStop) {
    EXPECT_TRUE(of.is_reached(events)) << "it need not settle";
    return;
  }
  EXPECT_TRUE(events.empty()) << "it settles";
  EXPECT_TRUE(of.is_reached(of.report(end + 51, kSteps, false)));
}

TEST(AtALimit, ARampThatWasShorterWaitsForThePlan) {
  Settling of(50);
  const Tick end = of.planned_end();
  EXPECT_TRUE(of.is_dropped(of.report(end - 6, kSteps - 1, true)));
  EXPECT_TRUE(of.report(end - 3, kSteps, false).empty());
  EXPECT_TRUE(of.report(end + 2, kSteps, false).empty());
  EXPECT_TRUE(of.report(end + 51, kSteps, false).empty());
  EXPECT_TRUE(of.is_reached(of.report(end + 52, kSteps, false)));
}

TEST(AtALimit, WhoDoesNotSettleHasReachedItsTargetAtOnce) {
  Settling of(0);
  const Tick end = of.planned_end();
  EXPECT_TRUE(of.is_dropped(of.report(end - 6, kSteps - 1, true)));
  EXPECT_TRUE(of.is_reached(of.report(end - 3, kSteps, false)));
}

TEST(AtALimit, OneThatStandsElsewhereHasNotReachedIt) {
  Settling of(50);
  const Tick end = of.planned_end();
  EXPECT_TRUE(of.is_dropped(of.report(end - 6, kSteps - 5, true)));
  const auto events = of.report(end + 2, kSteps - 2, false);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(std::get<event::Ended>(events[0]).outcome, Outcome::kLimit);
}

}  // namespace
}  // namespace bushd::motion::motor_limit_test
