// How soon a client hears that its motion has ended, on one MCU and on many.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/lab.h"
#include "daemon/line_times.h"
#include "sim/edge.h"

namespace bushd::test {
namespace {

class LastStep final : public sim::EdgeSink {
 public:
  void edge(const sim::Edge& edge) override {
    const bool step = edge.signal == sim::Signal::kStep && edge.level;
    if (step) at_ns_ = std::max(at_ns_, edge.time_ns);
  }
  void settled(sim::TimeNs) override {}
  std::int64_t at_us() const { return at_ns_ / 1000; }

 private:
  sim::TimeNs at_ns_ = 0;
};

struct HowItEnds {
  const char* name;
  int mcus;
  bool line;
  std::int64_t apart_steps;  // each motor goes so much farther than the one before
};

class EndsOfMoves : public testing::TestWithParam<HowItEnds> {};

// From the last edge to the result, at any phase of polls and SYNCs. The tick of the last edge
// ends, and crystals may have drifted by 0.2 ms; a SYNC may just be on the line; one poll, whose
// frame arrives then, asks all whose motors end, and they answer. Where they end apart, a poll that
// has asked others may have begun just before, and as long again nobody is asked.
TEST_P(EndsOfMoves, AreHeardOfByOnePoll) {
  const auto& [name, mcus, line, apart_steps] = GetParam();
  constexpr std::size_t kSync = 19;
  const std::int64_t poll_us = hall_poll_us(mcus, answer_at_end(1));
  const std::int64_t others_us = apart_steps != 0 && !line ? 2 * poll_us : 0;
  const std::int64_t answers_us =
      poll_us - hall_line_us(1 + static_cast<std::size_t>(mcus) * BUSHD_POLL_ENTRY);
  const std::int64_t most_us = kHallTickUs + 200 + hall_line_us(kSync) + others_us + answers_us;
  LastStep last;
  ReadyLab lab(hall(mcus, 1), {}, &last);
  lab.run_for(3);  // the MCUs know their rates
  std::vector<std::string> names;
  for (int m = 1; m <= mcus; ++m) names.push_back("m0" + std::to_string(m));
  std::int64_t longest_us = 0;
  for (int phase = 0; phase < 60; ++phase) {
    lab.run_for(0.1 + phase * 0.000873);
    std::vector<std::int64_t> steps;
    for (int m = 0; m < mcus; ++m) {
      steps.push_back((4 + m * apart_steps) * (phase % 2 == 0 ? 1 : -1));
    }
    const auto move = line ? lab.send(api::MoveLine{.motors = motor_steps(names, steps)})
                           : lab.send(Ask::kMoveBy, names, steps);
    ASSERT_TRUE(lab.run_until([&] { return lab.has_result(move); }, 10));
    ASSERT_EQ(lab.last_reply(move).result, "reached");
    longest_us = std::max(longest_us, lab.now_us() - last.at_us());
  }
  EXPECT_LE(longest_us, most_us);
}

INSTANTIATE_TEST_SUITE_P(Groups, EndsOfMoves,
                         testing::Values(HowItEnds{"one", 1, false, 0},
                                         HowItEnds{"two_mcus", 2, false, 0},
                                         HowItEnds{"two_mcus_apart", 2, false, 1},
                                         HowItEnds{"line_of_two_mcus", 2, true, 0},
                                         HowItEnds{"line_that_ends_apart", 2, true, 3},
                                         HowItEnds{"eight_mcus", 8, false, 0},
                                         HowItEnds{"eight_mcus_apart", 8, false, 1},
                                         HowItEnds{"line_of_eight_mcus", 8, true, 0}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace bushd::test
