// The motors judge what an emergency stop came to: within two ticks and a ramp, or without another
// step.
#include "sim/plant.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace bushd::sim::plant_test {
namespace {

constexpr TimeNs kTickNs = 2'560'000;

class PlantTest : public testing::Test {
 protected:
  PlantTest() {
    plant.attach(0, 0, rules);
    plant.on_violation = [this](TimeNs, std::size_t, std::size_t, const std::string& what) {
      violations.push_back(what);
    };
    plant.edge({0, 0, Signal::kEnable, 0, true});
    plant.edge({0, 0, Signal::kDir, 0, true});
  }
  void step_after(TimeNs ns) {
    now_ns += ns;
    plant.settled(now_ns);
    plant.edge({now_ns, 0, Signal::kStep, 0, true});
  }
  void accelerate() {
    for (const std::uint16_t code : codes) step_after(code * TimeNs{40'000});
  }
  void ramp_down() {
    for (std::size_t i = codes.size(); i-- > 0;) step_after(codes[i] * TimeNs{40'000});
  }
  void rest() {
    now_ns += 100 * kTickNs;
    plant.settled(now_ns);
  }

  static constexpr std::uint32_t kCodes = 6;
  std::array<std::uint16_t, kCodes> codes = {250, 131, 99, 83, 73, 66};
  bushd_table table = [this] {
    bushd_table made{};
    made.accel = {codes.data(), kCodes, nullptr, nullptr, 0};
    made.decel = made.accel;
    made.cruise = 66;
    made.time_unit_ns = 40'000;
    return made;
  }();
  PaceRules rules{table, kTickNs, 256, BUSHD_FORMAT_FINE};
  Plant plant{1};
  TimeNs now_ns = 0;
  std::vector<std::string> violations;
};

TEST_F(PlantTest, RampAfterAnEmergencyStopIsRight) {
  accelerate();
  plant.halt(0, now_ns, false);
  ramp_down();
  rest();
  EXPECT_TRUE(violations.empty()) << violations.front();
}

TEST_F(PlantTest, MovingOnAfterAnEmergencyStopIsNot) {
  accelerate();
  plant.halt(0, now_ns, false);
  for (int i = 0; i < 40; ++i) step_after(66 * 40'000);
  ASSERT_FALSE(violations.empty());
  EXPECT_NE(violations.front().find("still moving"), std::string::npos);
}

TEST_F(PlantTest, StartWhileAnEmergencyLastsIsWrong) {
  plant.halt(0, now_ns, false);
  rest();
  accelerate();
  EXPECT_FALSE(violations.empty());
}

TEST_F(PlantTest, CutStopsDeadAndMakesNoStepMore) {
  accelerate();
  plant.halt(0, now_ns, true);
  rest();
  EXPECT_TRUE(violations.empty()) << violations.front();
  step_after(kTickNs);
  EXPECT_EQ(violations.size(), 1u);
}

TEST_F(PlantTest, DriversMayBeOffInTheTicksThatWerePreparedForAnImmediateStop) {
  for (const bool halted : {true, false}) {
    accelerate();
    if (halted) plant.halt(0, now_ns, true);
    plant.edge({now_ns, 0, Signal::kEnable, 0, false});
    step_after(codes.back() * TimeNs{40'000});
    EXPECT_EQ(violations.empty(), halted);
    EXPECT_EQ(plant.steps_made(), 7u + (halted ? 0 : 6));
    rest();
    plant.release(0);
    plant.edge({now_ns, 0, Signal::kEnable, 0, true});
  }
}

TEST_F(PlantTest, ALineThatAnImmediateStopEndsMayRestBeforeItsTwoTicks) {
  for (const bool halted : {true, false}) {
    plant.begin_on_line(now_ns, 0, 0);
    accelerate();
    if (halted) plant.halt(0, now_ns, true);
    plant.rest_on_line(now_ns + kTickNs, 0, 0, true);
    EXPECT_EQ(violations.empty(), halted);
    plant.release(0);
    rest();
  }
}

TEST_F(PlantTest, ReleasedMotorsMoveAgain) {
  accelerate();
  plant.halt(0, now_ns, true);
  rest();
  plant.release(0);
  accelerate();
  ramp_down();
  rest();
  EXPECT_TRUE(violations.empty()) << violations.front();
}

// A step at just that time comes after it.
TEST_F(PlantTest, PositionBeforeATimeLeavesOutWhatCameSince) {
  EXPECT_EQ(plant.position_steps_before(0, 0, 0), 0);
  accelerate();
  const TimeNs fourth_ns = now_ns - (66 + 73) * TimeNs{40'000};
  EXPECT_EQ(plant.position_steps_before(0, 0, now_ns + 1), 6);
  EXPECT_EQ(plant.position_steps_before(0, 0, now_ns), 5);
  EXPECT_EQ(plant.position_steps_before(0, 0, fourth_ns + 1), 4);
  EXPECT_EQ(plant.position_steps_before(0, 0, fourth_ns), 3);
  ramp_down();
  rest();
  plant.edge({now_ns, 0, Signal::kDir, 0, false});
  for (int i = 0; i < 200; ++i) step_after(250 * TimeNs{40'000});
  EXPECT_EQ(plant.position_steps(0, 0), 12 - 200);
  EXPECT_EQ(plant.position_steps_before(0, 0, now_ns - 99 * 250 * TimeNs{40'000}), 12 - 100);
}

}  // namespace
}  // namespace bushd::sim::plant_test
