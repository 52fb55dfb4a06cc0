// A day in a lab, judged by tools/check-trace from the log of moves and the pins alone: moves in
// every way of emission, homing, local motion, a limit switch, jogs, pauses, moves of two legs,
// lines, trajectories.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/traced.h"

namespace bushd::test {
namespace {

struct Manner {
  const char* name;
  const char* keys;                 // of every MCU
  const char* otherwise = nullptr;  // in a move's line of the log
  const char* manner = "fine";
};

class Trace : public Traced<Manner> {
 protected:
  static std::string toml() {
    std::string text = hall(2, 3, GetParam().manner);
    const auto add = [&text](const std::string& after, const std::string& keys) {
      text.insert(text.find(after) + after.size(), keys);
    };
    add("name = \"m01\"\n",
        "home = { direction = \"negative\", position_steps = -50, most_steps = 6000 }\n");
    add("name = \"m02\"\n", "local = true\n");
    add("name = \"m04\"\n", "limit = \"positive\"\n");
    add("name = \"m06\"\n", "backlash = 30\nbacklash_speed = 150\n");
    add("address = 1\n", GetParam().keys);
    add("address = 2\n", GetParam().keys);
    return text;
  }
  void move(Lab& lab, const std::vector<std::string>& motors,
            const std::vector<std::int64_t>& steps) {
    const Answer result = lab.ask(Ask::kMoveBy, motors, steps);
    EXPECT_EQ(result.result, "reached") << result.reason;
  }
  // Slower than the table, slower yet in motion, faster, and back to where it was.
  void move_at_speeds(Lab& lab) {
    const auto to = [&lab](std::int64_t position, double speed) {
      return lab.send(api::Move{.kind = api::Move::Kind::kAbsolute,
                                .motors = {{"m02", position}, {"m05", -position}},
                                .speed = api::Speed{.per_s = speed, .in_steps = true}});
    };
    to(1500, 700);
    lab.run_for(0.6);
    to(1500, 180);
    lab.run_for(0.6);
    to(1700, 1900);
    lab.run_for(0.3);
    EXPECT_EQ(lab.wait(to(30, 411)).result, "reached");
  }
  // Paused and resumed, jogged to and fro.
  void change_on_the_way(Lab& lab) {
    const auto paused = lab.send(Ask::kMoveBy, {"m03", "m06"}, {900, -900});
    lab.run_for(0.35);
    EXPECT_EQ(lab.ask(api::Pause{}).reason, "paused: 2 motors");
    lab.run_for(0.5);
    lab.send(api::Resume{});
    const auto jog = [&lab](double speed) {
      return lab.send(api::Jog{.motor = "m05", .per_s = speed, .in_steps = true});
    };
    const auto jogged = jog(700);
    lab.run_for(0.4);
    jog(-450);
    lab.run_for(0.4);
    jog(-900);
    lab.run_for(0.4);
    jog(0);
    EXPECT_EQ(lab.wait(jogged).result, "done");
    EXPECT_EQ(lab.wait(paused).result, "reached");
  }
  // On one line: to its end, stopped, paused and resumed, and with another speed and a nearer end.
  void move_along_lines(Lab& lab) {
    const std::vector<std::string> motors{"m02", "m03", "m05"};
    const auto by = [&](const std::vector<std::int64_t>& steps, double speed = 0) {
      api::MoveLine line{.motors = motor_steps(motors, steps)};
      if (speed != 0) line.speed = api::Speed{.per_s = speed, .in_steps = true};
      return lab.send(line);
    };
    EXPECT_EQ(lab.wait(by({-31, 700, 299})).result, "reached");
    const auto stopped = by({900, -411, 17});
    lab.run_for(0.35);
    lab.send(Ask::kStop, {"m05"});
    EXPECT_EQ(lab.wait(stopped).result, "stopped");
    const auto paused = by({-1000, -3, 998});
    lab.run_for(0.35);
    EXPECT_EQ(lab.ask(api::Pause{{"m03"}}).reason, "paused: 3 motors");
    lab.send(api::Resume{});
    EXPECT_EQ(lab.wait(paused).result, "reached");
    by({2000, 1000, -500});
    lab.run_for(0.4);
    by({0, 0, 0}, 250);
    lab.run_for(0.5);
    by({0, 0, 0}, 900);
    lab.run_for(0.3);
    EXPECT_EQ(lab.wait(by({-1200, -600, 300})).result, "reached");
  }
  // Straight and cubic, to its end, in motion beyond it, stopped, and with rows that come later.
  void follow_trajectories(Lab& lab) {
    const std::vector<std::string> motors{"m02", "m03", "m05"};
    std::int64_t trajectory = 0;
    using Part = api::Follow::Part;
    const auto rows = [&](Part part, bool cubic, const std::vector<std::vector<double>>& all) {
      api::Follow follow{.part = part,
                         .array = trajectory,
                         .motors = motors,
                         .cubic = cubic,
                         .stretch = cubic ? 1.1 : 1};
      for (const auto& row : all) {
        follow.time_s.push_back(row.front());
        for (std::size_t m = 0; m < motors.size(); ++m) {
          const auto at = static_cast<double>(begins_[m]);
          follow.positions.push_back(at + row[m + 1]);
        }
      }
      return lab.send(follow);
    };
    const auto begin = [&] {
      ++trajectory;
      begins_.clear();
      for (const auto& motor : motors) begins_.push_back(lab.motor(motor).position_steps);
    };
    const auto expect_loaded = [&](std::int64_t number) {
      EXPECT_THAT(lab.wait(number), Ends("done"));
    };
    begin();
    expect_loaded(
        rows(Part::kLastRows, false,
             {{0, 0, 0, 0}, {1, 60, -99.25, 0}, {1.4, 90.3, -99.25, 7.7}, {2.5, 31, -0.5, 9}}));
    EXPECT_EQ(lab.wait(rows(Part::kRun, false, {})).result, "reached");
    begin();
    expect_loaded(rows(Part::kRows, true,
                       {{0, 0, 0, 0}, {0.5, 20, -8, 2}, {1, 90, -40, 3}, {1.5, 170, -90, 3}}));
    const auto cubic = rows(Part::kRun, true, {});
    expect_loaded(rows(Part::kRows, true, {{2, 230, -130, 4}, {2.5, 250, -140, 5}}));
    expect_loaded(rows(Part::kLastRows, true, {{3.1, 235, -130, 6}, {3.9, 220, -110, 12.2}}));
    EXPECT_EQ(lab.wait(cubic).result, "reached");
    begin();
    expect_loaded(rows(Part::kLastRows, true, {{0, 0, 0, 0}, {3, 220, 100, -200}}));
    const auto stopped = rows(Part::kRun, true, {});
    lab.run_for(1.6);
    lab.send(Ask::kStop, {"m03"});
    EXPECT_EQ(lab.wait(stopped).result, "stopped");
    begin();
    expect_loaded(rows(Part::kRows, true, {{0, 0, 0, 0}, {1.5, 110, 20, -80}, {3, 330, 0, -300}}));
    EXPECT_EQ(lab.wait(rows(Part::kRun, true, {})).result, "stopped");
  }
  void write(Lab& lab) {
    EXPECT_TRUE(vcd_->close(lab.bus(0).now_ns()).has_value());
    nlohmann::json positions;
    for (const char* name : {"m01", "m02", "m03", "m04", "m05", "m06"}) {
      positions["motors"].push_back(
          {{"name", name}, {"position_steps", lab.motor(name).position_steps}});
    }
    std::ofstream(path("positions.json")) << positions;
  }
  int check(const Lab& lab, const Bend& bend) {
    return Traced::check(lab, "--positions " + path("positions.json"), bend);
  }

  // Whatever the emission: of each kind of event one is left out or changed.
  void expect_that_all_events_count(const Lab& lab) {
    EXPECT_EQ(check(lab, [](auto& event) { return event["event"] != "autonomous"; }), 1);
    EXPECT_EQ(check(lab,
                    [](auto& event) {
                      if (event["result"] == "limit") {
                        event["position_steps"] = event["position_steps"].template get<int>() - 1;
                      }
                      return true;
                    }),
              1);
    EXPECT_EQ(check(lab,
                    [](auto& event) {
                      if (event.contains("line") && event["motor"] == "m03") {
                        event["line"]["increment"] =
                            event["line"]["increment"].template get<int>() - 1;
                      }
                      return true;
                    }),
              1);
    EXPECT_EQ(check(lab,
                    [](auto& event) {
                      if (event["event"] != "trajectory") return true;
                      event["rows"][1][0] = event["rows"][1][0].template get<int>() + 9'000'000;
                      return true;
                    }),
              1);
  }

  std::vector<std::int64_t> begins_;
};
INSTANTIATE_TEST_SUITE_P(
    Emission, Trace,
    testing::Values(
        Manner{"even", "", "{\"emission\": \"burst\", \"step_us\": 320}"},
        Manner{"coarse", "", nullptr, "coarse"}, Manner{"table", "", nullptr, "fine_table"},
        Manner{"burst", "steps = \"burst\"\nstep_us = 320\n", "{\"step_us\": 340}"},
        Manner{"common", "direction = \"common\"\nsteps = \"burst\"\nstep_us = 320\n",
               "{\"emission\": \"burst\"}"},
        Manner{"staggered", "steps = \"staggered\"\nstep_us = 320\nsettle_us = 60\n",
               "{\"settle_us\": 80}"},
        Manner{"spread", "steps = \"staggered\"\nstep_us = 320\n", "{\"settle_us\": 20}"},
        Manner{"measured", "steps = \"staggered\"\nstep_us = 320\nsettle_us = \"measured\"\n",
               "{\"step_us\": 240}"},
        Manner{"common_staggered",
               "direction = \"common\"\nsteps = \"staggered\"\nstep_us = 320\nsettle_us = 60\n",
               "{\"settle_us\": 100}"},
        Manner{"common_spread", "direction = \"common\"\nsteps = \"staggered\"\nstep_us = 320\n",
               "{\"emission\": \"staggered\"}"},
        Manner{"common_measured",
               "direction = \"common\"\nsteps = \"staggered\"\nstep_us = 320\n"
               "settle_us = \"measured\"\n",
               "{\"step_us\": 240}"},
        Manner{"inverted",
               "enable_active = \"low\"\nstep_active = \"low\"\ndirection_active = \"low\"\n"},
        Manner{"common_inverted",
               "direction = \"common\"\nsteps = \"burst\"\nstep_us = 320\nenable_active = \"low\"\n"
               "step_active = \"low\"\ndirection_active = \"low\"\n",
               "{\"emission\": \"burst\"}"},
        Manner{"measured_inverted",
               "steps = \"staggered\"\nstep_us = 320\nsettle_us = \"measured\"\n"
               "step_active = \"low\"\n",
               "{\"step_us\": 240}"},
        Manner{"phases", "steps = \"phases\"\nphase_sequence = \"half\"\n",
               "{\"phase_sequence\": \"full\"}"}),
    [](const auto& manner) { return std::string(manner.param.name); });

TEST_P(Trace, EveryEdgeIsExplained) {
  Lab lab(toml(), {}, vcd_.get());
  lab.bus(0).mcu(0).attach_switch(0, {.at_steps = -700, .hysteresis_steps = 4});
  lab.connect();
  EXPECT_EQ(lab.ask(Ask::kHome, {"m01"}).result, "reached");
  move(lab, {"m01", "m02", "m03", "m04", "m05"}, {500, -300, 200, -400, 1});
  lab.bus(0).mcu(0).set_inputs({0, BUSHD_INPUT_FORWARD});
  lab.run_for(0.7);
  move(lab, {"m03", "m05"}, {-90, 250});
  lab.bus(0).mcu(0).set_inputs({});
  lab.run_for(1);
  const auto limited = lab.send(Ask::kMoveBy, {"m04", "m06"}, {20000, -700});
  lab.run_for(1.5);
  lab.bus(0).mcu(1).set_inputs({0b001, 0});
  EXPECT_EQ(lab.wait(limited).result, "limit");
  move(lab, {"m04", "m05", "m06"}, {-300, 100, 300});
  move(lab, {"m01", "m02", "m03"}, {-100, -50, 30});
  move_at_speeds(lab);
  change_on_the_way(lab);
  move_along_lines(lab);
  follow_trajectories(lab);
  lab.run_for(0.1);
  write(lab);
  EXPECT_EQ(check(lab, [](auto&) { return true; }), 0) << said();
  if (std::string_view(GetParam().keys).find("\"low\"") != std::string_view::npos) {
    EXPECT_EQ(check(lab, [](auto& event) { return event["event"] != "levels"; }), 1);
  }
  // It would say so if something else had happened.
  if (GetParam().otherwise != nullptr) {
    EXPECT_EQ(check(lab,
                    [](auto& event) {
                      if (event["event"] == "move")
                        event.update(nlohmann::json::parse(GetParam().otherwise));
                      return true;
                    }),
              1);
  } else {
    expect_that_all_events_count(lab);
  }
}

}  // namespace
}  // namespace bushd::test
