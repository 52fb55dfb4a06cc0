// Which frames go out for which reports, without a bus.
#include "bus/rs485/stream_scheduler.h"

#include "bus/rs485/machines.h"
#include "bus/rs485/slave.h"

namespace bushd::test {
namespace {

using link::Tick;

constexpr std::int64_t kNowUs = 2'560'000;  // tick 1000
constexpr std::int64_t kLeadUs = 300'000;
constexpr link::StreamScheduler::Filling kFilling{.lead_us = kLeadUs, .target_us = kLeadUs};

class Scheduling : public testing::Test {
 protected:
  Scheduling() {
    clock.sample(1000, 0, kNowUs);
    for (std::uint8_t m = 0; m < 4; ++m) known_until(m, 1002);
    report().motor_count = 4;
  }

  bushd_report& report() { return mcus[kFirst].view.report; }
  void known_until(std::uint8_t motor, Tick tick) {
    mcus[kFirst].view.known_until[motor] = tick;
    if (tick > 1002) report().moving |= static_cast<std::uint16_t>(1u << motor);
  }
  struct Ticks {
    int mask;
    Tick first;
    int count;
    int flags;
    int epoch;
    bool operator==(const Ticks&) const = default;
  };
  // One frame, decoded; none if nothing is to be sent.
  std::optional<Ticks> next() {
    if (!streams.send_stream(kNowUs, kFilling)) return std::nullopt;
    return frame();
  }
  std::optional<Ticks> frame() {
    const auto sent = take_sent(writer);
    EXPECT_EQ(sent.size(), 1u);
    EXPECT_EQ(sent[0].type, BUSHD_MSG_TICKS);
    bushd_ticks ticks;
    EXPECT_EQ(bushd_decode_ticks(sent[0].payload.data(), sent[0].payload.size(), &ticks), BUSHD_OK);
    return Ticks{ticks.mask, ticks.first_tick, ticks.count, ticks.flags & ~BUSHD_TICKS_FINE,
                 ticks.epoch};
  }
  // Whether a replacement has failed.
  bool fail_late(std::int64_t now_us) {
    const std::size_t before = events.size();
    streams.fail_late_replacements(now_us);
    return events.size() > before;
  }
  int fill() {
    int frames = 0;
    while (next()) ++frames;
    return frames;
  }

  PerMcu<McuRecord> mcus = online_mcus(1);
  link::BusSetup setup = bus_setup(mcus);
  link::BusClock clock{kTickNs};
  FakeSource source;
  link::FrameWriter writer{kBaud};
  std::vector<link::Event> events;
  link::StreamScheduler streams{{.setup = setup,
                                 .mcus = mcus,
                                 .clock = clock,
                                 .source = source,
                                 .writer = writer,
                                 .events = events}};
};

TEST_F(Scheduling, NothingIsSentWithoutAMove) {
  EXPECT_FALSE(next());
  EXPECT_FALSE(streams.has_ticks_to_send(kFirst));
}

TEST_F(Scheduling, FirstFrameIsAStartAndTheOthersGoOn) {
  streams.begin(kFirst, 2, 1040);
  EXPECT_EQ(next(), (Ticks{4, 1040, 16, BUSHD_TICKS_START, 0}));
  EXPECT_EQ(next(), (Ticks{4, 1056, 16, 0, 0}));
  fill();
  EXPECT_LE(streams.next_tick(kFirst, 2), 1000 + clock.ticks_in(kLeadUs));
  EXPECT_TRUE(streams.has_ticks_to_send(kFirst));
}

TEST_F(Scheduling, MotorsOfOneTickShareAFrame) {
  streams.begin(kFirst, 0, 1040);
  streams.begin(kFirst, 3, 1040);
  EXPECT_EQ(next(), (Ticks{0b1001, 1040, 16, BUSHD_TICKS_START, 0}));
}

TEST_F(Scheduling, LaterMotorJoinsWhereItsStreamBegins) {
  streams.begin(kFirst, 0, 1040);
  streams.begin(kFirst, 1, 1050);
  EXPECT_EQ(next(), (Ticks{1, 1040, 10, BUSHD_TICKS_START, 0})) << "up to the other's start";
  EXPECT_EQ(next(), (Ticks{2, 1050, 16, BUSHD_TICKS_START, 0})) << "a start has a frame of its own";
  EXPECT_EQ(next(), (Ticks{1, 1050, 16, 0, 0}));
  EXPECT_EQ(next(), (Ticks{3, 1066, 16, 0, 0})) << "from here on both";
}

TEST_F(Scheduling, StreamEndsWithItsMove) {
  source.end = [](std::uint8_t) { return Tick{1045}; };
  streams.begin(kFirst, 0, 1040);
  EXPECT_EQ(next(), (Ticks{1, 1040, 5, BUSHD_TICKS_START, 0}));
  EXPECT_FALSE(streams.has_ticks_to_send(kFirst));
}

TEST_F(Scheduling, WhatAReportMissesIsSentAgain) {
  streams.begin(kFirst, 0, 1010);
  fill();
  known_until(0, 1026);
  streams.follow_report(kFirst);
  EXPECT_EQ(next(), (Ticks{1, 1026, 16, 0, 0}));
  EXPECT_EQ(mcus[kFirst].health.repeats, 1u);
}

TEST_F(Scheduling, TicksBeyondAGapAreNotSentAgain) {
  streams.begin(kFirst, 0, 1010);
  fill();
  const Tick sent = streams.next_tick(kFirst, 0);
  known_until(0, 1026);
  report().tick = 1000;
  report().out_of_order = 1;
  report().out_of_order_from = 1042;
  report().out_of_order_until = static_cast<std::uint16_t>(sent);
  mcus[kFirst].view.tick = 1000;
  streams.follow_report(kFirst);
  EXPECT_EQ(next(), (Ticks{1, 1026, 16, 0, 0}));
  EXPECT_EQ(streams.next_tick(kFirst, 0), sent);
  EXPECT_EQ(mcus[kFirst].health.missed_ticks, 16u);
}

TEST_F(Scheduling, StartThatCameTooLateIsToldAndDropped) {
  streams.begin(kFirst, 0, 1010);
  fill();
  report().moving = 0;
  mcus[kFirst].view.known_until[0] = 1020;  // its start has passed, and it does not move
  streams.follow_report(kFirst);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(std::get<link::StartMissed>(events[0]).motor, 0);
  EXPECT_FALSE(streams.has_ticks_to_send(kFirst));
}

// The trigger has begun it, so nothing was sent, and no start can be missed any more.
TEST_F(Scheduling, ARunThatTheMcuHasBegunMissesNoStart) {
  source.end = [](std::uint8_t) { return Tick{1200}; };
  streams.follow_run(kFirst, 0, 990, link::TableRun{.steps = 1000});
  known_until(0, 1010);  // not running any more, as far as it knows
  streams.follow_report(kFirst);
  streams.fail_late_starts(kNowUs);
  EXPECT_TRUE(events.empty());
  EXPECT_TRUE(streams.has_ticks_to_send(kFirst));
}

class Replacing : public Scheduling {
 protected:
  Replacing() {
    streams.begin(kFirst, 0, 1010);
    fill();
    writer.reset(kNowUs);  // all of it has left the line
    sent = streams.next_tick(kFirst, 0);
    known_until(0, sent);
  }
  Tick sent = 0;
};

TEST_F(Replacing, OpensAnEpochAndItsFollowersDoNotWait) {
  streams.replace(kFirst, 1, 1020, kNowUs);
  EXPECT_TRUE(streams.has_replacement_to_send(kFirst));
  EXPECT_FALSE(next()) << "the plan in the source is one that the MCU does not know";
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  EXPECT_EQ(frame(), (Ticks{1, 1020, 16, BUSHD_TICKS_REPLACE, 1}));
  EXPECT_TRUE(mcus[kFirst].poll_wanted) << "to see whether it was taken";
  EXPECT_EQ(next(), (Ticks{1, 1036, 16, 0, 1}));
}

TEST_F(Replacing, TakenOnceTheReportShowsItsEpoch) {
  streams.replace(kFirst, 1, 1020, kNowUs);
  streams.send_due_replacement(kNowUs);
  report().epoch = 1;
  known_until(0, 1036);
  streams.follow_report(kFirst);
  EXPECT_TRUE(events.empty());
  EXPECT_FALSE(streams.replacement_open(kFirst));
}

TEST_F(Replacing, NotTakenIsToldAndTheNextTryHasAnEpochOfItsOwn) {
  streams.replace(kFirst, 1, 1020, kNowUs);
  streams.send_due_replacement(kNowUs);
  streams.follow_report(kFirst);  // in epoch 0
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(std::get<link::ReplacementFailed>(events[0]).motors, 1);
  take_sent(writer);
  streams.replace(kFirst, 1, 1024, kNowUs);
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  EXPECT_EQ(frame()->epoch, 2);
}

// Behind a gap that no report shows the MCU may have ticks of the plan before the one that failed.
TEST_F(Replacing, AfterOneThatFailedTheNextTakesAwayWhatTheMcuMayHave) {
  streams.replace(kFirst, 1, 1020, kNowUs);
  streams.send_due_replacement(kNowUs);
  take_sent(writer);
  known_until(0, 1040);
  streams.follow_report(kFirst);  // in epoch 0
  streams.replace(kFirst, 1, 1060, kNowUs);
  ASSERT_TRUE(streams.send_due_replacement(kNowUs)) << "though nothing from 1060 on was sent";
  EXPECT_EQ(frame()->first, 1040);
}

TEST_F(Replacing, DroppedMotorIsNotReplaced) {
  streams.begin(kFirst, 1, 1010);
  fill();
  streams.replace(kFirst, 3, 1020, kNowUs);
  streams.drop(kFirst, 0);
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  EXPECT_EQ(frame()->mask, 2);
}

TEST_F(Replacing, TooLateToSendFailsUnsent) {
  streams.replace(kFirst, 1, 1002, kNowUs);
  EXPECT_FALSE(fail_late(kNowUs));
  EXPECT_TRUE(fail_late(kNowUs + 2'560)) << "a tick later";
  ASSERT_EQ(events.size(), 1u);
  EXPECT_FALSE(streams.send_due_replacement(kNowUs));
}

TEST_F(Replacing, WhatWasNeverSentNeedsNone) {
  streams.begin(kFirst, 1, 1040);
  streams.replace(kFirst, 2, 1040, kNowUs);
  EXPECT_FALSE(streams.has_replacement_to_send(kFirst));
}

// The MCU has the rest before the start already, so it refuses another start.
TEST_F(Replacing, BeforeTheStartIsFollowedByNoStart) {
  streams.begin(kFirst, 1, 1040);
  next();
  streams.replace(kFirst, 2, 1024, kNowUs);
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  EXPECT_EQ(frame(), (Ticks{2, 1024, 16, BUSHD_TICKS_REPLACE, 1})) << "just up to the start";
  EXPECT_EQ(next(), (Ticks{2, 1040, 16, 0, 1}));
  report().epoch = 1;
  known_until(1, 1030);
  streams.follow_report(kFirst);
  EXPECT_EQ(next(), (Ticks{2, 1030, 16, 0, 1})) << "what is missing before the start, too";
}

TEST_F(Replacing, BeforeTheStartThatFailedLeavesTheStartAsItWas) {
  streams.begin(kFirst, 1, 1040);
  next();
  streams.replace(kFirst, 2, 1024, kNowUs);
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  frame();
  streams.follow_report(kFirst);  // in epoch 0, and the start was lost too
  EXPECT_EQ(next(), (Ticks{2, 1040, 16, BUSHD_TICKS_START, 0}));
}

// An MCU refuses ticks of a motor that rests for good, and with them those of the others.
TEST_F(Replacing, OfARunCancelledBeforeItsStartHasNoFollowers) {
  streams.begin(kFirst, 1, 1060);
  next();
  source.delay = [](std::uint8_t motor, Tick) { return std::uint16_t(motor == 1 ? 0 : 50); };
  streams.replace(kFirst, 2, 1024, kNowUs);
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  EXPECT_EQ(frame(), (Ticks{2, 1024, 16, BUSHD_TICKS_REPLACE, 1}));
  while (const auto ticks = next()) EXPECT_EQ(ticks->mask & 2, 0);
}

// A motor whose last tick the MCU has, and whose other plan it then does not get.
class ReplacingAnEnded : public Scheduling {
 protected:
  ReplacingAnEnded() {
    plan_until(1026);
    streams.begin(kFirst, 0, 1010);
    fill();
    writer.reset(kNowUs);
    known_until(0, 1026);
    plan_until(1200);
    streams.replace(kFirst, 1, 1020, kNowUs);
  }
  void plan_until(Tick end) {
    source.end = [end](std::uint8_t) { return end; };
  }
};

TEST_F(ReplacingAnEnded, GoesOnIfItIsTaken) {
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  EXPECT_EQ(frame(), (Ticks{1, 1020, 16, BUSHD_TICKS_REPLACE, 1}));
  EXPECT_EQ(next(), (Ticks{1, 1036, 16, 0, 1}));
}

TEST_F(ReplacingAnEnded, HasNoFollowersIfItWasTooLateAndThePlanStays) {
  ASSERT_TRUE(fail_late(kNowUs + 60'000));
  EXPECT_FALSE(next()) << "its source has not planned anew";
  EXPECT_FALSE(fail_late(kNowUs + 60'000)) << "the next step";
  plan_until(1026);
  EXPECT_FALSE(next());
  EXPECT_FALSE(streams.has_ticks_to_send(kFirst));
}

TEST_F(ReplacingAnEnded, HasNoFollowersIfItWasNotTakenAndThePlanStays) {
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  take_sent(writer);
  streams.follow_report(kFirst);  // in epoch 0
  ASSERT_EQ(events.size(), 1u);
  plan_until(1026);
  EXPECT_FALSE(next());
  EXPECT_FALSE(streams.has_ticks_to_send(kFirst));
}

// Its frame may take longer than until its tick.
TEST_F(Replacing, TooLateToArriveFailsUnsent) {
  streams.replace(kFirst, 1, 1010, kNowUs);
  EXPECT_FALSE(fail_late(kNowUs));
  std::vector<std::uint8_t> payload(200);
  for (int i = 0; i < 8; ++i) writer.send(kNowUs, McuAddress{9}, BUSHD_MSG_TICKS, payload);
  take_sent(writer);
  EXPECT_TRUE(fail_late(kNowUs)) << "behind what waits for the line";
}

TEST_F(Scheduling, TableRunIsGivenAsAWhole) {
  source.end = [](std::uint8_t) { return Tick{5000}; };
  streams.begin_run(kFirst, 0, 1040, link::TableRun{-700});
  ASSERT_TRUE(streams.send_stream(kNowUs, kFilling));
  const auto sent = take_sent(writer);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].type, BUSHD_MSG_TABLE_RUN);
  EXPECT_EQ(streams.next_tick(kFirst, 0), 5000);
  EXPECT_FALSE(streams.has_ticks_to_send(kFirst));
  // Broken off by the MCU: the motor is free from where that ends.
  known_until(0, 1100);
  streams.drop(kFirst, 0);
  EXPECT_EQ(streams.next_tick(kFirst, 0), 1100);
}

class LineRuns : public Scheduling {
 protected:
  static link::LineRun part(std::uint32_t increment, int direction) {
    return {.bank = 3,
            .elementary = false,
            .shortest_delay = 9,
            .longest = 700,
            .from = 100,
            .steps = 500,
            .ticks = 800,
            .increment = increment,
            .direction = direction};
  }
  void SetUp() override {
    // The motors' own last steps.
    source.end = [](std::uint8_t motor) { return motor == 0 ? Tick{1840} : Tick{1200}; };
    streams.begin_run(kFirst, 0, 1040, part(700, 1));
    streams.begin_run(kFirst, 2, 1040, part(5, -1));
  }
};

TEST_F(LineRuns, AreOneFrameForAllMotors) {
  EXPECT_TRUE(streams.runs_line());
  ASSERT_TRUE(streams.send_stream(kNowUs, kFilling));
  const auto sent = take_sent(writer);
  ASSERT_EQ(sent.size(), 1u);
  ASSERT_EQ(sent[0].type, BUSHD_MSG_LINE_RUN);
  bushd_line_run message{};
  ASSERT_EQ(bushd_decode_line_run(sent[0].payload.data(), sent[0].payload.size(), &message),
            BUSHD_OK);
  EXPECT_EQ(message.first_tick, 1040u);
  EXPECT_EQ(message.line.bank, 3);
  EXPECT_EQ(message.line.shortest_delay, 9);
  EXPECT_EQ(message.line.longest, 700u);
  EXPECT_EQ(message.line.from, 100u);
  EXPECT_EQ(message.line.steps, 500u);
  ASSERT_EQ(message.line.count, 2);
  const std::uint8_t* at = message.line.entries;
  const bushd_line_entry first = bushd_next_line_entry(&at);
  const bushd_line_entry second = bushd_next_line_entry(&at);
  EXPECT_EQ(first.motor, 0);
  EXPECT_EQ(first.increment, 700u);
  EXPECT_EQ(second.motor, 2);
  EXPECT_EQ(second.direction, -1);
  EXPECT_FALSE(streams.has_ticks_to_send(kFirst));
}

TEST_F(LineRuns, LostFrameIsSentAgain) {
  ASSERT_TRUE(streams.send_stream(kNowUs, kFilling));
  take_sent(writer);
  streams.follow_report(kFirst);
  ASSERT_TRUE(streams.send_stream(kNowUs, kFilling));
  EXPECT_EQ(take_sent(writer)[0].type, BUSHD_MSG_LINE_RUN);
  // Then the report shows it.
  report().running = report().moving = 0b101;
  known_until(0, 1840);
  known_until(2, 1840);
  streams.follow_report(kFirst);
  EXPECT_FALSE(streams.send_stream(kNowUs, kFilling));
}

// The MCU makes the run to its end for every motor of it.
TEST_F(LineRuns, ReplacementTakesAllOffTheLine) {
  ASSERT_TRUE(streams.send_stream(kNowUs, kFilling));
  take_sent(writer);
  report().running = report().moving = 0b101;
  known_until(0, 1840);
  known_until(2, 1840);
  streams.follow_report(kFirst);
  source.end = [](std::uint8_t motor) { return motor == 0 ? Tick{1330} : Tick{1200}; };
  streams.replace(kFirst, 0b101, 1300, kNowUs);
  ASSERT_TRUE(streams.send_due_replacement(kNowUs));
  const auto replacement = frame();
  ASSERT_TRUE(replacement);
  EXPECT_EQ(replacement->mask, 0b101);
  EXPECT_EQ(replacement->first, 1300);
  EXPECT_EQ(replacement->flags, BUSHD_TICKS_REPLACE);
  EXPECT_FALSE(streams.runs_line());
}

// A start is urgent, since little is queued; its frame holds no less for that.
TEST_F(Scheduling, StatesOfRunsFillTheQueueWhateverMadeThemDue) {
  mcus[kFirst].view.identity.capabilities |= BUSHD_CAN_TABLE_TICKS;
  source.segment = [](std::uint8_t, Tick, unsigned max_ticks) {
    bushd_run run;
    bushd_run_start(&run, &small_table(), 1'000'000, 1, 0);
    return link::TickSource::RunSegment{run, max_ticks};
  };
  streams.begin(kFirst, 0, 1040);
  const link::StreamScheduler::Filling urgent{.lead_us = 120'000, .target_us = 300'000};
  ASSERT_TRUE(streams.send_stream(kNowUs, urgent));
  const auto sent = take_sent(writer);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].type, BUSHD_MSG_TABLE_TICKS);
  EXPECT_EQ(streams.next_tick(kFirst, 0), 1000 + 2 * clock.ticks_in(300'000));
  EXPECT_FALSE(streams.send_stream(kNowUs, urgent)) << "not due";
}

TEST_F(Scheduling, McuThatIsNotOnlineGetsNothing) {
  streams.begin(kFirst, 0, 1040);
  mcus[kFirst].view.phase = link::McuPhase::kConnecting;
  EXPECT_FALSE(next());
}

}  // namespace
}  // namespace bushd::test
