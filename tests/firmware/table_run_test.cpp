// TABLE_RUN: a whole move by the motor's own table, exact to a slot.
#include <algorithm>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

class TableRun : public Streams {
 protected:
  static Bytes run_frame(std::uint32_t first, std::vector<bushd_table_run_entry> entries,
                         std::uint8_t epoch = 0) {
    return payload_of([&](std::uint8_t* to) {
      return bushd_encode_table_run(epoch, first, entries.data(),
                                    static_cast<std::uint8_t>(entries.size()), to);
    });
  }
  static bushd_status start(Rig& on, std::uint32_t first, std::uint32_t steps, int direction = 1,
                            std::uint16_t shortest_delay = 0) {
    return on.take(
        BUSHD_MSG_TABLE_RUN,
        run_frame(first, {{0, 0, static_cast<std::int8_t>(direction), steps, shortest_delay}}));
  }
  // The steps of each tick of what motor 0 has done since the history was forgotten, from the tick
  // that was open then on.
  static void expect_steps(const Rig& of, const Reference& reference, int direction) {
    Streams::expect_steps({of.history(0).begin() + 2, of.history(0).end()},
                          steps_by_tick(reference, Rig::kTickNs), direction);
  }
};
BUSHD_IN_BOTH_FORMATS(TableRun);

TEST_P(TableRun, EveryStepFallsIntoTheSlotOfTheSumOfItsDelays) {
  const auto cruise = law.cruise;
  for (const auto& [steps, shortest_delay] : std::vector<std::pair<std::uint32_t, std::uint16_t>>{
           {1, 0}, {2, 0}, {23, 0}, {60, 0}, {333, 0}, {333, cruise + 3}, {60, 2 * cruise}}) {
    const auto reference = Reference::move(law, steps, shortest_delay);
    const std::uint32_t first = rig.first_open() + 3;
    ASSERT_EQ(start(rig, first, steps, 1, shortest_delay), BUSHD_OK);
    while (rig.tick() != first) rig.pass();
    std::size_t made = 0;
    for (std::uint64_t tick = 0; rig.poll().moving != 0; ++tick, rig.pass()) {
      std::vector<std::uint16_t> expected(256);
      const Wide begin = Wide{tick * Rig::kTickNs} * 256;
      const Wide length = Wide{Rig::kTickNs} * 256;
      for (; made < steps && reference.step(made).end <= begin + length; ++made) {
        const auto slot =
            static_cast<std::size_t>((reference.step(made).end - begin) * 256 / length);
        expected[std::min<std::size_t>(slot, 255)] = 1;
      }
      ASSERT_TRUE(std::ranges::equal(std::span(rig.slot_buffer().step).first(256), expected))
          << tick;
    }
    EXPECT_EQ(made, steps);
    EXPECT_EQ(rig.poll().faults, 0);
  }
  EXPECT_EQ(rig.poll().motor[0].position_steps, 1 + 2 + 23 + 60 + 333 + 333 + 60);
  EXPECT_EQ(rig.steps_with_dir(), 0);
}

TEST_P(TableRun, ReportTellsItsEndAndThatItRuns) {
  const std::uint32_t first = rig.first_open() + 10;
  const auto ticks =
      static_cast<std::uint32_t>(steps_by_tick(Reference::move(law, 100), Rig::kTickNs).size());
  ASSERT_EQ(start(rig, first, 100, -1), BUSHD_OK);
  while (rig.tick() != first + ticks) {
    const bushd_report report = rig.poll();
    ASSERT_EQ(report.moving, 1);
    ASSERT_EQ(report.state, BUSHD_STATE_RUN);
    const std::uint32_t known = std::max(first + ticks, rig.first_open());
    ASSERT_EQ(report.motor[0].known_until, static_cast<std::uint16_t>(known));
    // Over when its last tick is prepared.
    if (rig.tick() + 2 <= first + ticks) {
      ASSERT_EQ(report.running, 1) << rig.tick() - first;
    }
    rig.pass();
  }
  EXPECT_EQ(rig.poll().moving, 0);
  EXPECT_EQ(rig.poll().running, 0);
  EXPECT_EQ(rig.pulses(0), -100);
  // A run that lasts for hours is told as far as 15 bits go.
  ASSERT_EQ(start(rig, rig.first_open(), 2'000'000'000), BUSHD_OK);
  EXPECT_EQ(rig.poll().motor[0].known_until, static_cast<std::uint16_t>(rig.tick() + 32767));
}

TEST_P(TableRun, SameFrameAgainIsLateAndAnotherIsRefused) {
  const std::uint32_t first = rig.first_open() + 4;
  ASSERT_EQ(start(rig, first, 50), BUSHD_OK);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(start(rig, first, 50), BUSHD_E_LATE);
    rig.pass();
  }
  EXPECT_NE(start(rig, rig.first_open(), 50), BUSHD_OK);
  EXPECT_EQ(start(rig, first + 100, 50), BUSHD_E_STATE) << "one run a motor";
  EXPECT_EQ(rig.take(ones(0, first + 20, 5)), BUSHD_E_LATE);
  expect_position(0, 50);
  EXPECT_EQ(start(rig, first, 50), BUSHD_E_LATE) << "long over";
  expect_position(0, 50);
}

TEST_P(TableRun, NoOtherStartWaitsBehindOneThatWaits) {
  const std::uint32_t first = rig.first_open() + 20;
  ASSERT_EQ(start(rig, first, 5), BUSHD_OK);
  const auto ticks =
      static_cast<std::uint32_t>(steps_by_tick(Reference::move(law, 5), Rig::kTickNs).size());
  const std::uint32_t end = first + ticks;
  for (; rig.first_open() <= first; rig.pass()) {
    ASSERT_EQ(rig.take(ones(kStart, end, 5, 0)), BUSHD_E_STATE) << first - rig.tick();
  }
  EXPECT_EQ(rig.take(ones(kStart, end, 5, 0)), BUSHD_OK) << "it runs";
  expect_position(0, 10);
}

TEST_P(TableRun, RulesOfAStartHold) {
  const std::uint32_t first = rig.first_open();
  EXPECT_EQ(start(rig, first - 1, 5), BUSHD_E_LATE);
  EXPECT_EQ(start(rig, first + 1000, 5), BUSHD_E_CAPACITY);
  EXPECT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(first, {{0, 0, 1, 5, 0}}, 1)), BUSHD_E_EPOCH);
  EXPECT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(first, {{0, 3, 1, 5, 0}})), BUSHD_E_NO_TABLE)
      << "another table than the motor's";
  EXPECT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(first, {{0, 0, 1, 5, 0}, {4, 0, 1, 5, 0}})),
            BUSHD_E_FORMAT)
      << "four motors";
  ASSERT_EQ(rig.take(ones(kStart, first, 5)), BUSHD_OK);
  EXPECT_EQ(start(rig, first + 5, 5), BUSHD_E_STATE) << "moves on";
  EXPECT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(first + 5, {{1, 0, 1, 5, 0}, {0, 0, 1, 5, 0}})),
            BUSHD_E_FORMAT)
      << "motors in rising order";
  ASSERT_EQ(rig.take(ones(0, first + 5, 5, 0)), BUSHD_OK);
  EXPECT_EQ(start(rig, first + 10, 5), BUSHD_OK) << "behind the stream's end";
  expect_position(0, 15);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_EQ(start(rig, rig.first_open(), 5), BUSHD_E_STATE);
}

// The rest of the same move as ticks, from every tick on: nothing shows where they took over.
TEST_P(TableRun, IsReplacedByTicksAtEveryTick) {
  const Plan moves = plan(-120);
  for (std::size_t k = 0; k + 1 < moves.ticks(); ++k) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    fresh.forget_history();
    const std::uint32_t first = fresh.first_open();
    ASSERT_EQ(start(fresh, first, 120, -1), BUSHD_OK);
    fresh.pass(static_cast<int>(k) / 2);
    std::size_t from = k;
    while (from < moves.ticks()) {
      Ticks rest = fresh.part(moves, first, from, 40);
      rest.flags = from == k ? kReplace : 0;
      rest.epoch = 1;
      ASSERT_EQ(fresh.take(rest), BUSHD_OK) << k;
      from += 40;
      if (from < moves.ticks()) {
        while (first + static_cast<std::uint32_t>(from) - fresh.tick() > 100) fresh.pass();
      }
    }
    while (static_cast<std::int32_t>(first + static_cast<std::uint32_t>(k) - fresh.tick()) > 1) {
      ASSERT_EQ(fresh.poll().running, k == 0 ? 0 : 1);
      fresh.pass();
    }
    fresh.pass();
    ASSERT_EQ(fresh.poll().running, 0);
    fresh.pass_until_rest();
    fresh.pass(2);
    SCOPED_TRACE(k);
    expect_steps(fresh, Reference::move(law, 120), -1);
    ASSERT_EQ(fresh.poll().faults, 0);
    ASSERT_EQ(fresh.poll().motor[0].position_steps, -120);
  }
}

TEST_P(TableRun, TicksBeyondAGapAreKeptOnlyWhenItIsOver) {
  const Plan moves = plan(-120);
  rig.forget_history();
  const std::uint32_t first = rig.first_open();
  const auto part = [&](std::size_t from, std::uint8_t flags = 0) {
    Ticks ticks = rig.part(moves, first, from, 10);
    ticks.flags = flags;
    ticks.epoch = 1;
    return ticks;
  };
  ASSERT_EQ(start(rig, first, 120, -1), BUSHD_OK);
  ASSERT_EQ(rig.take(part(20, kReplace)), BUSHD_OK);
  EXPECT_EQ(rig.take(part(40)), BUSHD_E_GAP) << "the run has still to be made";
  EXPECT_EQ(rig.poll().out_of_order, 0);
  while (rig.tick() != first + 20) rig.pass();
  ASSERT_EQ(rig.take(part(40)), BUSHD_OK);
  EXPECT_EQ(rig.poll().out_of_order, 1);
  for (std::size_t from = 30; from < moves.ticks(); from += 10) {
    if (from == 40) continue;
    ASSERT_EQ(rig.take(part(from)), BUSHD_OK) << from;
    while (first + static_cast<std::uint32_t>(from) - rig.tick() > 5) rig.pass();
  }
  rig.pass_until_rest();
  rig.pass(2);
  expect_steps(rig, Reference::move(law, 120), -1);
  EXPECT_EQ(rig.poll().faults, 0);
}

TEST_P(TableRun, IsRampedDownWhenNoMasterIsHeard) {
  constexpr std::uint16_t kSilence = 30;
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, kSilence), BUSHD_OK) << "at any time";
  rig.forget_history();
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(start(rig, first, 1000), BUSHD_OK);
  for (int i = 0; i < 3; ++i) {
    rig.pass(kSilence - 1);
    rig.frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, {});  // good, though no one can use it
  }
  const std::uint32_t heard = rig.tick();
  rig.pass(kSilence);
  rig.feed(Bytes{5, 1, 2, 3, 4, 0});
  rig.pass(200);
  auto reference = Reference::move(law, 1000);
  reference.ramp_down_at(std::uint64_t{heard + kSilence + 1 - first} * Rig::kTickNs);
  expect_steps(rig, reference, 1);
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(report.ramp_downs, 1);
  EXPECT_EQ(report.moving, 0);
  EXPECT_EQ(report.motor[0].position_steps, rig.pulses(0));
}

TEST_P(TableRun, FramesForOthersAreSilence) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 30), BUSHD_OK);
  ASSERT_EQ(start(rig, rig.first_open(), 1000), BUSHD_OK);
  for (int i = 0; i < 60; ++i) {
    rig.frame(8, BUSHD_MSG_TABLES, {});
    rig.frame(7, BUSHD_MSG_TABLES | BUSHD_TYPE_REPLY, {});
    rig.pass();
  }
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
}

TEST_P(TableRun, ThatWaitsIsCancelledBySilence) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 30), BUSHD_OK);
  ASSERT_EQ(start(rig, rig.first_open() + 100, 50), BUSHD_OK);
  rig.pass(150);
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(report.ramp_downs, 0);
  EXPECT_EQ(report.moving, 0);
  EXPECT_EQ(rig.pulses(0), 0);
}

TEST_P(TableRun, LongerThanTheQueueThatIsCancelledLeavesTheTicksBefore) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 30), BUSHD_OK);
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(rig.take(ones(kStart, first, 100, 0)), BUSHD_OK);
  ASSERT_EQ(start(rig, first + 100, 3000), BUSHD_OK);
  rig.pass(150);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(rig.pulses(0), 100);
}

TEST_P(TableRun, OneThatSilenceHasCancelledKeepsNoOtherWaiting) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 30), BUSHD_OK);
  ASSERT_EQ(start(rig, rig.first_open() + 100, 50), BUSHD_OK);
  rig.pass(50);
  ASSERT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(start(rig, rig.first_open(), 20), BUSHD_OK);
  for (int i = 0; i < 80; ++i) {
    rig.poll();
    rig.pass();
  }
  EXPECT_EQ(rig.pulses(0), 20);
}

TEST_P(TableRun, SilenceWithoutARunIsNoFault) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 5), BUSHD_OK);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 30, 0)), BUSHD_OK);
  rig.pass(100);
  EXPECT_EQ(rig.poll().faults, 0);
  EXPECT_EQ(rig.pulses(0), 30);
}

}  // namespace
}  // namespace bushd::test
