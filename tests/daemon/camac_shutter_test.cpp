// BUSHD-1 through the daemon: a shutter between two limit switches, with reactor starts, down to
// the edges of its STEP output.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/camac_lab.h"

namespace bushd::test::camac_shutter_test {
namespace {

using testing::HasSubstr;

constexpr std::uint32_t kAllEnabled = 0x37;
constexpr std::uint32_t kLeft = 0x08;
constexpr std::uint32_t kAutomatic = 0x40;
constexpr std::uint32_t kSecondMode = 0x80;
enum Request : std::uint32_t {
  kRightLimit = 0x01,
  kLeftLimit = 0x02,
  kStepDone = 0x04,
  kStepNotDone = 0x08,
  kTravelFailed = 0x10,
  kRightLevel = 0x40,
  kLeftLevel = 0x80
};

// They fall and rise once, from 20 ms to 2.5 ms.
const std::vector<int> kCodes{400, 250, 120, 60, 50, 50, 70, 150, 300};

TEST(CamacShutter, AnMcuThatCannotTravelMakesSingleStepsWithoutASensor) {
  Shutter mechanics;
  CamacLab lab(lab_with("fine", "", "inputs = { positive = 3, negative = 4, step = 5 }\n"),
               &mechanics, kShutterStation, BUSHD_CAN_TRAVEL);
  mechanics.bus = &lab.bus(0);
  mechanics.tell();
  lab.run_for(0.1);
  lab.load_bytes(0, {2, 0, 100, 0, 200, 0, 200, 0});
  for (const std::uint32_t mode : {kAutomatic, kAutomatic | kSecondMode}) {
    lab.permit(mode | kAllEnabled);
    EXPECT_TRUE(lab.lam()) << "at once";
    EXPECT_EQ(lab.requests(), kTravelFailed | kLeftLevel);
    EXPECT_EQ(lab.warnings().back(),
              "camac-1-7: m03: the firmware of its MCU does not travel between limits by itself; "
              "use mode 00");
    lab.naf(kShutterStation, 0, 10);
  }
  lab.permit(kSecondMode | kAllEnabled);
  EXPECT_EQ(lab.requests(), kStepNotDone | kLeftLevel);
  EXPECT_EQ(lab.warnings().back(),
            "camac-1-7: m03: the firmware of its MCU does not watch a step sensor; use mode 00");
  lab.naf(kShutterStation, 0, 10);
  EXPECT_TRUE(mechanics.steps.empty());
  lab.run_to_lam(kAllEnabled);
  EXPECT_EQ(lab.requests() & 0x3FU, kStepDone);
  EXPECT_EQ(mechanics.steps.size(), 1u);
}

TEST(CamacShutter, TravelsToTheLimitAndBack) {
  ShutterLab lab;
  EXPECT_EQ(lab.requests(), kLeftLevel);
  lab.load_codes(kCodes, 6000);
  lab.run_to_lam(kAutomatic | kAllEnabled);
  EXPECT_EQ(lab.cleared_requests(), kRightLimit | kRightLevel);
  EXPECT_EQ(lab.shutter().position, 9);
  EXPECT_TRUE(lab.motor("m03").moving) << "it is to return";
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.cleared_requests(), kLeftLimit | kLeftLevel);
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }));
  EXPECT_EQ(lab.shutter().position, 0);
  EXPECT_EQ(lab.motor("m03").position_steps, 0);
  ASSERT_EQ(lab.shutter().steps.size(), 18U);
  const sim::TimeNs begin_ns = lab.shutter().steps[0].time_ns - kCodes[0] * ShutterLab::kUnitNs;
  lab.expect_run(0, begin_ns, kCodes, false);
  sim::TimeNs there_ns = begin_ns;
  for (const int code : kCodes) there_ns += code * ShutterLab::kUnitNs;
  lab.expect_run(9, there_ns + 6000 * ShutterLab::kUnitNs, kCodes, true);
  EXPECT_THAT(lab.description("m03").table.name, HasSubstr("camac-1-7-"));
  EXPECT_TRUE(lab.warnings().empty());
  EXPECT_TRUE(lab.errors().empty());
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m03"}, {3}).result, "reached") << "it is anybody's again";
}

TEST(CamacShutter, FollowsReactorStarts) {
  ShutterLab lab;
  lab.load_codes(kCodes, 12'000);
  lab.permit(kAutomatic | kSecondMode | kAllEnabled);
  lab.run_for(1);
  EXPECT_TRUE(lab.shutter().steps.empty()) << "it waits for the reactor";
  for (std::size_t start = 0; start < 3; ++start) {
    SCOPED_TRACE(start);
    lab.run_for(0.0013);
    const sim::TimeNs start_ns = lab.reactor_starts();
    ASSERT_TRUE(lab.wait_for_lam());
    EXPECT_EQ(lab.cleared_requests() & 0x3F, kRightLimit);
    lab.reactor_starts();  // during a travel: ignored
    ASSERT_TRUE(lab.wait_for_lam());
    EXPECT_EQ(lab.cleared_requests() & 0x3F, kLeftLimit);
    ASSERT_EQ(lab.shutter().steps.size(), (start + 1) * 18);
    lab.expect_run(start * 18, start_ns + 150'000'000, kCodes, false);
    lab.expect_run(start * 18 + 9, start_ns + 600'000'000, kCodes, true);
  }
  lab.naf(kShutterStation, 0, 24);
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }));
  lab.reactor_starts();
  lab.run_for(1);
  EXPECT_EQ(lab.shutter().steps.size(), 54U);
  EXPECT_FALSE(lab.lam()) << "F24 raises no request";
  EXPECT_EQ(lab.motor("m03").position_steps, 0);
}

// The other reading of U13: the delay is that of the opening, and the return keeps to the 150 ms.
TEST(CamacShutter, TheAdjustableDelayMayBeThatOfTheOpening) {
  ShutterLab lab("inputs = { positive = 3, negative = 4, step = 5 }\n", "",
                 "adjustable_delay = \"opening\"\n");
  std::size_t made = 0;
  const auto opens_and_closes = [&](int delay) {
    lab.load_codes(kCodes, delay);
    lab.permit(kAutomatic | kSecondMode | kAllEnabled);
    lab.run_for(0.5013);
    const sim::TimeNs start_ns = lab.reactor_starts();
    ASSERT_TRUE(lab.wait_for_lam());
    EXPECT_EQ(lab.cleared_requests() & 0x3F, kRightLimit);
    ASSERT_TRUE(lab.wait_for_lam());
    EXPECT_EQ(lab.cleared_requests() & 0x3F, kLeftLimit);
    ASSERT_EQ(lab.shutter().steps.size(), made + 18);
    lab.expect_run(made, start_ns + delay * ShutterLab::kUnitNs, kCodes, false);
    sim::TimeNs back_ns = start_ns + 150'000'000;
    const sim::TimeNs there_ns = lab.shutter().steps[made + 8].time_ns;
    if (there_ns > back_ns) {
      // As soon as its MCU has seen the limit.
      back_ns = lab.shutter().steps[made + 9].time_ns - kCodes[0] * ShutterLab::kUnitNs;
      EXPECT_GT(back_ns, there_ns);
      EXPECT_LE(back_ns, there_ns + 10 * 2'560'000);
    }
    lab.expect_run(made + 9, back_ns, kCodes, true);
    made += 18;
    lab.naf(kShutterStation, 0, 24);
    ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }));
  };
  opens_and_closes(600);     // 30 ms, and there after 102.5 ms
  opens_and_closes(205);     // 10.25 ms: four ticks are 10.24 ms
  opens_and_closes(30'000);  // 1.5 s: there when the 150 ms are long over
  EXPECT_TRUE(lab.warnings().empty());

  lab.load_codes(kCodes, 204);
  lab.permit(kAutomatic | kSecondMode | kAllEnabled);
  EXPECT_EQ(lab.cleared_requests() & 0x3F, kTravelFailed);
  EXPECT_THAT(lab.warnings().back(),
              HasSubstr("its MCU opens 10240 us after a reactor start at the earliest, and the "
                        "delay at addresses 2, 3 is 10200 us; write 205 or more there"));
  // Without reactor starts it is that of the return, however short.
  lab.permit(kAutomatic | kAllEnabled);
  ASSERT_TRUE(lab.run_until([&] { return lab.shutter().steps.size() == made + 18; }));
}

TEST(CamacShutter, ErrorsOfATravelStopIt) {
  struct Case {
    int right_limit;
    int left_limit;
    std::uint32_t levels;
    const char* log;
  };
  for (const Case& bad : {Case{5, 0, kRightLevel, "was active before its last step"},
                          Case{10, 0, 0, "was not active after its last step"},
                          Case{9, 9, kRightLevel | kLeftLevel, "came from is still active"}}) {
    SCOPED_TRACE(bad.log);
    ShutterLab lab;
    lab.load_codes(kCodes, 6000);
    lab.shutter().right_limit = bad.right_limit;
    lab.shutter().left_limit = bad.left_limit;
    lab.shutter().tell();
    lab.run_to_lam(kAutomatic | kAllEnabled);
    EXPECT_TRUE((lab.requests() & kTravelFailed) != 0);
    EXPECT_EQ(lab.requests() & (kRightLevel | kLeftLevel), bad.levels);
    EXPECT_THAT(lab.warnings().back(), HasSubstr(bad.log));
    const int stands = lab.shutter().position;
    lab.run_for(2);
    EXPECT_EQ(lab.shutter().position, stands) << "no return";
    EXPECT_FALSE(lab.motor("m03").moving);
    EXPECT_EQ(lab.motor("m03").position_steps, stands);
  }
}

// The limit that it has left, and returns to, is active sooner than it was left. While it ramps
// down the MCU already says so.
TEST(CamacShutter, AReturnThatMeetsItsLimitEarlyFails) {
  std::vector<int> codes;
  for (int i = 0; i < 40; ++i) codes.push_back(200 - 7 * std::min(i, 39 - i));
  for (const int early : {1, 5, 20, 30}) {
    SCOPED_TRACE(early);
    ShutterLab lab;
    lab.load_codes(codes, 2000);
    lab.shutter().left_limit = early;
    lab.shutter().tell();
    lab.run_for(0.1);
    lab.run_to_lam(kAutomatic | kAllEnabled);
    ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }));
    lab.run_for(0.5);
    EXPECT_THAT(lab.warnings().back(), HasSubstr("was active before its last step"));
    EXPECT_NE(lab.requests() & kTravelFailed, 0U);
    EXPECT_EQ(lab.motor("m03").position_steps, lab.shutter().position);
  }
}

TEST(CamacShutter, StepsAreSeenByTheSensorInTime) {
  ShutterLab lab;
  lab.permit(kSecondMode | kAllEnabled);
  lab.run_until([&] { return lab.shutter().position == 1; });
  lab.run_for(0.5);
  EXPECT_EQ(lab.requests(), 0U) << "it has 1.5 s";
  lab.shutter().sensor = true;
  lab.shutter().tell();
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.cleared_requests(), kStepDone);
  const std::int64_t began_us = lab.now_us();
  lab.run_to_lam(kSecondMode | kAllEnabled);
  EXPECT_EQ(lab.cleared_requests(), kStepNotDone);
  EXPECT_GE(lab.now_us() - began_us, 1'500'000);
  EXPECT_LE(lab.now_us() - began_us, 1'800'000);
  EXPECT_EQ(lab.shutter().position, 2);
  EXPECT_EQ(lab.motor("m03").position_steps, 2);
  EXPECT_THAT(lab.warnings().back(), HasSubstr("its sensor has not seen the step in time"));
}

TEST(CamacShutter, WhatCannotWorkIsAFaultThatTheLogExplains) {
  ShutterLab without("inputs = { positive = 3 }\n");
  without.load_codes(kCodes, 6000);
  without.permit(kAutomatic | kAllEnabled);
  ASSERT_TRUE(without.wait_for_lam());
  EXPECT_EQ(without.cleared_requests() & 0x3F, kTravelFailed);
  EXPECT_THAT(without.warnings().back(), HasSubstr("needs a limit switch of its own at each end"));
  without.permit(kSecondMode | kAllEnabled);
  EXPECT_EQ(without.cleared_requests() & 0x3F, kStepNotDone);
  EXPECT_THAT(without.warnings().back(), HasSubstr("it has no step sensor"));
  ShutterLab lab;
  lab.load_codes(kCodes, 6000);
  const auto move = lab.send(Ask::kMoveBy, {"m03"}, {1});
  lab.permit(kAutomatic | kAllEnabled);
  EXPECT_EQ(lab.cleared_requests() & 0x3F, kTravelFailed);
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shutter().position, 1);
}

TEST(CamacShutter, AStopOfSomebodyElseIsAFault) {
  ShutterLab lab;
  lab.load_codes(kCodes, 6000);
  lab.permit(kAutomatic | kAllEnabled);
  lab.run_until([&] { return lab.shutter().position == 2; });
  lab.ask(Ask::kStop, {});
  EXPECT_EQ(lab.cleared_requests() & 0x3F, kTravelFailed);
  const int stands = lab.shutter().position;
  lab.run_for(1);
  EXPECT_EQ(lab.shutter().position, stands);
  EXPECT_EQ(lab.motor("m03").position_steps, stands);
}

// What ends it comes when its last step is made, and nobody has reported that yet.
TEST(CamacShutter, AStopAroundTheLastStepLeavesItFreeForTheNextTravel) {
  const std::vector<camac::Naf> stops{{kShutterStation, 0, 24}, {28, 8, 26}};
  for (const camac::Naf& stop : stops) {
    ShutterLab lab;
    lab.load_codes(kCodes, 200);
    for (int ms = -12; ms <= 60; ms += 4) {
      SCOPED_TRACE("F" + std::to_string(stop.function) + ", " + std::to_string(ms) +
                   " ms after the last step");
      const std::size_t before = lab.shutter().steps.size();
      lab.permit(kAutomatic | kAllEnabled);
      ASSERT_TRUE(lab.run_until([&] { return lab.shutter().steps.size() == before + 17; }, 5));
      lab.run_for(kCodes.back() * 50e-6 + ms * 1e-3);
      lab.naf(stop.station, stop.subaddress, stop.function);
      ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }, 5));
      lab.run_for(0.1);
      lab.cleared_requests();
      if (lab.shutter().position != 0) lab.ask(Ask::kMoveTo, {"m03"}, {0});
      ASSERT_EQ(lab.shutter().position, 0);
    }
    lab.permit(kAutomatic | kAllEnabled);
    ASSERT_TRUE(lab.wait_for_lam(5));
    EXPECT_EQ(lab.cleared_requests() & 0x3F, kRightLimit);
  }
}

// Nobody makes it move on, nor twice.
TEST(CamacShutter, FaultsInBetweenEndIt) {
  ShutterLab lab;
  lab.load_codes(kCodes, 6000);
  lab.permit(kAutomatic | kSecondMode | kAllEnabled);
  lab.run_for(0.5);
  lab.unplug(0);
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.cleared_requests() & 0x3F, kTravelFailed);
  lab.run_for(2);
  lab.reactor_starts();
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.has_state("hall:1") && !lab.motor("m03").moving; }));
  lab.run_for(1);
  EXPECT_EQ(lab.shutter().position, 0) << "a shutter without its daemon stays closed";
  lab.ask(Ask::kClearFaults, {});
  lab.permit(kAutomatic | kSecondMode | kAllEnabled);
  lab.run_for(0.5);
  lab.restart_daemon();
  lab.run_for(2);
  lab.reactor_starts();
  lab.run_for(1);
  EXPECT_EQ(lab.shutter().position, 0) << "nor does one whose daemon is another one";
  EXPECT_FALSE(lab.motor("m03").moving);
}

}  // namespace
}  // namespace bushd::test::camac_shutter_test
