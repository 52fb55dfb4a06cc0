// Programs as they are carried out: every edge, by a plain walk over their frames.
#include <random>

#include "firmware/programs.h"

namespace bushd::test {
namespace {

using ProgramRun = Programs;
BUSHD_IN_BOTH_FORMATS(ProgramRun);

ProgramFrame move_by(std::uint8_t motor, std::int32_t steps) {
  return {.kind = Kind::kMoveBy, .motors = {motor}, .to = {{steps}}};
}

TEST_P(ProgramRun, EveryEdgeOfAScanIsWhereItsFramesPutIt) {
  const ProgramText scan{.frames = {{.kind = Kind::kMoveTo, .motors = {0, 2}, .to = {{50, -300}}},
                                    {.kind = Kind::kRepeat, .count = 3},
                                    {.kind = Kind::kLineTo,
                                     .motors = {0, 1, 3},
                                     .to = {{100, 40, 7}, {100, 0, -90}, {0, 0, 0}},
                                     .shortest_delay = 30},
                                    {.kind = Kind::kLineBy,
                                     .motors = {0, 1, 3},
                                     .to = {{30, -30, 0}, {-30, 12, -40}, {0, 18, 40}},
                                     .elementary = true},
                                    {.kind = Kind::kPulse, .us = 5'000},
                                    wait_us(20'000),
                                    {.kind = Kind::kMoveBy, .motors = {1, 2}, .to = {{-9, 200}}},
                                    {.kind = Kind::kNext},
                                    kProgramEnd}};
  ASSERT_EQ(load(scan), BUSHD_OK);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_LOADED);
  const std::uint32_t first = rig.first_open() + 5;
  ASSERT_EQ(start(first), BUSHD_OK);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_WAITS);
  ProgramWalk walk(law, Rig::kTickNs, rig.options().slots);
  walk.run(scan, first);
  expect_ended(BUSHD_PROGRAM_DONE);
  EXPECT_EQ(made, walk.steps());
  EXPECT_EQ(state().repeats, 3u);
  EXPECT_EQ(state().frame, 8);
  for (std::uint8_t m = 0; m < 4; ++m) EXPECT_EQ(rig.pulses(m), walk.at[m]);
  ASSERT_EQ(rises.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(rises[i], std::pair(walk.pulses()[i].first, 0));
    // 5 ms are 1 tick and 244 slots.
    EXPECT_EQ(falls[i], std::pair(walk.pulses()[i].first + 1, 244));
  }
}

ProgramFrame any_frame(std::mt19937& random, bool line) {
  ProgramFrame frame{.kind = line ? Kind::kLineTo : Kind::kMoveTo};
  if (random() % 2 == 0) frame.kind = line ? Kind::kLineBy : Kind::kMoveBy;
  const unsigned mask = 1 + static_cast<unsigned>(random()) % 15;
  for (std::uint8_t m = 0; m < 4; ++m) {
    if ((mask >> m & 1u) != 0) frame.motors.push_back(m);
  }
  frame.elementary = line && random() % 2 == 0;
  frame.to.resize(line ? 1 + random() % 4 : 1);
  for (auto& point : frame.to) {
    for (std::size_t i = 0; i < frame.motors.size(); ++i) {
      const auto size = random() % 3 == 0 ? 3u : 150u;
      point.push_back(static_cast<std::int32_t>(random() % (2 * size + 1)) -
                      static_cast<std::int32_t>(size));
    }
  }
  if (random() % 3 == 0) frame.shortest_delay = static_cast<std::uint16_t>(random() % 80);
  return frame;
}

// No more than a few hundred moves in all.
void append_frames(std::mt19937& random, int depth, std::vector<ProgramFrame>& frames) {
  for (unsigned left = 1 + static_cast<unsigned>(random()) % 4; left > 0; --left) {
    switch (random() % (depth < 4 ? 6 : 5)) {
      case 0:
      case 1:
        frames.push_back(any_frame(random, false));
        break;
      case 2:
        frames.push_back(any_frame(random, true));
        break;
      case 3:
        frames.push_back(wait_us(1 + static_cast<std::uint32_t>(random() % 30'000)));
        break;
      case 4:
        frames.push_back({.kind = Kind::kPulse, .us = 1});
        frames.push_back(wait_us(10'000));  // so the walk need not know when the output is free
        break;
      default:
        frames.push_back(
            {.kind = Kind::kRepeat, .count = static_cast<std::uint16_t>(1 + random() % 3)});
        append_frames(random, depth + 1, frames);
        frames.push_back({.kind = Kind::kNext});
    }
  }
}

TEST_P(ProgramRun, EveryEdgeOfAnyProgramIsWhereItsFramesPutIt) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    ProgramText text;
    append_frames(random, 0, text.frames);
    text.frames.push_back(kProgramEnd);
    ProgramWalk walk(law, Rig::kTickNs, rig.options().slots);
    for (std::uint8_t m = 0; m < 4; ++m) walk.at[m] = rig.poll().motor[m].position_steps;
    if (bytes_of(text).size() > rig.options().program_bytes) continue;
    made.clear();
    ASSERT_EQ(load(text), BUSHD_OK);
    const std::uint32_t first = rig.first_open() + static_cast<std::uint32_t>(random() % 3);
    ASSERT_EQ(start(first), BUSHD_OK);
    walk.run(text, first);
    expect_ended(BUSHD_PROGRAM_DONE);
    ASSERT_EQ(made, walk.steps());
    for (std::uint8_t m = 0; m < 4; ++m) {
      ASSERT_EQ(rig.poll().motor[m].position_steps, walk.at[m]);
    }
    ASSERT_EQ(rig.poll().faults, 0);
  }
}

TEST_P(ProgramRun, FramesThatTakeNoTimeAreSpreadOverTicks) {
  const ProgramText text{.frames = {{.kind = Kind::kRepeat, .count = 100},
                                    {.kind = Kind::kMoveBy, .motors = {0}, .to = {{0}}},
                                    {.kind = Kind::kNext},
                                    move_by(0, 1),
                                    kProgramEnd}};
  ASSERT_EQ(load(text), BUSHD_OK);
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(start(first), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_DONE);
  ASSERT_EQ(made.size(), 1u);
  ProgramWalk walk(law, Rig::kTickNs, rig.options().slots);
  walk.run(text, first);
  EXPECT_EQ(made, walk.steps());
  EXPECT_GE(made.begin()->tick, first + 200 / 8);
}

TEST_P(ProgramRun, WaitsForAnInputOfAMotorOrOfTheMcu) {
  const ProgramText text{
      .frames = {{.kind = Kind::kWaitInput, .input = 2},
                 move_by(0, 3),
                 {.kind = Kind::kWaitInput, .us = 10'000'000, .input = 19, .level = false},
                 move_by(0, 4),
                 kProgramEnd}};
  rig.pins({0, BUSHD_INPUT_TRIGGER});
  begin(text);
  pass(50);
  EXPECT_EQ(state().frame, 0);
  EXPECT_TRUE(made.empty());
  rig.pins({4, BUSHD_INPUT_TRIGGER});
  pass(100);
  EXPECT_EQ(rig.pulses(0), 3);
  EXPECT_EQ(state().frame, 2);
  EXPECT_EQ(rig.poll().autonomous, 0xF) << "at rest as well";
  rig.pins({4, 0});
  expect_ended(BUSHD_PROGRAM_DONE);
  EXPECT_EQ(rig.pulses(0), 7);
}

TEST_P(ProgramRun, AnInputThatDoesNotComeEndsIt) {
  begin({.frames = {
             {.kind = Kind::kWaitInput, .us = 25'600, .input = 1}, move_by(0, 3), kProgramEnd}});
  const std::uint32_t from = rig.tick();
  const bushd_program_state ended = pass_until_ended();
  EXPECT_EQ(ended.reason, BUSHD_PROGRAM_NO_INPUT);
  EXPECT_EQ(ended.frame, 0);
  EXPECT_LE(ended.tick - from, 2u + 10u + 5u);
  EXPECT_TRUE(made.empty());
}

constexpr std::int32_t kLongestMove = 600;

ProgramFrame move_until(std::int32_t steps, std::uint32_t after, std::uint16_t shortest_delay = 0) {
  return {.kind = Kind::kMoveUntil,
          .motors = {0},
          .to = {{steps}},
          .shortest_delay = shortest_delay,
          .input = 2,
          .after = after};
}

// So many steps a run of the longest move makes, if after `done` of them an input asks for `after`
// more; by the rule of bushd_run_retarget and bushd_run_ramp_down: the running step, and the fewest
// that its delay needs.
std::int32_t steps_in_all(const Law& law, std::size_t done, std::uint32_t after,
                          std::uint16_t shortest_delay) {
  const auto run = Reference::move(law, kLongestMove, shortest_delay);
  if (done >= run.steps()) return kLongestMove;
  std::size_t to_stop = 0;
  while (law.decel_at(to_stop) * law.unit_ns * 256 > run.step(done).delay) ++to_stop;
  const std::size_t in_all = done + std::max<std::size_t>(after, to_stop + 1);
  return static_cast<std::int32_t>(std::min<std::size_t>(in_all, kLongestMove));
}

// Whenever the input comes, the edges are those of a move that was so long from the beginning, and
// the next frame follows it.
TEST_P(ProgramRun, AnInputEndsAMoveSoManyStepsAfterIt) {
  int ended = 0;
  for (const std::uint32_t after : {0u, 1u, 2u, 9u, 40u, 150u, 599u}) {
    for (const int ticks : {0, 1, 2, 3, 7, 20, 60, 110}) {
      for (const std::uint16_t shortest_delay : {std::uint16_t{0}, std::uint16_t{60}}) {
        for (const int sign : {1, -1}) {
          SCOPED_TRACE(testing::Message() << after << " after tick " << ticks << ", shortest "
                                          << shortest_delay << ", " << sign);
          rig.pins({0, 0});
          ProgramWalk walk(law, Rig::kTickNs, rig.options().slots);
          for (std::uint8_t m = 0; m < 4; ++m) walk.at[m] = rig.poll().motor[m].position_steps;
          made.clear();
          ASSERT_EQ(load({.frames = {move_until(sign * kLongestMove, after, shortest_delay),
                                     move_by(0, -3 * sign), kProgramEnd}}),
                    BUSHD_OK);
          const std::uint32_t first = rig.first_open();
          ASSERT_EQ(start(first), BUSHD_OK);
          while (rig.tick() != first + static_cast<std::uint32_t>(ticks)) pass();
          if (rig.mcu().config.program->moving == 0) {
            pass_until_ended();
            continue;  // it had come to its end
          }
          rig.pins({4, 0});
          // It is looked at before the tick after the next one is prepared.
          pass(2);
          const std::size_t done = made.size();
          const std::int32_t steps = steps_in_all(law, done, after, shortest_delay);
          walk.run({.frames = {{.kind = Kind::kMoveBy,
                                .motors = {0},
                                .to = {{sign * steps}},
                                .shortest_delay = shortest_delay},
                               move_by(0, -3 * sign),
                               kProgramEnd}},
                   first);
          expect_ended(BUSHD_PROGRAM_DONE);
          ASSERT_EQ(made, walk.steps());
          ended += steps < kLongestMove ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(ended, 80);
}

// Pins may change while the run is made: after the look at all inputs and that of the frame which
// begins.
TEST_P(ProgramRun, AnInputThatComesWhileItsMoveIsMadeEndsIt) {
  ASSERT_EQ(load({.frames = {move_until(kLongestMove, 0), kProgramEnd}}), BUSHD_OK);
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(start(first), BUSHD_OK);
  int looks = 0;
  rig.sense = [&] {
    const bool is_made = rig.tick() == first - 1;
    looks += is_made ? 1 : 0;
    const bool active = is_made ? looks > 2 : rig.tick() == first;
    return bushd_inputs{static_cast<std::uint16_t>(active ? 4 : 0), 0};
  };
  expect_ended(BUSHD_PROGRAM_DONE);
  EXPECT_GE(looks, 2);
  EXPECT_LT(rig.pulses(0), 20);
}

TEST_P(ProgramRun, AnInputThatIsThereLetsNoMoveBegin) {
  rig.pins({4, 0});
  begin({.frames = {move_until(50, 9), move_by(0, 3), kProgramEnd}});
  expect_ended(BUSHD_PROGRAM_DONE);
  EXPECT_EQ(rig.pulses(0), 3);
}

TEST_P(ProgramRun, AMoveThatNoInputEndsEndsTheProgram) {
  begin({.frames = {move_until(-50, 9), move_by(0, 3), kProgramEnd}});
  expect_ended(BUSHD_PROGRAM_NO_INPUT);
  EXPECT_EQ(rig.pulses(0), -50);
}

TEST_P(ProgramRun, AMoveUntilAnInputIsNotPaused) {
  begin({.frames = {move_until(500, 0), move_by(0, 3), kProgramEnd}});
  pass(20);
  EXPECT_EQ(control(BUSHD_PROGRAM_PAUSE), BUSHD_E_STATE);
  EXPECT_EQ(control(BUSHD_PROGRAM_STOP, 0, BUSHD_STOP_RAMP), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_STOPPED);
}

TEST_P(ProgramRun, PausesAndGoesOnToTheSameTargets) {
  const ProgramText text{
      .frames = {{.kind = Kind::kLineTo, .motors = {0, 1, 2}, .to = {{300, -200, 31}, {0, 100, 0}}},
                 {.kind = Kind::kMoveTo, .motors = {1, 3}, .to = {{7, -400}}},
                 kProgramEnd}};
  for (int after = 1; after < 400; after += 37) {
    SCOPED_TRACE(after);
    begin(text);
    pass(after);
    const int running = state().stage;
    const bushd_status paused = control(BUSHD_PROGRAM_PAUSE);
    ASSERT_EQ(paused, running == BUSHD_PROGRAM_RUNS ? BUSHD_OK : BUSHD_E_STATE);
    if (paused == BUSHD_OK) {
      while (state().stage == BUSHD_PROGRAM_PAUSES) pass();
      ASSERT_EQ(state().stage, BUSHD_PROGRAM_PAUSED);
      const std::size_t before = made.size();
      pass(20);
      EXPECT_EQ(made.size(), before);
      EXPECT_EQ(state().stage, BUSHD_PROGRAM_PAUSED);
      ASSERT_EQ(control(BUSHD_PROGRAM_RESUME), BUSHD_OK);
    }
    expect_ended(BUSHD_PROGRAM_DONE);
    EXPECT_EQ(rig.pulses(0), 0);
    EXPECT_EQ(rig.pulses(1), 7);
    EXPECT_EQ(rig.pulses(2), 0);
    EXPECT_EQ(rig.pulses(3), -400);
  }
}

TEST_P(ProgramRun, APauseStopsTheClockOfAWait) {
  begin({.frames = {wait_us(256'000), move_by(0, 1), kProgramEnd}});
  pass(40);
  ASSERT_EQ(control(BUSHD_PROGRAM_PAUSE), BUSHD_OK);
  pass(500);
  EXPECT_TRUE(made.empty());
  ASSERT_EQ(control(BUSHD_PROGRAM_RESUME), BUSHD_OK);
  const std::uint32_t resumed = rig.tick();
  expect_ended(BUSHD_PROGRAM_DONE);
  ASSERT_EQ(made.size(), 1u);
  // About 40 of 100 ticks were over.
  EXPECT_GE(made.begin()->tick, resumed + 55);
  EXPECT_LE(made.begin()->tick, resumed + 70);
}

TEST_P(ProgramRun, StopsOnRequestByRampOrAtOnce) {
  for (const std::uint32_t mode : {BUSHD_STOP_RAMP, BUSHD_STOP_IMMEDIATE}) {
    SCOPED_TRACE(mode);
    const std::int64_t from = rig.pulses(0);
    begin(
        {.frames = {{.kind = Kind::kLineBy, .motors = {0, 1}, .to = {{2000, 1000}}}, kProgramEnd}});
    pass(150);
    const std::int64_t moved = rig.pulses(0) - from;
    ASSERT_GT(moved, 10);
    ASSERT_EQ(control(BUSHD_PROGRAM_STOP, 0, mode), BUSHD_OK);
    const std::uint32_t asked = rig.tick();
    expect_ended(BUSHD_PROGRAM_STOPPED);
    EXPECT_LT(rig.pulses(0) - from, 2000);
    ASSERT_FALSE(made.empty());
    if (mode == BUSHD_STOP_IMMEDIATE) {
      EXPECT_LE(made.rbegin()->tick, asked + 1);
    } else {
      EXPECT_GT(made.rbegin()->tick, asked + 1) << "it ramps down";
    }
    EXPECT_EQ(control(BUSHD_PROGRAM_STOP), BUSHD_OK) << "nothing to stop";
  }
}

}  // namespace
}  // namespace bushd::test
