// LINE_RUN: motors that follow one run along a line, exact to a slot.
#include <array>
#include <vector>

#include "firmware/line_runs.h"

namespace bushd::test {
namespace {

using LineRun = OfLines;
BUSHD_IN_BOTH_FORMATS(LineRun);

const std::vector<LineMotor> kOnLine = {{0, 333}, {1, -118}, {2, 1}, {3, 332}};

TEST_P(LineRun, EveryStepFallsIntoItsSlot) {
  std::array<std::int64_t, 4> at{};
  for (const std::uint16_t shortest_delay :
       {std::uint16_t{0}, static_cast<std::uint16_t>(law.cruise + 3)}) {
    const Frame line{.first = rig.first_open() + 3,
                     .motors = kOnLine,
                     .longest = 333,
                     .shortest_delay = shortest_delay};
    ASSERT_EQ(start(rig, line), BUSHD_OK);
    expect_slots(rig, Reference::move(law, 333, shortest_delay), line);
    for (const LineMotor& motor : kOnLine) at[motor.number] += motor.steps;
  }
  for (std::size_t m = 0; m < 4; ++m) EXPECT_EQ(rig.poll().motor[m].position_steps, at[m]);
  EXPECT_EQ(rig.steps_with_dir(), 0);
  EXPECT_EQ(rig.mcu().line.motors, 0);
}

TEST_P(LineRun, MayBeAPartOfALineWhoseLongestMotorIsElsewhere) {
  const Frame line{.first = rig.first_open() + 3,
                   .motors = {{1, -640}, {3, 71}},
                   .longest = 1000,
                   .from = 444,
                   .steps = 301};
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  expect_slots(rig, Reference::move(law, 301), line);
}

TEST_P(LineRun, IsExactInTicksThatAreNoWholeUnits) {
  Law odd = law;
  odd.unit_ns = 3701;
  for (std::uint16_t* code : {&odd.cruise}) *code = static_cast<std::uint16_t>(*code * 11);
  for (std::uint16_t& code : odd.accel) code = static_cast<std::uint16_t>(code * 11);
  for (std::uint16_t& code : odd.decel) code = static_cast<std::uint16_t>(code * 11);
  ReadyRig other(odd, format, {.queue_ticks = 256});
  const Frame line{.first = other.first_open() + 3, .motors = kOnLine, .longest = 333};
  ASSERT_EQ(start(other, line), BUSHD_OK);
  expect_slots(other, Reference::move(odd, 333), line);
}

TEST_P(LineRun, ReportTellsItsEndAndThatItRuns) {
  const Frame line{.first = rig.first_open() + 10, .motors = {{0, 5}, {2, -100}}, .longest = 100};
  const auto ticks =
      static_cast<std::uint32_t>(steps_by_tick(Reference::move(law, 100), Rig::kTickNs).size());
  ASSERT_EQ(start(rig, line), BUSHD_OK);
  for (; rig.tick() + 2 <= line.first + ticks; rig.pass()) {
    const bushd_report report = rig.poll();
    ASSERT_EQ(report.moving, 5) << "also the one that has made its last step";
    ASSERT_EQ(report.running, 5);
    const std::uint32_t known = line.first + ticks;
    ASSERT_EQ(report.motor[0].known_until, static_cast<std::uint16_t>(known));
    ASSERT_EQ(report.motor[2].known_until, static_cast<std::uint16_t>(known));
  }
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().moving, 0);
  EXPECT_EQ(rig.pulses(2), -100);
}

TEST_P(LineRun, RulesOfAStartHold) {
  const std::uint32_t first = rig.first_open();
  const Frame good{.first = first, .motors = {{0, 5}, {1, 7}}, .longest = 7};
  const auto with = [&good](auto change) {
    Frame changed = good;
    change(changed);
    return changed;
  };
  EXPECT_EQ(start(rig, with([](Frame& f) { --f.first; })), BUSHD_E_LATE);
  EXPECT_EQ(start(rig, with([](Frame& f) { f.first += 1000; })), BUSHD_E_CAPACITY);
  EXPECT_EQ(start(rig, with([](Frame& f) { f.epoch = 1; })), BUSHD_E_EPOCH);
  EXPECT_EQ(start(rig, with([](Frame& f) { f.bank = 3; })), BUSHD_E_NO_TABLE) << "no such table";
  EXPECT_EQ(start(rig, with([](Frame& f) { f.motors.push_back({4, 1}); })), BUSHD_E_FORMAT);
  EXPECT_EQ(start(rig, with([](Frame& f) {
                    f.longest = INT32_MAX;
                    f.shortest_delay = UINT16_MAX;
                  })),
            BUSHD_E_CAPACITY)
      << "for ever";
  ASSERT_EQ(start(rig, good), BUSHD_OK);
  EXPECT_EQ(start(rig, good), BUSHD_E_LATE) << "the same frame";
  EXPECT_EQ(start(rig, {.first = first, .motors = {{2, 5}}, .longest = 7}), BUSHD_E_STATE)
      << "room for one line";
  rig.pass_until_rest();
  EXPECT_EQ(start(rig, {.first = rig.first_open(), .motors = {{2, 5}}, .longest = 7}), BUSHD_OK);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 5);
  EXPECT_EQ(rig.pulses(1), 7);
  EXPECT_EQ(rig.pulses(2), 5);
}

TEST_P(LineRun, IsUnknownWhereItIsDenied) {
  ReadyRig denied(law, format, {.disabled_capabilities = BUSHD_CAN_LINE_RUN});
  EXPECT_EQ(denied.identify().capabilities & BUSHD_CAN_LINE_RUN, 0);
  EXPECT_EQ(start(denied, {.first = denied.first_open(), .motors = {{0, 5}}, .longest = 5}),
            BUSHD_E_UNKNOWN_MESSAGE);
}

// One that is too slow for TABLE_TICKS: 270 us between two steps of the run, ticks of 2.4 ms.
TEST_P(LineRun, OfASlowMcuIsSlow) {
  Law fast = law;
  fast.unit_ns = 1'000;
  fast.accel = fast.decel = {900, 500};
  fast.cruise = 269;
  for (const std::uint32_t disabled : std::array<std::uint32_t, 2>{0, BUSHD_CAN_TABLE_TICKS}) {
    const bool slow = disabled != 0;
    ReadyRig other(fast, format, {.queue_ticks = 256, .disabled_capabilities = disabled});
    Frame line{
        .first = other.first_open() + 3, .motors = kOnLine, .longest = 333, .shortest_delay = 269};
    ASSERT_EQ(start(other, line), slow ? BUSHD_E_CAPACITY : BUSHD_OK);
    if (!slow) continue;
    line.shortest_delay = 270;
    ASSERT_EQ(start(other, line), BUSHD_OK);
    expect_slots(other, Reference::move(fast, 333, 270), line);
  }
}

// The rest of the same line as displacements, from every tick on: in the end all have made their
// ways, and in the fine format nothing shows where they took over.
TEST_P(LineRun, IsReplacedByTicksAtEveryTick) {
  constexpr std::uint32_t kLongest = 120;
  const std::vector<LineMotor> motors = {{0, -120}, {1, 43}, {2, -3}};
  const Plan run = plan_move(law, kLongest, Rig::kTickNs, BUSHD_FORMAT_FINE);
  const auto position_at = [&](const LineMotor& motor, std::size_t tick) {
    bushd_line line;
    bushd_line_start(&line, length(motor.steps), kLongest);
    const std::int64_t at = tick == 0 ? 0 : run.made[tick - 1];
    bushd_line_go_to(&line, static_cast<std::uint32_t>(at));
    const auto part = static_cast<std::uint8_t>(tick == 0 ? 0 : run.fraction[tick - 1]);
    const auto end = std::int64_t{length(motor.steps)} * 256;
    const auto position =
        std::min(static_cast<std::int64_t>(bushd_line_position(&line, part)), end);
    return format == BUSHD_FORMAT_FINE ? position : position / 256 * 256;
  };
  for (std::size_t k = 0; k + 1 < run.ticks(); k += format == BUSHD_FORMAT_FINE ? 1 : 5) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    const std::uint32_t first = fresh.first_open();
    ASSERT_EQ(start(fresh, {.first = first, .motors = motors, .longest = kLongest}), BUSHD_OK);
    fresh.pass(static_cast<int>(k) / 2);
    ASSERT_NO_FATAL_FAILURE(replace_rest(
        fresh, first, {.from = k, .ticks = run.ticks(), .motors = motors},
        [&](const LineMotor& motor, std::size_t tick) { return position_at(motor, tick); }));
  }
}

// Where motors of the line are when `steps` of its run are over.
void expect_on_line(const Rig& of, const std::vector<LineMotor>& motors, std::uint32_t longest,
                    std::uint32_t steps) {
  for (const LineMotor& motor : motors) {
    bushd_line line;
    bushd_line_start(&line, length(motor.steps), longest);
    bushd_line_go_to(&line, steps);
    EXPECT_EQ(of.pulses(motor.number), motor.steps < 0 ? -std::int64_t{line.made} : line.made)
        << "motor " << +motor.number;
  }
}

bushd_sync sync_telling(const Rig& rig, std::uint32_t id, std::uint32_t tick) {
  bushd_sync message{};
  message.master = rig.mcu().clock.master;
  message.sync_id = id;
  message.follows = true;
  message.follow_up_id = id - 1000;  // one that nobody knows: the clock stays as it is
  message.sync_tick = tick;
  return message;
}

TEST_P(LineRun, IsRampedDownAlongTheLineWhenNoSyncTellsTheTime) {
  constexpr std::uint16_t kSilence = 60;
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, kSilence), BUSHD_OK);
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(start(rig, {.first = first, .motors = kOnLine, .longest = 333}), BUSHD_OK);
  rig.pass(20);
  const std::uint32_t told = rig.tick() - 7;
  rig.sync(sync_telling(rig, 7000, told));
  rig.sync(sync_telling(rig, 7001, told - 30));  // a late copy
  // Other frames do not count.
  for (int i = 0; i < 15; ++i) {
    rig.pass(10);
    rig.frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, {});
  }
  rig.pass_until_rest();
  auto run = Reference::move(law, 333);
  run.ramp_down_at(std::uint64_t{told + kSilence - first} * Rig::kTickNs, true);
  ASSERT_LT(run.steps(), 333u);
  expect_on_line(rig, kOnLine, 333, static_cast<std::uint32_t>(run.steps()));
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(report.ramp_downs, 4);
  EXPECT_EQ(rig.mcu().line.motors, 0);
}

TEST_P(LineRun, GoesOnForThatLongFromItsBeginning) {
  constexpr std::uint16_t kSilence = 60;
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, kSilence), BUSHD_OK);
  rig.sync(sync_telling(rig, 7000, rig.tick()));
  const std::uint32_t first = rig.first_open() + 40;
  ASSERT_EQ(start(rig, {.first = first, .motors = kOnLine, .longest = 333}), BUSHD_OK);
  rig.pass_until_rest();
  auto run = Reference::move(law, 333);
  run.ramp_down_at(std::uint64_t{kSilence} * Rig::kTickNs, true);
  expect_on_line(rig, kOnLine, 333, static_cast<std::uint32_t>(run.steps()));
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
}

TEST_P(LineRun, ThatWaitsIsCancelledBySilence) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 30), BUSHD_OK);
  ASSERT_EQ(start(rig, {.first = rig.first_open() + 100, .motors = kOnLine, .longest = 333}),
            BUSHD_OK);
  rig.pass(28);
  EXPECT_EQ(rig.poll().faults, 0);
  rig.pass(150);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(rig.poll().ramp_downs, 0);
  EXPECT_EQ(rig.poll().moving, 0);
  EXPECT_EQ(rig.mcu().line.motors, 0);
  for (const LineMotor& motor : kOnLine) EXPECT_EQ(rig.pulses(motor.number), 0);
}

TEST_P(LineRun, EmergencyRampLeadsAlongTheLine) {
  for (const int wait : {0, 3, 12, 40, 90}) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    const std::uint32_t first = fresh.first_open();
    ASSERT_EQ(start(fresh, {.first = first, .motors = kOnLine, .longest = 333}), BUSHD_OK);
    fresh.pass(wait);
    const std::uint32_t from = fresh.first_open();
    fresh.emergency(BUSHD_STOP_RAMP);
    fresh.pass_until_rest();
    auto run = Reference::move(law, 333);
    run.ramp_down_at(std::uint64_t{from - first} * Rig::kTickNs, true);
    SCOPED_TRACE(wait);
    // One that has not begun does not begin.
    expect_on_line(fresh, kOnLine, 333, wait == 0 ? 0 : static_cast<std::uint32_t>(run.steps()));
    EXPECT_EQ(fresh.poll().faults, BUSHD_FAULT_EMERGENCY);
    EXPECT_EQ(fresh.mcu().line.motors, 0);
  }
}

TEST_P(LineRun, ImmediateStopEndsItBetweenTwoSteps) {
  ASSERT_EQ(start(rig, {.first = rig.first_open(), .motors = kOnLine, .longest = 333}), BUSHD_OK);
  rig.pass(40);
  rig.emergency(BUSHD_STOP_IMMEDIATE);
  rig.pass(3);
  const std::int64_t stands = rig.pulses(0);
  EXPECT_EQ(rig.poll().moving, 0);
  rig.pass(20);
  EXPECT_EQ(rig.pulses(0), stands);
  EXPECT_EQ(rig.mcu().line.motors, 0);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(start(rig, {.first = rig.first_open(), .motors = {{3, 9}}, .longest = 9}), BUSHD_OK);
  rig.pass_until_rest();
}

// By its own table, from the speed that it has; the others go on.
TEST_P(LineRun, MotorThatMeetsALimitLeavesIt) {
  ASSERT_EQ(rig.set_inputs({.limit_positive = 1 << 3}), BUSHD_OK);
  ASSERT_EQ(start(rig, {.first = rig.first_open(), .motors = kOnLine, .longest = 333}), BUSHD_OK);
  rig.pass(60);
  rig.pins({.motors = 1 << 3, .system = 0});
  const std::int64_t before = rig.pulses(3);
  rig.pass_until_rest();
  EXPECT_GT(rig.pulses(3), before);
  EXPECT_LT(rig.pulses(3), before + 60) << "ramps down";
  EXPECT_EQ(rig.pulses(0), 333);
  EXPECT_EQ(rig.pulses(1), -118);
  EXPECT_EQ(rig.pulses(2), 1);
  EXPECT_EQ(rig.poll().faults, 0);
  EXPECT_EQ(rig.mcu().line.motors, 0);
  // One that must not begin stays where it is.
  ASSERT_EQ(start(rig, {.first = rig.first_open(), .motors = {{2, 9}, {3, 7}}, .longest = 9}),
            BUSHD_OK);
  const std::int64_t stands = rig.pulses(3);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(3), stands);
  EXPECT_EQ(rig.pulses(2), 10);
  EXPECT_EQ(start(rig, {.first = rig.first_open(), .motors = {{3, 7}}, .longest = 9}),
            BUSHD_E_FORBIDDEN);
}

}  // namespace
}  // namespace bushd::test
