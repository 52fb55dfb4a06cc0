// Lost frames: what came after them is kept, and only what is missing need be sent again.
#include <algorithm>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

class OutOfOrder : public Streams {
 protected:
  void expect_made(const Plan& moves) {
    rig.pass_until_rest();
    EXPECT_EQ(rig.poll().faults, 0);
    std::vector<int> expected;
    for (std::size_t i = 0; i < moves.ticks(); ++i) {
      const std::int64_t before = i == 0 ? 0 : moves.made[i - 1];
      expected.push_back(static_cast<int>(moves.direction * (moves.made[i] - before)));
    }
    std::vector<int> seen = rig.history(0);
    seen.resize(2 + expected.size());
    EXPECT_EQ(std::vector<int>(seen.begin() + 2, seen.end()), expected);
  }
};
BUSHD_IN_BOTH_FORMATS(OutOfOrder);

TEST_P(OutOfOrder, FrameBehindALostOneIsKeptAndJoinedWhenThatComesAgain) {
  const Plan moves = plan(-90);
  const std::uint32_t start = rig.first_open();
  rig.forget_history();
  const auto part = [&](std::size_t from) { return rig.part(moves, start, from, 10); };
  ASSERT_EQ(rig.take(part(0)), BUSHD_OK);
  ASSERT_EQ(rig.take(part(20)), BUSHD_OK);
  bushd_report report = rig.poll();
  EXPECT_EQ(report.motor[0].known_until, static_cast<std::uint16_t>(start + 10));
  EXPECT_EQ(report.out_of_order, 1);
  EXPECT_EQ(report.out_of_order_from, static_cast<std::uint16_t>(start + 20));
  EXPECT_EQ(report.out_of_order_until, static_cast<std::uint16_t>(start + 30));
  ASSERT_EQ(rig.take(part(30)), BUSHD_OK);
  EXPECT_EQ(rig.poll().out_of_order_until, static_cast<std::uint16_t>(start + 40)) << "it grows";
  EXPECT_EQ(rig.take(part(20)), BUSHD_E_LATE) << "known";
  EXPECT_EQ(rig.take(rig.part(moves, start, 25, 10)), BUSHD_E_LATE) << "known";
  EXPECT_EQ(rig.take(part(50)), BUSHD_E_GAP) << "one ahead a motor";
  EXPECT_EQ(rig.poll().out_of_order_until, static_cast<std::uint16_t>(start + 40));
  ASSERT_EQ(rig.take(part(10)), BUSHD_OK);
  report = rig.poll();
  EXPECT_EQ(report.out_of_order, 0);
  EXPECT_EQ(report.motor[0].known_until, static_cast<std::uint16_t>(start + 40));
  for (std::size_t from = 40; from < moves.ticks(); from += 10) {
    ASSERT_EQ(rig.take(part(from)), BUSHD_OK);
    while (start + static_cast<std::uint32_t>(from) - rig.tick() > 3) rig.pass();
  }
  expect_made(moves);
}

TEST_P(OutOfOrder, MoveIsCompleteThoughEveryThirdFrameIsLostAtFirst) {
  const Plan moves = plan(300);
  const std::uint32_t start = rig.first_open();
  rig.forget_history();
  std::size_t lost = 0;
  for (std::size_t from = 0, n = 0; from < moves.ticks(); from += 7, ++n) {
    const Ticks ticks = rig.part(moves, start, from, 7);
    if (n % 3 == 1) {
      lost = from;
      continue;
    }
    ASSERT_EQ(rig.take(ticks), BUSHD_OK) << from;
    if (n % 3 == 2) {
      ASSERT_EQ(rig.take(rig.part(moves, start, lost, 7)), BUSHD_OK) << lost;
    }
    while (start + static_cast<std::uint32_t>(from) - rig.tick() > 12) rig.pass();
  }
  if (rig.poll().motor[0].known_until != static_cast<std::uint16_t>(start + moves.ticks())) {
    ASSERT_EQ(rig.take(rig.part(moves, start, lost, 7)), BUSHD_OK);
  }
  expect_made(moves);
}

TEST_P(OutOfOrder, GapMayBeFilledInPiecesFromBothEnds) {
  const Plan moves = plan(60);
  const std::uint32_t start = rig.first_open();
  rig.forget_history();
  ASSERT_EQ(rig.take(rig.part(moves, start, 0, 10)), BUSHD_OK);
  ASSERT_EQ(rig.take(rig.part(moves, start, 30, 10)), BUSHD_OK);
  ASSERT_EQ(rig.take(rig.part(moves, start, 22, 12)), BUSHD_OK);
  EXPECT_EQ(rig.poll().out_of_order_from, static_cast<std::uint16_t>(start + 22));
  ASSERT_EQ(rig.take(rig.part(moves, start, 8, 8)), BUSHD_OK);
  EXPECT_EQ(rig.poll().out_of_order, 1);
  ASSERT_EQ(rig.take(rig.part(moves, start, 16, 8)), BUSHD_OK);
  EXPECT_EQ(rig.poll().motor[0].known_until, static_cast<std::uint16_t>(start + 40));
  for (std::size_t from = 40; from < moves.ticks(); from += 20) {
    ASSERT_EQ(rig.take(rig.part(moves, start, from, 20)), BUSHD_OK);
    rig.pass(19);
  }
  expect_made(moves);
}

TEST_P(OutOfOrder, IsDroppedWhenTheQueueRunsDryBeforeTheGapIsFilled) {
  const Plan moves = plan(90);
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(rig.part(moves, start, 0, 30)), BUSHD_OK);
  ASSERT_EQ(rig.take(rig.part(moves, start, 35, 10)), BUSHD_OK);
  rig.pass_until_rest();
  bushd_report report = rig.poll();
  EXPECT_EQ(report.faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(report.out_of_order, 0);
  EXPECT_EQ(report.ramp_downs, 1);
  const auto down = Reference::ramp_down(
      law, moves.delay[29], format == BUSHD_FORMAT_FINE ? moves.fraction[29] : std::uint8_t{0});
  const std::int64_t stands = moves.made[29] + static_cast<std::int64_t>(down.steps());
  EXPECT_EQ(rig.pulses(0), stands);
  EXPECT_EQ(report.motor[0].position_steps, stands);
  // Nothing of it is left in the queue.
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open() + 100, 1, 0)), BUSHD_OK);
  expect_position(0, stands + 1);
}

TEST_P(OutOfOrder, RangesAreCutAwayByAReplacement) {
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, start, 20)), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(0, start + 30, 20)), BUSHD_OK);
  Ticks replacement = ones(kReplace, start + 15, 2, 0);
  replacement.epoch = 1;
  ASSERT_EQ(rig.take(replacement), BUSHD_OK);
  EXPECT_EQ(rig.poll().out_of_order, 0);
  ASSERT_EQ(rig.take(ones(kStart, start + 60, 1, 0)), BUSHD_OK);
  expect_position(0, 18);
}

TEST_P(OutOfOrder, RangesOfAMotorAtRestAreRefused) {
  const std::uint32_t start = rig.first_open();
  EXPECT_EQ(rig.take(ones(0, start + 5, 5)), BUSHD_E_GAP);
  ASSERT_EQ(rig.take(ones(kStart, start, 5, 0)), BUSHD_OK);
  EXPECT_EQ(rig.take(ones(0, start + 8, 5)), BUSHD_E_GAP) << "at rest before the gap";
  EXPECT_EQ(rig.poll().out_of_order, 0);
  expect_position(0, 5);
}

TEST_P(OutOfOrder, ReportTellsThatOfTheLowestMotorAndWhoHasTheSame) {
  const std::uint32_t start = rig.first_open();
  const auto of = [&](Ticks ticks, std::uint16_t mask) {
    ticks.mask = mask;
    const std::size_t motors = mask == 0xF ? 4 : 1;
    ticks.displacements.assign(motors * ticks.count, one());
    ticks.delays.assign(motors, 64);
    return ticks;
  };
  ASSERT_EQ(rig.take(of(ones(kStart, start, 20), 0xF)), BUSHD_OK);
  ASSERT_EQ(rig.take(of(ones(0, start + 30, 5), 1 << 1)), BUSHD_OK);
  ASSERT_EQ(rig.take(of(ones(0, start + 30, 6), 1 << 2)), BUSHD_OK);
  ASSERT_EQ(rig.take(of(ones(0, start + 30, 5), 1 << 3)), BUSHD_OK);
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.out_of_order, 1 << 1 | 1 << 3);
  EXPECT_EQ(report.out_of_order_from, static_cast<std::uint16_t>(start + 30));
  EXPECT_EQ(report.out_of_order_until, static_cast<std::uint16_t>(start + 35));
}

}  // namespace
}  // namespace bushd::test
