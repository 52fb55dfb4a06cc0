// The judge is judged: what tables allow passes, at the tolerances it claims, and jumps do not.
#include "sim/pace.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/run.h"
#include "engine/slots.h"

namespace bushd::sim::pace_test {
namespace {

constexpr TimeNs kTickNs = 2'560'000;
constexpr std::uint16_t kSlots = 256;

struct Law {
  std::vector<std::uint16_t> accel;
  bushd_table table{};
};

// 100 to 2500 steps/s in 238 steps, constant acceleration, in units of 40 us.
Law constant_acceleration() {
  Law law;
  for (int i = 0; i < 238; ++i) {
    const double v = std::sqrt(100.0 * 100.0 + 2 * 13192.0 * i);
    law.accel.push_back(static_cast<std::uint16_t>(std::max(10.0, 25'000.0 / v)));
  }
  law.table.accel = {law.accel.data(), 238, nullptr, nullptr, 0};
  law.table.decel = law.table.accel;
  law.table.cruise = 10;
  law.table.time_unit_ns = 40'000;
  return law;
}

class PaceTest : public testing::TestWithParam<bushd_format> {
 protected:
  PaceTest() : rules(law.table, kTickNs, kSlots, GetParam()), pace(rules) {}

  // The displacements of `ticks` ticks of a run, in 1/256 step.
  std::vector<std::int16_t> expand(bushd_run& run, std::size_t ticks) {
    std::vector<std::int16_t> out(ticks);
    if (GetParam() == BUSHD_FORMAT_FINE) {
      bushd_run_expand_fine(&run, kTickNs, ticks, out.data(), 1);
      return out;
    }
    std::vector<std::uint8_t> bytes(ticks);
    bushd_run_expand_coarse(&run, kTickNs, ticks, bytes.data(), 1);
    for (std::size_t i = 0; i < ticks; ++i) out[i] = bushd_coarse_to_fine(bytes[i]);
    return out;
  }
  std::vector<std::int16_t> move(std::uint32_t steps, int direction = 1) {
    bushd_run run;
    bushd_run_start(&run, &law.table, steps, direction, 0);
    std::vector<std::int16_t> all;
    while (!bushd_run_done(&run)) all.push_back(expand(run, 1)[0]);
    return all;
  }

  // Makes the steps of these ticks; returns the first jump.
  Jump make(const std::vector<std::int16_t>& displacements) {
    Jump first = Jump::kNone;
    const std::int16_t crossing =
        GetParam() == BUSHD_FORMAT_FINE ? BUSHD_CROSSING_FINE : BUSHD_CROSSING_COARSE;
    for (const std::int16_t d : displacements) {
      std::array<std::uint16_t, kSlots> masks{};
      bushd_slots_add(masks.data(), kSlots, 1, d, &remainder, crossing);
      for (std::size_t s = 0; s < kSlots; ++s) {
        if (masks[s] == 0) continue;
        const Jump jump = pace.step(now + static_cast<TimeNs>(s) * kTickNs / kSlots, d > 0);
        if (first == Jump::kNone) first = jump;
      }
      now += kTickNs;
    }
    return first;
  }
  Jump rest() {
    now += 100 * kTickNs;
    return pace.silent(now);
  }

  Law law = constant_acceleration();
  PaceRules rules;
  Pace pace;
  TimeNs now = 0;
  std::int16_t remainder = 0;
};
INSTANTIATE_TEST_SUITE_P(Formats, PaceTest, testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         [](const auto& p) {
                           return p.param == BUSHD_FORMAT_FINE ? "Fine" : "Coarse";
                         });

TEST_P(PaceTest, WholeMovesOfAnyLengthPass) {
  for (std::uint32_t steps = 1; steps < 1200; ++steps) {
    ASSERT_EQ(make(move(steps, steps % 2 == 0 ? 1 : -1)), Jump::kNone) << steps;
    ASSERT_EQ(rest(), Jump::kNone) << steps;
  }
}

TEST_P(PaceTest, StopsAtAnyTickPass) {
  for (std::size_t at = 1; at < 200; ++at) {
    bushd_run run;
    bushd_run_start(&run, &law.table, 3000, 1, 0);
    ASSERT_EQ(make(expand(run, at)), Jump::kNone) << at;
    bushd_run_ramp_down(&run);
    ASSERT_EQ(make(expand(run, 200)), Jump::kNone) << at;
    ASSERT_EQ(rest(), Jump::kNone) << at;
  }
}

TEST_P(PaceTest, StartInTheMiddleOfARampIsAJump) {
  for (const std::size_t skipped : {10, 20, 40, 60}) {
    std::vector<std::int16_t> ticks = move(3000);
    ticks.erase(ticks.begin(), ticks.begin() + static_cast<std::ptrdiff_t>(skipped));
    remainder = 0;
    EXPECT_EQ(make(ticks), Jump::kTooFast) << skipped;
    rest();
  }
}

TEST_P(PaceTest, DeadStopIsAJump) {
  for (const std::size_t kept : {30, 60, 100, 200}) {
    std::vector<std::int16_t> ticks = move(3000);
    ticks.resize(kept);
    remainder = 0;
    EXPECT_EQ(make(ticks), Jump::kNone);
    EXPECT_EQ(rest(), Jump::kStoppedDead) << kept;
  }
}

// Steps of the coarse format may be off by a tick either way: there it takes more than two.
TEST_P(PaceTest, HoleInTheMiddleIsAJump) {
  const bool fine = GetParam() == BUSHD_FORMAT_FINE;
  for (const std::size_t at : {60, 90, 120, 200}) {
    for (const int hole : {fine ? 1 : 3, 8}) {
      std::vector<std::int16_t> ticks = move(3000);
      ticks.insert(ticks.begin() + static_cast<std::ptrdiff_t>(at), static_cast<std::size_t>(hole),
                   0);
      remainder = 0;
      EXPECT_NE(make(ticks), Jump::kNone) << at << ", " << hole << " ticks";
      rest();
    }
  }
}

TEST_P(PaceTest, TurnAtSpeedIsAJump) {
  std::vector<std::int16_t> ticks = move(3000);
  for (std::size_t i = 100; i < ticks.size(); ++i) ticks[i] = static_cast<std::int16_t>(-ticks[i]);
  EXPECT_NE(make(ticks), Jump::kNone);
}

// On a path a motor turns round without a rest, where its table has led it to one.
TEST_P(PaceTest, TurnOnAPathTakesTheWholeRampDown) {
  constexpr std::size_t kSteps = 40;
  const auto ramps = [&](bool positive, std::size_t steps) {
    Jump first = Jump::kNone;
    for (std::size_t j = 1; j <= steps; ++j) {
      const std::uint16_t code = std::max(law.accel[j - 1], law.accel[kSteps - j]);
      now += TimeNs{code} * law.table.time_unit_ns;
      const Jump jump = pace.step(now, positive);
      if (first == Jump::kNone) first = jump;
    }
    return first;
  };
  pace.begin_on_line(now);
  EXPECT_EQ(ramps(true, kSteps), Jump::kNone);
  const TimeNs begun_ns = pace.first_ns();
  now -= rules.delay_ns(0) / 2;  // half a delay after the last step
  EXPECT_EQ(ramps(false, kSteps), Jump::kNone);
  EXPECT_EQ(pace.first_ns(), begun_ns) << "that was no rest";
  EXPECT_EQ(pace.rest_on_line(now, true), Jump::kNone);
  now += 100 * kTickNs;
  pace.begin_on_line(now);
  EXPECT_EQ(ramps(true, kSteps - 3), Jump::kNone);
  EXPECT_EQ(ramps(false, kSteps), Jump::kStoppedDead);
}

// A short rest is as long as the first delay of a motion that goes on.
TEST_P(PaceTest, AMotionThatIsSaidToBeginHasItsOwnFirstStep) {
  EXPECT_EQ(pace.step(now, true), Jump::kNone);
  const TimeNs before_ns = now;
  for (const bool said : {false, true}) {
    now += rules.delay_ns(0);
    if (said) pace.begin();
    EXPECT_EQ(pace.step(now, true), Jump::kNone);
    EXPECT_EQ(pace.first_ns(), said ? now : before_ns);
  }
  pace.begin_on_line(now);
  pace.begin();
  now += rules.delay_ns(0);
  EXPECT_EQ(pace.step(now, false), Jump::kNone);
  EXPECT_EQ(pace.first_ns(), now) << "on a line, in the other direction";
}

// A master that was killed has not told that its line is over; another one starts from rest.
TEST_P(PaceTest, AMotionBeginsWhereTheLineBeforeWasForgotten) {
  for (const bool positive : {true, false}) {
    pace.begin_on_line(now);
    EXPECT_EQ(pace.step(now, true), Jump::kNone);
    now += 1000 * kTickNs;
    pace.forget_line();
    pace.begin_on_line(now);
    EXPECT_EQ(pace.step(now, positive), Jump::kNone);
    EXPECT_EQ(pace.first_ns(), now) << "in either direction";
    now += 1000 * kTickNs;
    EXPECT_EQ(pace.rest_on_line(now, true), Jump::kNone);
  }
}

// On a line it may be slower than its table, also when the line is lost with its MCU's link.
TEST_P(PaceTest, OneThatIsLostOnALineMayTakeTheLongestDelay) {
  EXPECT_EQ(pace.step(now, true), Jump::kNone);
  EXPECT_LT(pace.ramp_down_ns(), rules.longest_told_ns());
  pace.begin_on_line(now);
  EXPECT_GE(pace.ramp_down_ns(), rules.longest_told_ns());
  EXPECT_EQ(pace.rest_on_line(now, false), Jump::kNone);
  now += 1000 * kTickNs;
  EXPECT_EQ(pace.step(now, true), Jump::kNone);
  EXPECT_GE(pace.ramp_down_ns(), rules.longest_told_ns());
  pace.forget_line();
  EXPECT_LT(pace.ramp_down_ns(), rules.longest_told_ns());
}

// What is queued speeds up along the line, in fewer steps than its table has after such a delay.
TEST_P(PaceTest, OneThatIsLostOnALineMaySpeedUpAlongIt) {
  constexpr std::size_t kSteps = 60;
  for (const bool lost : {true, false}) {
    pace.begin_on_line(now);
    for (std::size_t k = 0; k < kSteps; ++k) {
      EXPECT_EQ(pace.step(now, true), Jump::kNone);
      now += rules.delay_ns(0);
    }
    if (lost) {
      EXPECT_EQ(pace.rest_on_line(now, false), Jump::kNone);
    } else {
      pace.forget_line();
    }
    Jump first = pace.step(now, true);
    for (std::size_t k = kSteps + 1; k < 2 * kSteps && first == Jump::kNone; ++k) {
      now += rules.delay_ns(k);
      first = pace.step(now, true);
    }
    EXPECT_EQ(first, lost ? Jump::kNone : Jump::kTooFast);
    now += 10'000 * kTickNs;
    pace.silent(now);
    pace.cut();
  }
}

TEST_P(PaceTest, AFifthFasterThanTheTableIsFound) {
  std::vector<std::int16_t> ticks = move(3000);
  for (std::int16_t& d : ticks) d = static_cast<std::int16_t>(d * 6 / 5);
  EXPECT_EQ(make(ticks), Jump::kTooFast);
}

TEST_P(PaceTest, WhatAResetCutOffIsExcused) {
  std::vector<std::int16_t> ticks = move(3000);
  ticks.resize(100);
  EXPECT_EQ(make(ticks), Jump::kNone);
  pace.cut();
  EXPECT_EQ(rest(), Jump::kNone);
  remainder = 0;
  EXPECT_EQ(make(move(500)), Jump::kNone);
}

}  // namespace
}  // namespace bushd::sim::pace_test
