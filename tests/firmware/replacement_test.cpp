// Replacements and the epochs they open; and tick numbers that wrap while motors move.
#include "firmware/streams.h"

namespace bushd::test {
namespace {

class Replacement : public Streams {};
BUSHD_IN_BOTH_FORMATS(Replacement);

TEST_P(Replacement, TakesTheTailAndRaisesTheEpoch) {
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 40)), BUSHD_OK);
  rig.pass(10);
  Ticks replacement = ones(kReplace, start + 20, 3, 0);
  EXPECT_EQ(rig.take(replacement), BUSHD_E_EPOCH) << "it must open a later epoch";
  for (const int epoch : {128, 200, 255}) {
    replacement.epoch = static_cast<std::uint8_t>(epoch);
    EXPECT_EQ(rig.take(replacement), BUSHD_E_EPOCH) << epoch;
  }
  replacement.epoch = 1;
  replacement.first = rig.first_open() - 1;
  EXPECT_EQ(rig.take(replacement), BUSHD_E_LATE) << "that tick is prepared";
  EXPECT_EQ(rig.poll().epoch, 0);
  replacement.first = start + 20;
  EXPECT_EQ(rig.take(replacement), BUSHD_OK);
  EXPECT_EQ(rig.poll().epoch, 1);
  EXPECT_EQ(rig.poll().motor[0].known_until, static_cast<std::uint16_t>(start + 23));
  Ticks old = ones(0, start + 23, 5);
  old.epoch = 0;
  EXPECT_EQ(rig.take(old), BUSHD_E_EPOCH);
  EXPECT_EQ(rig.take(replacement), BUSHD_E_EPOCH) << "repeated";
  expect_position(0, 23);
  rig.run_plan(plan(-23), 0);
  expect_position(0, 0);
}

TEST_P(Replacement, OpensAnyEpochThatIsLater) {
  int epoch = 0;
  for (const int ahead : {2, 127, 127, 60}) {
    ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 4)), BUSHD_OK);
    Ticks replacement = ones(kReplace, rig.first_open() + 1, 1, 0);
    replacement.epoch = static_cast<std::uint8_t>(epoch + ahead);
    EXPECT_EQ(rig.take(replacement), BUSHD_OK) << epoch << " + " << ahead;
    epoch = rig.poll().epoch;
    EXPECT_EQ(epoch, replacement.epoch);
    rig.pass_until_rest();
  }
}

TEST_P(Replacement, OfTheWholeQueueFromTheFirstOpenTick) {
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open() + 10, 20)), BUSHD_OK);
  rig.pass(3);
  Ticks replacement = ones(kReplace, rig.first_open(), 1, 0);
  replacement.epoch = 1;
  replacement.displacements = {0};
  EXPECT_EQ(rig.take(replacement), BUSHD_OK);
  rig.pass(3);
  EXPECT_EQ(rig.poll().moving, 0) << "at rest before its first tick";
  rig.pass(60);
  expect_position(0, 0);
}

TEST_P(Replacement, AtTheEndOfTheQueueAndNotBeyond) {
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 10)), BUSHD_OK);
  Ticks replacement = ones(kReplace, start + 11, 2, 0);
  replacement.epoch = 1;
  EXPECT_EQ(rig.take(replacement), BUSHD_E_GAP);
  replacement.first = start + 10;
  EXPECT_EQ(rig.take(replacement), BUSHD_OK);
  expect_position(0, 12);
}

TEST_P(Replacement, OfAMotorAtRestIsRefusedWhole) {
  Ticks replacement = ones(kReplace, rig.first_open(), 3, 0);
  replacement.epoch = 1;
  EXPECT_EQ(rig.take(replacement), BUSHD_E_GAP);
  replacement.first += 5;
  EXPECT_EQ(rig.take(replacement), BUSHD_E_GAP);
  // Motor 0 moves, motor 1 rests: neither is touched.
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 20, 0)), BUSHD_OK);
  replacement = {.flags = kReplace,
                 .first = start + 5,
                 .count = 1,
                 .mask = 3,
                 .displacements = {one(), one()},
                 .delays = {0, 0},
                 .epoch = 1};
  EXPECT_EQ(rig.take(replacement), BUSHD_E_GAP);
  EXPECT_EQ(rig.poll().epoch, 0);
  replacement = ones(kReplace, start + 20, 1, 0);
  replacement.epoch = 1;
  EXPECT_EQ(rig.take(replacement), BUSHD_E_GAP) << "its move is over there";
  expect_position(0, 20);
  expect_position(1, 0);
}

TEST_P(Replacement, EpochWrapsAt256) {
  for (int i = 1; i <= 300; ++i) {
    const std::uint32_t start = rig.first_open();
    ASSERT_EQ(rig.take(ones(kStart, start, 4)), BUSHD_OK);
    Ticks replacement = ones(kReplace, start + 1, 1, 0);
    ++replacement.epoch;
    ASSERT_EQ(rig.take(replacement), BUSHD_OK);
    EXPECT_EQ(rig.poll().epoch, i % 256);
    rig.pass_until_rest();
  }
  expect_position(0, 600);
}

// A tick number's wrap in the queue, at each place of a move.
TEST_P(Replacement, TickNumbersWrapInMotion) {
  const Plan moves = plan(60);
  for (std::uint32_t before = 5; before < moves.ticks() + 12; before += 3) {
    ReadyRig wrapping(law, format, {}, 0u - before - 30);
    while (wrapping.tick() != 0u - before) wrapping.pass();
    wrapping.run_plan(moves, 3);
    EXPECT_EQ(wrapping.pulses(3), 60);
    EXPECT_EQ(wrapping.poll().faults, 0);
    wrapping.run_plan(plan(-60), 3);
    EXPECT_LT(wrapping.tick(), 1000u) << "went over 2^32";
    EXPECT_EQ(wrapping.poll().motor[3].position_steps, 0);
  }
}

TEST_P(Replacement, ReplacedAndRampedDownAcrossTheWrap) {
  const Plan moves = plan(200);
  for (std::uint32_t before = 1; before < 40; ++before) {
    ReadyRig wrapping(law, format, {}, 0u - before - 30);
    while (wrapping.tick() != 0u - before) wrapping.pass();
    const std::uint32_t start = wrapping.first_open();
    ASSERT_EQ(wrapping.take(wrapping.part(moves, start, 0, 20)), BUSHD_OK);
    ASSERT_EQ(wrapping.take(wrapping.part(moves, start, 20, 20)), BUSHD_OK);
    Ticks tail = wrapping.part(moves, start, 10, 20);
    tail.flags = kReplace;
    tail.epoch = 1;
    ASSERT_EQ(wrapping.take(tail), BUSHD_OK);
    wrapping.pass_until_rest();
    EXPECT_EQ(wrapping.poll().faults, BUSHD_FAULT_LINK);
    const auto down = Reference::ramp_down(law, moves.delay[29],
                                           format == BUSHD_FORMAT_FINE ? moves.fraction[29] : 0);
    EXPECT_EQ(wrapping.pulses(0), moves.made[29] + static_cast<std::int64_t>(down.steps()));
  }
}

}  // namespace
}  // namespace bushd::test
