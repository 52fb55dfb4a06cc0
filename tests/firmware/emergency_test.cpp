// EMERGENCY: all stop from the first tick that is not prepared, and every step is counted.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

class Emergency : public Streams {
 protected:
  // Steps from the first open tick on until rest.
  static std::vector<int> after_emergency(Rig& on, bushd_stop_mode mode) {
    const std::size_t open = on.history(0).size() + 2;
    on.emergency(mode);
    EXPECT_EQ(on.poll().state, BUSHD_STATE_FAULT);
    on.pass_until_rest();
    on.pass(3);
    EXPECT_EQ(on.poll().faults, BUSHD_FAULT_EMERGENCY);
    EXPECT_EQ(on.poll().motor[0].position_steps, on.pulses(0));
    return {on.history(0).begin() + static_cast<std::ptrdiff_t>(open), on.history(0).end()};
  }
  static Bytes run_frame(std::uint32_t first, std::uint32_t steps, std::int8_t direction,
                         std::uint8_t motor = 0) {
    return table_run_payload(0, first, {motor, 0, direction, steps, 0});
  }
  // The delay of the step that runs at the end of the first `ticks` of a plan, as the MCU takes it:
  // from the last displacement, or in the coarse format from the steps of the two ticks before and
  // after.
  std::uint16_t delay_of(const Plan& moves, std::size_t ticks) const {
    std::uint64_t time_ns = Rig::kTickNs;
    std::uint64_t share = 0;
    if (format == BUSHD_FORMAT_FINE) {
      std::uint64_t still = 1;
      while (magnitude(moves, ticks - still) == 0) ++still;
      time_ns *= still;
      share = magnitude(moves, ticks - still);
    } else {
      time_ns =
          time_ns * 4 / (steps_in(moves, ticks - std::min<std::size_t>(ticks, 2), ticks + 2) + 1);
      share = 256;
    }
    const std::uint64_t d = share * law.unit_ns;
    return static_cast<std::uint16_t>(
        std::max<std::uint64_t>((256 * time_ns + d - 1) / d, law.cruise));
  }
  std::uint64_t steps_in(const Plan& moves, std::size_t from, std::size_t until) const {
    std::uint64_t steps = 0;
    for (; from < std::min(until, moves.ticks()); ++from) steps += magnitude(moves, from) / 256;
    return steps;
  }
  std::uint64_t magnitude(const Plan& moves, std::size_t tick) const {
    const int d = moves.displacement[tick];
    return static_cast<std::uint64_t>(format == BUSHD_FORMAT_FINE ? std::abs(d) : (d & 0x7F) * 256);
  }
};
BUSHD_IN_BOTH_FORMATS(Emergency);

// Speeds that the coarse format cannot tell: below a step in four ticks.
class FineEmergency : public Emergency {};
INSTANTIATE_TEST_SUITE_P(Formats, FineEmergency, testing::Values(BUSHD_FORMAT_FINE), format_name);

TEST_P(Emergency, RampsATableRunDownFromEveryTick) {
  const std::size_t ticks = steps_by_tick(Reference::move(law, 150), Rig::kTickNs).size();
  for (std::size_t n = 0; n <= ticks; n += 3) {
    ReadyRig fresh(law, format);
    const std::uint32_t first = fresh.first_open();
    ASSERT_EQ(fresh.take(BUSHD_MSG_TABLE_RUN, run_frame(first, 150, -1)), BUSHD_OK);
    fresh.pass(static_cast<int>(n));
    const std::int64_t open_ns = static_cast<std::int64_t>(n) * Rig::kTickNs;
    auto reference = Reference::move(law, 150);
    std::vector<int> expected;
    if (n > 0) {
      reference.ramp_down_at(static_cast<std::uint64_t>(open_ns));
      expected = steps_by_tick(reference, Rig::kTickNs);
      expected.erase(expected.begin(),
                     expected.begin() + static_cast<std::ptrdiff_t>(std::min(n, expected.size())));
    }
    SCOPED_TRACE(n);
    expect_steps(after_emergency(fresh, BUSHD_STOP_RAMP), expected, -1);
  }
}

TEST_P(Emergency, RampsAStreamDownFromEveryTick) {
  const Plan moves = plan(200);
  for (std::size_t n = 0; n <= moves.ticks(); n += 2) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    const std::uint32_t start = fresh.first_open();
    ASSERT_NO_FATAL_FAILURE(fresh.take_plan(moves, start, moves.ticks(), 40));
    fresh.pass(static_cast<int>(n));
    std::vector<int> expected;
    bool begun = false;
    for (std::size_t i = 0; i < n; ++i) begun |= magnitude(moves, i) != 0;
    if (begun && n < moves.ticks()) {
      const bool fine = format == BUSHD_FORMAT_FINE;
      expected = steps_by_tick(Reference::ramp_down(law, delay_of(moves, n),
                                                    fine ? moves.fraction[n - 1] : std::uint8_t{0}),
                               Rig::kTickNs);
    }
    SCOPED_TRACE(n);
    expect_steps(after_emergency(fresh, BUSHD_STOP_RAMP), expected, 1);
  }
}

// A step in 800 ticks and more: most ticks of the stream are without a displacement. By its table
// two of these make one step more, D(0), and the others none.
TEST_P(FineEmergency, OfAMotorThatIsSlowMakesNoStepMoreThanItsTable) {
  const Law slow{{2000, 400, 150, 40}, {2000, 400, 150, 40}, 40, 1'000'000};
  constexpr std::uint32_t kShortNs = 250'000;
  for (const std::uint16_t delay : std::array<std::uint16_t, 4>{200, 460, 700, 2000}) {
    Law even = slow;
    even.accel = even.decel = {delay};
    even.cruise = delay;
    const Plan moves = plan_move(even, 4, kShortNs, format);
    for (const double at : {0.3, 1.1, 1.6, 1.9, 2.7}) {
      ReadyRig fresh(slow, format, {.queue_ticks = 16384});
      ASSERT_EQ(fresh.configure(format, kShortNs), BUSHD_OK);
      fresh.sync_to(1000);
      ASSERT_EQ(fresh.assign(0, 0), BUSHD_OK);
      const std::uint32_t start = fresh.first_open();
      ASSERT_NO_FATAL_FAILURE(fresh.take_plan(moves, start, 16000, 100));
      fresh.pass(static_cast<int>(at * delay * 1e6 / kShortNs) - 1);
      fresh.emergency(BUSHD_STOP_RAMP);
      fresh.pass(1'200'000'000 / kShortNs);
      SCOPED_TRACE(std::to_string(delay) + " ms, stopped after " + std::to_string(at) + " steps");
      EXPECT_EQ(fresh.poll().moving, 0);
      const double left_ms = (std::ceil(at) - at) * delay;
      const int steps = left_ms > 500 ? 0 : delay < 400 ? 2 : 1;
      EXPECT_EQ(fresh.pulses(0), static_cast<std::int64_t>(at) + steps);
      EXPECT_EQ(fresh.poll().motor[0].position_steps, fresh.pulses(0));
    }
  }
}

// Tick numbers of starts have 16 bits: 2^16 ticks later the same ones come again.
TEST_P(Emergency, RampsAStreamDownThatBeganLongAgo) {
  const auto steps_after = [&](std::uint32_t ticks) {
    ReadyRig on(law, format);
    const std::uint32_t first = on.first_open() + 20;
    std::uint32_t end = first;
    for (std::uint8_t flags = kStart; on.first_open() != first + ticks; on.pass()) {
      while (end - on.tick() < 60) {
        Ticks more = ones(flags, end, 30);
        flags = 0;
        EXPECT_EQ(on.take(more), BUSHD_OK);
        end += 30;
      }
    }
    return after_emergency(on, BUSHD_STOP_RAMP);
  };
  const std::vector<int> expected = steps_after(100);
  EXPECT_GT(std::accumulate(expected.begin(), expected.end(), 0), 1);
  for (const std::uint32_t before : {25u, 10u, 1u, 0u}) {
    EXPECT_EQ(steps_after(65536 - before), expected) << before;
  }
}

// What was replaced knew of a rest where the motor moves now.
TEST_P(Emergency, RampsAStreamDownThatWasPutInPlaceOfARest) {
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, first, 20, 0)), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(kStart, first + 40, 10, 0)), BUSHD_OK);
  Ticks moves = ones(kReplace, first + 10, 40);
  moves.epoch = static_cast<std::uint8_t>(moves.epoch + 1);
  moves.displacements[15] = 0;
  ASSERT_EQ(rig.take(moves), BUSHD_OK);
  while (rig.first_open() != first + 26) rig.pass();
  const std::vector<int> after = after_emergency(rig, BUSHD_STOP_RAMP);
  EXPECT_GT(std::accumulate(after.begin(), after.end(), 0), 0);
}

// Its last step is made, and its queue goes on, since frames are of some length or another motor's.
TEST_P(Emergency, MotorThatStandsBeforeItsQueueEndsMakesNoStep) {
  Plan moves = plan(5);
  const std::size_t ticks = moves.ticks();
  moves.displacement.resize(ticks + 20, format == BUSHD_FORMAT_FINE ? 0 : 0x80);
  moves.delay.resize(ticks + 20, 0);
  for (std::size_t n = ticks; n < ticks + 20; n += 3) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    ASSERT_EQ(fresh.take(fresh.part(moves, fresh.first_open(), 0, ticks + 20)), BUSHD_OK);
    fresh.pass(static_cast<int>(n));
    SCOPED_TRACE(n);
    expect_steps(after_emergency(fresh, BUSHD_STOP_RAMP), {}, 1);
    EXPECT_EQ(fresh.pulses(0), 5);
  }
}

TEST_P(Emergency, CutsWithoutAnotherStep) {
  const Plan moves = plan(200);
  for (const int n : {0, 3, 30, 100}) {
    for (const bool run : {false, true}) {
      ReadyRig fresh(law, format, {.queue_ticks = 256});
      const std::uint32_t start = fresh.first_open();
      if (run) {
        ASSERT_EQ(fresh.take(BUSHD_MSG_TABLE_RUN, run_frame(start, 200, 1)), BUSHD_OK);
      } else {
        ASSERT_NO_FATAL_FAILURE(fresh.take_plan(moves, start, moves.ticks(), 40));
      }
      fresh.pass(n);
      expect_steps(after_emergency(fresh, BUSHD_STOP_IMMEDIATE), {}, 1);
      // And it moves again from there, by whole steps.
      ASSERT_EQ(fresh.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
      const std::int64_t stands = fresh.pulses(0);
      fresh.run_plan(plan(-7), 0);
      EXPECT_EQ(fresh.pulses(0), stands - 7);
    }
  }
}

TEST_P(Emergency, CutsARampDownShortToo) {
  ASSERT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(rig.first_open(), 500, 1)), BUSHD_OK);
  rig.pass(100);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass(4);
  expect_steps(after_emergency(rig, BUSHD_STOP_IMMEDIATE), {}, 1);
}

TEST_P(Emergency, RepeatedFramesChangeNothing) {
  const Plan moves = plan(200);
  std::vector<std::vector<int>> seen;
  for (const int repeats : {0, 5}) {
    ReadyRig fresh(law, format);
    const std::uint32_t start = fresh.first_open();
    ASSERT_NO_FATAL_FAILURE(fresh.take_plan(moves, start, 80, 40));
    ASSERT_EQ(fresh.take(BUSHD_MSG_TABLE_RUN, run_frame(start, 200, -1, 1)), BUSHD_OK);
    fresh.pass(40);
    fresh.emergency(BUSHD_STOP_RAMP);
    for (int i = 0; i < repeats; ++i) {
      fresh.pass();
      fresh.emergency(BUSHD_STOP_RAMP, i % 2 ? BUSHD_ADDRESS_BROADCAST : fresh.options().address);
    }
    fresh.pass(150 - repeats);
    EXPECT_EQ(fresh.poll().moving, 0);
    seen.push_back(fresh.history(0));
    seen.push_back(fresh.history(1));
  }
  EXPECT_EQ(seen[0], seen[2]);
  EXPECT_EQ(seen[1], seen[3]);
}

TEST_P(Emergency, WaitingStartsAreEmptied) {
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start + 20, 10, 64)), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(0, start + 40, 10, 64)), BUSHD_OK);
  ASSERT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(start + 20, 200, -1, 1)), BUSHD_OK);
  rig.pass(5);
  expect_steps(after_emergency(rig, BUSHD_STOP_RAMP), {}, 1);
  EXPECT_EQ(rig.poll().out_of_order, 0);
  EXPECT_EQ(rig.pulses(1), 0);
}

// Between two moves that are both queued a motor is at rest, though it has moved just before.
TEST_P(Emergency, MotorThatRestsBetweenTwoQueuedMovesStays) {
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 5, 0)), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(kStart, start + 20, 5, 0)), BUSHD_OK);
  rig.pass(5);
  expect_steps(after_emergency(rig, BUSHD_STOP_RAMP), {}, 1);
  EXPECT_EQ(rig.pulses(0), 5);
}

TEST_P(Emergency, IsLatchedAtRestTooAndClearedByControl) {
  rig.emergency(BUSHD_STOP_RAMP);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_EMERGENCY);
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 5, 0)), BUSHD_E_STATE);
  EXPECT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(rig.first_open(), 5, 1)), BUSHD_E_STATE);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 5, 0)), BUSHD_OK);
  rig.pass(2);
  rig.emergency(BUSHD_STOP_RAMP);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_E_STATE) << "it still moves";
  rig.pass_until_rest();
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
}

}  // namespace
}  // namespace bushd::test
