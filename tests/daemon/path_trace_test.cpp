// What comes out of the pins on a path, judged by tools/check-trace from the file of its points.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "daemon/traced.h"

namespace bushd::test {
namespace {

const std::vector<std::string> kTraced{"m01", "m03", "m04"};

class PathTrace : public Traced<const char*> {
 protected:
  // A contour of short segments, then some long ones with sharp corners.
  static std::vector<double> points() {
    std::vector<double> all;
    for (int i = 1; i <= 60; ++i) {
      const double angle = i * 0.12;
      all.insert(all.end(), {std::round(300 * std::sin(angle)),
                             std::round(200 - 200 * std::cos(angle)), std::round(i * 1.7)});
    }
    all.insert(all.end(), {500, 0, 102, 500, 400, 90, 0, 0, 0});
    return all;
  }
  void write_points(const std::vector<double>& points) const {
    std::ofstream file(path("path.csv"));
    file << "m01,m03,m04\n";
    for (std::size_t i = 0; i < points.size(); i += 3) {
      file << points[i] << ',' << points[i + 1] << ',' << points[i + 2] << '\n';
    }
  }
  int check(const Lab& lab) { return Traced::check(lab, "--path " + path("path.csv")); }
};
INSTANTIATE_TEST_SUITE_P(Formats, PathTrace, testing::Values("fine", "coarse"),
                         [](const auto& format) { return std::string(format.param); });

TEST_P(PathTrace, EveryEdgeIsOnThePath) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const auto move = lab.send(api::MovePath{.motors = kTraced, .rows = 63, .positions = points()});
  for (int pause = 0; pause < 3; ++pause) {
    lab.run_for(0.8);
    lab.ask(api::Pause{});
    lab.send(api::Resume{});
  }
  EXPECT_EQ(lab.wait(move).result, "reached");
  close_trace(lab);
  write_points(points());
  EXPECT_EQ(check(lab), 0) << said();
  // It would say so if the path had been another one.
  std::vector<double> other = points();
  other[3 * 20 + 1] += 40;
  write_points(other);
  EXPECT_EQ(check(lab), 1) << said();
}

TEST_P(PathTrace, OfALogOfSeveralPathsEachIsJudgedByItsPoints) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  EXPECT_EQ(lab.ask(api::MovePath{.motors = kTraced, .rows = 63, .positions = points()}).result,
            "reached");
  // Back by another way, and without one of the motors.
  const auto back =
      lab.send(api::MovePath{.motors = {"m03", "m01"}, .rows = 2, .positions = {100, -50, 7, 9}});
  EXPECT_EQ(lab.wait(back).result, "reached");
  close_trace(lab);
  write_points(points());
  std::ofstream(path("back.csv")) << "m03,m01\n100,-50\n7,9\n";
  const std::string both = "--path " + path("path.csv") + " --path " + path("back.csv");
  EXPECT_EQ(Traced::check(lab, both), 0) << said();
  EXPECT_EQ(check(lab), 2);
  EXPECT_THAT(said(), testing::HasSubstr("it has 2 paths, and --path names 1"));
  std::ofstream(path("back.csv")) << "m03,m01\n100,-90\n7,9\n";
  EXPECT_EQ(Traced::check(lab, both), 1) << said();
}

TEST_P(PathTrace, PathsAndOtherMotionsInAnyOrderAreJudgedTogether) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  const auto reaches = [&lab](auto request) {
    EXPECT_EQ(lab.ask(std::move(request)).result, "reached");
  };
  const api::MovePath path_there{.motors = kTraced, .rows = 63, .positions = points()};
  reaches(api::Move{.motors = {{"m01", 200}, {"m04", -90}}});
  reaches(api::Move{.kind = api::Move::Kind::kAbsolute, .motors = {{"m01", 0}, {"m04", 0}}});
  reaches(path_there);
  reaches(api::MoveLine{.motors = {{"m01", 120}, {"m03", -70}}});
  reaches(api::Move{.motors = {{"m03", 60}}});
  // m03 alone moves beside a path of others.
  const auto long_move = lab.send(api::Move{.motors = {{"m03", 900}}});
  const api::MovePath path_back{.motors = {"m04", "m01"}, .rows = 2, .positions = {100, -50, 7, 9}};
  reaches(path_back);
  EXPECT_EQ(lab.wait(long_move).result, "reached");
  reaches(api::Move{.motors = {{"m01", -40}, {"m03", 33}}});
  close_trace(lab);
  write_points(points());
  std::ofstream(path("back.csv")) << "m04,m01\n100,-50\n7,9\n";
  const std::string both = "--path " + path("path.csv") + " --path " + path("back.csv");
  EXPECT_EQ(Traced::check(lab, both), 0) << said();
  EXPECT_THAT(said(), testing::ContainsRegex("edges of 3 motors are judged by the path"));
  EXPECT_THAT(said(), testing::HasSubstr("steps commanded"));
  EXPECT_EQ(check(lab), 2);
  EXPECT_THAT(said(), testing::HasSubstr("it has 2 paths, and --path names 1"));
  // A move that was asked to go elsewhere, and a path that was another one.
  const auto elsewhere = [](nlohmann::json& event) {
    if (event["event"] == "move" && event["steps"] == 33) event["steps"] = 34;
    return true;
  };
  EXPECT_EQ(Traced::check(lab, both, elsewhere), 1) << said();
  std::ofstream(path("back.csv")) << "m04,m01\n100,-90\n7,9\n";
  EXPECT_EQ(Traced::check(lab, both), 1) << said();
  EXPECT_THAT(said(), testing::HasSubstr("its edges are not the steps of the path's points"));
}

TEST_P(PathTrace, ATraceThatIsStillWrittenIsToldAsThat) {
  ReadyLab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  EXPECT_EQ(lab.ask(api::Move{.motors = {{"m01", 20}}}).result, "reached");
  EXPECT_EQ(Traced::check(lab, ""), 2);
  EXPECT_THAT(said(), testing::HasSubstr("the trace is unfinished: bushsim still writes it"));
  ASSERT_TRUE(vcd_->close(lab.bus(0).now_ns()).has_value());
  EXPECT_EQ(Traced::check(lab, ""), 0) << said();
}

}  // namespace
}  // namespace bushd::test
