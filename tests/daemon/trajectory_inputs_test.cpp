// What inputs and outputs of the MCUs do while motors follow a trajectory: position compare goes
// on, and a limit switch that one motor meets ends the trajectory for all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "daemon/lab.h"
#include "daemon/step_times.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using Part = api::Follow::Part;

// m01 and m02 are at the first MCU, m03 at the second.
const std::vector<std::string> kFlyScan{"m01", "m03"};

api::Follow fly_scan_part(Part part) {
  api::Follow follow{.part = part, .array = 1, .motors = kFlyScan};
  if (part == Part::kRun) return follow;
  // To 150 and -60 steps and back, at up to 100 steps/s.
  follow.time_s = {0, 1.5, 2, 3.5};
  follow.positions = {0, 0, 150, -60, 150, -60, 0, 0};
  return follow;
}

class TrajectoryInputs : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Format, TrajectoryInputs, testing::Values("fine", "coarse"));

TEST_P(TrajectoryInputs, APulseComesWhereTheMotorPasses) {
  StepTimes pins;
  ReadyLab lab(hall(2, 2, GetParam()), "", &pins);
  const api::PositionCompare compare{.motor = "m01",
                                     .position = 100,
                                     .arrivals = {.positive = true},
                                     .delay_us = 3'000,
                                     .width_us = 500};
  ASSERT_EQ(lab.ask(compare).result, "done");
  ASSERT_EQ(lab.ask(fly_scan_part(Part::kLastRows)).result, "done");
  EXPECT_THAT(lab.ask(fly_scan_part(Part::kRun)), Ends("reached"));
  ASSERT_EQ(pins.of(0, 0).size(), 300u);
  ASSERT_EQ(pins.pulses.size(), 2u) << "one pulse, none on the way back";
  EXPECT_TRUE(pins.pulses[0].level);
  EXPECT_FALSE(pins.pulses[1].level);
  // The MCU counts in slots of 20 us.
  constexpr double kSlotNs = 2'560'000.0 / 128;
  EXPECT_NEAR(static_cast<double>(pins.pulses[0].time_ns - pins.of(0, 0)[99]), 3e6, kSlotNs);
  EXPECT_NEAR(static_cast<double>(pins.pulses[1].time_ns - pins.pulses[0].time_ns), 500e3, kSlotNs);
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST_P(TrajectoryInputs, ALimitSwitchEndsTheTrajectoryForAll) {
  ReadyLab lab(with_keys(hall(2, 2, GetParam()), "m01", "limit = \"positive\"\n"));
  ASSERT_EQ(lab.ask(fly_scan_part(Part::kLastRows)).result, "done");
  const auto run = lab.send(fly_scan_part(Part::kRun));
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") == 80; }));
  lab.bus(0).mcu(0).set_inputs({1, 0});
  const Answer end = lab.wait(run);
  EXPECT_THAT(end, Ends("limit", "m01"));
  EXPECT_EQ(end.motor_results, (std::vector<std::string>{"limit", "stopped"}));
  // At 100 steps/s, where its table begins: the step that is under way, and one while the input is
  // debounced. In the coarse format the MCU reckons the speed from whole steps in ticks, which may
  // add two to its ramp.
  EXPECT_LE(lab.shaft_steps("m01"), std::string(GetParam()) == "fine" ? 82 : 84);
  // The daemon hears of it with a report; until then m03 goes on, at 40 steps/s.
  EXPECT_LT(std::abs(lab.shaft_steps("m03")), 59);
  for (std::size_t i = 0; i < kFlyScan.size(); ++i) {
    EXPECT_EQ(lab.shaft_steps(kFlyScan[i]), end.position_steps[i]);
    EXPECT_EQ(lab.motor(kFlyScan[i]).trust, api::Trust::kKnown);
  }
  // The way back is free, the way on is not.
  EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {5})).reason,
              HasSubstr("limit switch"));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {-5}).result, "reached");
  EXPECT_THAT(lab.errors(), IsEmpty());
}

}  // namespace
}  // namespace bushd::test
