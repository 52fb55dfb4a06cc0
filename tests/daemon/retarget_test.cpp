// Moves given to motors that move: each step is checked against the table from outside
// (sim/plant.h), and where the shaft stands in the end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/lab.h"
#include "sim/plant.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr std::uint32_t kTickNs = 2'560'000;

// The motors of one MCU of hall(), each step against its table.
class JudgedLab {
 public:
  JudgedLab(int motors, const std::string& format)
      : plant_(1), lab_(hall(1, motors, format, "glacier"), table_text(), &plant_) {
    table_.accel = {kCodes.data(), static_cast<std::uint16_t>(kCodes.size()), nullptr, nullptr, 0};
    table_.decel = table_.accel;
    table_.cruise = kCodes.back();
    table_.time_unit_ns = 40'000;
    rules_ = std::make_unique<sim::PaceRules>(
        table_, kTickNs, sim::McuOptions{}.slots,
        format == "fine" ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE);
    for (int m = 0; m < motors; ++m) plant_.attach(0, static_cast<std::size_t>(m), *rules_);
    plant_.on_violation = [](sim::TimeNs time_ns, std::size_t, std::size_t output,
                             const std::string& what) {
      ADD_FAILURE() << static_cast<double>(time_ns) * 1e-9 << " s, output " << output << ": "
                    << what;
    };
    lab_.connect();
  }
  Lab* operator->() { return &lab_; }

  // Runs until the motor has passed a position in its direction.
  void pass(const std::string& motor, std::int64_t steps) {
    const bool up = steps > lab_.shaft_steps(motor);
    ASSERT_TRUE(lab_.run_until(
        [&] { return up ? lab_.shaft_steps(motor) >= steps : lab_.shaft_steps(motor) <= steps; }));
  }
  void expect_reached(std::int64_t move, const std::string& motor, std::int64_t steps) {
    const Answer result = lab_.wait(move);
    EXPECT_EQ(result.result, "reached") << result.reason;
    EXPECT_EQ(lab_.replies(move).size(), 2u) << "accepted and exactly one result";
    lab_.run_for(0.5);
    EXPECT_EQ(lab_.shaft_steps(motor), steps);
    EXPECT_EQ(lab_.motor(motor).position_steps, steps);
    EXPECT_EQ(lab_.motor(motor).target_steps, steps);
    EXPECT_FALSE(lab_.motor(motor).moving);
  }
  // Events of the log of moves, of one kind.
  std::vector<nlohmann::json> events(const std::string& kind) const {
    std::vector<nlohmann::json> found;
    for (const std::string& line : lab_.move_lines()) {
      const auto event = nlohmann::json::parse(line);
      if (event.at("event") == kind) found.push_back(event);
    }
    return found;
  }

 private:
  static constexpr std::array<std::uint16_t, 25> kCodes{250, 172, 114, 92, 79, 70, 64, 59, 55,
                                                        52,  49,  47,  45, 43, 42, 40, 39, 37,
                                                        36,  35,  34,  33, 32, 31, 30};
  static std::string table_text() {
    std::string text = "name = \"glacier\"\ntime_unit_ns = 40000\naccel = [";
    for (const std::uint16_t code : kCodes) text += std::to_string(code) + ", ";
    return text + "]\n";
  }

  bushd_table table_{};
  std::unique_ptr<sim::PaceRules> rules_;
  sim::Plant plant_;
  Lab lab_;
};

class Retarget : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats, Retarget, testing::Values("fine", "coarse"),
                         [](const auto& format) { return std::string(format.param); });

TEST_P(Retarget, FartherGoesOnWithoutARest) {
  JudgedLab lab(1, GetParam());
  const auto first = lab->send(Ask::kMoveTo, {"m01"}, {500});
  lab.pass("m01", 200);
  const auto second = lab->send(Ask::kMoveTo, {"m01"}, {1500});
  EXPECT_THAT(lab->last_reply(first),
              Ends("stopped", "m01: was given a new target by command 2 of test"))
      << "its move has ended, the motor goes on";
  lab->run_for(0.1);
  EXPECT_EQ(lab->motor("m01").target_steps, 1500);
  lab.expect_reached(second, "m01", 1500);
  EXPECT_EQ(lab->replies(first).size(), 2u);
  EXPECT_EQ(lab.events("move").size(), 1u);
  ASSERT_EQ(lab.events("retarget").size(), 1u);
  EXPECT_EQ(lab.events("retarget")[0].at("target_steps"), 1500);
}

TEST_P(Retarget, NearerWithinReachEndsThere) {
  JudgedLab lab(1, GetParam());
  lab->send(Ask::kMoveTo, {"m01"}, {-2000});
  lab.pass("m01", -300);
  lab.expect_reached(lab->send(Ask::kMoveTo, {"m01"}, {-700}), "m01", -700);
  EXPECT_EQ(lab.events("move").size(), 1u) << "in one go";
}

TEST_P(Retarget, TooNearOvershootsAndComesBack) {
  JudgedLab lab(1, GetParam());
  lab->send(Ask::kMoveTo, {"m01"}, {2000});
  lab.pass("m01", 300);
  lab.expect_reached(lab->send(Ask::kMoveTo, {"m01"}, {305}), "m01", 305);
  const auto legs = lab.events("move");
  ASSERT_EQ(legs.size(), 2u);
  EXPECT_LT(legs[1].at("steps"), 0);
  EXPECT_EQ(lab.events("result")[0].at("result"), "turned");
}

TEST_P(Retarget, BehindReverses) {
  JudgedLab lab(1, GetParam());
  lab->send(Ask::kMoveTo, {"m01"}, {2000});
  lab.pass("m01", 300);
  const auto back = lab->send(Ask::kMoveTo, {"m01"}, {-100});
  lab->run_for(0.06);
  EXPECT_EQ(lab->motor("m01").target_steps, -100) << "while it still runs down";
  lab.expect_reached(back, "m01", -100);
}

TEST_P(Retarget, AtAnyTimeOfAMove) {
  for (const std::int64_t target : {400, 150, 149, 80, -20}) {
    JudgedLab lab(1, GetParam());
    std::int64_t from = 0;
    for (int ms = 0; ms <= 660; ms += 33) {
      const auto first = lab->send(Ask::kMoveTo, {"m01"}, {from + 150});
      lab->run_for(ms * 1e-3);
      const bool over = lab->has_result(first);
      lab.expect_reached(lab->send(Ask::kMoveTo, {"m01"}, {from + target}), "m01", from + target);
      EXPECT_EQ(lab->last_reply(first).result, over ? "reached" : "stopped") << ms << " ms";
      from += target;
    }
  }
}

TEST_P(Retarget, RelativeCountsFromThePresentTarget) {
  JudgedLab lab(1, GetParam());
  lab->send(Ask::kMoveTo, {"m01"}, {1000});
  lab.pass("m01", 100);
  lab->send(Ask::kMoveBy, {"m01"}, {500});
  lab.expect_reached(lab->send(Ask::kMoveBy, {"m01"}, {-200}), "m01", 1300);
}

TEST_P(Retarget, ManyTimesInARow) {
  for (const int every_ms : {1, 7, 25, 60, 150}) {
    JudgedLab lab(1, GetParam());
    std::int64_t last = lab->send(Ask::kMoveTo, {"m01"}, {800});
    std::set<std::int64_t> over;  // it was there before the next one came
    for (const std::int64_t target : {900, 300, -500, -480, 700, 0, 80, 650}) {
      lab->run_for(every_ms * 1e-3);
      if (lab->has_result(last)) over.insert(last);
      last = lab->send(Ask::kMoveTo, {"m01"}, {target});
    }
    lab.expect_reached(last, "m01", 650);
    for (std::int64_t number = 1; number < last; ++number) {
      EXPECT_EQ(lab->replies(number).size(), 2u) << "command " << number;
      EXPECT_EQ(lab->last_reply(number).result, over.contains(number) ? "reached" : "stopped");
    }
  }
}

TEST_P(Retarget, ThenStopEndsAtRestAndStartsNoSecondRun) {
  for (const std::int64_t target : {3000, 305, -500}) {
    for (const int later_ms : {0, 5, 40, 90, 300}) {
      JudgedLab lab(1, GetParam());
      lab->send(Ask::kMoveTo, {"m01"}, {2000});
      lab.pass("m01", 300);
      const auto move = lab->send(Ask::kMoveTo, {"m01"}, {target});
      lab->run_for(later_ms * 1e-3);
      const auto stop = lab->send(Ask::kStop, {"m01"});
      EXPECT_EQ(lab->wait(stop).result, "done");
      const Answer result = lab->last_reply(move);
      const bool back_already = target == 305 && later_ms == 300;
      EXPECT_EQ(result.result, back_already ? "reached" : "stopped") << later_ms << " ms";
      lab->run_for(1);
      EXPECT_EQ(lab->shaft_steps("m01"), result.position_steps.at(0));
      EXPECT_FALSE(lab->motor("m01").moving);
    }
  }
}

TEST_P(Retarget, OfAStoppingMotorTakesTheStopsPlace) {
  for (const std::int64_t target : {1200, 340, -70}) {
    for (const int later_ms : {0, 5, 40, 90}) {
      JudgedLab lab(1, GetParam());
      const auto first = lab->send(Ask::kMoveTo, {"m01"}, {2000});
      lab.pass("m01", 300);
      const auto stop = lab->send(Ask::kStop, {});
      lab->run_for(later_ms * 1e-3);
      const bool at_rest = lab->has_result(stop);
      const auto second = lab->send(Ask::kMoveTo, {"m01"}, {target});
      lab.expect_reached(second, "m01", target);
      EXPECT_EQ(lab->last_reply(first).result, "stopped");
      EXPECT_EQ(lab->last_reply(stop).result, "done");
      EXPECT_THAT(lab->last_reply(stop).reason,
                  HasSubstr(at_rest ? "done" : "m01 was given a new target"))
          << later_ms << " ms";
    }
  }
}

TEST_P(Retarget, IsPlannedAgainIfTheMcuDoesNotGetIt) {
  for (const std::int64_t target : {1200, 305, -70}) {
    for (const int lost : {1, 2, 3, 5}) {
      JudgedLab lab(1, GetParam());
      lab->send(Ask::kMoveTo, {"m01"}, {700});
      lab.pass("m01", 300);
      const auto move = lab->send(Ask::kMoveTo, {"m01"}, {target});
      int count = 0;
      lab->on_send = [&](std::size_t, std::vector<std::uint8_t>&) { return ++count > lost; };
      lab.expect_reached(move, "m01", target);
    }
  }
}

// Two streams of an MCU begin together, and leave time for that.
// What is told tick by tick starts 100 ms after the request.
TEST_P(Retarget, BeforeTheStartIsAnotherMove) {
  for (const std::int64_t target : {900, -400, 0}) {
    for (const int later_ms : {0, 5, 40, 60}) {
      JudgedLab lab(2, GetParam() + std::string("_ticks"));
      lab->send(Ask::kMoveTo, {"m01", "m02"}, {500, 500});
      lab->run_for(later_ms * 1e-3);
      lab.expect_reached(lab->send(Ask::kMoveTo, {"m01"}, {target}), "m01", target);
      EXPECT_EQ(lab.events("move").size(), 2u) << target << " after " << later_ms << " ms";
    }
  }
}

TEST_P(Retarget, GroupWithMotorsAtRestAndInMotion) {
  JudgedLab lab(16, GetParam());
  std::vector<std::string> all;
  std::vector<std::int64_t> steps;
  for (int m = 1; m <= 16; ++m) {
    all.push_back((m < 10 ? "m0" : "m") + std::to_string(m));
    steps.push_back((m % 2 != 0 ? 1 : -1) * (100 + 61 * m));
  }
  const auto first = lab->send(Ask::kMoveTo, {"m01", "m02", "m03"}, {900, 900, 900});
  lab.pass("m01", 250);
  const auto late = lab->send(Ask::kMoveTo, {"m04"}, {900});
  lab->run_for(0.02);
  const auto second = lab->send(Ask::kMoveTo, all, steps);
  EXPECT_TRUE(lab->has_result(first));
  EXPECT_TRUE(lab->has_result(late));
  EXPECT_EQ(lab->wait(second).result, "reached");
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(lab->shaft_steps(all[i]), steps[i]);
  EXPECT_EQ(lab->bus(0).mcu(0).core().reception.rejected_frames, 0);
}

TEST_P(Retarget, OfOneMotorOfAGroupLeavesTheOthersAsTheyWere) {
  JudgedLab lab(2, GetParam());
  const auto group = lab->send(Ask::kMoveTo, {"m01", "m02"}, {900, 1000});
  lab.pass("m01", 250);
  const auto single = lab->send(Ask::kMoveTo, {"m01"}, {-50});
  EXPECT_FALSE(lab->has_result(group));
  lab.expect_reached(single, "m01", -50);
  const Answer result = lab->wait(group);
  EXPECT_EQ(result.result, "stopped");
  EXPECT_THAT(result.motor_results, testing::ElementsAre("stopped", "reached"));
  EXPECT_EQ(lab->shaft_steps("m02"), 1000);
}

TEST_P(Retarget, ShutDownEndsTheSecondRunToo) {
  JudgedLab lab(1, GetParam());
  lab->send(Ask::kMoveTo, {"m01"}, {2000});
  lab.pass("m01", 300);
  const auto back = lab->send(Ask::kMoveTo, {"m01"}, {-500});
  lab->run_for(0.1);
  lab->core().shut_down(lab->now_us());
  EXPECT_TRUE(lab->run_until([&] { return lab->core().at_rest(); }, 10));
  EXPECT_EQ(lab->last_reply(back).result, "stopped");
  EXPECT_GT(lab->shaft_steps("m01"), 0);
}

}  // namespace
}  // namespace bushd::test
