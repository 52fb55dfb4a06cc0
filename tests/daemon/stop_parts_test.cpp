// Stops of what is under way in part only: a path or a trajectory whose rows still come, a motor
// that has been homed and is to move on, a jog whose end is not as it should be.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using Part = api::Follow::Part;

// A client that is read as slowly as it is told to be.
class Late final : public api::Session, public std::enable_shared_from_this<Late> {
 public:
  explicit Late(Lab& lab) : Session(api::Transport::kSocket, "late", true), lab_(lab) {}
  void answer(std::int64_t number, const api::Reply& reply) override {
    if (!api::is_final(reply)) return;
    const auto* completed = std::get_if<api::Completed>(&reply);
    results_[number] = (completed == nullptr ? "refused" : std::string(word(completed->outcome))) +
                       ": " + api::reason_of(reply);
  }
  std::uint64_t stops() { return lab_.core().counted_stops().stops(); }
  // Which arrived when so many stops had; without that, now.
  std::int64_t ask(const api::Request& request,
                   std::uint64_t after_stops = api::Asker::kNotCounted) {
    lab_.core().request(
        lab_.now_us(),
        {.session = shared_from_this(), .number = ++number_, .after_stops = after_stops}, request);
    return number_;
  }
  std::string result(std::int64_t number) {
    lab_.run_until([&] { return results_.contains(number); }, 10);
    return results_[number];
  }

 private:
  Lab& lab_;
  std::int64_t number_ = 0;
  std::map<std::int64_t, std::string> results_;
};

api::MovePath part_of_path(std::int32_t first_row, bool dry_run) {
  return {.motors = {"m01", "m02"},
          .rows = 2,
          .first_row = first_row,
          .positions = {first_row + 1.0, 1},
          .dry_run = dry_run};
}

TEST(StopParts, APathIsADryRunFromItsFirstPartOn) {
  ReadyLab lab(hall(1, 2));
  for (const bool first : {false, true}) {
    EXPECT_EQ(lab.ask(part_of_path(0, first)).result, "done");
    EXPECT_THAT(lab.ask(part_of_path(1, !first)),
                Ends("refused", "send the path again from its beginning"));
  }
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(StopParts, APathThatWasEndedBeforeItsFirstPartIsNoDryRunLater) {
  ReadyLab lab(hall(1, 2));
  const auto late = std::make_shared<Late>(lab);
  for (const bool dry_run : {false, true}) {
    const std::uint64_t before = late->stops();
    lab.ask(Ask::kStop, {});
    const auto first = late->ask(part_of_path(0, false), before);
    const auto second = late->ask(part_of_path(1, dry_run));
    EXPECT_THAT(late->result(first), HasSubstr("stopped: m01: stopped by command"));
    EXPECT_THAT(late->result(second),
                HasSubstr(dry_run ? "refused: it is" : "stopped: m01: stopped by command"));
  }
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

api::Follow part_of_trajectory(Part part, std::vector<double> time_s = {},
                               std::vector<double> positions = {}) {
  return {.part = part,
          .array = 7,
          .motors = {"m01", "m02"},
          .time_s = std::move(time_s),
          .positions = std::move(positions)};
}

// By its number, a later part was asked for before a stop that had ended by then.
TEST(StopParts, APartThatWasAskedForBeforeAStopEndsTheWhole) {
  ReadyLab lab(hall(1, 2));
  const auto late = std::make_shared<Late>(lab);
  const std::uint64_t before = late->stops();
  lab.ask(Ask::kStop, {});
  EXPECT_THAT(late->result(late->ask(part_of_path(0, false))), HasSubstr("done: "));
  EXPECT_THAT(late->result(late->ask(part_of_path(1, false), before)),
              HasSubstr("stopped: m01: stopped by command"));
  const std::vector<double> times{0, 2};
  const std::vector<double> positions{0, 0, 100, 0};
  EXPECT_THAT(late->result(late->ask(part_of_trajectory(Part::kRows, times, positions))),
              HasSubstr("done: "));
  EXPECT_THAT(late->result(late->ask(part_of_trajectory(Part::kRun), before)),
              HasSubstr("stopped: m01: stopped by command"));
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

// It runs; these rows of it were sent before the stop, and are taken before it or after it.
struct RunningTrajectory {
  RunningTrajectory() : lab(hall(1, 2)) {
    lab.connect();
    late->result(late->ask(part_of_trajectory(Part::kRows, {0, 2}, {0, 0, 100, 0})));
    run = late->ask(part_of_trajectory(Part::kRun));
    lab.run_for(0.5);
  }
  std::string result_of_rows(const api::Request& stop, bool taken_before, const api::Follow& rows) {
    const std::uint64_t before = late->stops();
    std::int64_t number = 0;
    if (taken_before) number = late->ask(rows, before);
    lab.send(stop);
    if (!taken_before) number = late->ask(rows, before);
    return late->result(number);
  }
  Lab lab;
  std::shared_ptr<Late> late = std::make_shared<Late>(lab);
  std::int64_t run = 0;
};

// None of these ends the motion of a motor that follows a trajectory: so they end none of its rows.
TEST(StopParts, WhatDoesNotStopARunningTrajectoryLeavesItsRowsWhole) {
  const std::vector<api::Request> harmless{api::Hold{{"m01"}}, api::Pause{{"m01"}},
                                           api::Jog{.motor = "m01"}, api::Disarm{{"m01"}}};
  for (const api::Request& stop : harmless) {
    for (const bool taken : {false, true}) {
      SCOPED_TRACE(std::string(api::name_of(stop)) + (taken ? ", rows taken" : ", rows not taken"));
      RunningTrajectory trajectory;
      EXPECT_EQ(
          trajectory.result_of_rows(stop, taken, part_of_trajectory(Part::kRows, {3}, {100, 0})),
          "done: 3 rows can be followed so far");
      EXPECT_THAT(trajectory.late->result(
                      trajectory.late->ask(part_of_trajectory(Part::kLastRows, {5}, {0, 0}))),
                  HasSubstr("done: 4 rows"));
      EXPECT_THAT(trajectory.late->result(trajectory.run), HasSubstr("reached: "));
      EXPECT_EQ(trajectory.lab.shaft_steps("m01"), 0);
      EXPECT_THAT(trajectory.lab.errors(), IsEmpty());
    }
  }
}

TEST(StopParts, RowsOfARunningTrajectoryThatAStopEndsSaySo) {
  for (const bool taken : {false, true}) {
    SCOPED_TRACE(taken ? "rows taken" : "rows not taken");
    RunningTrajectory trajectory;
    const std::string rows = trajectory.result_of_rows(
        api::Stop{{"m02"}}, taken, part_of_trajectory(Part::kLastRows, {4}, {9, 0}));
    EXPECT_THAT(rows, HasSubstr("stopped: "));
    EXPECT_THAT(rows, HasSubstr("stopped by command"));
    EXPECT_THAT(trajectory.late->result(trajectory.run), HasSubstr("stopped: "));
  }
}

// The end of a jog is carried out though something about it is wrong.
TEST(StopParts, AJogEndsWhateverElseItsEndSays) {
  ReadyLab lab(hall(1, 2));
  const std::vector<api::Jog> ends{{.motor = "m01", .keepalive_ms = 0},
                                   {.motor = "m01", .steps_after = -5},
                                   {.motor = "m01", .steps_after = INT64_MAX}};
  for (const api::Jog& end : ends) {
    const auto jog =
        lab.send(api::Jog{.motor = "m01", .per_s = 200, .in_steps = true, .keepalive_ms = 10'000});
    lab.run_for(0.5);
    const auto last = lab.send(end);
    ASSERT_TRUE(lab.run_until([&] { return lab.has_result(jog); }, 2)) << "it jogs on";
    const Answer ended = lab.wait(last);
    EXPECT_EQ(ended.result, end.steps_after ? "fault" : "done");
    if (end.steps_after) {
      EXPECT_THAT(ended.reason, HasSubstr("steps after the stop event; allowed: 0 to"));
      EXPECT_THAT(ended.reason, HasSubstr("ramped down at once"));
    }
    lab.run_for(1);
  }
}

// The gap could not become negative where its blades stand: that is not asked any more.
TEST(StopParts, AMoveOfAComputedAxisThatAStopHasEndedIsStoppedAndNotRefused) {
  ReadyLab lab(
      hall(1, 2) +
      "[[pseudo]]\nname = [\"gap\", \"centre\"]\nunit = \"mm\"\nmotors = [\"m01\", \"m02\"]\n"
      "kind = \"slit\"\nsoft_limits = [[0, 20], [-10, 10]]\n");
  const auto late = std::make_shared<Late>(lab);
  const std::uint64_t before = late->stops();
  const api::Request move =
      api::Move{.kind = api::Move::Kind::kAbsolute, .motors = {{"gap", api::UserUnits{-1}}}};
  lab.ask(Ask::kStop, {"m02"});
  EXPECT_THAT(late->result(late->ask(move, before)), HasSubstr("stopped: m02: stopped by command"));
  EXPECT_THAT(late->result(late->ask(move)), HasSubstr("refused: "));
}

TEST(StopParts, ADisarmingTellsWhichMcusAreAway) {
  ReadyLab lab(hall(1, 2));
  lab.unplug(0);
  lab.run_for(1);
  EXPECT_THAT(lab.ask(api::Disarm{{"m01"}}),
              Ends("link", "not online, so it is unknown whether they stand: hall:1"));
  EXPECT_THAT(lab.ask(api::Disarm{}), Ends("done", "not online")) << "none was lost in motion";
}

std::string hall_with_home() {
  return with_keys(hall(1, 2), "m01",
                   "home = { direction = \"negative\", most_steps = 3000, then = 120 }\n");
}

TEST(StopParts, AMotorThatIsPausedWhileItIsHomedDoesNotMoveOn) {
  Lab lab(hall_with_home());
  lab.bus(0).mcu(0).attach_switch(0, {.at_steps = -300});
  lab.connect();
  const auto home = lab.send(Ask::kHome, {"m01"});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") < -50; }));
  lab.ask(api::Pause{{"m01"}});
  EXPECT_THAT(lab.wait(home),
              Ends("reached", "m01: homed; it does not move on, stopped by command"));
  lab.run_for(2);
  EXPECT_EQ(lab.motor("m01").position_steps, 0);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {20}).result, "reached");
}

}  // namespace
}  // namespace bushd::test
