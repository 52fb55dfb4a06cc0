#include "engine/run_slots.h"

#include <vector>

#include "engine/slots.h"
#include "engine/tables.h"

namespace bushd::test::run_slots_test {
namespace {

struct Emitted {
  std::vector<uint16_t> masks;
  int steps;
};

Emitted emit(bushd_run* run, uint32_t tick_ns, uint16_t slots, uint16_t bit) {
  Emitted tick{std::vector<uint16_t>(slots), 0};
  const bushd_run_tick length = bushd_run_tick_of(tick_ns, run->table, slots);
  tick.steps = bushd_run_slots(run, &length, bit, tick.masks.data());
  bushd_run_note_fraction(run);
  return tick;
}

// The step at time t lies in slot floor((t - tick's start) x S / tick); at the tick's end in the
// last one.
TEST(RunSlots, EveryStepFallsIntoItsSlotByTheSumOfTheDelays) {
  holds("slots of a move against the slow reference", [] {
    const TestTable table(any_law(), between(0, 1) != 0);
    uint32_t tick_ns = any_tick_ns(table.law());
    // Mostly ticks are whole microseconds, and whole time units.
    if (tick_ns > 10'000 && between(0, 1) != 0) tick_ns -= tick_ns % 10'000;
    if (tick_ns > table.law().unit_ns && between(0, 1) != 0) {
      tick_ns -= tick_ns % table.law().unit_ns;
    }
    const auto slots = *rc::gen::element<uint16_t>(128, 199, 256);
    const auto steps = between<uint32_t>(1, 200);
    const int direction = between(0, 1) != 0 ? 1 : -1;
    const auto late_ns = between<uint32_t>(0, 2) == 0 ? between<uint32_t>(0, tick_ns - 1) : 0;
    const uint64_t shortest_delay = any_long_shortest_delay(table.law());
    auto reference = Reference::move(table.law(), steps, shortest_delay);
    reference.begin_late(late_ns);
    bushd_run run;
    bushd_run_start(&run, table.view(), steps, direction, shortest_delay);
    bushd_run_begin_late(&run, late_ns);
    size_t made = 0;
    for (uint64_t tick = 0; tick < 3000 && !bushd_run_done(&run); ++tick) {
      std::vector<uint16_t> expected(slots);
      const size_t before = made;
      for (; made < steps && reference.step(made).end <= Wide{(tick + 1) * tick_ns} * 256; ++made) {
        const Wide at = reference.step(made).end - Wide{tick * tick_ns} * 256;
        const auto slot = static_cast<size_t>(at * slots / (Wide{tick_ns} * 256));
        expected[std::min<size_t>(slot, slots - 1u)] |= 4;
      }
      const Emitted emitted = emit(&run, tick_ns, slots, 4);
      RC_ASSERT(emitted.steps == direction * static_cast<int>(made - before));
      RC_ASSERT(emitted.masks == expected);
      RC_ASSERT(run.steps_done == made);
    }
  });
}

// A step an hour, by tables of nanoseconds too: each step to its slot, and its 256 parts before it.
TEST(RunSlots, AStepAnHourIsExactToASlot) {
  constexpr uint32_t kTickNs = 2'560'000;
  constexpr uint64_t kHourNs = BUSHD_LONGEST_DELAY_NS;
  const std::vector<uint8_t> nothing(1000, BUSHD_COARSE_DIRECTION);
  for (const uint32_t unit_ns : {1u, 19u, 40'000u}) {
    const TestTable table({{60'000, 30'000}, {60'000}, 30'000, unit_ns}, true);
    const uint64_t delay_ns = kHourNs / unit_ns * unit_ns;
    bushd_run run;
    bushd_run_start(&run, table.view(), 3, 1, kHourNs / unit_ns);
    bushd_run fine = run;
    uint64_t tick = 0;
    for (uint64_t step = 1; step <= 3; ++step) {
      const uint64_t tick_of_step = (step * delay_ns - 1) / kTickNs;
      while (tick + 10 < tick_of_step) {
        const size_t ticks = std::min<uint64_t>(nothing.size(), tick_of_step - 10 - tick);
        std::vector<uint8_t> made(ticks);
        bushd_run_expand_coarse(&run, kTickNs, ticks, made.data(), 1);
        ASSERT_TRUE(std::equal(made.begin(), made.end(), nothing.begin())) << tick;
        tick += ticks;
      }
      for (; tick < tick_of_step; ++tick) ASSERT_EQ(emit(&run, kTickNs, 256, 1).steps, 0) << tick;
      std::vector<uint16_t> expected(256);
      const uint64_t in_tick_ns = step * delay_ns - tick_of_step * kTickNs;
      expected[std::min<uint64_t>(in_tick_ns * 256 / kTickNs, 255)] = 1;
      const Emitted emitted = emit(&run, kTickNs, 256, 1);
      ++tick;
      EXPECT_EQ(emitted.steps, 1);
      EXPECT_EQ(emitted.masks, expected) << "step " << step << ", unit " << unit_ns;
    }
    EXPECT_TRUE(bushd_run_done(&run));
    uint64_t ticks = 0;
    for (int16_t displacement = 0; displacement == 0; ++ticks) {
      bushd_run_expand_fine(&fine, kTickNs, 1, &displacement, 1);
    }
    EXPECT_EQ(ticks, (delay_ns / 256 + (delay_ns % 256 != 0) + kTickNs - 1) / kTickNs);
  }
}

TEST(RunSlots, TimeUnitOfSecondsIsCountedToItsEnd) {
  constexpr uint32_t kUnitNs = 4'294'963'296;  // with a tick more than 32 bits hold
  constexpr uint32_t kTickNs = 20'000'000;
  constexpr uint32_t kLateNs = 5000;
  const uint16_t code = 1;
  bushd_table table{};
  table.accel.code = table.decel.code = &code;
  table.accel.count = table.decel.count = 1;
  table.cruise = 1;
  table.time_unit_ns = kUnitNs;
  bushd_run run;
  bushd_run_start(&run, &table, 2, 1, 0);
  bushd_run_begin_late(&run, kLateNs);
  std::vector<int> ticks_of_steps;
  for (int tick = 0; !bushd_run_done(&run) && tick < 1000; ++tick) {
    if (emit(&run, kTickNs, 256, 1).steps != 0) ticks_of_steps.push_back(tick);
  }
  EXPECT_EQ(ticks_of_steps, (std::vector<int>{(1ull * kUnitNs + kLateNs) / kTickNs,
                                              (2ull * kUnitNs + kLateNs) / kTickNs}));
}

// So ticks of displacements may take over from any tick on, and the other way round.
TEST(RunSlots, LeavesTheRunWhereAnExpandedTickLeavesIt) {
  holds("two runs that take turns", [] {
    const TestTable table(any_law(), between(0, 1) != 0);
    const uint32_t tick_ns = any_tick_ns(table.law());
    bushd_run by_ticks;
    bushd_run_start(&by_ticks, table.view(), between<uint32_t>(1, 300), -1,
                    any_long_shortest_delay(table.law()));
    bushd_run mixed = by_ticks;
    for (int tick = 0; tick < 400; ++tick) {
      if (tick == 50) {
        bushd_run_ramp_down(&by_ticks);
        bushd_run_ramp_down(&mixed);
      }
      int16_t displacement = 0;
      bushd_run_expand_fine(&by_ticks, tick_ns, 1, &displacement, 1);
      if (between(0, 1) != 0) {
        emit(&mixed, tick_ns, 256, 1);
      } else {
        bushd_run_expand_fine(&mixed, tick_ns, 1, &displacement, 1);
      }
      RC_ASSERT(mixed.steps_done == by_ticks.steps_done);
      RC_ASSERT(mixed.fraction == by_ticks.fraction);
      RC_ASSERT(bushd_run_delay(&mixed) == bushd_run_delay(&by_ticks));
      RC_ASSERT(bushd_run_units_left(&mixed) == bushd_run_units_left(&by_ticks));
    }
  });
}

TEST(RunSlots, MotorsShareMasksAndADoneRunMakesNothing) {
  const TestTable table({{4}, {4}, 4, 1000}, false);
  bushd_run run;
  bushd_run_start(&run, table.view(), 2, 1, 0);
  const bushd_run_tick tick = bushd_run_tick_of(8000, table.view(), 128);
  std::vector<uint16_t> masks(128, 0x8000);
  EXPECT_EQ(bushd_run_slots(&run, &tick, 1, masks.data()), 2);
  for (size_t slot = 0; slot < 128; ++slot) {
    EXPECT_EQ(masks[slot], slot == 64 || slot == 127 ? 0x8001 : 0x8000) << slot;
  }
  EXPECT_EQ(bushd_run_slots(&run, &tick, 1, masks.data()), 0);
}

}  // namespace
}  // namespace bushd::test::run_slots_test
