// TRIGGER: table runs that an edge at the trigger input starts, exact to a slot.
#include <random>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

class Trigger : public Streams {
 protected:
  // Slots since tick 0 in which the motor steps, until it has come to rest.
  std::vector<std::int64_t> steps_until_rest(std::uint8_t motor, int limit = 5000) {
    std::vector<std::int64_t> slots;
    for (int i = 0; i < limit && rig.poll().moving != 0; ++i) {
      for (std::int64_t slot = 0; slot < kSlots; ++slot) {
        if (rig.slot_buffer().step[slot] >> motor & 1) slots.push_back(rig.tick() * kSlots + slot);
      }
      rig.pass();
    }
    EXPECT_EQ(rig.poll().moving, 0);
    return slots;
  }
  // Where they belong by the sums of the table's delays if the move begins at `begin_ns`: a step at
  // just a tick's end lies in its last slot.
  std::vector<std::int64_t> slots_of(std::uint32_t steps, std::int64_t begin_ns) const {
    const auto reference = Reference::move(law, steps);
    std::vector<std::int64_t> slots;
    for (std::size_t i = 0; i < steps; ++i) {
      const auto at_ns = begin_ns + static_cast<std::int64_t>(reference.step(i).end / 256);
      slots.push_back(at_ns % kTick == 0 ? at_ns / kTick * kSlots - 1 : at_ns * kSlots / kTick);
    }
    return slots;
  }
  std::int64_t now_ns() const { return rig.tick() * kTick; }
  bushd_status arm(std::uint8_t number, std::uint32_t steps = 20, std::uint32_t delay_us = 50) {
    return rig.arm(number, BUSHD_EDGE_RISING, delay_us, {{0, 0, 1, steps, 0}});
  }
  static Bytes run_frame(std::uint32_t first, std::uint8_t motor) {
    const bushd_table_run_entry entry = {motor, 0, 1, 5, 0};
    return table_run_payload(0, first, entry);
  }
};
BUSHD_IN_BOTH_FORMATS(Trigger);

TEST_P(Trigger, StepsFallIntoTheSlotsOfTheTableCountedFromTheEdge) {
  std::mt19937 random(4);
  const auto below = [&random](std::uint32_t n) {
    return static_cast<std::uint32_t>(random() % n);
  };
  std::int64_t position = 0;
  for (int i = 0; i < 150; ++i) {
    const auto number = static_cast<std::uint8_t>(i + 1);
    const std::uint32_t steps = 1 + below(70);
    const std::uint32_t delay_us = i % 10 == 0 ? 1'650'000 - below(1000) : 50 + below(9000);
    const int direction = i % 3 == 0 ? -1 : 1;
    ASSERT_EQ(rig.arm(number, BUSHD_EDGE_FALLING, delay_us,
                      {{0, 0, static_cast<std::int8_t>(direction), steps, 0}}),
              BUSHD_OK);
    rig.pass(static_cast<int>(below(5)));
    ASSERT_EQ(rig.awaited_edge(), BUSHD_EDGE_FALLING);
    // At any time of a tick, and noticed in that tick or the next.
    const auto in_tick_ns = static_cast<std::int32_t>(below(Rig::kTickNs));
    const bool noticed_later = below(3) == 0;
    const std::int64_t begin_ns = now_ns() + in_tick_ns + 3 * kTick + delay_us * 1000ll;
    if (noticed_later) rig.pass();
    rig.trigger(in_tick_ns - (noticed_later ? static_cast<std::int32_t>(kTick) : 0));
    const bushd_report report = rig.poll();
    ASSERT_EQ(report.trigger_state, BUSHD_TRIGGER_STARTED);
    ASSERT_EQ(report.trigger_number, number);
    ASSERT_EQ(report.start_tick * kTick + report.start_ns, begin_ns);
    ASSERT_EQ(report.armed, 0);
    ASSERT_EQ(report.running, 1);
    const auto expected = slots_of(steps, begin_ns);
    ASSERT_EQ(report.motor[0].known_until,
              static_cast<std::uint16_t>(expected.back() / kSlots + 1));
    ASSERT_EQ(steps_until_rest(0), expected)
        << "steps " << steps << " delay " << delay_us << " edge " << in_tick_ns;
    position += direction * static_cast<int>(steps);
    ASSERT_EQ(rig.poll().motor[0].position_steps, position);
    ASSERT_EQ(rig.pulses(0), position);
  }
  EXPECT_EQ(rig.poll().faults, 0);
  EXPECT_EQ(rig.steps_with_dir(), 0);
}

TEST_P(Trigger, StartsSeveralMotorsInTheSameSlotWhileOthersStream) {
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 60, 0)), BUSHD_OK);
  ASSERT_EQ(rig.arm(1, BUSHD_EDGE_RISING, 1234, {{1, 0, 1, 10, 0}, {3, 0, -1, 10, 0}}), BUSHD_OK);
  rig.pass(5);
  EXPECT_EQ(rig.poll().armed, 0b1010);
  EXPECT_EQ(rig.poll().moving, 1) << "what waits is at rest";
  const std::int64_t begin_ns = now_ns() + 777'777 + 3 * kTick + 1'234'000;
  rig.trigger(777'777);
  const auto expected = slots_of(10, begin_ns);
  std::vector<std::int64_t> first;
  while (rig.poll().moving != 0) {
    for (std::int64_t slot = 0; slot < kSlots; ++slot) {
      const auto both = rig.slot_buffer().step[slot] & 0b1010;
      EXPECT_TRUE(both == 0 || both == 0b1010);
      if (both != 0) first.push_back(rig.tick() * kSlots + slot);
    }
    rig.pass();
  }
  EXPECT_EQ(first, expected);
  EXPECT_EQ(rig.pulses(0), 60);
  EXPECT_EQ(rig.pulses(1), 10);
  EXPECT_EQ(rig.pulses(3), -10);
}

TEST_P(Trigger, OneNoticedTooLateStartsNothing) {
  ASSERT_EQ(arm(1), BUSHD_OK);
  rig.pass(4);
  rig.trigger(-2 * static_cast<std::int32_t>(kTick) - 60'000);
  bushd_report report = rig.poll();
  EXPECT_EQ(report.trigger_state, BUSHD_TRIGGER_LATE);
  EXPECT_EQ(report.armed, 0);
  EXPECT_EQ(report.moving, 0);
  EXPECT_EQ(report.faults, 0);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE);
  rig.pass(30);
  EXPECT_EQ(rig.pulses(0), 0);
  ASSERT_EQ(arm(2), BUSHD_OK) << "it may be armed again";
  rig.trigger(5);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 20);
}

TEST_P(Trigger, AnEdgeThatNobodyAwaitsStartsNothing) {
  rig.trigger(100);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_NONE);
  ASSERT_EQ(arm(1), BUSHD_OK);
  ASSERT_EQ(rig.disarm(), BUSHD_OK);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE);
  rig.trigger(100);
  rig.pass(30);
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.trigger_state, BUSHD_TRIGGER_DISARMED);
  EXPECT_EQ(report.trigger_number, 1);
  EXPECT_EQ(report.armed, 0);
  EXPECT_EQ(rig.pulses(0), 0);
  EXPECT_EQ(rig.disarm(), BUSHD_OK) << "nothing is armed already";
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 5, 0)), BUSHD_OK);
}

// Its acknowledgement may have been lost, and the edge have come before it is sent again.
TEST_P(Trigger, SameNumberAgainIsTheSameFrameAgain) {
  ASSERT_EQ(arm(9), BUSHD_OK);
  ASSERT_EQ(arm(9), BUSHD_OK);
  rig.trigger(100);
  ASSERT_EQ(arm(9), BUSHD_OK);
  EXPECT_EQ(rig.poll().armed, 0);
  rig.pass_until_rest();
  ASSERT_EQ(arm(9), BUSHD_OK);
  EXPECT_EQ(rig.poll().armed, 0);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_STARTED);
  EXPECT_EQ(rig.pulses(0), 20);
}

TEST_P(Trigger, WhatWaitsForItTakesNothingElse) {
  ASSERT_EQ(arm(1), BUSHD_OK);
  EXPECT_EQ(arm(2), BUSHD_E_STATE) << "one at a time";
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 5)), BUSHD_E_STATE);
  EXPECT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(rig.first_open(), 0)), BUSHD_E_STATE);
  EXPECT_EQ(rig.set_position(0, 5), BUSHD_E_STATE);
  EXPECT_EQ(rig.assign(0, 0), BUSHD_E_STATE);
  EXPECT_EQ(rig.begin(1, law), BUSHD_E_STATE);
  EXPECT_EQ(rig.configure(format, 2 * Rig::kTickNs), BUSHD_E_STATE);
  EXPECT_EQ(rig.configure(format), BUSHD_OK) << "the same again";
  for (const std::uint8_t action :
       {BUSHD_CONTROL_DISABLE, BUSHD_CONTROL_CLEAR_FAULTS, BUSHD_CONTROL_FORGET_TABLES}) {
    EXPECT_EQ(rig.control(action), BUSHD_E_STATE);
  }
  EXPECT_EQ(rig.set_position(1, 5), BUSHD_OK) << "of another motor";
  EXPECT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, run_frame(rig.first_open(), 1)), BUSHD_OK);
  rig.trigger(100);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 20);
  EXPECT_EQ(rig.pulses(1), 5);
}

TEST_P(Trigger, IsForMotorsAtRestWithTheirTablesInAnMcuThatIsReady) {
  const auto arm_one = [this](std::uint8_t motor, std::uint8_t bank, std::uint32_t steps) {
    return rig.arm(5, BUSHD_EDGE_RISING, 50, {{motor, bank, 1, steps, 0}});
  };
  EXPECT_EQ(arm_one(4, 0, 5), BUSHD_E_FORMAT) << "four motors";
  EXPECT_EQ(arm_one(1, 1, 5), BUSHD_E_NO_TABLE);
  EXPECT_EQ(arm_one(1, 0, 0), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.arm(5, BUSHD_EDGE_RISING, 49, {{1, 0, 1, 5, 0}}), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.arm(5, BUSHD_EDGE_RISING, 1'650'001, {{1, 0, 1, 5, 0}}), BUSHD_E_FORMAT);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 5, 0)), BUSHD_OK);
  EXPECT_EQ(arm_one(0, 0, 5), BUSHD_E_STATE);
  EXPECT_EQ(arm_one(1, 0, 5), BUSHD_OK) << "nothing of what was refused has been taken";
  rig.pass_until_rest();
  ASSERT_EQ(rig.disarm(), BUSHD_OK);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  EXPECT_EQ(rig.arm(6, BUSHD_EDGE_RISING, 50, {{1, 0, 1, 5, 0}}), BUSHD_E_STATE);
  EXPECT_EQ(rig.poll().trigger_number, 5);
}

TEST_P(Trigger, AFaultDisarms) {
  ASSERT_EQ(arm(1), BUSHD_OK);
  rig.emergency(BUSHD_STOP_IMMEDIATE);
  rig.trigger(100);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_FAULT);
  rig.pass(30);
  EXPECT_EQ(rig.pulses(0), 0);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(arm(2), BUSHD_OK);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass();
  EXPECT_EQ(rig.poll().armed, 0);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
}

TEST_P(Trigger, NothingStartsWhereNoMasterIsHeard) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 30), BUSHD_OK);
  ASSERT_EQ(arm(1), BUSHD_OK);
  rig.pass(35);
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.armed, 0);
  EXPECT_EQ(report.trigger_state, BUSHD_TRIGGER_FAULT);
  EXPECT_EQ(report.faults, BUSHD_FAULT_LINK);
  rig.trigger(100);
  rig.pass(30);
  EXPECT_EQ(rig.pulses(0), 0);
}

TEST_P(Trigger, NothingStartsTowardsAClosedLimit) {
  const auto arm_both = [this](std::uint8_t number) {
    return rig.arm(number, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 20, 0}, {1, 0, -1, 20, 0}});
  };
  const InputSettings limits{.limit_positive = 0b11};
  ASSERT_EQ(rig.set_inputs(limits), BUSHD_OK);
  ASSERT_EQ(arm_both(1), BUSHD_OK);
  EXPECT_EQ(rig.set_inputs(limits), BUSHD_E_STATE);
  rig.pins({0b01, 0});
  rig.pass(3);
  rig.trigger(100);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_FORBIDDEN);
  rig.pass(30);
  EXPECT_EQ(rig.pulses(0), 0);
  EXPECT_EQ(rig.pulses(1), 0) << "all together or none";
  EXPECT_EQ(arm_both(2), BUSHD_E_FORBIDDEN);
  rig.pins({0b10, 0});
  rig.pass(3);
  ASSERT_EQ(arm_both(3), BUSHD_OK) << "that one goes the other way";
  rig.trigger(100);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 20);
  EXPECT_EQ(rig.pulses(1), -20);
}

TEST_P(Trigger, RisingIsWhereTheInputBecomesActive) {
  ASSERT_EQ(rig.set_inputs({.system_inverted = BUSHD_INPUT_TRIGGER}), BUSHD_OK);
  ASSERT_EQ(arm(1), BUSHD_OK);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_FALLING);
  ASSERT_EQ(rig.disarm(), BUSHD_OK);
  ASSERT_EQ(rig.arm(2, BUSHD_EDGE_FALLING, 50, {{0, 0, 1, 5, 0}}), BUSHD_OK);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_RISING);
}

// From the edge on it is a table run that has not begun.
TEST_P(Trigger, AfterTheEdgeItIsATableRun) {
  ASSERT_EQ(arm(1, 50, 100'000), BUSHD_OK);
  rig.trigger(100);
  ASSERT_EQ(rig.disarm(), BUSHD_OK);
  rig.pass(10);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_STARTED);
  EXPECT_EQ(rig.poll().running, 1) << "too late to disarm";
  EXPECT_EQ(arm(2), BUSHD_E_STATE);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 0) << "but not for an emergency stop";
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(arm(3, 500), BUSHD_OK);
  rig.trigger(1'300'000);
  rig.pass(60);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass_until_rest();
  EXPECT_GT(rig.pulses(0), 20);
  EXPECT_LT(rig.pulses(0), 200);
  EXPECT_EQ(rig.poll().motor[0].position_steps, rig.pulses(0));
}

// From any tick after its first on, with the displacements that its beginning leads to.
TEST_P(Trigger, ItsRunIsReplacedByTicks) {
  constexpr std::int32_t kLateNs = 1'000'001;
  for (std::uint32_t k = 1; k < 12; ++k) {
    ReadyRig fresh(law, format, {.queue_ticks = 256});
    ASSERT_EQ(fresh.arm(1, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 60, 0}}), BUSHD_OK);
    fresh.trigger(kLateNs - 50'000);
    const std::uint32_t start = fresh.poll().start_tick;
    ASSERT_EQ(fresh.poll().start_ns, kLateNs);
    auto reference = Reference::move(law, 60);
    reference.begin_late(kLateNs);
    const bool fine = format == BUSHD_FORMAT_FINE;
    Ticks rest{.flags = kReplace, .first = start + k, .count = 60, .epoch = 1};
    const auto place = [&](std::uint64_t tick) {
      const std::uint64_t ns = tick * Rig::kTickNs;
      return fine ? reference.position_at(ns) : static_cast<std::int64_t>(reference.steps_at(ns));
    };
    for (std::uint64_t n = k; n < k + 60u; ++n) {
      const auto d = static_cast<int>(place(n + 1) - place(n));
      rest.displacements.push_back(static_cast<std::int16_t>(fine ? d : 0x80 | d));
    }
    rest.delays = {reference.delay_at(std::uint64_t{k + 60} * Rig::kTickNs)};
    ASSERT_EQ(fresh.take(rest), BUSHD_OK);
    for (std::uint32_t n = 0; n + 1 < k + 60; ++n) {
      while (fresh.tick() < start + n) fresh.pass();
      ASSERT_EQ(fresh.slot_buffer().steps[0], static_cast<int>(reference.steps_at((n + 1) * kTick) -
                                                               reference.steps_at(n * kTick)))
          << "replaced from " << k << ", tick " << n;
    }
  }
}

TEST(TriggerInput, IsNotForAPortWithoutOne) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE, {.disabled_capabilities = BUSHD_CAN_TRIGGER});
  EXPECT_EQ(rig.identify().capabilities & BUSHD_CAN_TRIGGER, 0);
  EXPECT_EQ(rig.arm(1, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 5, 0}}), BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(rig.disarm(), BUSHD_E_UNKNOWN_MESSAGE);
}

}  // namespace
}  // namespace bushd::test
