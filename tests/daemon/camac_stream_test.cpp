// Programs of BUSHD-2 for motors whose MCU moves others, so that it cannot take their codes as a
// table: they are streamed. Edges are judged by tools/check-trace, from the codes that the program
// has written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "daemon/camac_lab.h"
#include "daemon/step_times.h"
#include "daemon/traced.h"
#include "tables/table_file.h"

namespace bushd::test::camac_stream_test {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr int kUnitNs = 1'000'000'000 / (250 * 100);
constexpr std::uint32_t kEnabled = 0x60;  // fault and end of motion
constexpr std::uint32_t kLeft = 0x80;

// From 250 to 12, never as fast as the table of the group.
std::vector<int> program_codes() {
  std::vector<int> codes;
  for (int i = 0; i < 238; ++i) codes.push_back(std::max(250 - 2 * i, 12));
  return codes;
}

// Faster than its MCU could ramp down from by the table that it has.
std::vector<int> fast_codes() {
  auto codes = program_codes();
  std::fill(codes.begin() + 200, codes.end(), 9);
  return codes;
}

// The MCU of m01 moves another motor, so that it takes no table.
std::int64_t move_another(CamacLab& lab, std::int64_t steps) {
  const auto other = lab.send(Ask::kMoveBy, {"m03"}, {steps});
  lab.run_until([&] { return lab.shaft_steps("m03") > 200; });
  return other;
}

class CamacStream : public Traced<const char*> {
 protected:
  // m03, of another group and the same MCU, moves.
  void begin(CamacLab& lab) {
    other_ = lab.send(Ask::kMoveBy, {"m03"}, {60'000});
    ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m03") > 200; }));
  }
  bool goes_on(const CamacLab& lab) const { return !lab.has_result(other_); }
  // The trace, which is closed, against the program as it was written.
  int judge(const CamacLab& lab, const std::vector<int>& codes) {
    // The content of a table without decel and cruise is hashed in full.
    tables::TableContent content{.time_unit_ns = kUnitNs};
    content.accel.assign(codes.begin(), codes.end());
    const std::string hash = tables::content_hash(content);
    return check(lab, "", [&](nlohmann::json& event) {
      if (event["event"] == "table") {
        event = {{"event", "table"},
                 {"name", "the program"},
                 {"table_sha256", hash},
                 {"time_unit_ns", kUnitNs},
                 {"accel", codes}};
      }
      const auto replace = [&hash](nlohmann::json& of) {
        if (of.value("table_file", "?").empty()) of["table_sha256"] = hash;
      };
      replace(event);
      if (event.contains("motors") && event["event"] == "line") {
        for (nlohmann::json& motor : event["motors"]) replace(motor);
      }
      return true;
    });
  }
  std::int64_t other_ = 0;
};
INSTANTIATE_TEST_SUITE_P(Manners, CamacStream,
                         testing::Values("fine", "coarse", "fine_table", "fine_ticks"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(CamacStream, EveryEdgeIsWhereTheReportPutsIt) {
  CamacLab lab(lab_with(GetParam()), vcd_.get());
  begin(lab);
  const std::string before = lab.description("m01").table.name;
  const auto codes = program_codes();
  for (const int steps : {1, 2, 7, 475, 476, 1001}) {
    SCOPED_TRACE(steps);
    const std::int64_t from = lab.shaft_steps("m02");
    lab.naf(kStation, 0, 10);
    lab.load(0, steps, codes);
    lab.run_to_lam(kEnabled | 1 | (steps % 2 == 0 ? kLeft : 0));
    EXPECT_EQ(lab.requests(), 0x10U | static_cast<std::uint32_t>(steps % 4) << 8);
    EXPECT_EQ(lab.shaft_steps("m02") - from, steps % 2 == 0 ? -steps : steps);
  }
  EXPECT_TRUE(goes_on(lab)) << "nothing has waited for it";
  EXPECT_EQ(lab.description("m01").table.name, before);
  lab.send(Ask::kStop, {"m03"});
  lab.wait(other_);
  lab.run_for(0.2);
  // The MCU rests: the table is uploaded.
  lab.naf(kStation, 0, 10);
  lab.run_to_lam(kEnabled | 1);
  EXPECT_THAT(lab.description("m01").table.name, HasSubstr("camac-1-5-0-"));
  EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0);
  EXPECT_EQ(lab.mcu_health("hall:1").ramp_downs, 0u);
  EXPECT_TRUE(lab.errors().empty());
  close_trace(lab);
  EXPECT_EQ(judge(lab, codes), 0) << said();
  // It would say so if the program had been another one.
  auto others = codes;
  others[5] = others[6];
  EXPECT_EQ(judge(lab, others), 1);
}

// Whoever pauses, resumes or stops it: all by the codes of the program.
TEST_P(CamacStream, StopsAndPausesAreThoseOfTheProgram) {
  CamacLab lab(lab_with(GetParam()), vcd_.get());
  begin(lab);
  const auto codes = program_codes();
  lab.load(0, 3000, codes);
  lab.permit(kEnabled);
  lab.run_until([&] { return lab.shaft_steps("m01") > 500; });
  lab.ask(api::Pause{{"m01"}});
  EXPECT_FALSE(lab.lam());
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {5}).result, "refused");
  lab.ask(api::Resume{{"m01"}});
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.shaft_steps("m01"), 3000);
  lab.naf(kStation, 0, 10);
  lab.permit(kEnabled | kLeft);
  lab.run_until([&] { return lab.shaft_steps("m01") < 2500; });
  lab.naf(kStation, 0, 24);
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m01").moving; }));
  lab.run_for(0.2);
  EXPECT_FALSE(lab.lam());
  lab.permit(kEnabled | kLeft);
  lab.run_for(0.4);
  lab.send(Ask::kStop, {"m01"});
  ASSERT_TRUE(lab.wait_for_lam()) << "a stop by somebody else is a fault";
  EXPECT_THAT(lab.warnings().back(), HasSubstr("stopped on request"));
  EXPECT_THAT(lab.warnings().back(), Not(HasSubstr("line")));
  EXPECT_TRUE(goes_on(lab));
  lab.send(Ask::kStop, {"m03"});
  lab.wait(other_);
  close_trace(lab, 0.2);
  EXPECT_EQ(judge(lab, codes), 0) << said();
}

// The MCU knows the table of the group, and ramps the motor down by that.
TEST_P(CamacStream, ALostLinkRampsItDownByTheTableOfTheGroup) {
  StepTimes edges;
  CamacLab lab(lab_with(GetParam()), &edges);
  begin(lab);
  lab.load(0, 20'000, program_codes());
  lab.permit(kEnabled);
  lab.run_until([&] { return lab.shaft_steps("m01") > 1000; });
  lab.unplug(0);
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.requests() & 0xFF, 8U) << "not connected";
  lab.run_for(3);
  lab.plug(0);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready() && !lab.motor("m01").moving; }));
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.lams().size(), 1U) << "told once";
  const auto table = tables::load((kShippedTables / "bushd2-constant.toml").string());
  ASSERT_TRUE(table.has_value());
  const bushd_ramp& decel = (*table)->view().decel;
  std::size_t fewest = 0;  // to rest, from the last code of the program
  while (decel.code[fewest] * (*table)->view().time_unit_ns > 12u * kUnitNs) ++fewest;
  const std::vector<sim::TimeNs>& times_ns = edges.of(0, 0);
  ASSERT_GT(times_ns.size(), fewest + 1);
  // Each edge is in the tick of its step; by the program's codes it would take half a second more.
  constexpr sim::TimeNs kTickNs = 2'560'000;
  sim::TimeNs due_ns = 0;
  for (std::size_t k = 0; k < fewest; ++k) {
    due_ns += decel.code[k] * sim::TimeNs{(*table)->view().time_unit_ns};
    const sim::TimeNs took_ns = times_ns.back() - times_ns[times_ns.size() - 2 - k];
    EXPECT_LT(std::abs(took_ns - due_ns), 2 * kTickNs) << "of the last " << k + 1 << " steps";
  }
}

// What its MCU could not ramp down by the table that it has waits, as before.
TEST(CamacStreaming, FasterProgramsWaitForTheTable) {
  CamacLab lab(lab_with("fine"));
  const auto other = move_another(lab, 3'000);
  lab.load(0, 500, fast_codes());
  lab.permit(kEnabled);
  lab.run_for(0.3);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_FALSE(lab.has_result(other));
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_TRUE(lab.has_result(other));
  EXPECT_EQ(lab.shaft_steps("m01"), 500);
  EXPECT_THAT(lab.description("m01").table.name, HasSubstr("camac-1-5-0-"));
  // A motion that does not come to those codes is streamed.
  lab.naf(kStation, 0, 10);
  lab.wait(lab.use("axes", "bushd2-constant"));
  const auto again = lab.send(Ask::kMoveBy, {"m03"}, {-20'000});
  lab.run_until([&] { return lab.shaft_steps("m03") < 2800; });
  lab.load(0, 398, fast_codes());
  lab.run_to_lam(kEnabled | kLeft);
  EXPECT_FALSE(lab.has_result(again));
  EXPECT_EQ(lab.shaft_steps("m01"), 102);
}

TEST(CamacStreaming, AStopByOthersEndsWhatWaitsForItsTable) {
  CamacLab lab(lab_with("fine"));
  const auto other = move_another(lab, 3'000);
  lab.load(0, 500, fast_codes());
  lab.permit(kEnabled);
  lab.run_for(0.3);
  lab.ask(Ask::kStop, {"m01"});
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_TRUE(lab.has_result(other));
  lab.run_for(3);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.shaft_steps("m03"), 3'000) << "the other is left alone";
  EXPECT_THAT(lab.warnings().back(), HasSubstr("m01: stopped before it began"));
}

// Its settings hold, in the units of the program's table.
TEST(CamacStreaming, LimitsOfSpeedAndBacklashHold) {
  CamacLab lab(lab_with("fine",
                        "unit = \"mm\"\nsteps_per_unit = 100\nmax_speed = 5\nbacklash = 0.2\n"
                        "soft_limits = [-20, 20]\n"));
  const auto other = move_another(lab, 30'000);
  lab.load(0, 1000, program_codes());
  lab.permit(kEnabled | kLeft);
  const std::int64_t begun_us = lab.now_us();
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.shaft_steps("m01"), -1000);
  EXPECT_GE(lab.now_us() - begun_us, 1020 * 2000) << "500 steps/s";
  lab.naf(kStation, 0, 10);
  lab.load(0, 1001, program_codes());
  lab.permit(kEnabled | kLeft);
  EXPECT_TRUE(lab.lam());
  EXPECT_THAT(lab.warnings().back(), HasSubstr("soft limit"));
  EXPECT_FALSE(lab.has_result(other));
}

// The history has it as a move of its module; the log of moves has its codes.
TEST(CamacStreaming, IsKeptLikeOtherMoves) {
  CamacLab lab;
  lab.keep_positions();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  move_another(lab, 30'000);
  lab.load(0, 300, program_codes());
  lab.run_to_lam(kEnabled);
  lab.run_for(0.5);
  const auto history = lab.send(api::GetHistory{.motor = "m01"});
  lab.wait(history);
  const auto past = lab.history(history);
  ASSERT_FALSE(past.empty());
  EXPECT_EQ(past.front().what, "move");
  EXPECT_THAT(past.front().who, HasSubstr("camac-1-5"));
  EXPECT_EQ(past.front().to_steps, 300);
  EXPECT_EQ(std::ranges::count_if(lab.move_lines(),
                                  [](const std::string& line) {
                                    return line.find("\"event\":\"table\"") != std::string::npos;
                                  }),
            1);
}

}  // namespace
}  // namespace bushd::test::camac_stream_test
