// Motors that run by their tables: their ticks told as states, or the whole move at once.
#include "bus/rs485/slave.h"
#include "bus/rs485/start_margin.h"

namespace bushd::test {
namespace {

using link::Tick;

class Tables : public testing::TestWithParam<bushd_format> {
 protected:
  Tables() : bus(1, 4, GetParam()) {
    bus.source.displacement = [this](std::uint8_t m, Tick t) { return displacement(m, t); };
    bus.source.delay = [this](std::uint8_t m, Tick t) {
      const auto run = at(m, t);
      return run ? static_cast<std::uint16_t>(bushd_run_delay(&*run)) : std::uint16_t{0};
    };
    bus.source.end = [this](std::uint8_t m) { return end(m); };
    bus.source.segment = [this](std::uint8_t m, Tick first,
                                unsigned max_ticks) -> std::optional<link::TickSource::RunSegment> {
      const auto run = at(m, first);
      if (!run) return std::nullopt;
      const bool stops = plan[m].stop && *plan[m].stop > first;
      const auto left = static_cast<unsigned>((stops ? *plan[m].stop : end(m)) - first);
      return link::TickSource::RunSegment{*run, std::min(left, max_ticks)};
    };
    bus.connect();
  }

  // A motor's plan: a run from its start, ramped down from a tick on if there is a stop.
  struct Plan {
    Tick start = 0;
    std::optional<Tick> stop;
    // At the beginning of each tick from `start` on, and its displacement; until it is done.
    std::vector<std::pair<bushd_run, std::int16_t>> ticks;
  };
  void plan_run(std::uint8_t m, Tick start, std::uint32_t steps) {
    bushd_run run;
    bushd_run_start(&run, &bus.table, steps, 1, 0);
    plan[m] = {start, {}, {}};
    expand(plan[m], run);
  }
  void plan_stop(std::uint8_t m, Tick at) {
    Plan& p = plan[m];
    bushd_run run = p.ticks.at(static_cast<std::size_t>(at - p.start)).first;
    p.ticks.resize(static_cast<std::size_t>(at - p.start));
    p.stop = at;
    bushd_run_ramp_down(&run);
    expand(p, run);
  }
  void expand(Plan& p, bushd_run run) const {
    while (!bushd_run_done(&run)) {
      const bushd_run before = run;
      std::int16_t displacement = 0;
      if (GetParam() == BUSHD_FORMAT_FINE) {
        bushd_run_expand_fine(&run, bus.setup.tick_ns, 1, &displacement, 1);
      } else {
        std::uint8_t coarse = 0;
        bushd_run_expand_coarse(&run, bus.setup.tick_ns, 1, &coarse, 1);
        displacement = coarse;
      }
      p.ticks.emplace_back(before, displacement);
    }
  }
  Tick end(std::uint8_t m) const { return plan[m].start + static_cast<Tick>(plan[m].ticks.size()); }
  // The run at the beginning of a tick; none before the start and after the end.
  std::optional<bushd_run> at(std::uint8_t m, Tick tick) const {
    if (tick < plan[m].start || tick >= end(m)) return std::nullopt;
    return plan[m].ticks[static_cast<std::size_t>(tick - plan[m].start)].first;
  }
  std::int16_t displacement(std::uint8_t m, Tick tick) const {
    if (tick < plan[m].start || tick >= end(m)) return 0;
    return plan[m].ticks[static_cast<std::size_t>(tick - plan[m].start)].second;
  }

  void start(std::uint8_t m, std::uint32_t steps, bool whole) {
    plan_run(m, bus.master->earliest_start(bus.now_us, McuIndex{0}, m), steps);
    if (whole) {
      bus.master->begin_table_run(McuIndex{0}, m, plan[m].start,
                                  {static_cast<std::int32_t>(steps)});
    } else {
      bus.master->begin(McuIndex{0}, m, plan[m].start);
    }
  }
  void expect_taken(std::uint8_t m, Tick from, Tick until) const {
    for (Tick t = from; t < until; ++t) {
      const auto found = bus.slaves[0].taken[m].find(static_cast<std::uint32_t>(t));
      ASSERT_NE(found, bus.slaves[0].taken[m].end()) << t - from;
      const std::int16_t expected = displacement(m, t);
      // Behind the last step a coarse byte may have a direction.
      ASSERT_EQ(found->second & ~0x80, expected & ~0x80) << t - from;
    }
  }

  FakeBus bus;
  std::array<Plan, 4> plan;
};
INSTANTIATE_TEST_SUITE_P(Formats, Tables, testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         [](const auto& p) {
                           return p.param == BUSHD_FORMAT_FINE ? "Fine" : "Coarse";
                         });

TEST_P(Tables, StatesGiveTheSameTicksInFewFrames) {
  start(0, 600, false);
  start(2, 350, false);
  bus.run_for(4'000'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TICKS).size(), 0u);
  EXPECT_GE(bus.heard_of(BUSHD_MSG_TABLE_TICKS).size(), 2u);
  expect_taken(0, plan[0].start, end(0));
  expect_taken(2, plan[2].start, end(2));
  EXPECT_EQ(bus.slaves[0].faults, 0);
  EXPECT_EQ(bus.slaves[0].rejected, 0);
  EXPECT_EQ(bus.master->health(McuIndex{0}).repeats, 0u);
}

TEST_P(Tables, LostStatesAreSentAgain) {
  for (int every = 2; every < 5; ++every) {
    int n = 0;
    bus.slaves[0].loses = [&](const Heard& heard) {
      const bool ticks = heard.type == BUSHD_MSG_TABLE_TICKS || heard.type == BUSHD_MSG_TICKS;
      return ticks && ++n % every == 0;
    };
    start(0, 700, false);
    bus.run_for(4'000'000);
    expect_taken(0, plan[0].start, end(0));
    EXPECT_EQ(bus.slaves[0].faults, 0);
  }
}

TEST_P(Tables, StopReplacesStatesFromItsTickOn) {
  start(0, 3000, false);
  bus.run_for(1'500'000);
  plan_stop(0, bus.earliest_replace());
  bus.master->replace(McuIndex{0}, 1, *plan[0].stop);
  bus.run_for(4'000'000);
  expect_taken(0, plan[0].start, end(0));
  EXPECT_EQ(bus.slaves[0].faults, 0);
  EXPECT_EQ(bus.slaves[0].epoch, 1);
}

TEST_P(Tables, WholeMoveIsOneFrame) {
  start(1, 2000, true);
  start(3, 1000, true);
  bus.run_for(200'000);
  ASSERT_EQ(bus.heard_of(BUSHD_MSG_TABLE_RUN).size(), 1u) << "both start at the same tick";
  ASSERT_TRUE(bus.slaves[0].run[1].has_value());
  EXPECT_EQ(bus.slaves[0].run[1]->steps, 2000u);
  EXPECT_EQ(bus.slaves[0].run[3]->steps, 1000u);
  bus.run_for(6'000'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TABLE_RUN).size(), 1u);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TICKS).size() + bus.heard_of(BUSHD_MSG_TABLE_TICKS).size(), 0u);
  EXPECT_EQ(bus.count<link::StartMissed>(), 0);
}

TEST_P(Tables, LostWholeMoveIsSentAgainInTime) {
  int n = 0;
  bus.slaves[0].loses = [&](const Heard& h) { return h.type == BUSHD_MSG_TABLE_RUN && n++ == 0; };
  start(1, 2000, true);
  bus.run_for(200'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TABLE_RUN).size(), 2u);
  EXPECT_TRUE(bus.slaves[0].run[1].has_value());
}

// Polls are 50 ms apart otherwise. Asked is within a tick of the end, and an exchange takes less
// than 5 ms: some 15 bytes of 20 us, 1 ms to the first window, some 80 bytes.
TEST_P(Tables, TheEndOfAMoveIsHeardOfAtOnce) {
  for (std::uint32_t steps = 20; steps < 60; ++steps) {
    start(1, steps, steps % 2 == 0);
    ASSERT_TRUE(bus.run_until([&] { return bus.master->tick_at(bus.now_us) >= end(1); }));
    const std::int64_t ended_us = bus.now_us;
    ASSERT_TRUE(bus.run_until([&] { return bus.master->view(McuIndex{0}).tick >= end(1); }));
    EXPECT_LE(bus.now_us - ended_us, std::int64_t{FakeBus::kTickNs} / 1000 + 5'000) << steps;
    bus.master->drop(McuIndex{0}, 1);
  }
}

// The line is busy with a poll for 5 ms at most (see above), carries the frame of some 40 bytes in
// 0.8 ms, and the program has 2 ms; then the MCU needs two ticks, by one of which the clock may
// lag, and the start is the next one.
TEST_P(Tables, WhatOneFrameTellsBeginsAsSoonAsThatCanCome) {
  const Tick most = bus.master->earliest_start(bus.now_us, McuIndex{0}, 1);
  const Tick lead = 4 + (5'000 + 800 + 2'000) * 1000 / FakeBus::kTickNs;
  ASSERT_LT(lead, most - bus.master->tick_at(bus.now_us)) << "no bound otherwise";
  for (std::uint32_t phase = 0; phase < 60; ++phase) {
    bus.run_for(50'000 + phase * 873);
    const bool whole = phase % 2 == 0;
    const Tick now = bus.master->tick_at(bus.now_us);
    const std::uint16_t motors = whole ? 0b1010 : 0b0010;
    const link::ToBegin begins[] = {
        {McuIndex{0}, motors,
         whole ? link::StartMessages::kTableRun : link::StartMessages::kStates}};
    const Tick start = bus.master->earliest_common_start(bus.now_us, begins).at;
    EXPECT_LE(start - now, lead) << phase;
    for (std::uint8_t m = 0; m < 4; ++m) {
      if ((motors >> m & 1) == 0) continue;
      plan_run(m, start, 200);
      if (whole) {
        bus.master->begin_table_run(McuIndex{0}, m, start, {200});
      } else {
        bus.master->begin(McuIndex{0}, m, start);
      }
    }
    ASSERT_TRUE(bus.run_until([&] { return bus.master->view(McuIndex{0}).tick >= end(1); }));
    bus.master->drop(McuIndex{0}, 1);
    bus.master->drop(McuIndex{0}, 3);
  }
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TABLE_RUN).size(), 30u);
  EXPECT_EQ(bus.count<link::StartMissed>(), 0);
}

TEST_P(Tables, AStartThatWouldComeTooLateIsNotSent) {
  const Tick start = bus.master->tick_at(bus.now_us) + 1;
  plan_run(1, start, 40);
  bus.master->begin_table_run(McuIndex{0}, 1, start, {40});
  bus.run_for(1'000);
  EXPECT_EQ(bus.count<link::StartMissed>(), 1);
  EXPECT_FALSE(bus.master->start_was_lost(McuIndex{0}, 1)) << "nothing was told";
  bus.run_for(500'000);
  EXPECT_EQ(bus.count<link::StartMissed>(), 1);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TABLE_RUN).size(), 0u);
}

TEST_P(Tables, AMissedStartLeavesMoreTimeForTheNext) {
  const auto lead = [this] {
    const link::ToBegin begins[] = {{McuIndex{0}, 1, link::StartMessages::kTableRun}};
    return bus.master->earliest_common_start(bus.now_us, begins).at -
           bus.master->tick_at(bus.now_us);
  };
  bus.run_for(500'000);
  const Tick before = lead();
  for (int missed = 0; missed < 5; ++missed) {
    bus.run_for(1'000);
    bus.master->start_missed();
    bus.master->start_missed();  // another motor, at the same time
  }
  EXPECT_EQ(bus.master->start_margin_us(bus.now_us), link::StartMargin::kMostUs);
  // The clock's part of a tick is cut off at both times.
  EXPECT_GE(
      lead() - before,
      (link::StartMargin::kMostUs - link::StartMargin::kLeastUs) * 1000 / FakeBus::kTickNs - 1);
  bus.run_for(60'000'000);
  EXPECT_LE(lead(), before + 1) << "forgotten";
  EXPECT_EQ(bus.master->start_margin_us(bus.now_us), link::StartMargin::kLeastUs);
}

TEST_P(Tables, WholeMoveThatIsTooLateIsTold) {
  bus.slaves[0].loses = [](const Heard& h) { return h.type == BUSHD_MSG_TABLE_RUN; };
  start(1, 2000, true);
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::StartMissed>() > 0; }, 1'000'000));
}

TEST_P(Tables, AStartThatIsLostIsToldFromOneThatIsRefused) {
  bool refuses = false;
  bus.slaves[0].loses = [&](const Heard& h) {
    if (h.type != BUSHD_MSG_TABLE_RUN) return false;
    if (refuses) ++bus.slaves[0].rejected;  // as it does what comes too late
    return true;
  };
  start(1, 2000, true);
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::StartMissed>() == 1; }, 1'000'000));
  EXPECT_TRUE(bus.master->start_was_lost(McuIndex{0}, 1));
  refuses = true;
  start(1, 2000, true);
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::StartMissed>() == 2; }, 1'000'000));
  EXPECT_FALSE(bus.master->start_was_lost(McuIndex{0}, 1));
}

TEST_P(Tables, StopOfAWholeMoveGoesOnAsAStream) {
  start(1, 5000, true);
  bus.run_for(1'500'000);
  plan_stop(1, bus.earliest_replace());
  bus.master->replace(McuIndex{0}, 2, *plan[1].stop);
  bus.run_for(3'000'000);
  EXPECT_EQ(bus.slaves[0].epoch, 1);
  EXPECT_FALSE(bus.slaves[0].run[1].has_value());
  expect_taken(1, *plan[1].stop, end(1));
  EXPECT_EQ(bus.slaves[0].faults, 0);
}

TEST_P(Tables, StopOfAWholeMoveThatIsLostIsToldAndTriedAgain) {
  start(1, 5000, true);
  bus.run_for(1'500'000);
  int n = 0;
  bus.slaves[0].loses = [&](const Heard& h) {
    return h.type == BUSHD_MSG_TICKS && (h.payload[1] & BUSHD_TICKS_REPLACE) && n++ == 0;
  };
  plan_stop(1, bus.earliest_replace());
  bus.master->replace(McuIndex{0}, 2, *plan[1].stop);
  ASSERT_TRUE(bus.run_until([&] { return bus.count<link::ReplacementFailed>() > 0; }, 500'000));
  EXPECT_TRUE(bus.slaves[0].run[1].has_value()) << "goes on";
  plan_stop(1, bus.earliest_replace());
  bus.master->replace(McuIndex{0}, 2, *plan[1].stop);
  bus.run_for(3'000'000);
  expect_taken(1, *plan[1].stop, end(1));
  EXPECT_EQ(bus.slaves[0].faults, 0);
}

TEST_P(Tables, StopBeforeAWholeMoveWasSentMakesItAStream) {
  start(1, 5000, true);
  plan_stop(1, plan[1].start + 20);
  bus.master->replace(McuIndex{0}, 2, *plan[1].stop);
  bus.run_for(3'000'000);
  EXPECT_FALSE(bus.slaves[0].run[1].has_value());
  expect_taken(1, plan[1].start, end(1));
  EXPECT_EQ(bus.slaves[0].faults, 0);
}

TEST_P(Tables, EmergencyIsSaidUntilAllHaveHeardIt) {
  start(0, 3000, false);
  start(1, 3000, true);
  bus.run_for(800'000);
  int n = 0;
  bus.slaves[0].loses = [&](const Heard& h) { return h.type == BUSHD_MSG_EMERGENCY && n++ < 4; };
  bus.heard.clear();
  bus.master->emergency_stop(BUSHD_STOP_IMMEDIATE);
  const std::int64_t from_us = bus.now_us;
  ASSERT_TRUE(bus.run_until([&] { return bus.slaves[0].faults != 0; }, 1'000'000));
  EXPECT_LE(bus.now_us - from_us, 100'000);
  bus.run_for(1'000'000);
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_EMERGENCY).size(), 6u) << "three, and three more";
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_EMERGENCY)[0].payload, Bytes{BUSHD_STOP_IMMEDIATE});
  EXPECT_EQ(bus.heard_of(BUSHD_MSG_TABLE_TICKS).size(), 0u) << "nothing more for any motor";
  // It stays latched through a lost link: people clear it.
  bus.master->port_lost(bus.now_us, "unplugged");
  bus.master->port_opened(bus.now_us);
  bus.connect();
  EXPECT_EQ(bus.slaves[0].faults, BUSHD_FAULT_EMERGENCY);
  bus.master->control(McuIndex{0}, BUSHD_CONTROL_CLEAR_FAULTS);
  bus.run_for(300'000);
  EXPECT_EQ(bus.slaves[0].faults, 0);
}

}  // namespace
}  // namespace bushd::test
