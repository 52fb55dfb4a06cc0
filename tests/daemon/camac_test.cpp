// Programs that drive BUSHD-2 and BUSHD-1 through the daemon, down to the steps of the motors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/camac_lab.h"
#include "daemon/step_times.h"
#include "heritage/camac/bushd2.h"

namespace bushd::test::camac_test {
namespace {

using camac::Bushd2;
using testing::HasSubstr;

constexpr int kStartHz = 100;
constexpr std::int64_t kUnitNs = 1'000'000'000 / (250 * kStartHz);

constexpr std::uint32_t kEnabled = 0x60;  // fault and end of motion
constexpr std::uint32_t kLeft = 0x80;

// From 250 to 10, as the report's figure.
std::vector<int> falling_codes() {
  std::vector<int> codes;
  for (int i = 0; i < 238; ++i) codes.push_back(std::max(250 - i * 2, 10));
  return codes;
}

TEST(CamacMotion, AProgramMovesAMotorAndRaisesLam) {
  for (const char* manner : {"fine", "coarse", "fine_table", "fine_ticks"}) {
    SCOPED_TRACE(manner);
    CamacLab lab(lab_with(manner));
    lab.load(0, 300, falling_codes());
    lab.run_to_lam(kEnabled);
    EXPECT_EQ(lab.lams().back(), (api::CamacLam{.crate = 1, .raised = 16, .requests = 16}));
    EXPECT_EQ(lab.shaft_steps("m01"), 300);
    EXPECT_TRUE(lab.lam());
    EXPECT_EQ(lab.requests(), 0x10U | (300U % 4) << 8);
    EXPECT_THAT(lab.description("m01").table.name, HasSubstr("camac-1-5-0-"));
    lab.naf(kStation, 0, 10);
    EXPECT_FALSE(lab.lam());
    lab.run_to_lam(kEnabled | kLeft | 1);
    EXPECT_EQ(lab.shaft_steps("m02"), -300);
    EXPECT_EQ(lab.shaft_steps("m01"), 300);
    EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0);
    EXPECT_EQ(lab.mcu_health("hall:1").ramp_downs, 0u);
    EXPECT_TRUE(lab.errors().empty());
  }
}

// S14, S25: the times of the steps, as an MCU makes them, against the formula of the report.
TEST(CamacMotion, StepsAreWhereTheReportPutsThem) {
  constexpr std::int64_t kSlotNs = 2'560'000 / 128;
  for (const int steps : {1, 2, 3, 7, 101, 475, 476, 477, 1001}) {
    SCOPED_TRACE(steps);
    StepTimes edges;
    CamacLab lab(lab_with("fine_table"), &edges);
    lab.load(0, steps, falling_codes());
    lab.run_to_lam(kEnabled);
    ASSERT_EQ(edges.of(0, 0).size(), static_cast<std::size_t>(steps));
    camac::Program program{.steps = static_cast<std::uint32_t>(steps)};
    for (const int code : falling_codes()) {
      program.codes.push_back(static_cast<std::uint8_t>(code));
    }
    // A code stands before its step, so all times follow from the first step.
    std::int64_t due_ns = edges.of(0, 0).front();
    for (std::uint32_t step = 1; step < program.steps; ++step) {
      due_ns += code_of_step(program, step) * kUnitNs;
      EXPECT_NEAR(static_cast<double>(edges.of(0, 0)[step]), static_cast<double>(due_ns),
                  static_cast<double>(kSlotNs))
          << "step " << step;
    }
  }
}

// Code 250 is F_start and code 10 is 25 F_start, which are at most 10 % apart from the next code.
TEST(CamacMotion, FrequenciesGoFromStartTo25Times) {
  constexpr double kSlotNs = 20'000;
  for (const int start_hz : {1, 40, 100}) {
    SCOPED_TRACE(start_hz);
    std::string toml = lab_with("fine_table");
    const std::string set = "f_start_hz = 100";
    toml.replace(toml.find(set), set.size(), "f_start_hz = " + std::to_string(start_hz));
    StepTimes edges;
    CamacLab lab(toml, &edges);
    lab.load(0, 4, {250, 11, 10});
    lab.run_to_lam(kEnabled);
    lab.naf(kStation, 0, 10);
    lab.load(0, 5, {250, 11, 10});
    lab.run_to_lam(kEnabled);
    ASSERT_EQ(edges.of(0, 0).size(), 9u);
    const auto delay_ns = [&](std::size_t step) {
      return static_cast<double>(edges.of(0, 0)[step] - edges.of(0, 0)[step - 1]);
    };
    // An edge is in the slot of its time, so a delay is off by less than one.
    EXPECT_NEAR(delay_ns(3), 1e9 / start_hz, kSlotNs) << "code 250";
    EXPECT_NEAR(delay_ns(6), 1e9 / (25.0 * start_hz), kSlotNs) << "code 10";
    EXPECT_NEAR(delay_ns(5), 1.1e9 / (25.0 * start_hz), kSlotNs) << "code 11, a tenth slower";
  }
}

TEST(CamacMotion, ForbidRampsDownWithoutARequest) {
  CamacLab lab;
  lab.load(0, 60'000, falling_codes());
  lab.permit(kEnabled);
  lab.run_until([&] { return lab.shaft_steps("m01") > 1000; });
  lab.naf(kStation, 0, 24);
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m01").moving; }));
  lab.run_for(1);
  const std::int64_t stands = lab.shaft_steps("m01");
  EXPECT_LT(stands, 2500);
  EXPECT_FALSE(lab.lam());
  EXPECT_TRUE(lab.lams().empty());
  EXPECT_EQ(lab.requests() >> 8, static_cast<std::uint32_t>(stands) % 4);
  lab.load(0, 40, falling_codes());
  lab.run_to_lam(kEnabled);
  EXPECT_EQ(lab.shaft_steps("m01"), stands + 40);
}

TEST(CamacMotion, AnotherProgramIsAnotherTable) {
  CamacLab lab;
  lab.load(0, 20, falling_codes());
  lab.run_to_lam(kEnabled);
  const std::string first = lab.description("m01").table.name;
  lab.naf(kStation, 0, 10);
  lab.run_to_lam(kEnabled);
  EXPECT_EQ(lab.description("m01").table.name, first);
  lab.naf(kStation, 0, 10);
  lab.load(0, 20, std::vector<int>(238, 100));
  lab.run_to_lam(kEnabled);
  EXPECT_NE(lab.description("m01").table.name, first);
  EXPECT_EQ(lab.shaft_steps("m01"), 60);
  EXPECT_THAT(lab.kept(), testing::IsEmpty()) << "the next daemon has the tables of bushd.toml";
}

TEST(CamacMotion, CodesThatAMotionDoesNotComeToMayRise) {
  CamacLab lab;
  std::vector<int> codes = falling_codes();
  codes[3] = 255;
  lab.load(0, 6, codes);
  lab.run_to_lam(kEnabled);
  EXPECT_EQ(lab.shaft_steps("m01"), 6);
  EXPECT_THAT(lab.description("m01").table.name, HasSubstr("camac-1-5-0-")) << "by a table";
}

TEST(CamacMotion, WhatTheMotorCannotDoIsInItsStatus) {
  CamacLab lab;
  lab.load(0, 8, falling_codes());
  lab.permit(kEnabled | 7);
  EXPECT_EQ(lab.requests(), 0x108U) << "there is no motor 7";
  lab.naf(kStation, 0, 10);
  lab.ask(Ask::kDisable, {"m01"});
  lab.permit(kEnabled);
  EXPECT_EQ(lab.requests(), 0x104U) << "supply missing";
  EXPECT_THAT(lab.warnings().back(), HasSubstr("drivers of MCU hall:1 are disabled"));
  lab.ask(Ask::kEnable, {"m01"});
  lab.naf(kStation, 0, 10);
  lab.run_to_lam(kEnabled);
  lab.naf(kStation, 0, 10);
  lab.unplug(0);
  lab.run_for(2);
  lab.permit(kEnabled);
  EXPECT_EQ(lab.requests(), 0x108U) << "not connected";
  EXPECT_TRUE(lab.lam());
}

TEST(CamacMotion, ALostLinkEndsItAsNotConnected) {
  CamacLab lab;
  lab.load(0, 20'000, falling_codes());
  lab.permit(kEnabled);
  lab.run_until([&] { return lab.shaft_steps("m01") > 500; });
  lab.unplug(0);
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.requests() & 0xFF, 8U);
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready() && !lab.motor("m01").moving; }));
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.lams().size(), 1U) << "told once";
}

TEST(CamacMotion, ALimitSwitchIsInTheStatus) {
  for (const bool left : {false, true}) {
    CamacLab lab(lab_with("fine", left ? "limit = \"negative\"\n" : "limit = \"positive\"\n"));
    lab.load(0, 20'000, falling_codes());
    lab.permit(kEnabled | (left ? kLeft : 0));
    lab.run_until([&] { return std::abs(lab.shaft_steps("m01")) > 500; });
    lab.bus(0).mcu(0).set_inputs({1, 0});
    ASSERT_TRUE(lab.wait_for_lam());
    EXPECT_EQ(lab.requests() & 0xFF, left ? 2U : 1U);
    const std::int64_t stands = lab.shaft_steps("m01");
    lab.naf(kStation, 0, 10);
    lab.permit(kEnabled | (left ? kLeft : 0));
    EXPECT_EQ(lab.requests(), left ? 0x102U : 0x101U) << "no motion into it";
    lab.naf(kStation, 0, 10);
    lab.load(0, 30, falling_codes());
    lab.run_to_lam(kEnabled | (left ? 0 : kLeft));
    EXPECT_EQ(lab.shaft_steps("m01"), stands + (left ? 30 : -30));
  }
}

TEST(CamacMotion, AStopOfSomebodyElseIsAFault) {
  CamacLab lab;
  lab.load(0, 20'000, falling_codes());
  lab.permit(kEnabled);
  lab.run_until([&] { return lab.shaft_steps("m01") > 500; });
  lab.send(Ask::kStop, {});
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_THAT(lab.warnings().back(), HasSubstr("stopped on request"));
  lab.run_for(0.2);
  EXPECT_FALSE(lab.motor("m01").moving);
}

TEST(CamacMotion, TheLogOfMovesSaysWhoHasAsked) {
  CamacLab lab;
  lab.load(0, 20'000, falling_codes());
  lab.permit(kEnabled);
  lab.run_until([&] { return lab.shaft_steps("m01") > 500; });
  lab.naf(kStation, 0, 24);
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m01").moving; }));
  const auto asked = [&](const std::string& what) {
    return std::ranges::count_if(lab.move_lines(), [&](const std::string& line) {
      return line.find("\"request\":\"" + what + "\"") != std::string::npos &&
             line.find("\"client\":\"camac-1-5\"") != std::string::npos &&
             line.find("\"by\":\"camac\"") != std::string::npos &&
             line.find("\"motors\":[\"m01\"]") != std::string::npos;
    });
  };
  EXPECT_EQ(asked("move"), 1);
  EXPECT_EQ(asked("stop"), 1);
}

TEST(CamacMotion, SoftLimitsHold) {
  CamacLab lab(lab_with("fine", "unit = \"mm\"\nsteps_per_unit = 100\nsoft_limits = [-1, 1]\n"));
  lab.load(0, 101, falling_codes());
  lab.permit(kEnabled);
  EXPECT_TRUE(lab.lam());
  EXPECT_THAT(lab.warnings().back(), HasSubstr("camac-1-5: m01: "));
  lab.run_for(3);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

// Cleared and started in one block; what begins after it is refused at once.
TEST(CamacMotion, ALamThatFallsAndRisesBetweenTwoStepsIsToldAgain) {
  CamacLab lab(lab_with(
      "fine", "unit = \"mm\"\nsteps_per_unit = 100\nsoft_limits = [-1, 1]\nbacklash = 0.1\n"));
  lab.load(0, 100, falling_codes());
  lab.run_to_lam(kEnabled);
  lab.naf(kStation, 1, 16, 0);
  lab.naf(kStation, 0, 16, 200);  // steps
  const std::size_t before = lab.lams().size();
  const Answer answer = lab.block({.cycles = {{kStation, 0, 10},
                                              {kStation, 2, 16, kEnabled | kLeft},
                                              {kStation, 0, 26},
                                              {kStation, 0, 8}},
                                   .count = 4});
  EXPECT_FALSE(answer.camac->block.responses.back().q);
  lab.run_until([&] { return lab.lams().size() > before; }, 3);
  EXPECT_EQ(lab.lams().size(), before + 1);
  EXPECT_THAT(lab.warnings().back(), HasSubstr("for backlash"));
  EXPECT_TRUE(lab.lam());
}

TEST(CamacMotion, AMotorThatMovesAlreadyIsLeftAlone) {
  CamacLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {3000});
  lab.run_until([&] { return lab.shaft_steps("m01") > 100; });
  lab.load(0, 10, falling_codes());
  lab.permit(kEnabled);
  EXPECT_TRUE(lab.lam());
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 3000);
}

TEST(CamacMotion, SingleStepsOfTheShutter) {
  CamacLab lab;
  lab.naf(kShutterStation, 2, 16, 0x37);
  lab.naf(kShutterStation, 0, 26);
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.lams().back().raised, 1U << (kShutterStation - 1));
  EXPECT_EQ(lab.naf(kShutterStation, 3, 0).data, 0x04U);
  EXPECT_EQ(lab.shaft_steps("m03"), 1);
  lab.naf(kShutterStation, 0, 10);
  lab.naf(kShutterStation, 2, 16, 0x3F);
  lab.naf(kShutterStation, 0, 26);
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.shaft_steps("m03"), 0);
}

// U28: as the shafts have turned, whatever has ended a motion.
TEST(CamacMotion, ThePositionOfTheMotorIsInTheMemory) {
  CamacLab lab;
  lab.keep_positions();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  const auto position = [&](std::uint32_t number) {
    lab.naf(kStation, 1, 16, 240 + 2 * number);
    const std::uint32_t low = lab.naf(kStation, 0, 0).data;
    return std::int64_t{static_cast<std::int16_t>(low + 256 * lab.naf(kStation, 0, 0).data)};
  };
  lab.load(0, 300, falling_codes());
  lab.run_to_lam(kEnabled | kLeft | 1);
  lab.naf(kStation, 0, 10);
  EXPECT_EQ(position(1), -300);
  EXPECT_EQ(position(0), 0);
  lab.permit(kEnabled | 1);
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m02") > -200; }));
  lab.naf(kStation, 0, 24);
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m02").moving; }));
  lab.run_for(1);
  const std::int64_t stands = lab.shaft_steps("m02");
  EXPECT_EQ(position(1), stands) << "with the steps of the ramp-down";
  lab.load(0, 20'000, falling_codes());
  lab.permit(kEnabled);
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 500; }));
  lab.send(Ask::kStop, {});
  ASSERT_TRUE(lab.wait_for_lam());
  lab.run_for(2);
  lab.restart_daemon();  // nothing has asked the module since: the end of the motion has kept it
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  EXPECT_EQ(position(0), lab.shaft_steps("m01"));
  EXPECT_EQ(position(1), stands);
}

// Another daemon finds the memory, and no motor moves because of it.
TEST(CamacMotion, MemorySurvivesRestartsAndPowerCuts) {
  CamacLab lab;
  lab.keep_positions();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  lab.load(1, 40, falling_codes());
  lab.load(0, 30, falling_codes());
  lab.run_to_lam(kEnabled);
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  EXPECT_FALSE(lab.lam()) << "registers begin anew";
  lab.naf(kStation, 1, 16, 256);
  EXPECT_EQ(lab.naf(kStation, 0, 0).data, 40U);
  lab.run_to_lam(kEnabled);
  EXPECT_EQ(lab.shaft_steps("m01"), 60);
  lab.run_for(2);
  lab.cut_pc_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  lab.naf(kStation, 1, 16, 0);
  EXPECT_EQ(lab.naf(kStation, 0, 0).data, 30U);
  EXPECT_EQ(lab.shaft_steps("m01"), 60);
  EXPECT_TRUE(lab.errors().empty());
}

// The motion ends without its module; the next daemon has neither LAM nor a second motion.
TEST(CamacMotion, ARestartInMotionLeavesTheMotorAccountedFor) {
  CamacLab lab;
  lab.keep_positions();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  lab.load(0, 20'000, falling_codes());
  lab.permit(kEnabled);
  lab.run_until([&] { return lab.shaft_steps("m01") > 500; });
  lab.restart_daemon();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready() && !lab.motor("m01").moving; }));
  lab.run_for(2);
  const std::int64_t stands = lab.shaft_steps("m01");
  EXPECT_EQ(lab.motor("m01").position_steps, stands);
  EXPECT_EQ(lab.requests(), 0U);
  lab.run_for(5);
  EXPECT_EQ(lab.shaft_steps("m01"), stands);
}

TEST(CamacRequests, BadOnesAreRefused) {
  CamacLab lab;
  EXPECT_THAT(lab.block({.cycles = {{5, 0, 0}}}, 2).reason, HasSubstr("there is no crate 2"));
  const auto reason = [&](const camac::Block& block) { return lab.block(block).reason; };
  EXPECT_THAT(reason({}), HasSubstr("number of cycles 0 is out of range; allowed: 1..4096"));
  EXPECT_THAT(reason({.cycles = {{0, 0, 0}}}), HasSubstr("station 0"));
  EXPECT_THAT(reason({.cycles = {{32, 0, 0}}}), HasSubstr("allowed: 1..31"));
  EXPECT_THAT(reason({.cycles = {{5, 16, 0}}}), HasSubstr("subaddress 16"));
  EXPECT_THAT(reason({.cycles = {{5, 0, 32}}}), HasSubstr("function 32"));
  EXPECT_THAT(reason({.cycles = {{5, 0, 16, 1U << 24}}}), HasSubstr("data 16777216"));
  EXPECT_THAT(reason({.cycles = {{5, 0, 0}}, .count = 2}), HasSubstr("give as many"));
  EXPECT_THAT(reason({.mode = camac::BlockMode::kQStop, .cycles = {{5, 0, 0}}, .count = 4097}),
              HasSubstr("count 4097"));
  EXPECT_THAT(reason({.mode = camac::BlockMode::kScan, .cycles = {{5, 0, 0}}, .last_station = 24}),
              HasSubstr("last station 24"));
}

TEST(CamacRequests, ABlockReadsTheMemory) {
  CamacLab lab;
  lab.load(3, 513, {7, 6, 5});
  lab.naf(kStation, 1, 16, 768);
  const Answer answer =
      lab.block({.mode = camac::BlockMode::kQStop, .cycles = {{kStation, 0, 0}}, .count = 5});
  ASSERT_TRUE(answer.camac);
  std::vector<std::uint32_t> bytes;
  for (const auto& response : answer.camac->block.responses) bytes.push_back(response.data);
  EXPECT_EQ(bytes, (std::vector<std::uint32_t>{1, 2, 7, 6, 5}));
}

}  // namespace
}  // namespace bushd::test::camac_test
