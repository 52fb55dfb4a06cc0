// Axes that are computed from motors: the examples of docs/pseudo-axes.md, and what is asked of
// such axes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "daemon/lab.h"
#include "source_path.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr double kStepsPerUnit = 400;

// Motors of these names, in mm, on one MCU.
std::string motors(const std::vector<std::string>& names) {
  std::string toml = hall(1, static_cast<int>(names.size()), "fine");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = "name = \"m0" + std::to_string(i + 1) + "\"\n";
    toml.replace(toml.find(name), name.size(),
                 "name = \"" + names[i] + "\"\nunit = \"mm\"\nsteps_per_unit = 400\n");
  }
  return toml;
}

api::Request to(const std::vector<std::pair<std::string, double>>& targets) {
  api::Move move{.kind = api::Move::Kind::kAbsolute};
  for (const auto& [name, position] : targets) {
    move.motors.push_back({name, api::UserUnits{position}});
  }
  return move;
}

// A section of docs/pseudo-axes.md with an example.
struct Example {
  std::string title;
  std::string toml;
  std::map<std::string, std::string> files;
  std::string moves;
  std::vector<std::string> motors() const {
    std::vector<std::string> names;
    std::smatch list;
    if (!std::regex_search(toml, list, std::regex("motors = \\[([^\\]]*)\\]"))) return names;
    const std::string text = list[1];
    const std::regex quoted("\"([^\"]*)\"");
    for (auto it = std::sregex_iterator(text.begin(), text.end(), quoted);
         it != std::sregex_iterator(); ++it) {
      names.push_back((*it)[1]);
    }
    return names;
  }
};

std::vector<Example> examples() {
  std::ifstream file(source_path("docs/pseudo-axes.md"));
  std::vector<Example> all;
  std::string line;
  std::string* block = nullptr;
  while (std::getline(file, line)) {
    if (block != nullptr) {
      if (line == "```") {
        block = nullptr;
      } else {
        *block += line + "\n";
      }
    } else if (line.starts_with("### ")) {
      all.push_back({.title = line.substr(4), .toml = {}, .files = {}, .moves = {}});
    } else if (line == "```toml") {
      block = &all.back().toml;
    } else if (line == "```moves") {
      block = &all.back().moves;
    } else if (line.starts_with("```csv ")) {
      block = &all.back().files[line.substr(7)];
    }
  }
  return all;
}

// "gap 2, centre 0.5"
std::vector<std::pair<std::string, double>> targets_of(const std::string& text) {
  std::vector<std::pair<std::string, double>> targets;
  const std::regex one("([a-z0-9]+) (-?[0-9.]+)");
  for (auto it = std::sregex_iterator(text.begin(), text.end(), one); it != std::sregex_iterator();
       ++it) {
    targets.emplace_back((*it)[1], std::stod((*it)[2]));
  }
  return targets;
}

TEST(PseudoAxes, TheExamplesOfTheDocument) {
  const std::vector<Example> all = examples();
  ASSERT_EQ(all.size(), 4u);
  for (const Example& example : all) {
    SCOPED_TRACE(example.title);
    const std::string toml = motors(example.motors());
    Lab lab(toml);
    for (const auto& [name, text] : example.files) lab.write_file(name, text);
    lab.use_configuration(toml + example.toml);
    lab.connect();
    // To where the calibrated ones begin.
    if (!example.files.empty()) {
      const auto first = targets_of(example.moves.substr(example.moves.find(':')));
      ASSERT_EQ(lab.ask(to({first.begin(),
                            first.begin() + static_cast<std::ptrdiff_t>(example.motors().size())}))
                    .result,
                "reached");
    }
    std::istringstream lines(example.moves);
    std::string line;
    int count = 0;
    while (std::getline(lines, line)) {
      SCOPED_TRACE(line);
      const auto asked = targets_of(line.substr(0, line.find(':')));
      const auto expected = targets_of(line.substr(line.find(':')));
      const Answer result = lab.ask(to(asked));
      ASSERT_EQ(result.result, "reached") << result.reason;
      lab.run_for(0.2);
      double half_steps = 0;
      for (const auto& [motor, position] : expected) {
        // Half a step, and the last digit of the document.
        EXPECT_NEAR(lab.motor(motor).user, position, 0.5 / kStepsPerUnit + 1e-4);
        EXPECT_EQ(lab.shaft_steps(motor), std::llround(lab.motor(motor).user * kStepsPerUnit));
        half_steps += 0.5 / kStepsPerUnit;
      }
      // No matrix there has a factor above 2.5; on the curves a unit of a motor is less than 2.5
      // degrees or 500 eV.
      const double most = half_steps * (asked[0].first == "energy" ? 500 : 2.5);
      for (const auto& [axis, position] : asked) {
        EXPECT_NEAR(lab.motor(axis).user, position, most);
        EXPECT_EQ(lab.motor(axis).trust, api::Trust::kKnown);
        EXPECT_FALSE(lab.motor(axis).moving);
      }
      ++count;
    }
    EXPECT_GE(count, 2);
  }
}

const std::string kSlit =
    "[[pseudo]]\nname = [\"gap\", \"centre\"]\nunit = \"mm\"\nmotors = [\"left\", \"right\"]\n"
    "kind = \"slit\"\nsoft_limits = [[0, 20], [-10, 10]]\nprecision = 3\n";

TEST(PseudoAxes, AreShownAsTheirMotorsAre) {
  ReadyLab lab(motors({"left", "right", "beam"}) + kSlit);
  EXPECT_EQ(lab.description("gap").scale.unit, "mm");
  EXPECT_EQ(lab.description("gap").text, "computed from left, right");
  EXPECT_EQ(lab.description("centre").soft_limits, (units::SoftLimits{-10, 10}));
  const auto move = lab.send(to({{"right", 5}}));
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("right").velocity_steps_per_s > 1000; }));
  EXPECT_TRUE(lab.motor("gap").moving);
  // A gap goes as fast as one blade, a centre half as fast; they count thousandths.
  const double speed = lab.motor("right").velocity_steps_per_s / kStepsPerUnit * 1000;
  EXPECT_NEAR(lab.motor("gap").velocity_steps_per_s, speed, 1e-6 * speed);
  EXPECT_NEAR(lab.motor("centre").velocity_steps_per_s, speed / 2, 1e-6 * speed);
  EXPECT_EQ(lab.motor("gap").user_target, 5);
  EXPECT_EQ(lab.wait(move).result, "reached");
  lab.run_for(0.2);
  EXPECT_EQ(lab.motor("gap").user, 5);
  EXPECT_EQ(lab.motor("centre").user, 2.5);
  EXPECT_EQ(lab.motor("centre").position_steps, 2500);
  EXPECT_FALSE(lab.motor("gap").moving);
}

TEST(PseudoAxes, ResultsNameTheAxesBeforeTheMotors) {
  ReadyLab lab(motors({"left", "right", "beam"}) + kSlit);
  const Answer opened = lab.ask(to({{"gap", 4.002}}));
  EXPECT_THAT(opened.motors, testing::ElementsAre("gap", "left", "right"));
  EXPECT_THAT(opened.motor_results, testing::Each("reached"));
  // 800.4 steps of each blade are 800.
  EXPECT_THAT(opened.users, testing::ElementsAre(4, -2, 2));
  EXPECT_EQ(opened.position_steps.front(), 4000) << "counts of the last decimal";
  const Answer both = lab.ask(to({{"centre", 0.5}, {"gap", 3}}));
  EXPECT_THAT(both.motors, testing::ElementsAre("centre", "gap", "left", "right"));
  EXPECT_THAT(both.users, testing::ElementsAre(0.5, 3, -1, 2));
  EXPECT_THAT(lab.ask(to({{"beam", 1}})).motors, testing::ElementsAre("beam"));
  // What has been stopped on its way stands somewhere too.
  const auto move = lab.send(to({{"gap", 20}}));
  lab.run_for(0.3);
  lab.ask(api::Stop{{"gap"}});
  EXPECT_THAT(lab.last_reply(move).motors, testing::ElementsAre("gap", "left", "right"));
  EXPECT_EQ(lab.last_reply(move).motor_results.front(), "stopped");
  EXPECT_EQ(lab.last_reply(move).users.front(), lab.motor("gap").user);
}

TEST(PseudoAxes, AreAsTrustedAsTheLeastTrustedMotor) {
  std::string toml = hall(2, 1, "fine");
  for (const std::string number : {"1", "2"}) {
    const std::string name = "name = \"m0" + number + "\"\n";
    toml.replace(toml.find(name), name.size(),
                 "name = \"" + std::string(number == "1" ? "left" : "right") +
                     "\"\nunit = \"mm\"\nsteps_per_unit = 400\n");
  }
  ReadyLab lab(toml + kSlit);
  EXPECT_EQ(lab.motor("gap").trust, api::Trust::kKnown);
  lab.bus(0).reboot(1);
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("right").trust != api::Trust::kKnown; }));
  EXPECT_EQ(lab.motor("left").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.motor("gap").trust, lab.motor("right").trust);
  EXPECT_THAT(lab.motor("gap").uncertain_reason, HasSubstr("right: "));
  lab.connect();
}

TEST(PseudoAxes, BeyondItsCalibrationAnAxisIsUncertain) {
  const std::string toml = motors({"lift"});
  Lab lab(toml);
  lab.write_file("bar.csv", "angle,lift\n0,1\n10,17.36\n");
  lab.use_configuration(toml +
                        "[[pseudo]]\nname = \"angle\"\nunit = \"deg\"\nmotors = [\"lift\"]\n"
                        "calibration = \"bar.csv\"\n");
  lab.connect();
  EXPECT_EQ(lab.motor("lift").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.motor("angle").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.motor("angle").uncertain_reason, "lift stands beyond the calibration");
  EXPECT_THAT(lab.last_reply(lab.send(to({{"angle", 10.1}}))).reason,
              HasSubstr("angle: 10.1 is beyond the calibration; allowed: 0 to 10"));
  EXPECT_EQ(lab.ask(to({{"angle", 10}})).result, "reached");
  lab.run_for(0.2);
  EXPECT_EQ(lab.motor("angle").trust, api::Trust::kKnown);
}

TEST(PseudoAxes, StopAndPauseAreThoseOfTheMotors) {
  ReadyLab lab(motors({"left", "right", "beam"}) + kSlit);
  const auto move = lab.send(to({{"gap", 20}}));
  const auto other = lab.send(to({{"beam", 30}}));
  lab.run_for(0.4);
  ASSERT_EQ(lab.ask(api::Pause{{"gap"}}).result, "done");
  EXPECT_TRUE(lab.motor("left").paused && lab.motor("right").paused);
  EXPECT_FALSE(lab.motor("beam").paused);
  EXPECT_TRUE(lab.motor("gap").paused);
  const double opened = lab.motor("gap").user;
  EXPECT_GT(opened, 0);
  EXPECT_LT(opened, 20);
  // The line is kept: both blades have gone as far.
  EXPECT_EQ(lab.motor("left").position_steps, -lab.motor("right").position_steps);
  EXPECT_EQ(lab.motor("centre").user, 0);
  ASSERT_EQ(lab.ask(api::Resume{{"centre"}}).result, "done");
  lab.run_for(0.3);
  EXPECT_EQ(lab.ask(api::Stop{{"gap"}}).result, "done");
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  EXPECT_EQ(lab.motor("left").position_steps, -lab.motor("right").position_steps);
  EXPECT_EQ(lab.wait(other).result, "reached");
}

TEST(PseudoAxes, WhatCannotBeAskedSaysWhatCan) {
  ReadyLab lab(motors({"left", "right", "beam"}) + kSlit);
  const auto refusal = [&](const api::Request& request) {
    const Answer answer = lab.last_reply(lab.send(request));
    EXPECT_EQ(answer.result, "refused");
    return answer.reason;
  };
  EXPECT_EQ(refusal(to({{"gap", 20.5}})),
            "gap: target 20.500 mm is beyond the soft limit at 20.000 mm; allowed: 0.000 mm to "
            "20.000 mm");
  EXPECT_THAT(refusal(to({{"gap", 1}, {"beam", 1}})),
              HasSubstr("beam does not go with the axes that are computed from left, right"));
  EXPECT_THAT(refusal(to({{"gap", std::nan("")}})), HasSubstr("not finite"));
  EXPECT_THAT(refusal(to({{"gap", 1e300}})), HasSubstr("beyond the soft limit"));
  for (const api::Request& request : std::initializer_list<api::Request>{
           api::Home{{"gap"}}, api::Jog{.motor = "centre", .per_s = 1},
           api::SetPosition{.motors = {{"gap", api::UserUnits{0}}}},
           api::GetHistory{.motor = "gap"}, api::Confirm{{"gap"}}, api::Enable{{"gap"}},
           api::PositionCompare{.motor = "gap", .position = api::UserUnits{1}},
           api::Configure{.motors = {"gap"}}, api::UseTable{.group = "gap", .table = "slow"},
           api::Configure{.kind = api::Configure::Kind::kChange,
                          .changes = {{"gap", "offset", "1"}}}}) {
    EXPECT_EQ(refusal(request).substr(refusal(request).find(" is computed")),
              " is computed from motors left, right; name these");
  }
  EXPECT_EQ(lab.ask(api::Disarm{{"gap"}}).result, "done") << "as a stop";
  EXPECT_THAT(lab.ask(to({{"gap", 0}})).reason, HasSubstr("left"));
}

TEST(PseudoAxes, DryRunsAndSpeeds) {
  ReadyLab lab(motors({"left", "right", "beam"}) + kSlit);
  // Each blade makes half of the way of the gap, at half its speed: 2 mm/s, so 4 mm take 2 s and
  // their ramps.
  api::Move move{.kind = api::Move::Kind::kAbsolute,
                 .motors = {{"gap", api::UserUnits{8}}},
                 .speed = api::Speed{.per_s = 4}};
  const std::int64_t began_us = lab.now_us();
  EXPECT_EQ(lab.ask(move).result, "reached");
  const double took_s = static_cast<double>(lab.now_us() - began_us) * 1e-6;
  EXPECT_GE(took_s, 2.0);
  // The table starts at 100 steps/s and is at 800 within 0.06 s; a report comes within 0.3 s.
  EXPECT_LE(took_s, 2.5);
  move.dry_run = true;
  move.speed.reset();
  move.motors[0].amount = api::UserUnits{0};
  EXPECT_EQ(lab.ask(move).result, "done");
  EXPECT_EQ(lab.motor("gap").user, 8);
}

}  // namespace
}  // namespace bushd::test
