// Moves whose first ticks come too late at their MCUs, as on a very busy PC or a bad line: nothing
// has begun, so they begin anew, all motors of a move at one tick, or none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "daemon/lost_frames.h"
#include "daemon/on_line.h"
#include "daemon/services/common_starts.h"
#include "daemon/traced.h"
#include "engine/frame.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

constexpr std::uint8_t kAllMcus = 0;

// Motion of one MCU, and what would keep others from beginning without it.
bool carries_motion(const bushd_frame& frame, std::uint8_t address) {
  const bool motion = frame.type == BUSHD_MSG_TICKS || frame.type == BUSHD_MSG_TABLE_TICKS ||
                      frame.type == BUSHD_MSG_TABLE_RUN || frame.type == BUSHD_MSG_LINE_RUN;
  const bool replaces =
      frame.type == BUSHD_MSG_TICKS && (frame.payload[1] & BUSHD_TICKS_REPLACE) != 0;
  return motion && (address == kAllMcus || frame.address == address || replaces);
}

// What carries motion to this MCU does not get through for a while.
void lose_motion(Lab& lab, double seconds, std::uint8_t address) {
  const std::int64_t until_us = lab.now_us() + static_cast<std::int64_t>(seconds * 1e6);
  lab.on_send = [&lab, until_us, address](std::size_t, std::vector<std::uint8_t>& bytes) {
    if (lab.now_us() >= until_us) return true;
    bytes = without(bytes,
                    [address](const bushd_frame& frame) { return carries_motion(frame, address); });
    return true;
  };
}

// m01, m02 at MCU 1; m03, m04 at MCU 2.
class LateStarts : public Traced<const char*> {
 protected:
  LateStarts() { lab.connect(); }

  void loses(double seconds, std::uint8_t address = kAllMcus) {
    lose_motion(lab, seconds, address);
  }
  // A move at two MCUs that is lost for a while, and what comes at any time of it: before the first
  // start, while the motors are late, after they have begun anew.
  void at_any_time(Ask ask, std::int64_t steps,
                   const std::function<void(std::int64_t move, int ms)>& then) {
    for (int ms = 60; ms < 400; ms += 20) {
      SCOPED_TRACE(ms);
      loses(0.15);
      const auto move = lab.send(ask, {"m01", "m03"}, {steps, steps});
      lab.run_for(ms * 1e-3);
      then(move, ms);
    }
  }
  void expect_late_then_reached() const {
    auto results = logged<std::string>("result", "result");
    ASSERT_FALSE(results.empty());
    EXPECT_EQ(results.back(), "reached");
    results.pop_back();
    EXPECT_THAT(results, AllOf(Not(IsEmpty()), Each("late")));
  }
  // What a key has in the events of a kind, in the log of moves.
  template <class T>
  std::vector<T> logged(const std::string& kind, const std::string& key) const {
    std::vector<T> found;
    for (const std::string& line : lab.move_lines()) {
      const auto event = nlohmann::json::parse(line);
      if (event.at("event") == kind) found.push_back(event.at(key).template get<T>());
    }
    return found;
  }
  // A table run that was lost and changed before it was sent again is streamed, though it is logged
  // as a table run: its steps are spread over their ticks, so `changed` ones are not judged.
  void expect_each_edge_is_explained(bool changed = false) {
    if (changed && std::string(GetParam()) == "fine_table") return;
    close_trace(lab, 0.5);
    EXPECT_EQ(check(lab, ""), 0) << said();
    EXPECT_EQ(lab.mcu_health("hall:1").ramp_downs, 0u);
  }

  Lab lab{hall(2, 2, GetParam()), {}, vcd_.get()};
};

TEST_P(LateStarts, AMoveBeginsAnew) {
  loses(0.12);
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {-700});
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.replies(move).size(), 2u);
  EXPECT_EQ(lab.shaft_steps("m01"), -700);
  expect_late_then_reached();
  expect_each_edge_is_explained();
}

// It is over by its plan before anybody hears of it.
TEST_P(LateStarts, AMoveOfOneStepBeginsAnew) {
  loses(0.12);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {1}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 1);
  expect_late_then_reached();
  expect_each_edge_is_explained();
}

// What is told tick by tick does not begin at once.
class StartsAtOnce : public LateStarts {};

// A frame that is lost now and then puts no start off; what is lost again and again does.
TEST_P(StartsAtOnce, ALostFrameLeavesTheNextAsSoonAsThisOne) {
  const auto margin_us = [this] { return lab.health_of("hall").start_margin_us; };
  const std::int64_t before_us = margin_us();
  loses(0.005);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {1}).result, "reached");
  EXPECT_EQ(margin_us(), before_us);
  loses(0.05);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {1}).result, "reached");
  EXPECT_GT(margin_us(), before_us);
}

TEST_P(LateStarts, AGroupBeginsAnewAtOneTick) {
  loses(0.12);
  const auto move = lab.send(Ask::kMoveTo, {"m01", "m02", "m03"}, {500, -600, 700});
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_THAT(result.position_steps, ElementsAre(500, -600, 700));
  const auto ticks = logged<std::int64_t>("move", "start_tick");
  ASSERT_GE(ticks.size(), 6u);
  ASSERT_EQ(ticks.size() % 3, 0u);
  for (std::size_t i = 0; i < ticks.size(); i += 3) {
    EXPECT_TRUE(i == 0 || ticks[i - 1] < ticks[i]);
    EXPECT_EQ(ticks[i], ticks[i + 1]);
    EXPECT_EQ(ticks[i], ticks[i + 2]);
  }
  expect_each_edge_is_explained();
}

// One that the daemon streams ends.
TEST_P(LateStarts, ALineOfTheMcusBeginsAnew) {
  const bool streamed = std::string(GetParam()) == "fine_ticks";
  for (const double seconds : {0.02, 0.05, 0.12}) {
    SCOPED_TRACE(seconds);
    lab.ask(Ask::kMoveTo, {"m01", "m02", "m03"}, {0, 0, 0});
    loses(seconds);
    // One of them makes no step.
    const auto line =
        lab.send(api::MoveLine{.kind = api::Move::Kind::kAbsolute,
                               .motors = motor_steps({"m01", "m02", "m03"}, {500, 0, -700})});
    const Answer result = lab.wait(line);
    EXPECT_EQ(lab.replies(line).size(), 2u);
    if (streamed) continue;
    EXPECT_EQ(result.result, "reached") << result.reason;
    EXPECT_THAT(result.position_steps, ElementsAre(500, 0, -700));
  }
  if (!streamed) expect_each_edge_is_explained();
}

TEST_P(LateStarts, ALineThatIsStoppedWhileItIsLateEnds) {
  for (int ms = 5; ms < 200; ms += 15) {
    SCOPED_TRACE(ms);
    loses(0.15);
    const auto line = lab.send(api::MoveLine{.motors = motor_steps({"m01", "m03"}, {600, -900})});
    lab.run_for(ms * 1e-3);
    EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
    ASSERT_TRUE(lab.has_result(line));
    const Answer result = lab.last_reply(line);
    EXPECT_THAT(result.result, testing::AnyOf("stopped", "link")) << result.reason;
    lab.run_for(1);
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps[0]);
    EXPECT_EQ(lab.shaft_steps("m03"), result.position_steps[1]);
  }
}

TEST_P(LateStarts, OneOfAGroupThatIsLateEndsWhereItStands) {
  loses(0.2, 2);
  const Answer result = lab.ask(Ask::kMoveTo, {"m01", "m02", "m03"}, {500, -600, 700});
  EXPECT_THAT(result, Ends("link", "m03: its first ticks did not reach MCU hall:2 in time"));
  EXPECT_THAT(result.motor_results, ElementsAre("reached", "reached", "link"));
  EXPECT_THAT(result.position_steps, ElementsAre(500, -600, 0));
  EXPECT_EQ(lab.shaft_steps("m03"), 0);
  expect_each_edge_is_explained();
}

// The first leg of the other one, for its backlash, is over before anybody hears that it has begun.
TEST(LateStartsOfLegs, OneThatIsLateEndsThough) {
  ReadyLab lab(with_keys(hall(2, 2), "m01", "backlash = 3\n"));
  lose_motion(lab, 0.2, 2);
  EXPECT_THAT(lab.ask(Ask::kMoveTo, {"m01", "m03"}, {-1, 700}).motor_results,
              ElementsAre("reached", "link"));
  EXPECT_EQ(lab.shaft_steps("m01"), -1);
  EXPECT_EQ(lab.shaft_steps("m03"), 0);
}

TEST_P(LateStarts, ALineThatLosesEverythingEndsTheMove) {
  loses(1000);
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {700});
  const Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("link", "did not move"));
  EXPECT_EQ(lab.replies(move).size(), 2u);
  EXPECT_EQ(logged<std::string>("move", "motor").size(), daemon::CommonStarts::kMostTries);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_FALSE(lab.motor("m01").moving);
  loses(0);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {-5}).result, "reached");
  expect_each_edge_is_explained();
}

// The daemon stands still from when it was asked.
TEST_P(LateStarts, AfterTheDaemonStoodStill) {
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m04"}, {40, -50});
  lab.pause_daemon(0.2);
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 40);
  EXPECT_EQ(lab.shaft_steps("m04"), -50);
  expect_each_edge_is_explained();
}

TEST_P(LateStarts, AStopEndsIt) {
  std::int64_t from = 0;
  at_any_time(Ask::kMoveBy, 6000, [&](std::int64_t move, int) {
    EXPECT_EQ(lab.ask(Ask::kStop, {"m01", "m03"}).result, "done");
    ASSERT_TRUE(lab.has_result(move));
    const Answer result = lab.last_reply(move);
    EXPECT_EQ(result.result, "stopped") << result.reason;
    lab.run_for(1);
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps[0]);
    EXPECT_LT(lab.shaft_steps("m01") - from, 6000);
    from = lab.shaft_steps("m01");
  });
  expect_each_edge_is_explained(true);
}

TEST_P(LateStarts, APauseKeepsItsTarget) {
  std::int64_t target = 0;
  at_any_time(Ask::kMoveBy, 2500, [&](std::int64_t move, int) {
    target += 2500;
    EXPECT_EQ(lab.ask(api::Pause{}).result, "done");
    const std::int64_t stands = lab.shaft_steps("m01");
    lab.run_for(1);
    EXPECT_EQ(lab.shaft_steps("m01"), stands);
    EXPECT_FALSE(lab.has_result(move));
    EXPECT_EQ(lab.ask(api::Resume{}).result, "done");
    EXPECT_EQ(lab.wait(move).result, "reached") << lab.last_reply(move).reason;
    EXPECT_EQ(lab.shaft_steps("m01"), target);
  });
  expect_each_edge_is_explained(true);
}

TEST_P(LateStarts, AnotherTargetIsTheNewest) {
  at_any_time(Ask::kMoveTo, 2500, [&](std::int64_t, int ms) {
    EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {-ms}).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), -ms);
    EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01", "m03"}, {0, 0}).result, "reached");
  });
  expect_each_edge_is_explained(true);
}

TEST_P(LateStarts, AStopOfOneLeavesTheOther) {
  at_any_time(Ask::kMoveTo, 2500, [&](std::int64_t move, int) {
    EXPECT_EQ(lab.ask(Ask::kStop, {"m03"}).result, "done");
    EXPECT_THAT(lab.wait(move).motor_results, ElementsAre("reached", "stopped"));
    EXPECT_EQ(lab.shaft_steps("m01"), 2500);
    EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01", "m03"}, {0, 0}).result, "reached");
  });
  expect_each_edge_is_explained(true);
}

TEST_P(LateStarts, AnEmergencyStopEndsIt) {
  at_any_time(Ask::kMoveBy, 6000, [&](std::int64_t move, int) {
    EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
    EXPECT_EQ(lab.wait(move).result, "stopped") << lab.last_reply(move).reason;
    const std::int64_t stands = lab.shaft_steps("m01");
    lab.run_for(1);
    EXPECT_EQ(lab.shaft_steps("m01"), stands);
    EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  });
}

INSTANTIATE_TEST_SUITE_P(Manners, StartsAtOnce, testing::Values("fine", "coarse", "fine_table"),
                         [](const auto& tested) { return std::string(tested.param); });
INSTANTIATE_TEST_SUITE_P(Manners, LateStarts,
                         testing::Values("fine", "coarse", "fine_table", "fine_ticks"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace bushd::test
