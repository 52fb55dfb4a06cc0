// Which TICKS frames an MCU takes, and that those it takes are made pulse by pulse.
#include "firmware/streams.h"

#include <algorithm>

namespace bushd::test {
namespace {

BUSHD_IN_BOTH_FORMATS(Streams);

TEST_P(Streams, MovesMakeTheStepsOfTheirTicks) {
  std::int64_t position = 0;
  for (const std::int64_t steps : {1, -1, 2, -3, 10, 34, 35, 36, -90, 150, -210}) {
    rig.forget_history();
    const Plan moves = plan(steps);
    rig.run_plan(moves, 1);
    position += steps;
    expect_position(1, position);
    // Tick by tick, not only in sum. run_plan starts at the first tick that is open: two ticks on.
    for (std::size_t i = 0; i < moves.ticks(); ++i) {
      const std::int64_t made = moves.made[i] - (i == 0 ? 0 : moves.made[i - 1]);
      ASSERT_EQ(rig.history(1).at(i + 2), moves.direction * made) << steps << " tick " << i;
    }
  }
  EXPECT_EQ(rig.steps_with_dir(), 0) << "DIR is set before the first step of its tick";
  EXPECT_EQ(rig.pulses(0) + rig.pulses(2) + rig.pulses(3), 0);
}

TEST_P(Streams, StartMayBeAheadAndTheTicksBetweenAreRest) {
  const std::uint32_t start = rig.first_open() + 30;
  rig.forget_history();
  ASSERT_EQ(rig.take(ones(kStart, start, 3, 0)), BUSHD_OK);
  EXPECT_EQ(rig.poll().motor[0].known_until, static_cast<std::uint16_t>(start + 3));
  expect_position(0, 3);
  std::vector<int> expected(35, 0);
  expected[32] = expected[33] = expected[34] = 1;
  EXPECT_EQ(rig.history(0), expected);
}

TEST_P(Streams, StartInTheFirstOpenTickAndNotEarlier) {
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open() - 1, 3, 0)), BUSHD_E_LATE);
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open() - 3, 3, 0)), BUSHD_E_LATE);
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 3, 0)), BUSHD_OK);
  expect_position(0, 3);
}

TEST_P(Streams, StartOfAMovingMotorIsRefused) {
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 5)), BUSHD_OK);
  const std::uint32_t end = rig.first_open() + 5;
  EXPECT_EQ(rig.take(ones(kStart, end, 5)), BUSHD_E_STATE);
  EXPECT_EQ(rig.take(ones(kStart, end + 3, 5)), BUSHD_E_STATE);
  EXPECT_EQ(rig.take(ones(0, end, 5, 0)), BUSHD_OK);
  EXPECT_EQ(rig.take(ones(kStart, end + 5, 5, 0)), BUSHD_OK) << "at rest where the move ends";
  expect_position(0, 15);
}

TEST_P(Streams, ContinuationJoinsWithoutAGap) {
  EXPECT_EQ(rig.take(ones(0, rig.first_open(), 4)), BUSHD_E_GAP) << "its start was lost";
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 4)), BUSHD_OK);
  EXPECT_EQ(rig.take(ones(0, start + 4, 4)), BUSHD_OK);
  EXPECT_EQ(rig.take(ones(0, start + 8, 1, 0)), BUSHD_OK);
  EXPECT_EQ(rig.take(ones(0, start + 9, 4)), BUSHD_E_GAP) << "at rest there";
  expect_position(0, 9);
}

TEST_P(Streams, DuplicatesAreRefusedAndChangeNothing) {
  const std::uint32_t start = rig.first_open();
  const Ticks first = ones(kStart, start, 4);
  const Ticks second = ones(0, start + 4, 4, 0);
  ASSERT_EQ(rig.take(first), BUSHD_OK);
  EXPECT_EQ(rig.take(first), BUSHD_E_LATE);
  ASSERT_EQ(rig.take(second), BUSHD_OK);
  EXPECT_EQ(rig.take(second), BUSHD_E_LATE);
  EXPECT_EQ(rig.take(first), BUSHD_E_LATE);
  rig.pass(6);
  EXPECT_EQ(rig.take(first), BUSHD_E_LATE);
  EXPECT_EQ(rig.take(second), BUSHD_E_LATE);
  rig.pass(20);
  EXPECT_EQ(rig.take(first), BUSHD_E_LATE) << "long over";
  expect_position(0, 8);
}

TEST_P(Streams, OverlapKeepsWhatIsKnownAndAddsTheRest) {
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 4)), BUSHD_OK);
  Ticks overlap = ones(0, start + 2, 5, 0);
  overlap.displacements[0] = overlap.displacements[1] = two_back();
  EXPECT_EQ(rig.take(overlap), BUSHD_OK);
  expect_position(0, 7);
}

TEST_P(Streams, OverlapWithThePastAddsTheRest) {
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 8)), BUSHD_OK);
  rig.pass(6);
  EXPECT_EQ(rig.take(ones(0, start, 12, 0)), BUSHD_OK);
  expect_position(0, 12);
}

TEST_P(Streams, CapacityEndsAtTheQueuesDepth) {
  const auto depth = static_cast<std::uint32_t>(rig.options().queue_ticks);
  EXPECT_EQ(rig.take(ones(kStart, rig.tick() + depth - 3, 5, 0)), BUSHD_E_CAPACITY);
  EXPECT_EQ(rig.take(ones(kStart, rig.tick() + depth + 1, 1, 0)), BUSHD_E_CAPACITY);
  EXPECT_EQ(rig.take(ones(kStart, rig.tick() + depth - 4, 5, 0)), BUSHD_OK);
  expect_position(0, 5);
}

TEST_P(Streams, QueueFilledToTheBrimLosesNothing) {
  const std::uint32_t start = rig.first_open();
  const auto depth = static_cast<std::uint32_t>(rig.options().queue_ticks);
  ASSERT_EQ(rig.take(ones(kStart, start, 1)), BUSHD_OK);
  std::uint32_t next = start + 1;
  for (int i = 0; i < 500; ++i) {
    while (next <= rig.tick() + depth) ASSERT_EQ(rig.take(ones(0, next++, 1)), BUSHD_OK);
    ASSERT_EQ(rig.take(ones(0, next, 1)), BUSHD_E_CAPACITY);
    rig.pass();
  }
  ASSERT_EQ(rig.take(ones(0, next++, 1, 0)), BUSHD_OK);
  expect_position(0, next - start);
}

TEST_P(Streams, TickNumbersFarAwayAreRefused) {
  for (std::int64_t far = 255; far <= INT64_C(1) << 32; far *= 2) {
    for (const std::int64_t distance : {far, -far, far - 255, 255 - far, far + 1, -far - 1}) {
      if (distance > -256 && distance <= rig.options().queue_ticks) continue;
      // Half the ring and more away is the other direction.
      if (distance > INT64_C(0xFFFFFF00) || distance < -INT64_C(0xFFFFFF00)) continue;
      for (const auto flags : {std::uint8_t{0}, std::uint8_t{kStart}, std::uint8_t{kReplace}}) {
        Ticks ticks = ones(flags, rig.tick() + static_cast<std::uint32_t>(distance), 16, 0);
        if (flags == kReplace) ++ticks.epoch;
        EXPECT_NE(rig.take(ticks), BUSHD_OK) << distance << " flags " << int{flags};
      }
    }
  }
  EXPECT_EQ(rig.poll().moving, 0);
  EXPECT_EQ(rig.poll().epoch, 0);
}

TEST_P(Streams, FormatTableMotorAndPowerAreChecked) {
  const std::uint32_t start = rig.first_open() + 10;
  Ticks ticks = ones(kStart, start, 2, 0);
  Bytes other = rig.encode(ticks);
  other[1] ^= BUSHD_TICKS_FINE;
  const bool fine = format == BUSHD_FORMAT_FINE;
  if (fine)
    other.resize(other.size() - 2);
  else
    other.resize(other.size() + 2);
  rig.frame(BUSHD_MSG_TICKS, other);
  EXPECT_EQ(rig.poll().last_rejection, BUSHD_E_FORMAT) << "the other format";
  ticks.mask = 1 << 4;
  EXPECT_EQ(rig.take(ticks), BUSHD_E_FORMAT) << "only four motors";
  ticks.mask = 1 << 15;
  EXPECT_EQ(rig.take(ticks), BUSHD_E_FORMAT);
  Ticks both = ones(kReplace | kStart, start, 2, 0);
  EXPECT_EQ(rig.take(both), BUSHD_E_FORMAT);
  // Sending bank 0 again takes the table from all motors.
  ASSERT_EQ(rig.upload(0, law), BUSHD_OK);
  ASSERT_EQ(rig.assign(1, 0), BUSHD_OK);
  ticks.mask = 1;
  EXPECT_EQ(rig.take(ticks), BUSHD_E_NO_TABLE);
  ticks.mask = 3;
  ticks.displacements.assign(4, one());
  ticks.delays = {0, 0};
  EXPECT_EQ(rig.take(ticks), BUSHD_E_NO_TABLE) << "taken whole or not at all";
  EXPECT_EQ(rig.poll().moving, 0);
  ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_EQ(rig.take(ticks), BUSHD_E_STATE);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(rig.take(ticks), BUSHD_OK);
  expect_position(1, 2);
  expect_position(0, 2);
}

TEST_P(Streams, FramesOfAnotherEpochAreRefused) {
  for (int epoch = 1; epoch < 256; ++epoch) {
    Ticks ticks = ones(kStart, rig.first_open(), 2, 0);
    ticks.epoch = static_cast<std::uint8_t>(epoch);
    ASSERT_EQ(rig.take(ticks), BUSHD_E_EPOCH) << epoch;
  }
}

// A start that is kept back on its way may have been planned anew when it comes.
TEST_P(Streams, FramesThatWereOvertakenAreRefused) {
  Bytes kept_back(BUSHD_FRAME_MAX_WIRE);
  const Bytes payload = rig.encode(ones(kStart, rig.first_open() + 4, 3, 0));
  rig.poll();
  kept_back.resize(bushd_frame_encode(rig.options().address, BUSHD_MSG_TICKS, rig.last_sequence(),
                                      payload.data(), payload.size(), kept_back.data()));
  rig.poll();
  rig.feed(kept_back);
  EXPECT_EQ(rig.poll().last_rejection, BUSHD_E_LATE);
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open() + 4, 2, 0)), BUSHD_OK) << "planned anew";
  rig.feed(kept_back);
  expect_position(0, 2);
}

TEST_P(Streams, MovingBitsFollowTheLastTickOut) {
  const std::uint32_t start = rig.first_open() + 2;
  ASSERT_EQ(rig.take(ones(kStart, start, 3, 0)), BUSHD_OK);
  while (rig.tick() != start + 3) {
    EXPECT_EQ(rig.poll().moving, 1) << rig.tick() - start;
    EXPECT_EQ(rig.poll().state, BUSHD_STATE_RUN);
    rig.pass();
  }
  EXPECT_EQ(rig.poll().moving, 0);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
  EXPECT_EQ(rig.poll().motor[0].position_steps, 3) << "all counted by then";
}

TEST_P(Streams, DirIsConstantInATickAndStaysAtRest) {
  rig.run_plan(plan(-4), 2);
  EXPECT_EQ(rig.slot_buffer().direction & 4, 0);
  rig.run_plan(plan(4), 2);
  EXPECT_EQ(rig.slot_buffer().direction & 4, 4);
  rig.pass(10);
  EXPECT_EQ(rig.slot_buffer().direction & 4, 4);
  rig.run_plan(plan(-4), 2);
  EXPECT_EQ(rig.slot_buffer().direction & 4, 0);
  EXPECT_EQ(rig.steps_with_dir(), 0);
}

TEST_P(Streams, PositionCounterWrapsWithoutHarm) {
  ASSERT_EQ(rig.set_position(0, INT32_MAX - 2), BUSHD_OK);
  rig.run_plan(plan(5), 0);
  EXPECT_EQ(rig.poll().motor[0].position_steps, INT32_MIN + 2);
  rig.run_plan(plan(-5), 0);
  EXPECT_EQ(rig.poll().motor[0].position_steps, INT32_MAX - 2);
}

// Fine displacements carry more than a tick can hold; the protocol allows 127 steps.
TEST(StreamsFine, DisplacementsBeyond127StepsAreRefused) {
  for (const std::uint16_t slots : std::initializer_list<std::uint16_t>{128, 200, 256}) {
    ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE, {.slots = slots});
    for (const int displacement : {32767, -32768, 32513, -32513}) {
      const Ticks ticks = {.flags = kStart,
                           .first = rig.first_open(),
                           .displacements = {static_cast<std::int16_t>(displacement)},
                           .delays = {0}};
      EXPECT_EQ(rig.take(ticks), BUSHD_E_FORMAT) << displacement;
    }
    for (const int displacement : {32512, -32512}) {
      ASSERT_EQ(rig.take({.flags = kStart,
                          .first = rig.first_open(),
                          .displacements = {static_cast<std::int16_t>(displacement)},
                          .delays = {0}}),
                BUSHD_OK);
      rig.pass_until_rest();
      EXPECT_EQ(rig.pulses(0), displacement > 0 ? 127 : 0);
      EXPECT_EQ(rig.poll().motor[0].position_steps, rig.pulses(0)) << "each step has its slot";
    }
  }
}

// Jitter around a border makes no steps: after a reversal a whole step must be gone back.
TEST(StreamsFine, JitterMakesNoSteps) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  Ticks ticks = {.flags = kStart, .first = rig.first_open(), .count = 60, .delays = {0}};
  ticks.displacements = {255, 2};
  while (ticks.displacements.size() < 60) {
    ticks.displacements.push_back(-2);
    ticks.displacements.push_back(2);
  }
  ASSERT_EQ(rig.take(ticks), BUSHD_OK);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 1);
  EXPECT_EQ(rig.poll().motor[0].position_steps, 1);
}

// All outputs, on every kind of port: different moves at the same time, frames shared by motors.
TEST(StreamsAll, SixteenMotorsMakeTheirOwnMoves) {
  for (const bushd_format format : {BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE}) {
    for (const std::uint16_t slots : std::initializer_list<std::uint16_t>{128, 131, 256}) {
      ReadyRig rig(ramp_law(), format, {.motors = 16, .slots = slots});
      std::vector<Plan> plans;
      std::size_t longest = 0;
      for (int m = 0; m < 16; ++m) {
        plans.push_back(
            plan_move(ramp_law(), (m % 2 ? -1 : 1) * (1 + 9 * m), Rig::kTickNs, format));
        longest = std::max(longest, plans.back().ticks());
      }
      const std::uint32_t start = rig.first_open();
      for (std::size_t from = 0; from < longest; from += 4) {
        Ticks ticks = {.flags = static_cast<std::uint8_t>(from == 0 ? kStart : 0),
                       .first = start + static_cast<std::uint32_t>(from),
                       .count = 4,
                       .mask = 0};
        for (std::size_t m = 0; m < 16; ++m) {
          if (plans[m].ticks() > from) ticks.mask |= static_cast<std::uint16_t>(1u << m);
        }
        for (std::size_t t = from; t < from + 4; ++t) {
          for (std::size_t m = 0; m < 16; ++m) {
            if ((ticks.mask >> m & 1) == 0) continue;
            const bool over = t >= plans[m].ticks();
            ticks.displacements.push_back(over ? std::int16_t{0} : plans[m].displacement[t]);
            if (t == from)
              ticks.delays.push_back(from + 4 > plans[m].ticks() ? std::uint16_t{0}
                                                                 : plans[m].delay[from + 3]);
          }
        }
        ASSERT_EQ(rig.take(ticks), BUSHD_OK) << from;
        while (start + static_cast<std::uint32_t>(from) - rig.tick() > 3) rig.pass();
      }
      rig.pass_until_rest();
      const bushd_report report = rig.poll();
      for (std::uint8_t m = 0; m < 16; ++m) {
        EXPECT_EQ(rig.pulses(m), (m % 2 ? -1 : 1) * (1 + 9 * m));
        EXPECT_EQ(report.motor[m].position_steps, rig.pulses(m));
      }
      EXPECT_EQ(report.faults, 0);
      EXPECT_EQ(rig.steps_with_dir(), 0);
    }
  }
}

}  // namespace
}  // namespace bushd::test
