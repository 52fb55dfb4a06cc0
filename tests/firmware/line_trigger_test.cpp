// LINE_TRIGGER: a line's run that an edge at the trigger input starts, exact to a slot.
#include <random>
#include <vector>

#include "firmware/line_runs.h"

namespace bushd::test {
namespace {

// What a TRIGGER of table runs may not do is refused here for the same reasons (trigger_test.cpp).
class LineTrigger : public OfLines {
 protected:
  struct Arming {
    std::uint8_t number = 1;
    std::uint32_t delay_us = 50;
    Frame line{};
  };
  static Bytes frame_of(const Arming& arming) {
    const Bytes run = frame(arming.line);
    Bytes payload(6);
    payload[0] = arming.number;
    payload[1] = BUSHD_EDGE_RISING;
    bushd_put_u32(&payload[2], arming.delay_us);
    payload.insert(payload.end(), run.begin() + 5, run.end());
    return payload;
  }
  static bushd_status arm(Rig& on, const Arming& arming) {
    return on.request(BUSHD_MSG_LINE_TRIGGER, frame_of(arming));
  }
  Frame line() const { return {.first = 0, .motors = motors_, .longest = 97}; }
  static bushd_status table_runs(Rig& on, std::uint8_t number, std::uint8_t motor) {
    return on.arm(number, BUSHD_EDGE_RISING, 50, {{motor, 0, 1, 5, 0}});
  }

  const std::vector<LineMotor> motors_ = {{0, 97}, {1, -31}, {2, 1}, {3, 96}};
};
BUSHD_IN_BOTH_FORMATS(LineTrigger);

TEST_P(LineTrigger, EveryStepFallsIntoItsSlotCountedFromTheEdge) {
  std::mt19937 random(5);
  const auto below = [&random](std::uint32_t n) {
    return static_cast<std::uint32_t>(random() % n);
  };
  std::array<std::int64_t, 4> at{};
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(i);
    Arming arming{.number = static_cast<std::uint8_t>(i + 1), .line = line()};
    arming.delay_us = i % 10 == 0 ? 1'650'000 - below(1000) : 50 + below(9000);
    if (i % 2 == 1) {
      arming.line.elementary = true;
      arming.line.longest = 97 + 31 + 1 + 96;
    }
    if (i % 3 == 1) arming.line.shortest_delay = static_cast<std::uint16_t>(law.cruise + 5);
    ASSERT_EQ(arm(rig, arming), BUSHD_OK);
    EXPECT_EQ(rig.poll().armed, 0b1111);
    EXPECT_EQ(rig.poll().moving, 0) << "what waits is at rest";
    rig.pass(static_cast<int>(below(5)));
    const auto in_tick_ns = static_cast<std::int32_t>(below(Rig::kTickNs));
    const bool noticed_later = below(3) == 0;
    const std::int64_t begin_ns =
        rig.tick() * kTick + in_tick_ns + 3 * kTick + arming.delay_us * 1000ll;
    if (noticed_later) rig.pass();
    rig.trigger(in_tick_ns - (noticed_later ? static_cast<std::int32_t>(kTick) : 0));
    const bushd_report report = rig.poll();
    ASSERT_EQ(report.trigger_state, BUSHD_TRIGGER_STARTED);
    ASSERT_EQ(report.armed, 0);
    ASSERT_EQ(report.start_tick * kTick + report.start_ns, begin_ns);
    ASSERT_EQ(report.running, 0b1111);
    arming.line.first = report.start_tick;
    const Reference run = Reference::move(law, arming.line.longest, arming.line.shortest_delay);
    const std::size_t last = arming.line.longest - 1;
    const auto end_ns = begin_ns + static_cast<std::int64_t>(run.step(last).end / 256);
    ASSERT_EQ(report.motor[2].known_until,
              static_cast<std::uint16_t>((end_ns + kTick - 1) / kTick));
    ASSERT_NO_FATAL_FAILURE(expect_slots(rig, run, arming.line, report.start_ns));
    for (const LineMotor& motor : motors_) {
      at[motor.number] += motor.steps;
      ASSERT_EQ(rig.poll().motor[motor.number].position_steps, at[motor.number]);
      ASSERT_EQ(rig.pulses(motor.number), at[motor.number]);
    }
    ASSERT_EQ(rig.mcu().line.motors, 0);
  }
  EXPECT_EQ(rig.poll().faults, 0);
}

TEST_P(LineTrigger, WaitsInPlaceOfAnyOtherLineAndTrigger) {
  ASSERT_EQ(arm(rig, {.line = {.motors = {{0, 9}, {2, -4}}, .longest = 9}}), BUSHD_OK);
  EXPECT_EQ(arm(rig, {.number = 2, .line = line()}), BUSHD_E_STATE);
  EXPECT_EQ(table_runs(rig, 2, 1), BUSHD_E_STATE);
  EXPECT_EQ(start(rig, {.first = rig.first_open(), .motors = {{1, 5}}, .longest = 5}),
            BUSHD_E_STATE)
      << "there is room for one line";
  EXPECT_EQ(start(rig, {.first = rig.first_open(), .motors = {{0, 5}}, .longest = 5}),
            BUSHD_E_STATE);
  EXPECT_EQ(rig.begin(0, law), BUSHD_E_STATE) << "its table";
  EXPECT_EQ(arm(rig, {.line = {.motors = {{0, 9}, {2, -4}}, .longest = 9}}), BUSHD_OK)
      << "the same frame again";
  rig.trigger(5);
  EXPECT_EQ(arm(rig, {.line = {.motors = {{0, 9}, {2, -4}}, .longest = 9}}), BUSHD_OK);
  EXPECT_EQ(rig.poll().armed, 0);
  EXPECT_EQ(start(rig, {.first = rig.first_open(), .motors = {{1, 5}}, .longest = 5}),
            BUSHD_E_STATE);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 9);
  EXPECT_EQ(rig.pulses(2), -4);
}

// Nothing of it is left: neither for other lines nor for other triggers.
TEST_P(LineTrigger, DisarmedItLeavesNothing) {
  ASSERT_EQ(arm(rig, {.line = line()}), BUSHD_OK);
  ASSERT_EQ(rig.disarm(), BUSHD_OK);
  rig.trigger(5);
  rig.pass(30);
  EXPECT_EQ(rig.pulses(0), 0);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_DISARMED);
  ASSERT_EQ(table_runs(rig, 2, 1), BUSHD_OK);
  ASSERT_EQ(start(rig, {.first = rig.first_open(), .motors = {{0, 5}}, .longest = 5}), BUSHD_OK)
      << "beside a table run that waits";
  rig.trigger(5);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 5);
  EXPECT_EQ(rig.pulses(1), 5);
  ASSERT_EQ(arm(rig, {.number = 3, .line = line()}), BUSHD_OK);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass(3);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_FAULT);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(start(rig, {.first = rig.first_open(), .motors = {{0, 5}}, .longest = 5}), BUSHD_OK);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 10);
}

TEST_P(LineTrigger, IsForMotorsAtRestWithTablesAndFreeWays) {
  const auto arm_with = [this](auto change) {
    Arming arming{.number = 7, .line = line()};
    change(arming);
    return arm(rig, arming);
  };
  EXPECT_EQ(arm_with([](Arming& a) { a.line.motors.push_back({4, 1}); }), BUSHD_E_FORMAT);
  EXPECT_EQ(arm_with([](Arming& a) { a.delay_us = 49; }), BUSHD_E_FORMAT);
  EXPECT_EQ(arm_with([](Arming& a) { a.line.bank = 3; }), BUSHD_E_NO_TABLE);
  EXPECT_EQ(arm_with([](Arming& a) {
              a.line.longest = INT32_MAX;
              a.line.shortest_delay = UINT16_MAX;
            }),
            BUSHD_E_CAPACITY);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 5, 0)), BUSHD_OK);
  EXPECT_EQ(arm_with([](Arming&) {}), BUSHD_E_STATE) << "one moves";
  rig.pass_until_rest();
  rig.set_inputs({.limit_negative = 2});
  rig.pins({2, 0});
  rig.pass(3);
  ASSERT_EQ(rig.poll().forbidden_negative, 2);
  EXPECT_EQ(arm_with([](Arming&) {}), BUSHD_E_FORBIDDEN) << "motor 1 goes back";
  EXPECT_EQ(rig.poll().trigger_number, 0);
}

TEST_P(LineTrigger, NoneBeginsIfALimitForbidsTheWayOfOne) {
  rig.set_inputs({.limit_negative = 2});
  ASSERT_EQ(arm(rig, {.line = line()}), BUSHD_OK);
  rig.pins({2, 0});
  rig.pass(3);
  rig.trigger(5);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_FORBIDDEN);
  rig.pass(30);
  EXPECT_EQ(rig.pulses(0), 0);
}

// As of any line, from the run as it is: along the line.
TEST_P(LineTrigger, IsRampedDownAlongTheLineInSilence) {
  constexpr std::uint16_t kSilence = 40;
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, kSilence), BUSHD_OK);
  ASSERT_EQ(arm(rig, {.delay_us = 777, .line = {.motors = {{0, 333}, {1, -118}}, .longest = 333}}),
            BUSHD_OK);
  rig.trigger(1'234'567);
  const bushd_report report = rig.poll();
  auto run = Reference::move(law, 333);
  run.ramp_down_at(std::uint64_t{kSilence} * Rig::kTickNs - report.start_ns, true);
  rig.pass_until_rest();
  ASSERT_LT(run.steps(), 333u);
  bushd_line other;
  bushd_line_start(&other, 118, 333);
  bushd_line_go_to(&other, static_cast<std::uint32_t>(run.steps()));
  EXPECT_EQ(rig.pulses(0), static_cast<std::int64_t>(run.steps()));
  EXPECT_EQ(rig.pulses(1), -std::int64_t{other.made});
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
}

TEST_P(LineTrigger, IsUnknownWithoutLinesOrAnInput) {
  Rig without_lines({.disabled_capabilities = BUSHD_CAN_LINE_RUN});
  Rig without_input({.disabled_capabilities = BUSHD_CAN_TRIGGER});
  for (Rig* other : {&without_lines, &without_input}) {
    other->make_ready(law, format);
    EXPECT_EQ(arm(*other, {.line = line()}), BUSHD_E_UNKNOWN_MESSAGE);
  }
}

}  // namespace
}  // namespace bushd::test
