// Stops on lines that are as slow as a configuration may have them.
#include <gtest/gtest.h>

#include <string>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

void replace_in(std::string& text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
}

std::string slow_hall(int baud, int tick_us, int motors, const std::string& manner) {
  std::string toml = hall(1, motors, manner);
  replace_in(toml, "baud = 500000", "baud = " + std::to_string(baud));
  replace_in(toml, "tick_us = 2560", "tick_us = " + std::to_string(tick_us));
  return toml;
}

struct Line {
  int baud;
  int tick_us;
  int motors;
  const char* manner;
};

class SlowLines : public testing::TestWithParam<Line> {};

TEST_P(SlowLines, AStopOfAllMotorsIsMadeAndTheBusIsNotSilent) {
  const Line& line = GetParam();
  for (int phase_ms = 0; phase_ms < 50; phase_ms += 7) {
    SCOPED_TRACE(phase_ms);
    ReadyLab lab(slow_hall(line.baud, line.tick_us, line.motors, line.manner));
    std::vector<std::string> motors;
    for (int m = 1; m <= line.motors; ++m) motors.push_back("m0" + std::to_string(m));
    const std::int64_t move =
        lab.send(Ask::kMoveBy, motors, std::vector<std::int64_t>(motors.size(), 50'000));
    lab.run_for(2 + phase_ms * 1e-3);
    const std::int64_t before_us = lab.now_us();
    const std::int64_t stop = lab.send(Ask::kStop, motors);
    EXPECT_EQ(lab.wait(stop, 5).result, "done");
    // The longest time of a stop of these lines, a ramp of 197 ms, a poll and its answer.
    EXPECT_LE(lab.now_us() - before_us, 107'000 + 197'000 + 50'000 + 24'000 + 6'000);
    EXPECT_EQ(lab.last_reply(move).result, "stopped") << lab.last_reply(move).reason;
  }
}
INSTANTIATE_TEST_SUITE_P(Lines, SlowLines,
                         testing::Values(Line{57'600, 5'000, 4, "fine_table"},
                                         Line{57'600, 5'000, 4, "fine"},
                                         Line{57'600, 5'000, 4, "fine_ticks"},
                                         Line{115'200, 3'000, 8, "fine_table"},
                                         Line{115'200, 3'000, 8, "fine_ticks"}));

}  // namespace
}  // namespace bushd::test
