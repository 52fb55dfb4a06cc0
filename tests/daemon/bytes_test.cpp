// Bytes on the bus for each step of a move, by the way it is sent: what the daemon's core hands
// over for it, the delimiters that take the line included, polls and SYNCs not. Beside it all bytes
// of the line in both directions until the result, to which the time of the move adds polls and
// SYNCs. The shipped table bushd2-constant, ticks of 2.56 ms, one motor on a line that loses
// nothing.
#include <gtest/gtest.h>

#include <cstdio>

#include "daemon/lab.h"
#include "daemon/motion_frames.h"

namespace bushd::test {
namespace {

struct ByteWay {
  const char* name;
  const char* manner;
  std::int64_t steps;
  double goal;                   // bytes a step; 0: none
  std::int64_t most_frames = 0;  // 0: as many as it takes
};

constexpr ByteWay kWays[] = {
    {.name = "TABLE_RUN", .manner = "fine_table", .steps = 200, .goal = 0.15, .most_frames = 1},
    {.name = "TABLE_TICKS", .manner = "fine", .steps = 200, .goal = 0.25, .most_frames = 1},
    {.name = "TICKS coarse", .manner = "coarse_ticks", .steps = 200, .goal = 0},
    {.name = "TICKS fine", .manner = "fine_ticks", .steps = 200, .goal = 0},
    {.name = "TABLE_RUN", .manner = "fine_table", .steps = 2000, .goal = 0.03, .most_frames = 1},
    {.name = "TABLE_TICKS", .manner = "fine", .steps = 2000, .goal = 0},
    {.name = "TABLE_RUN", .manner = "fine_table", .steps = 20000, .goal = 0.01, .most_frames = 1},
    {.name = "TABLE_TICKS", .manner = "fine", .steps = 20000, .goal = 0.03},
    {.name = "TICKS coarse", .manner = "coarse_ticks", .steps = 20000, .goal = 0},
    {.name = "TICKS fine", .manner = "fine_ticks", .steps = 20000, .goal = 0},
};

struct Carried {
  MotionFrames motion;
  std::int64_t all_bytes = 0;
};

Carried carried_for(const ByteWay& way) {
  ReadyLab lab(hall(1, 1, way.manner));
  Carried carried;
  lab.on_send = [&carried](std::size_t, const std::vector<std::uint8_t>& bytes) {
    carried.motion.add(bytes);
    carried.all_bytes += static_cast<std::int64_t>(bytes.size());
    return true;
  };
  lab.on_receive = [&carried](std::size_t, std::uint8_t&) { ++carried.all_bytes; };
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {way.steps}).result, "reached");
  return carried;
}

TEST(Bytes, PerStepKeepTheirGoals) {
  std::printf("%-12s %8s %8s %8s %12s %8s %10s\n", "way", "steps", "frames", "bytes", "bytes/step",
              "goal", "all/step");
  for (const ByteWay& way : kWays) {
    SCOPED_TRACE(way.name);
    const auto& [sent, all_bytes] = carried_for(way);
    const std::int64_t bytes = sent.bytes + sent.delimiters;
    const double cost = static_cast<double>(bytes) / static_cast<double>(way.steps);
    std::printf("%-12s %8lld %8lld %8lld %12.4f", way.name, static_cast<long long>(way.steps),
                static_cast<long long>(sent.frames), static_cast<long long>(bytes), cost);
    const double all = static_cast<double>(all_bytes) / static_cast<double>(way.steps);
    if (way.goal == 0) {
      std::printf(" %8s %10.4f\n", "", all);
      continue;
    }
    std::printf(" %8.2f %10.4f\n", way.goal, all);
    EXPECT_LE(cost, way.goal);
    if (way.most_frames != 0) {
      EXPECT_LE(sent.frames, way.most_frames);
    }
  }
}

}  // namespace
}  // namespace bushd::test
