// Ticks on their way: far enough ahead, each once and as the source has it, whatever is lost.
#include "bus/rs485/slave.h"

namespace bushd::test {
namespace {

using link::Tick;

class Stream : public testing::TestWithParam<bushd_format> {
 protected:
  Stream() : bus(2, 4, GetParam()) {
    bus.source.displacement = [](std::uint8_t m, Tick t) { return value(m, t, 0); };
    bus.connect();
  }
  // Any function of motor and tick; coarse bytes must fit one byte.
  static std::int16_t value(std::uint8_t m, Tick t, int plan) {
    return static_cast<std::int16_t>((t * 13 + m * 5 + plan * 101) % 251);
  }
  Tick begin(std::uint8_t motor, std::size_t mcu = 0) {
    const Tick start = bus.master->earliest_start(bus.now_us, McuIndex{mcu}, motor);
    bus.master->begin(McuIndex{mcu}, motor, start);
    return start;
  }
  double ahead_ms(std::uint8_t motor, std::size_t slave = 0) const {
    const auto ticks =
        static_cast<std::int32_t>(bus.slaves[slave].known_until[motor] - bus.tick(slave));
    return ticks * 2.56;
  }
  // Everything from `start` on that the slave took is the plan's, without a hole.
  void expect_taken(std::uint8_t motor, Tick start, Tick until, int plan = 0) const {
    const auto& taken = bus.slaves[0].taken[motor];
    for (Tick t = start; t < until; ++t) {
      const auto at = taken.find(static_cast<std::uint32_t>(t));
      ASSERT_NE(at, taken.end()) << "tick " << t - start << " of motor " << int{motor};
      ASSERT_EQ(at->second, value(motor, t, plan)) << "tick " << t - start;
    }
  }
  FakeBus bus;
};
INSTANTIATE_TEST_SUITE_P(Formats, Stream, testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         [](const auto& p) {
                           return p.param == BUSHD_FORMAT_FINE ? "Fine" : "Coarse";
                         });

TEST_P(Stream, QueuesAreKept200To500MillisecondsAhead) {
  for (std::uint8_t m = 0; m < 4; ++m) begin(m), begin(m, 1);
  bus.run_for(400'000);
  const std::int64_t until = bus.now_us + 5'000'000;
  while (bus.now_us < until) {
    bus.run_for(1'000);
    for (std::uint8_t m = 0; m < 4; ++m) {
      for (std::size_t s = 0; s < 2; ++s) {
        ASSERT_GE(ahead_ms(m, s), 200);
        ASSERT_LE(ahead_ms(m, s), 500);
      }
    }
  }
  EXPECT_EQ(bus.slaves[0].rejected, 0) << "nothing is sent twice";
}

TEST_P(Stream, StartIsAheadEnoughAndEverythingArrives) {
  const Tick start = begin(2);
  EXPECT_GE(start - bus.tick(0), 37) << "95 ms";
  bus.run_for(1'000'000);
  expect_taken(2, start, start + 300);
  EXPECT_EQ(bus.slaves[0].faults, 0);
}

TEST_P(Stream, MotorsThatStartLaterDoNotDisturbOthers) {
  const Tick first = begin(0);
  bus.run_for(333'000);
  const Tick second = begin(1);
  bus.run_for(90'000);
  const Tick third = begin(2);
  bus.run_for(1'000'000);
  expect_taken(0, first, first + 450);
  expect_taken(1, second, second + 350);
  expect_taken(2, third, third + 300);
  EXPECT_EQ(bus.slaves[0].rejected, 0);
}

TEST_P(Stream, EndOfAMoveEndsItsStream) {
  bus.source.delay = [](std::uint8_t m, Tick t) {
    return std::uint16_t(m == 1 && t % 256 > 100 ? 0 : 50);
  };
  Tick start = bus.master->earliest_start(bus.now_us, McuIndex{0}, 1);
  start += 256 - start % 256;  // so that rest comes after some 100 ticks
  bus.source.end = [start](std::uint8_t) { return start + 101; };
  bus.run_for((start - bus.tick(0) - 60) * 2560);
  bus.master->begin(McuIndex{0}, 1, start);
  bus.run_for(1'500'000);
  EXPECT_EQ(bus.slaves[0].faults, 0) << "told to be at rest";
  const auto frames = bus.heard_of(BUSHD_MSG_TICKS).size();
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TICKS).size(), frames) << "and then nothing more";
}

// Any frame may be lost, also its repetition: the slave has the whole stream in the end.
TEST_P(Stream, LostFramesAreSentAgain) {
  for (int every = 3; every < 14; ++every) {
    int n = 0;
    bus.slaves[0].loses = [&](const Heard& heard) {
      return heard.type == BUSHD_MSG_TICKS && ++n % every == 0;
    };
    const Tick a = begin(0);
    const Tick b = begin(3);
    bus.run_for(2'000'000);
    expect_taken(0, a, a + 700);
    expect_taken(3, b, b + 700);
    ASSERT_EQ(bus.slaves[0].faults, 0) << "one frame in " << every << " lost";
    EXPECT_EQ(bus.count<link::StartMissed>(), 0);
    // Brought to rest for the next round.
    bus.slaves[0].loses = [](const Heard&) { return false; };
    const Tick stop = bus.earliest_replace();
    bus.source.delay = [stop](std::uint8_t, Tick t) { return std::uint16_t(t > stop ? 0 : 50); };
    bus.source.end = [stop](std::uint8_t) { return stop + 1; };
    bus.master->replace(McuIndex{0}, 0b1001, stop);
    bus.run_for(200'000);
    bus.master->drop(McuIndex{0}, 0);
    bus.master->drop(McuIndex{0}, 3);
    bus.source.delay = [](std::uint8_t, Tick) { return std::uint16_t{50}; };
    bus.source.end = [](std::uint8_t) { return INT64_MAX; };
    bus.run_for(500'000);
    ASSERT_EQ(bus.slaves[0].faults, 0);
  }
}

// The second of the frames that fill the queue at first.
TEST_P(Stream, OnlyWhatWasLostIsSentAgain) {
  int n = 0;
  bus.slaves[0].loses = [&n](const Heard& h) { return h.type == BUSHD_MSG_TICKS && n++ == 1; };
  const Tick start = begin(0);
  bus.run_for(1'000'000);
  expect_taken(0, start, start + 300);
  EXPECT_EQ(bus.master->health(McuIndex{0}).repeats, 1u);
  EXPECT_EQ(bus.master->health(McuIndex{0}).missed_ticks, 16u) << "a frame";
  EXPECT_EQ(bus.slaves[0].rejected, 0);
}

// What an MCU claims to have beyond a gap is believed only as far as it can be true.
TEST_P(Stream, OutOfOrderRangeThatCannotBeIsNotBelieved) {
  int n = 0;
  bus.slaves[0].loses = [&n](const Heard& h) { return h.type == BUSHD_MSG_TICKS && n++ == 1; };
  bus.slaves[0].spoils = [](bushd_report& report) {
    if (report.out_of_order != 0)
      report.out_of_order_until = static_cast<std::uint16_t>(report.tick + 5000);
  };
  const Tick start = begin(0);
  bus.run_for(1'000'000);
  expect_taken(0, start, start + 300);
  EXPECT_GT(bus.master->health(McuIndex{0}).repeats, 1u) << "all from the gap on";
}

TEST_P(Stream, ReplacementSwitchesThePlanAtItsTick) {
  const Tick start = begin(0);
  const Tick other = begin(1);
  bus.run_for(600'000);
  const Tick at = bus.earliest_replace();
  EXPECT_LE(at - bus.tick(0), 15) << "well before the end of the queue";
  bus.source.displacement = [at](std::uint8_t m, Tick t) { return value(m, t, m == 0 && t >= at); };
  bus.master->replace(McuIndex{0}, 1, at);
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.slaves[0].epoch, 1);
  expect_taken(0, start, at, 0);
  expect_taken(0, at, at + 350, 1);
  expect_taken(1, other, other + 500, 0);
  EXPECT_EQ(bus.count<link::ReplacementFailed>(), 0);
  EXPECT_EQ(bus.slaves[0].faults, 0);
  EXPECT_EQ(bus.slaves[1].epoch, 0);
}

// One that had to wait for an answer until it was too late is not even sent; and nothing else goes
// out before the source knows and has planned anew.
TEST_P(Stream, LateReplacementIsToldBeforeAnythingElseIsSent) {
  int late = 0;
  for (int unanswered_ms = 150; unanswered_ms < 230; unanswered_ms += 2) {
    FakeBus fresh(1, 4, GetParam());
    fresh.source.displacement = bus.source.displacement;
    fresh.connect();
    const Tick start = fresh.master->earliest_start(fresh.now_us, McuIndex{0}, 0);
    fresh.master->begin(McuIndex{0}, 0, start);
    fresh.run_for(600'000);
    fresh.slaves[0].loses = [](const Heard& frame) { return frame.type == BUSHD_MSG_POLL; };
    fresh.run_for(unanswered_ms * 1000);
    const Tick at = fresh.earliest_replace();
    fresh.source.displacement = [at](std::uint8_t m, Tick t) { return value(m, t, t >= at); };
    fresh.master->replace(McuIndex{0}, 1, at);
    fresh.slaves[0].loses = [](const Heard&) { return false; };
    fresh.run_until(
        [&] { return fresh.count<link::ReplacementFailed>() > 0 || fresh.slaves[0].epoch != 0; },
        200'000);
    if (fresh.slaves[0].epoch != 0) continue;
    ++late;
    fresh.source.displacement = bus.source.displacement;
    fresh.run_for(500'000);
    for (const auto& [tick, taken] : fresh.slaves[0].taken[0]) {
      ASSERT_EQ(taken, value(0, tick, 0)) << unanswered_ms << " ms, tick " << tick - start;
    }
  }
  EXPECT_GT(late, 0);
}

TEST_P(Stream, LostReplacementIsToldAndTheOldPlanStandsUntilThen) {
  const Tick start = begin(0);
  begin(1);
  bus.run_for(600'000);
  const Tick at = bus.earliest_replace();
  bus.slaves[0].loses = [](const Heard& heard) {
    return heard.type == BUSHD_MSG_TICKS && (heard.payload[1] & BUSHD_TICKS_REPLACE);
  };
  bus.master->replace(McuIndex{0}, 3, at);
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::ReplacementFailed>() > 0; }, 200'000));
  EXPECT_EQ(bus.last<link::ReplacementFailed>()->motors, 3);
  EXPECT_EQ(bus.slaves[0].epoch, 0);
  bus.slaves[0].loses = [](const Heard&) { return false; };
  // Planned again from a later tick.
  const Tick again = bus.earliest_replace();
  bus.source.displacement = [again](std::uint8_t m, Tick t) { return value(m, t, t >= again); };
  bus.master->replace(McuIndex{0}, 3, again);
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.slaves[0].epoch, 2) << "what followed the first may still be on its way";
  expect_taken(0, start, again, 0);
  expect_taken(0, again, again + 350, 1);
  EXPECT_EQ(bus.count<link::ReplacementFailed>(), 1);
  EXPECT_EQ(bus.slaves[0].faults, 0);
}

TEST_P(Stream, LostConfirmationOfAReplacementIsAskedForAgain) {
  const Tick start = begin(0);
  bus.run_for(600'000);
  const Tick at = bus.earliest_replace();
  bus.source.displacement = [at](std::uint8_t m, Tick t) { return value(m, t, t >= at); };
  bus.master->replace(McuIndex{0}, 1, at);
  int polls = 0;
  bus.slaves[0].loses = [&](const Heard& heard) {
    return heard.type == BUSHD_MSG_POLL && ++polls <= 2;
  };
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.slaves[0].epoch, 1);
  EXPECT_EQ(bus.count<link::ReplacementFailed>(), 0);
  expect_taken(0, start, at, 0);
  expect_taken(0, at, at + 350, 1);
}

TEST_P(Stream, ReplacementOfWhatWasNotYetSentNeedsNone) {
  bus.master->begin(McuIndex{0}, 0, bus.master->earliest_start(bus.now_us, McuIndex{0}, 0));
  bus.master->replace(McuIndex{0}, 1, bus.earliest_replace());
  bus.run_for(500'000);
  EXPECT_EQ(bus.slaves[0].epoch, 0);
  EXPECT_EQ(bus.slaves[0].faults, 0);
}

TEST_P(Stream, LateStartIsToldAndDropped) {
  bus.slaves[0].loses = [](const Heard& heard) { return heard.type == BUSHD_MSG_TICKS; };
  begin(2);
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::StartMissed>() > 0; }, 1'000'000));
  EXPECT_EQ(bus.last<link::StartMissed>()->motor, 2);
  EXPECT_EQ(bus.last<link::StartMissed>()->mcu, McuIndex{0});
  bus.slaves[0].loses = [](const Heard&) { return false; };
  bus.run_for(500'000);
  EXPECT_TRUE(bus.slaves[0].taken[2].empty()) << "not started by a later frame";
  EXPECT_EQ(bus.count<link::StartMissed>(), 1);
  const Tick start = begin(2);
  bus.run_for(1'000'000);
  expect_taken(2, start, start + 300);
}

TEST_P(Stream, PortLostDropsAllStreams) {
  begin(0);
  bus.run_for(500'000);
  bus.master->port_lost(bus.now_us, "unplugged");
  bus.master->port_opened(bus.now_us);
  bus.run_for(10'000);  // what was on the way
  bus.heard.clear();
  bus.run_for(1'500'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TICKS).size(), 0u);
}

}  // namespace
}  // namespace bushd::test
