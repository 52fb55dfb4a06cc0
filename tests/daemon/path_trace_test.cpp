// What comes out of the pins on a path, judged by tools/check-trace from the file of its points.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/lab.h"
#include "sim/shipped_motors.h"
#include "sim/vcd.h"

namespace bushd::test {
namespace {

const std::vector<std::string> kTraced{"m01", "m03", "m04"};

class PathTrace : public testing::TestWithParam<const char*> {
 protected:
  PathTrace() {
    std::string name = (std::filesystem::temp_directory_path() / "bushd-path-XXXXXX").string();
    directory_ = ::mkdtemp(name.data());
    const std::array<std::uint8_t, 2> addresses = {1, 2};
    vcd_ = std::move(sim::VcdWriter::create(path("trace.vcd"), addresses).value());
  }
  ~PathTrace() override { std::filesystem::remove_all(directory_); }

  std::string path(const char* file) const { return (directory_ / file).string(); }

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
  int check(const Lab& lab) {
    std::ofstream moves(path("moves.jsonl"));
    for (const std::string& line : lab.move_lines()) moves << line << "\n";
    moves.close();
    const std::string tool = (kShippedTables.parent_path() / "tools" / "check-trace").string();
    const std::string command = BUSHD_PYTHON " -B " + tool + " --moves " + path("moves.jsonl") +
                                " --trace " + path("trace.vcd") + " --path " + path("path.csv") +
                                " > " + path("said") + " 2>&1";
    const int status = std::system(command.c_str());  // NOLINT: a program of ours
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string said() const {
    std::ifstream file(path("said"));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::filesystem::path directory_;
  std::unique_ptr<sim::VcdWriter> vcd_;
};
INSTANTIATE_TEST_SUITE_P(Formats, PathTrace, testing::Values("fine", "coarse"),
                         [](const auto& format) { return std::string(format.param); });

TEST_P(PathTrace, EveryEdgeIsOnThePath) {
  Lab lab(hall(2, 2, GetParam()), {}, vcd_.get());
  lab.connect();
  const auto move = lab.send(api::MovePath{.motors = kTraced, .rows = 63, .positions = points()});
  for (int pause = 0; pause < 3; ++pause) {
    lab.run_for(0.8);
    lab.wait(lab.send(api::Pause{}));
    lab.send(api::Resume{});
  }
  EXPECT_EQ(lab.wait(move).result, "reached");
  lab.run_for(0.1);
  ASSERT_TRUE(vcd_->close(lab.bus(0).now_ns()).has_value());
  write_points(points());
  EXPECT_EQ(check(lab), 0) << said();
  // It would say so if the path had been another one.
  std::vector<double> other = points();
  other[3 * 20 + 1] += 40;
  write_points(other);
  EXPECT_EQ(check(lab), 1) << said();
}

}  // namespace
}  // namespace bushd::test
