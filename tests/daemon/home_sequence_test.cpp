// Homing of all motors by their order, and what they do once their switches were found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kSwitch = -300;

// Two MCUs with two motors each; `keys` of the `home` of each motor, "" for none.
std::string homes(const std::vector<std::string>& keys) {
  std::string toml = hall(2, 2);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].empty()) continue;
    toml = with_keys(toml, "m0" + std::to_string(i + 1),
                     "home = { direction = \"negative\", most_steps = 3000, " + keys[i] + " }\n");
  }
  return toml;
}

struct SequenceLab : Lab {
  // `of_m01`: more keys of that motor.
  explicit SequenceLab(const std::vector<std::string>& keys, bool kept = false,
                       const std::string& of_m01 = "")
      : Lab(with_keys(homes(keys), "m01", of_m01)) {
    if (kept) keep_positions();
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (!keys[i].empty()) bus(0).mcu(i / 2).attach_switch(i % 2, {.at_steps = kSwitch});
    }
    connect();
  }
  void lose_switch(const std::string& motor) {
    const auto i = static_cast<std::size_t>(motor.back() - '1');
    bus(0).mcu(i / 2).attach_switch(i % 2, {.at_steps = -1'000'000});
  }
  std::int64_t home_all() { return send(api::Home{.all = true}); }
  bool has_moved(const std::string& motor) const { return shaft_steps(motor) != 0; }
  bool homed(const std::string& name) const {
    return !motor(name).moving && std::abs(motor(name).position_steps) <= 1 && has_moved(name);
  }
};

TEST(HomeSequence, LowerOrdersAreHomedFirstAndThoseOfOneOrderTogether) {
  for (const bool kept : {false, true}) {
    SequenceLab lab({"order = 2", "order = 1", "order = 1", ""}, kept);
    const auto all = lab.home_all();
    ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m02") < -50; }));
    EXPECT_LT(lab.shaft_steps("m03"), -30) << "another MCU homes it at the same time";
    EXPECT_EQ(lab.motor("m01").activity, api::Activity::kHoming) << "it waits for its turn";
    ASSERT_TRUE(lab.run_until([&] { return lab.has_moved("m01"); }, 60));
    EXPECT_TRUE(lab.homed("m02"));
    EXPECT_TRUE(lab.homed("m03"));
    const Answer answer = lab.wait(all);
    EXPECT_EQ(answer.result, "reached") << answer.reason;
    EXPECT_THAT(answer.motor_results, ElementsAre("reached", "reached", "reached"));
    EXPECT_FALSE(lab.has_moved("m04"));
  }
}

TEST(HomeSequence, OneThatIsNotFoundEndsTheOthers) {
  for (const bool kept : {false, true}) {
    SequenceLab lab({"order = 3", "order = 2", "order = 2", "order = 1"}, kept);
    lab.lose_switch("m03");
    lab.bus(0).mcu(0).attach_switch(1, {.at_steps = -2990});
    const Answer answer = lab.wait(lab.home_all());
    EXPECT_THAT(answer, Ends("fault", "m03: its switch was not found"));
    // In the order in which they are homed.
    EXPECT_EQ(answer.motor_results.front(), "reached") << "m04";
    EXPECT_EQ(answer.motor_results.back(), "stopped") << "m01";
    EXPECT_FALSE(lab.has_moved("m01"));
    for (const char* motor : {"m01", "m02", "m03", "m04"}) {
      EXPECT_EQ(lab.motor(motor).activity, api::Activity::kResting);
    }
    // And is over: motors can be used, and all can be homed again.
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {20}).result, "reached");
    lab.bus(0).mcu(1).attach_switch(0, {.at_steps = -3500});
    EXPECT_EQ(lab.wait(lab.home_all()).result, "reached");
  }
}

TEST(HomeSequence, AMotorMovesOnToThenAndThatIsPartOfTheResult) {
  for (const bool kept : {false, true}) {
    SequenceLab lab({"then = 120", "order = 2", "", ""}, kept);
    const auto all = lab.home_all();
    ASSERT_TRUE(lab.run_until([&] { return lab.has_moved("m02"); }, 60));
    EXPECT_EQ(lab.motor("m01").position_steps, 120) << "the next order waits for that too";
    const Answer answer = lab.wait(all);
    EXPECT_EQ(answer.result, "reached") << answer.reason;
    EXPECT_EQ(answer.position_steps.front(), 120);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    EXPECT_EQ(lab.shaft_steps("m01"), kSwitch + 120);
    // By name as well.
    EXPECT_EQ(lab.ask(Ask::kHome, {"m01", "m02"}).result, "reached");
    EXPECT_EQ(lab.motor("m01").position_steps, 120);
    EXPECT_THAT(lab.errors(), IsEmpty());
  }
}

TEST(HomeSequence, AMotorMovesOnToThenAsAnyMoveDoesByItsLegs) {
  for (const bool kept : {false, true}) {
    SequenceLab lab({"then = 120", "order = 2", "", ""}, kept, "backlash = -20\n");
    const auto all = lab.home_all();
    std::int64_t farthest = -1000;
    ASSERT_TRUE(lab.run_until(
        [&] {
          if (lab.motor("m01").activity == api::Activity::kMoving) {
            farthest = std::max(farthest, lab.shaft_steps("m01"));
          }
          return lab.has_moved("m02");
        },
        60));
    EXPECT_EQ(farthest, kSwitch + 140) << "from there it approaches in the negative direction";
    EXPECT_EQ(lab.motor("m01").position_steps, 120);
    EXPECT_EQ(lab.shaft_steps("m01"), kSwitch + 120);
    EXPECT_EQ(lab.wait(all).result, "reached");
  }
}

TEST(HomeSequence, AMotorThatIsHeldBeforeItsTurnIsNotMoved) {
  for (const bool kept : {false, true}) {
    SequenceLab lab({"order = 1", "order = 2", "", ""}, kept);
    const auto all = lab.home_all();
    ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") < -50; }));
    EXPECT_EQ(lab.ask(api::Hold{{"m02"}}).result, "done");
    const Answer answer = lab.wait(all);
    EXPECT_THAT(answer.motor_results, ElementsAre("reached", "stopped"));
    EXPECT_THAT(answer.reason,
                HasSubstr("m02: it was held before it was its turn to be homed, by "));
    EXPECT_FALSE(lab.has_moved("m02"));
    EXPECT_EQ(lab.ask(api::Release{{"m02"}}).result, "done");
    EXPECT_EQ(lab.ask(Ask::kHome, {"m02"}).result, "reached");
  }
}

// As it is held; and the one that is being homed goes on.
TEST(HomeSequence, AMotorThatIsPausedBeforeItsTurnIsNotMoved) {
  for (const bool kept : {false, true}) {
    SequenceLab lab({"order = 1", "order = 2", "", ""}, kept);
    const auto all = lab.home_all();
    ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") < -50; }));
    EXPECT_THAT(lab.ask(api::Pause{}).reason, HasSubstr("not paused, being homed: m01"));
    const Answer answer = lab.wait(all);
    EXPECT_THAT(answer.motor_results, ElementsAre("reached", "stopped"));
    EXPECT_THAT(answer.reason, HasSubstr("m02: stopped before it was its turn to be homed, asked"));
    EXPECT_FALSE(lab.has_moved("m02"));
  }
}

TEST(HomeSequence, ThenMayBecomeImpossible) {
  SequenceLab lab({"then = 120", "order = 2", "", ""});
  EXPECT_EQ(lab.ask(api::Configure{.kind = api::Configure::Kind::kChange,
                                   .changes = {{"m01", "soft_limits", "-50,50"}}})
                .result,
            "done");
  EXPECT_THAT(lab.wait(lab.home_all()),
              Ends("fault", "m01: homed, but it does not move on: m01: target 120"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_FALSE(lab.has_moved("m02"));
}

TEST(HomeSequence, SpeedIsThatOfTheFastApproachUnlessAskedOtherwise) {
  const auto duration_us = [](const std::string& keys, std::optional<api::Speed> speed) {
    SequenceLab lab({keys, "", "", ""});
    const std::int64_t begin_us = lab.now_us();
    EXPECT_EQ(lab.ask(api::Home{.motors = {"m01"}, .speed = speed}).result, "reached");
    return lab.now_us() - begin_us;
  };
  const std::int64_t slow_us = duration_us("speed = 30", {});
  EXPECT_GT(slow_us, 10'000'000) << "300 steps at 30 steps/s";
  EXPECT_LT(duration_us("order = 1", {}), slow_us - 5'000'000);
  EXPECT_LT(duration_us("speed = 30", api::Speed{.per_s = 1000}), slow_us - 5'000'000);
}

TEST(HomeSequence, IsStoppedAtAnyTimeAndHasOneResult) {
  for (const bool kept : {false, true}) {
    for (int tenths = 0; tenths < 60; tenths += 3) {
      SequenceLab lab({"then = 120", "order = 2", "order = 2, then = -40", ""}, kept);
      const auto all = lab.home_all();
      lab.run_for(0.1 * tenths + 0.003);
      const bool over = lab.has_result(all);
      EXPECT_EQ(lab.ask(Ask::kStop, {}).result, "done");
      EXPECT_EQ(lab.wait(all).result, over ? "reached" : "stopped") << tenths;
      EXPECT_EQ(lab.replies(all).size(), 2u);
      EXPECT_TRUE(lab.core().at_rest());
      for (const char* motor : {"m01", "m02", "m03"}) {
        EXPECT_EQ(lab.motor(motor).activity, api::Activity::kResting) << tenths;
      }
    }
  }
}

TEST(HomeSequence, EndsWithItsLinkAndInAnEmergency) {
  for (const bool emergency : {false, true}) {
    for (int tenths = 0; tenths < 60; tenths += 7) {
      SequenceLab lab({"then = 120", "order = 2", "order = 2, then = -40", ""});
      const auto all = lab.home_all();
      lab.run_for(0.1 * tenths + 0.003);
      const bool over = lab.has_result(all);
      if (emergency) {
        lab.send(Ask::kEmergencyStop, {});
      } else {
        lab.unplug(0);
      }
      const Answer answer = lab.wait(all);
      EXPECT_EQ(answer.result == "reached", over) << tenths << ": " << answer.reason;
      EXPECT_EQ(lab.replies(all).size(), 2u);
      EXPECT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }, 5));
    }
  }
}

TEST(HomeSequence, IsRefusedAsAWhole) {
  SequenceLab lab({"order = 2", "order = 1", "", ""});
  const auto refused = [&](const api::Request& request) {
    const Answer answer = lab.ask(request);
    EXPECT_EQ(answer.result, "refused");
    return answer.reason;
  };
  EXPECT_THAT(refused(api::Home{.motors = {"m01"}, .all = true}), HasSubstr("some are named"));
  const auto all = lab.home_all();
  EXPECT_THAT(refused(api::Home{.all = true}), HasSubstr("m02: it is being homed"));
  EXPECT_THAT(refused(api::Home{.motors = {"m01"}}), HasSubstr("m01: it is being homed"));
  EXPECT_THAT(refused(api::Move{.motors = {{"m01", 5}}}), HasSubstr("it is being homed"));
  EXPECT_EQ(lab.wait(all).result, "reached");
  ReadyLab none(hall(1, 1));
  EXPECT_THAT(none.ask(api::Home{.all = true}).reason,
              HasSubstr("no motor has a home switch; add 'home = {...}'"));
}

}  // namespace
}  // namespace bushd::test
