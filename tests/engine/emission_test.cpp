#include "engine/emission.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "engine/properties.h"

namespace bushd::test::emission_test {
namespace {

// The document's figures: T_step 2.048 ms, eight of them in a tick, dt_p 0.518 ms.
constexpr std::uint32_t kTickNs = 16'384'000;
constexpr std::uint16_t kSlots = 256;  // of 64 us

bushd_emission periodic(bushd_emission_mode mode, std::uint16_t step_us = 2048,
                        std::uint16_t settle_us = 0) {
  bushd_emission settings{};
  settings.mode = mode;
  settings.step_us = step_us;
  settings.settle_us = settle_us;
  return settings;
}

bushd_emission_grid fit(const bushd_emission& settings, std::uint16_t slots = kSlots) {
  bushd_emission_grid grid{};
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, slots, &grid), BUSHD_OK);
  return grid;
}

// The slots of each motor's pulses.
std::vector<std::vector<int>> fill(const bushd_emission_grid& grid,
                                   const std::vector<std::int16_t>& steps,
                                   std::uint16_t slots = kSlots) {
  std::vector<std::uint16_t> masks(slots, 0xFFFF);
  bushd_emission_fill(masks.data(), slots, &grid, steps.data(),
                      static_cast<std::uint8_t>(steps.size()));
  std::vector<std::vector<int>> pulses(16);
  for (int slot = 0; slot < slots; ++slot) {
    for (unsigned m = 0; m < 16; ++m) {
      if (masks[slot] >> m & 1) pulses[m].push_back(slot);
    }
  }
  pulses.resize(steps.size());
  return pulses;
}

using Pulses = std::vector<std::vector<int>>;

TEST(Burst, AllMotorsPulseTogetherUntilEachHasMadeItsSteps) {
  const auto grid = fit(periodic(BUSHD_EMISSION_BURST));
  EXPECT_EQ(grid.max_steps, 8);
  EXPECT_EQ(fill(grid, {3, 0, -1, 2}), (Pulses{{0, 32, 64}, {}, {0}, {0, 32}}));
}

TEST(Burst, StepsWaitForTheDirSetupInEveryTick) {
  bushd_emission settings = periodic(BUSHD_EMISSION_BURST);
  settings.dir_setup_us = 5;
  const auto grid = fit(settings);
  EXPECT_EQ(grid.max_steps, 7);
  EXPECT_EQ(fill(grid, {2, -2}), (Pulses{{1, 33}, {1, 33}}));
}

TEST(CommonDir, LeftMoversPulseInEvenSlotsAndRightMoversInTheNextOnes) {
  const auto grid = fit(periodic(BUSHD_EMISSION_COMMON_DIR));
  EXPECT_EQ(fill(grid, {2, -3, 1}), (Pulses{{1, 33}, {0, 32, 64}, {1}}));
}

TEST(CommonDir, PeriodIsEvenHoweverShort) {
  const auto grid = fit(periodic(BUSHD_EMISSION_COMMON_DIR, 190));  // 2.97 slots
  EXPECT_EQ(grid.period_slots, 4);
  EXPECT_EQ(grid.max_steps, 64);
  EXPECT_EQ(fit(periodic(BUSHD_EMISSION_COMMON_DIR, 1)).period_slots, 2);
}

TEST(Staggered, FourMotorsAreAQuarterOfTheStepApartAsInTheDocument) {
  const auto grid = fit(periodic(BUSHD_EMISSION_STAGGERED, 2048, 518));
  // dt_n = 0.512 ms < dt_p
  EXPECT_EQ(fill(grid, {1, 1, -1, 2}), (Pulses{{0}, {8}, {16}, {24, 32}}));
}

TEST(Staggered, FewerMotorsAreTheSettlingTimeApart) {
  const auto grid = fit(periodic(BUSHD_EMISSION_STAGGERED, 2048, 518));
  EXPECT_EQ(fill(grid, {0, 1, 0, -1}), (Pulses{{}, {0}, {}, {9}}));  // 0.576 ms, the next slot
}

TEST(Staggered, UnknownSettlingTimeSpreadsOverTheWholeStep) {
  const auto grid = fit(periodic(BUSHD_EMISSION_STAGGERED));
  EXPECT_EQ(fill(grid, {1, 1, 1}), (Pulses{{0}, {10}, {21}}));
}

TEST(Staggered, MoreMotorsThanSlotsShareThem) {
  const auto grid = fit(periodic(BUSHD_EMISSION_STAGGERED, 128));  // two slots
  EXPECT_EQ(fill(grid, {1, 1, 1, 1, 1}), (Pulses{{0}, {0}, {0}, {1}, {1}}));
}

// Pairs of 128 us: dt_n = 0.512 ms is less than dt_p, four of them.
TEST(CommonStaggered, LeftMoversFollowEachOtherThenRightMovers) {
  const auto grid = fit(periodic(BUSHD_EMISSION_COMMON_STAGGERED, 2048, 518));
  EXPECT_EQ(fill(grid, {1, -1, 2, -1}), (Pulses{{17}, {0}, {25, 33}, {8}}));
}

TEST(CommonStaggered, FewerMotorsAreTheSettlingTimeApart) {
  const auto grid = fit(periodic(BUSHD_EMISSION_COMMON_STAGGERED, 2048, 518));
  // 0.64 ms, the next pair.
  EXPECT_EQ(fill(grid, {-1, 0, -1}), (Pulses{{0}, {}, {10}}));
  EXPECT_EQ(fill(grid, {1, 0, -1}), (Pulses{{11}, {}, {0}})) << "and time for DIR";
}

TEST(CommonStaggered, UnknownSettlingTimeSpreadsOverTheWholeStep) {
  const auto grid = fit(periodic(BUSHD_EMISSION_COMMON_STAGGERED));
  EXPECT_EQ(fill(grid, {1, 1, -1}), (Pulses{{11}, {21}, {0}}));
}

// By pulses alone: DIR is at the level of each motor, and turns once in a T_step.
TEST(CommonStaggered, NoMotorGoesLeftAfterOneThatGoesRight) {
  holds("in each T_step all left movers pulse in even slots, then all right movers in odd ones",
        [] {
          const auto step_us = between<std::uint16_t>(100, 8000);
          const auto grid = fit(
              periodic(BUSHD_EMISSION_COMMON_STAGGERED, step_us, between<std::uint16_t>(0, 2000)));
          std::vector<std::int16_t> steps(between<std::size_t>(1, 16));
          for (auto& count : steps) {
            count = static_cast<std::int16_t>(between<int>(-grid.max_steps, grid.max_steps));
          }
          const Pulses pulses = fill(grid, steps);
          std::map<int, int> last_left;
          std::map<int, int> first_right;
          for (std::size_t m = 0; m < steps.size(); ++m) {
            RC_ASSERT(pulses[m].size() == static_cast<std::size_t>(std::abs(steps[m])));
            for (std::size_t k = 0; k < pulses[m].size(); ++k) {
              const int at = pulses[m][k];
              const int period = static_cast<int>(k);
              RC_ASSERT(at / grid.period_slots == period);
              RC_ASSERT(at % 2 == (steps[m] > 0 ? 1 : 0));
              if (steps[m] < 0) last_left[period] = std::max(last_left[period], at);
              if (steps[m] > 0) {
                const auto [found, is_new] = first_right.try_emplace(period, at);
                found->second = std::min(found->second, at);
              }
            }
          }
          for (const auto& [period, at] : last_left) {
            const auto right = first_right.find(period);
            RC_ASSERT(right == first_right.end() || at < right->second);
          }
        });
}

TEST(CommonStaggered, MoreMotorsThanPairsShareThem) {
  const auto grid = fit(periodic(BUSHD_EMISSION_COMMON_STAGGERED, 190));  // two pairs
  EXPECT_EQ(grid.period_slots, 4);
  EXPECT_EQ(fill(grid, {1, -1, 1, -1, 1}), (Pulses{{1}, {0}, {3}, {0}, {3}}));
}

// By the definition, period by period.
Pulses by_definition(const bushd_emission_grid& grid, const std::vector<std::int16_t>& steps) {
  Pulses pulses(steps.size());
  for (int k = 0; k < 128; ++k) {
    std::vector<std::size_t> due;
    for (std::size_t m = 0; m < steps.size(); ++m) {
      if (std::abs(steps[m]) > k) due.push_back(m);
    }
    const int begin = grid.setup_slots + k * grid.period_slots;
    for (std::size_t i = 0; i < due.size(); ++i) {
      int at = begin;
      if (grid.mode == BUSHD_EMISSION_COMMON_DIR && steps[due[i]] > 0) ++at;
      if (grid.mode == BUSHD_EMISSION_COMMON_STAGGERED) {
        // The place in turn: those to the left before all others.
        int index = 0;
        const bool right = steps[due[i]] > 0;
        for (const std::size_t other : due) {
          const bool other_right = steps[other] > 0;
          index += (right && !other_right) || (right == other_right && other < due[i]) ? 1 : 0;
        }
        const int n = static_cast<int>(due.size());
        const int apart = grid.settle_slots + grid.settle_slots % 2;
        at +=
            apart * n < grid.period_slots ? index * apart : index * (grid.period_slots / 2) / n * 2;
        if (right) ++at;
      }
      if (grid.mode == BUSHD_EMISSION_STAGGERED) {
        const int n = static_cast<int>(due.size());
        const int index = static_cast<int>(i);
        at += grid.settle_slots * n < grid.period_slots ? index * grid.settle_slots
                                                        : index * grid.period_slots / n;
      }
      pulses[due[i]].push_back(at);
    }
  }
  return pulses;
}

TEST(Emission, EveryStepHasItsPulseWhereTheDefinitionPutsIt) {
  std::mt19937 random(4);
  const auto up_to = [&](int most) { return static_cast<int>(random() % (most + 1u)); };
  for (int i = 0; i < 4000; ++i) {
    constexpr bushd_emission_mode kModes[] = {BUSHD_EMISSION_BURST, BUSHD_EMISSION_COMMON_DIR,
                                              BUSHD_EMISSION_STAGGERED,
                                              BUSHD_EMISSION_COMMON_STAGGERED};
    bushd_emission settings = periodic(kModes[i % 4]);
    settings.step_us = static_cast<std::uint16_t>(1 + up_to(i / 4 % 2 ? 16000 : 300));
    settings.settle_us = static_cast<std::uint16_t>(up_to(2000));
    settings.dir_setup_us = static_cast<std::uint16_t>(up_to(30));
    const auto slots = static_cast<std::uint16_t>(128 + up_to(128));
    bushd_emission_grid grid{};
    const bushd_status status = bushd_emission_fit(&settings, kTickNs, slots, &grid);
    if (status == BUSHD_E_STEP_PERIOD && settings.step_us > 15'000) continue;
    ASSERT_EQ(status, BUSHD_OK);
    ASSERT_GE(grid.max_steps, 1);
    std::vector<std::int16_t> steps(1 + static_cast<std::size_t>(up_to(15)));
    for (auto& count : steps) {
      count = static_cast<std::int16_t>(up_to(grid.max_steps) * (up_to(1) ? 1 : -1));
    }
    ASSERT_EQ(fill(grid, steps, slots), by_definition(grid, steps));
  }
}

TEST(Emission, WhatTheSlotsCannotKeepIsRefused) {
  bushd_emission_grid grid{};
  bushd_emission settings{};
  // Half a slot is 32 us; a tick that is 1/64 shorter leaves 31.5.
  settings.pulse_us = 31;
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, kSlots, &grid), BUSHD_OK);
  settings.pulse_us = 32;
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, kSlots, &grid), BUSHD_E_PULSE_WIDTH);
  settings = {};
  settings.dir_setup_us = 16'000;
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, kSlots, &grid), BUSHD_OK);
  EXPECT_EQ(grid.max_steps, 2);
  settings.dir_setup_us = 17'000;
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, kSlots, &grid), BUSHD_E_DIR_SETUP);
  settings = periodic(BUSHD_EMISSION_COMMON_DIR);
  settings.dir_setup_us = 32;
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, kSlots, &grid), BUSHD_E_DIR_SETUP);
  settings = periodic(BUSHD_EMISSION_COMMON_STAGGERED);
  settings.dir_setup_us = 32;
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, kSlots, &grid), BUSHD_E_DIR_SETUP);
  settings = periodic(BUSHD_EMISSION_BURST, 16'385);
  EXPECT_EQ(bushd_emission_fit(&settings, kTickNs, kSlots, &grid), BUSHD_E_STEP_PERIOD);
}

TEST(Emission, EarlyStepsMoveToTheFirstFreeSlotsBehindTheSetup) {
  std::vector<std::uint16_t> masks(128, 0);
  masks[0] = 0x0003;
  masks[1] = 0x0001;
  masks[2] = 0x0001;
  masks[4] = 0x0001;
  bushd_emission_defer(masks.data(), 0x0001, 2);
  EXPECT_EQ(masks[0], 0x0002) << "the other motor's DIR has not changed";
  EXPECT_EQ(masks[1], 0);
  EXPECT_EQ(masks[2], 1);
  EXPECT_EQ(masks[3], 1);
  EXPECT_EQ(masks[4], 1);
  EXPECT_EQ(masks[5], 1);
}

TEST(Phases, EachStepSwitchesAsTheSequencesSay) {
  const std::map<int, std::vector<int>> sequences = {
      {BUSHD_PHASES_WAVE, {0b0001, 0b0010, 0b0100, 0b1000}},
      {BUSHD_PHASES_FULL, {0b0011, 0b0110, 0b1100, 0b1001}},
      {BUSHD_PHASES_HALF, {0x1, 0x3, 0x2, 0x6, 0x4, 0xC, 0x8, 0x9}},
      {BUSHD_PHASES_THREE, {0b001, 0b011, 0b010, 0b110, 0b100, 0b101}}};
  for (const auto& [sequence, levels] : sequences) {
    const auto kind = static_cast<std::uint8_t>(sequence);
    ASSERT_EQ(bushd_phase_count(kind), levels.size());
    for (std::size_t i = 0; i < levels.size(); ++i) {
      EXPECT_EQ(bushd_phase_levels(kind, static_cast<std::uint8_t>(i)), levels[i]);
    }
  }
}

}  // namespace
}  // namespace bushd::test::emission_test
