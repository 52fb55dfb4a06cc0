// Runs of the engine against the slow reference, for random tables and moves.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdint>
#include <vector>

#include "engine/run.h"
#include "tables/random_table.h"
#include "tables/reference_move.h"
#include "tables/table.h"
#include "tables/table_file.h"

namespace bushd::test {
namespace {

constexpr int kMovesPerTable = 8;
constexpr std::uint64_t kMaxTicks = 20000;

// Expands in blocks of block_ticks() each into every second place, past the end of the run.
template <class Displacement, class Expand, class BlockTicks>
std::vector<int> expand(const bushd_table& table, std::int64_t steps, std::uint32_t tick_ns,
                        Expand expand_block, BlockTicks block_ticks) {
  constexpr Displacement kUntouched = 77;
  bushd_run run;
  bushd_run_start(&run, &table, static_cast<std::uint32_t>(steps < 0 ? -steps : steps),
                  steps < 0 ? -1 : 1, 0);
  std::vector<int> out;
  while (!bushd_run_done(&run)) {
    const std::size_t ticks = block_ticks();
    std::vector<Displacement> block(2 * ticks, kUntouched);
    const std::size_t active = expand_block(&run, tick_ns, ticks, block.data(), 2);
    RC_ASSERT(active <= ticks);
    RC_ASSERT(active == ticks || bushd_run_done(&run));
    for (std::size_t i = 0; i < ticks; ++i) {
      if (i < active) out.push_back(block[2 * i]);
      if (i >= active) RC_ASSERT(block[2 * i] == 0);
      RC_ASSERT(block[2 * i + 1] == kUntouched);
    }
  }
  RC_ASSERT(run.steps_done == static_cast<std::uint32_t>(steps < 0 ? -steps : steps));
  return out;
}

// The same table for an MCU: codes only.
bushd_table without_index(bushd_table table) {
  table.accel.sum = table.decel.sum = nullptr;
  table.accel.bucket = table.decel.bucket = nullptr;
  return table;
}

std::int64_t random_steps(const RandomCase& made) {
  const int codes = static_cast<int>(made.content.accel.size());
  std::int64_t steps = random_in(0, random_in(0, 1) == 0 ? 2 * codes + 3 : 3000);
  while (ReferenceMove(made.content, steps, made.tick_ns).active_ticks() > kMaxTicks) steps /= 2;
  return random_in(0, 1) == 0 ? steps : -steps;
}

TEST(Expansion, AgreesWithTheSlowReferenceForAnyMonotoneTable) {
  EXPECT_TRUE(rc::check("displacements of every tick", [] {
    const RandomCase made = random_case(1);
    const auto table = tables::make(made.content);
    RC_ASSERT(table.has_value());
    const bushd_table& indexed = (*table)->view();
    const auto random_block = [] { return static_cast<std::size_t>(random_in(1, 200)); };
    const bushd_table plain = without_index(indexed);
    RC_ASSERT(bushd_table_max_steps_per_tick(&indexed, made.tick_ns) <= BUSHD_MAX_STEPS_PER_TICK);
    for (int i = 0; i < kMovesPerTable; ++i) {
      const std::int64_t steps = random_steps(made);
      const ReferenceMove reference(made.content, steps, made.tick_ns);
      const std::vector<int> coarse = reference.coarse();
      const std::vector<int> fine = reference.fine();
      RC_LOG() << file_text(made.content) << "tick_ns " << made.tick_ns << " steps " << steps
               << '\n';
      for (const bushd_table* view : {&indexed, &plain}) {
        RC_ASSERT(expand<std::uint8_t>(*view, steps, made.tick_ns, bushd_run_expand_coarse,
                                       random_block) == coarse);
        RC_ASSERT(expand<std::int16_t>(*view, steps, made.tick_ns, bushd_run_expand_fine,
                                       random_block) == fine);
      }
    }
  }));
}

// Once the last step fell on the last tick that a block took in one go, one more tick was called
// active.
TEST(Expansion, MoveThatEndsWithABlockHasNoTickAfterIt) {
  const tables::TableContent content{.name = "t", .time_unit_ns = 22223, .accel = {1}};
  const auto table = tables::make(content);
  ASSERT_TRUE(table.has_value());
  for (const std::int64_t steps : {117, 125, 126, 135}) {
    for (const std::size_t block : {4, 5, 7, 13, 14, 100}) {
      EXPECT_EQ(expand<std::uint8_t>((*table)->view(), steps, 200'000, bushd_run_expand_coarse,
                                     [&] { return block; }),
                ReferenceMove(content, steps, 200'000).coarse())
          << steps << ' ' << block;
    }
  }
}

TEST(Expansion, AgreesWithTheSlowReferenceForTheShippedTables) {
  const auto block = [] { return std::size_t{37}; };
  for (const char* name : {"bushd2-constant", "bushd2-scurve", "bushd2-exponential",
                           "bushd2-resonance", "micro16-standard", "micro32-smooth"}) {
    const auto path = tables::find(name, tables::shipped_directories());
    ASSERT_TRUE(path.has_value());
    const auto table = tables::load(*path);
    ASSERT_TRUE(table.has_value());
    const bushd_ramp& accel = (*table)->view().accel;
    tables::TableContent content{.name = name, .time_unit_ns = (*table)->view().time_unit_ns};
    content.accel.assign(accel.code, accel.code + accel.count);
    for (const std::int64_t steps : {1, -2, 475, 476, -477, 5000}) {
      for (const std::uint32_t tick_ns : {1'000'000u, 2'560'000u}) {
        SCOPED_TRACE(testing::Message() << name << ' ' << steps << ' ' << tick_ns);
        const ReferenceMove reference(content, steps, tick_ns);
        const bushd_table& view = (*table)->view();
        EXPECT_EQ(expand<std::uint8_t>(view, steps, tick_ns, bushd_run_expand_coarse, block),
                  reference.coarse());
        EXPECT_EQ(expand<std::int16_t>(view, steps, tick_ns, bushd_run_expand_fine, block),
                  reference.fine());
      }
    }
  }
}

}  // namespace
}  // namespace bushd::test
