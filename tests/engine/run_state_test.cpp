// A run that is saved at a tick, sent in a TABLE_TICKS frame and taken up by an MCU must go on as
// the original does; and whatever a frame holds, no MCU may go faster than its table.
#include "engine/run_state.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/message.h"
#include "engine/tables.h"

namespace bushd::test::run_state_test {
namespace {

enum class Format { kCoarse, kFine };

std::vector<int> expand(bushd_run* run, Format format, uint32_t tick_ns, size_t ticks) {
  std::vector<int> all;
  if (format == Format::kCoarse) {
    std::vector<uint8_t> out(ticks);
    bushd_run_expand_coarse(run, tick_ns, ticks, out.data(), 1);
    all.assign(out.begin(), out.end());
  } else {
    std::vector<int16_t> out(ticks);
    bushd_run_expand_fine(run, tick_ns, ticks, out.data(), 1);
    all.assign(out.begin(), out.end());
  }
  return all;
}

// A run at any tick boundary of any move, perhaps ramped down or given another end on the way.
bushd_run any_run(const TestTable& table, Format format, uint32_t tick_ns) {
  bushd_run run;
  const int direction = *rc::gen::element(1, -1);
  bushd_run_start(&run, table.view(),
                  *rc::gen::element<uint32_t>(between<uint32_t>(1, 300), INT32_MAX), direction,
                  any_shortest_delay(table.law()));
  for (int again = between(0, 3); again >= 0; --again) {
    expand(&run, format, tick_ns, between<size_t>(0, 60));
    if (again == 0) break;
    if (between(0, 1) == 0) {
      bushd_run_ramp_down(&run);
    } else {
      bushd_run_retarget(&run, between<uint32_t>(0, 300), any_shortest_delay(table.law()));
    }
  }
  return run;
}

bushd_run_state through_a_frame(const bushd_run_state& state) {
  const bushd_table_ticks_entry entry{3, state};
  std::vector<uint8_t> payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_table_ticks(1, 0, 1000, 190, &entry, 1, payload.data()));
  bushd_table_ticks message{};
  RC_ASSERT(bushd_decode_table_ticks(payload.data(), payload.size(), &message) == BUSHD_OK);
  RC_ASSERT(message.mask == 1 << 3);
  bushd_table_ticks_entry read{};
  uint16_t at = 0;
  RC_ASSERT(bushd_next_table_ticks_entry(&message, &at, &read));
  return read.state;
}

// The MCU's table has no index arrays.
struct Tables {
  explicit Tables(const Law& law) : host(law, true), mcu(law, false) {}
  TestTable host;
  TestTable mcu;
};

void goes_on_as_the_original(Format format) {
  const Tables tables(any_law());
  const uint32_t tick_ns = any_tick_ns(tables.host.law());
  bushd_run run = any_run(tables.host, format, tick_ns);
  RC_PRE(bushd_run_has_state(&run));
  const auto ticks = between<uint16_t>(1, 190);
  const bushd_run_state state = through_a_frame(bushd_run_save(&run, tick_ns, ticks));
  bushd_run taken_up;
  RC_ASSERT(bushd_run_restore(&taken_up, tables.mcu.view(), &state));
  RC_ASSERT(taken_up.direction == run.direction);
  const uint32_t before = run.steps_done;
  RC_ASSERT(expand(&taken_up, format, tick_ns, ticks) == expand(&run, format, tick_ns, ticks));
  RC_ASSERT(taken_up.steps_done == run.steps_done - before);
  RC_ASSERT(bushd_run_delay(&taken_up) == bushd_run_delay(&run));
  RC_ASSERT(bushd_run_done(&taken_up) == bushd_run_done(&run));
  if (format == Format::kFine && !bushd_run_done(&run))
    RC_ASSERT(taken_up.fraction == run.fraction);
}

TEST(RunState, GoesOnAsTheOriginalCoarse) {
  holds("save, frame, restore, expand == expand", [] { goes_on_as_the_original(Format::kCoarse); });
}

TEST(RunState, GoesOnAsTheOriginalFine) {
  holds("save, frame, restore, expand == expand", [] { goes_on_as_the_original(Format::kFine); });
}

// A stream of TABLE_TICKS frames, each for itself, is the move.
TEST(RunState, FramesInARowMakeTheMove) {
  holds("every stretch restored from its own state", [] {
    const Tables tables(any_law());
    const uint32_t tick_ns = any_tick_ns(tables.host.law());
    const Format format = *rc::gen::element(Format::kCoarse, Format::kFine);
    bushd_run run;
    bushd_run_start(&run, tables.host.view(), between<uint32_t>(1, 300), 1,
                    any_shortest_delay(tables.host.law()));
    uint64_t steps = 0;
    const uint32_t asked = bushd_run_steps_left(&run);
    for (int frames = 0; frames < 400 && !bushd_run_done(&run); ++frames) {
      const auto ticks = between<uint16_t>(1, 40);
      const bushd_run_state state = bushd_run_save(&run, tick_ns, ticks);
      bushd_run taken_up;
      RC_ASSERT(bushd_run_restore(&taken_up, tables.mcu.view(), &state));
      RC_ASSERT(expand(&taken_up, format, tick_ns, ticks) == expand(&run, format, tick_ns, ticks));
      steps += taken_up.steps_done;
    }
    if (bushd_run_done(&run)) RC_ASSERT(steps == asked);
  });
}

TEST(RunState, CruisesOnlyIfItDoesThroughout) {
  const TestTable table({{5, 4}, {5, 4}, 3, 1000}, true);
  bushd_run run;
  bushd_run_start(&run, table.view(), 104, 1, 0);
  EXPECT_FALSE(bushd_run_save(&run, 3000, 1).cruises);  // speeds up
  expand(&run, Format::kCoarse, 3000, 3);               // 9 of cruise's 300 us are over
  EXPECT_TRUE(bushd_run_save(&run, 3000, 99).cruises);
  EXPECT_FALSE(bushd_run_save(&run, 3000, 100).cruises);  // its last step ends just then
  bushd_run_ramp_down(&run);
  EXPECT_FALSE(bushd_run_save(&run, 3000, 1).cruises);
}

// --- What no run of the table can be in ----------------------------------------------------------

// The delays of the steps that are to come, at most so many.
std::vector<uint32_t> delays(bushd_run run, size_t most) {
  std::vector<uint32_t> all;
  while (!bushd_run_done(&run) && all.size() < most) {
    all.push_back(static_cast<uint32_t>(bushd_run_delay(&run)));
    if (run.lead_delay != 0) {
      run.lead_delay = 0;
    } else if (run.accel_at < run.accel_end) {
      ++run.accel_at;
    } else if (run.cruise_left != 0) {
      --run.cruise_left;
    } else {
      --run.decel_left;
    }
  }
  return all;
}

// The shortest delay that may follow a step of this one.
uint32_t next_of(const Law& law, uint32_t delay) {
  for (const uint16_t code : law.accel) {
    if (code < delay) return std::max<uint32_t>(code, law.cruise);
  }
  return law.cruise;
}

// The longest delay that may follow a step of this one: the next on the way to rest.
uint32_t slowest_after(const Law& law, uint32_t delay) {
  size_t k = 0;
  while (law.decel_at(k) > Wide{delay}) ++k;
  return k == 0 ? 65535 : static_cast<uint32_t>(law.decel_at(k - 1));
}

// A hostile state is mostly made of numbers that the table knows: those nearly fit.
uint16_t any_number_for(const std::vector<uint16_t>& side) {
  const auto count = static_cast<uint16_t>(side.size());
  switch (between(0, 5)) {
    case 0:
      return between<uint16_t>(0, 65535);
    case 1:
      return count;
    default:
      return between<uint16_t>(0, static_cast<uint16_t>(count + 1));
  }
}

uint16_t any_delay_for(const Law& law) {
  switch (between(0, 3)) {
    case 0:
      return between<uint16_t>(0, 65535);
    case 1:
      return *rc::gen::elementOf(law.accel);
    case 2:
      return *rc::gen::elementOf(law.decel);
    default:
      return law.cruise;
  }
}

bushd_run_state hostile_state(const Law& law) {
  bushd_run_state state{};
  state.direction = *rc::gen::element<int8_t>(1, -1);
  state.cruises = between(0, 3) == 0;
  state.since = between(0, 1) == 0 ? uint16_t{0} : any_delay_for(law);
  state.since_ns = *rc::gen::element<uint32_t>(0, 0, 0, law.unit_ns - 1, law.unit_ns, UINT32_MAX);
  state.lead_delay = between(0, 1) == 0 ? uint16_t{0} : any_delay_for(law);
  state.accel_at = any_number_for(law.accel);
  state.accel_end = any_number_for(law.accel);
  state.cruise_left =
      *rc::gen::element<uint32_t>(0, 0, 0, 1, 5, INT32_MAX, UINT32_MAX - 1, UINT32_MAX);
  state.decel_left = any_number_for(law.decel);
  state.cruise = any_shortest_delay(law);
  return state;
}

bool refused_or_legal(const TestTable& table, const bushd_run_state& state) {
  const Law& law = table.law();
  bushd_run run;
  if (!bushd_run_restore(&run, table.view(), &state)) return false;
  const auto all = delays(run, 300);
  RC_ASSERT(!all.empty());
  RC_ASSERT(run.since < all[0] && run.since_ns < law.unit_ns);
  for (size_t i = 0; i < all.size(); ++i) {
    RC_ASSERT(all[i] >= law.cruise);
    if (i > 0) RC_ASSERT(all[i] >= next_of(law, all[i - 1]));
    if (i > 0) RC_ASSERT(all[i] <= slowest_after(law, all[i - 1]));
  }
  // It comes to rest by its decelerating side: a step before which n more are left is not faster
  // than D(n).
  if (!state.cruises && all.size() < 300) {
    for (size_t i = 0; i + 1 < all.size(); ++i) {
      RC_ASSERT(Wide{all[i]} >= law.decel_at(all.size() - 1 - i));
    }
  }
  const uint32_t tick_ns = any_tick_ns(law);
  bushd_run coarse = run;
  for (const int byte : expand(&coarse, Format::kCoarse, tick_ns, 200)) {
    RC_ASSERT((byte & 0x7F) <= 127);
  }
  for (const int displacement : expand(&run, Format::kFine, tick_ns, 200)) {
    RC_ASSERT(displacement * state.direction >= 0);
  }
  RC_ASSERT(run.steps_done == coarse.steps_done);
  return true;
}

TEST(RunState, AnyStateIsRefusedOrNotFasterThanTheTable) {
  int taken = 0;
  holds("hostile states", [&] {
    const TestTable table(any_law(), *rc::gen::arbitrary<bool>());
    for (int i = 0; i < 200; ++i) taken += refused_or_legal(table, hostile_state(table.law()));
  });
  EXPECT_GE(taken, 100) << "too few states that nearly fit";
}

// Each of these would be a jump in speed, in a table of 50 40 30 | 20 | 30 40 50.
TEST(RunState, RefusesJumpsInSpeed) {
  const TestTable table({{50, 40, 30}, {50, 40, 30}, 20, 1000}, false);
  const auto taken = [&](const bushd_run_state& state) {
    bushd_run run;
    return bushd_run_restore(&run, table.view(), &state);
  };
  // direction, cruises, since, since_ns, lead, accel_at, accel_end, cruise_left, decel_left, cruise
  EXPECT_TRUE(taken({1, false, 0, 0, 0, 0, 3, 7, 3, 0}));
  EXPECT_FALSE(taken({1, false, 0, 0, 0, 0, 1, 7, 3, 0})) << "to cruise from half way up";
  EXPECT_FALSE(taken({1, false, 0, 0, 0, 0, 3, 7, 1, 0})) << "from cruise to rest in one step";
  EXPECT_FALSE(taken({1, false, 0, 0, 0, 0, 3, 0, 1, 0})) << "from the top to rest in one step";
  EXPECT_FALSE(taken({1, false, 0, 0, 0, 0, 1, 0, 3, 0}))
      << "to decelerating codes not yet reached";
  EXPECT_TRUE(taken({1, false, 0, 0, 35, 2, 3, 7, 3, 0}));
  EXPECT_FALSE(taken({1, false, 0, 0, 45, 2, 3, 7, 3, 0}))
      << "a lead slower than what comes before";
  EXPECT_FALSE(taken({1, false, 0, 0, 45, 3, 3, 7, 3, 0})) << "from a slow lead to cruise";
  EXPECT_FALSE(taken({1, false, 0, 0, 20, 0, 3, 7, 3, 0})) << "from a fast lead to the foot";
  EXPECT_FALSE(taken({1, false, 0, 0, 20, 0, 0, 0, 1, 0}))
      << "from a fast lead to rest in one step";
  EXPECT_FALSE(taken({1, false, 0, 0, 19, 0, 0, 0, 3, 0})) << "a lead faster than cruise";
  EXPECT_TRUE(taken({1, true, 19, 999, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(taken({1, true, 20, 0, 0, 0, 0, 0, 0, 0})) << "the step is over";
  EXPECT_FALSE(taken({1, true, 0, 1000, 0, 0, 0, 0, 0, 0})) << "more than a unit";
  EXPECT_FALSE(taken({1, true, 0, 0, 30, 0, 0, 0, 0, 0})) << "a lead is no cruise";
  EXPECT_FALSE(taken({1, false, 0, 0, 0, 3, 3, 0, 0, 0})) << "nothing to be done";
  EXPECT_FALSE(taken({1, false, 0, 0, 0, 0, 3, UINT32_MAX - 2, 3, 0}))
      << "more steps than a run counts";
}

}  // namespace
}  // namespace bushd::test::run_state_test
