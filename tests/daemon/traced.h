// A lab of two MCUs whose pins are written as a trace, judged by tools/check-trace.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "daemon/lab.h"
#include "sim/shipped_motors.h"
#include "sim/vcd.h"

namespace bushd::test {

template <class Parameter>
class Traced : public testing::TestWithParam<Parameter> {
 protected:
  using Bend = std::function<bool(nlohmann::json&)>;

  Traced() {
    std::string name = (std::filesystem::temp_directory_path() / "bushd-trace-XXXXXX").string();
    directory_ = ::mkdtemp(name.data());
    const std::array<std::uint8_t, 2> addresses = {1, 2};
    vcd_ = std::move(sim::VcdWriter::create(path("trace.vcd"), addresses).value());
  }
  ~Traced() override { std::filesystem::remove_all(directory_); }

  std::string path(const char* file) const { return (directory_ / file).string(); }

  // Ends the trace when it has what comes so soon.
  void close_trace(Lab& lab, double within_s = 0.1) {
    lab.run_for(within_s);
    const auto closed = vcd_->close(lab.bus(0).now_ns());
    if (!closed) throw std::runtime_error(closed.error().text());
  }
  // Exit code of check-trace with these options. `bend` changes an event of the log of moves, or
  // leaves it out by returning false.
  int check(
      const Lab& lab, const std::string& options,
      const Bend& bend = [](nlohmann::json&) { return true; }) {
    std::ofstream moves(path("moves.jsonl"));
    for (const std::string& line : lab.move_lines()) {
      nlohmann::json event = nlohmann::json::parse(line);
      if (bend(event)) moves << event << "\n";
    }
    moves.close();
    const std::string tool = (kShippedTables.parent_path() / "tools" / "check-trace").string();
    const std::string command = BUSHD_PYTHON " -B " + tool + " --moves " + path("moves.jsonl") +
                                " --trace " + path("trace.vcd") + " " + options + " > " +
                                path("said") + " 2>&1";
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

}  // namespace bushd::test
