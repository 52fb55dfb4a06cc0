#include "engine/slots.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "engine/properties.h"

namespace bushd::test::slots_test {
namespace {

constexpr uint16_t kBit = 0x0010;
constexpr uint16_t kSlotCounts[] = {128, 200, 256};

// One motor through one tick: the slots in which it stepped.
struct Tick {
  std::vector<uint16_t> slots;
  int steps = 0;
};

Tick add(uint16_t slot_count, int displacement, int16_t* remainder, int16_t crossing) {
  // Slots past the end would be seen by the sanitizer; the other motors' bits must stay.
  std::vector<uint16_t> masks(slot_count, 0x8001);
  Tick tick;
  tick.steps = bushd_slots_add(masks.data(), slot_count, kBit, static_cast<int16_t>(displacement),
                               remainder, crossing);
  for (uint16_t s = 0; s < slot_count; ++s) {
    EXPECT_EQ(masks[s] & ~kBit, 0x8001);
    if (masks[s] & kBit) tick.slots.push_back(s);
  }
  return tick;
}

TEST(SlotsCoarse, PutsStepIOfCAtTheMiddleOfItsShare) {
  for (const uint16_t slot_count : kSlotCounts) {
    for (int c = 0; c <= 127; ++c) {
      for (const int sign : {1, -1}) {
        int16_t remainder = 0;
        const Tick tick = add(slot_count, sign * c * 256, &remainder, BUSHD_CROSSING_COARSE);
        std::vector<uint16_t> expected;
        for (int i = 0; i < c; ++i) {
          expected.push_back(static_cast<uint16_t>((2 * i + 1) * slot_count / (2 * c)));
        }
        ASSERT_EQ(tick.slots, expected) << c << " steps in " << slot_count << " slots";
        EXPECT_EQ(tick.steps, sign * c);
        EXPECT_EQ(remainder, 0);
      }
    }
  }
}

TEST(SlotsCoarse, ByteBecomesSignedSteps) {
  EXPECT_EQ(bushd_coarse_to_fine(0x00), 0);
  EXPECT_EQ(bushd_coarse_to_fine(0x80), 0);
  EXPECT_EQ(bushd_coarse_to_fine(0x01), -256);
  EXPECT_EQ(bushd_coarse_to_fine(0x81), 256);
  EXPECT_EQ(bushd_coarse_to_fine(0x7F), -127 * 256);
  EXPECT_EQ(bushd_coarse_to_fine(0xFF), 127 * 256);
}

// The definition: the exact position p goes linearly to p + d; the made position follows it with
// steps where the difference reaches a whole step, in either direction.
Tick by_definition(int slot_count, int displacement, int* remainder) {
  Tick tick;
  const int direction = displacement < 0 ? -1 : 1;
  const int distance = std::abs(displacement);
  const int progress = *remainder * direction;
  for (int i = 1; i * 256 - progress <= distance; ++i) {
    const int slot = (i * 256 - progress) * slot_count / distance;
    tick.slots.push_back(static_cast<uint16_t>(std::min(slot, slot_count - 1)));
    tick.steps += direction;
  }
  *remainder += displacement - 256 * tick.steps;
  return tick;
}

TEST(SlotsFine, StepsWhereTheExactPositionCrossesAWholeNumber) {
  holds("slots == definition through any displacements, reversals included", [] {
    const auto slot_count = *rc::gen::element<uint16_t>(128, 200, 256);
    const int most = *rc::gen::element(1, 100, 1000, 32767);
    int16_t remainder = 0;
    int expected_remainder = 0;
    int64_t exact = 0;
    int64_t made = 0;
    for (int n = 0; n < 100; ++n) {
      const int displacement = between(-most, most);
      const Tick expected = by_definition(slot_count, displacement, &expected_remainder);
      const Tick tick = add(slot_count, displacement, &remainder, BUSHD_CROSSING_FINE);
      RC_ASSERT(tick.slots == expected.slots);
      RC_ASSERT(tick.steps == expected.steps);
      RC_ASSERT(remainder == expected_remainder);
      // Every step has a slot of its own, and nothing of the position is ever lost.
      RC_ASSERT(tick.slots.size() == static_cast<size_t>(std::abs(tick.steps)));
      exact += displacement;
      made += tick.steps;
      RC_ASSERT(exact == made * 256 + remainder);
      RC_ASSERT(std::abs(remainder) < 256);
    }
  });
}

TEST(SlotsFine, ReversalWaitsForAWholeStepBack) {
  int16_t remainder = 0;
  EXPECT_EQ(add(128, 256 + 200, &remainder, BUSHD_CROSSING_FINE).steps, 1);
  EXPECT_EQ(add(128, -300, &remainder, BUSHD_CROSSING_FINE).steps,
            0);  // at 156/256: still on step 1
  EXPECT_EQ(add(128, -156, &remainder, BUSHD_CROSSING_FINE).steps, -1);
  EXPECT_EQ(remainder, 0);
}

TEST(SlotsFine, NothingMovesWithoutDisplacement) {
  for (int16_t remainder = -255; remainder <= 255; ++remainder) {
    int16_t kept = remainder;
    EXPECT_TRUE(add(128, 0, &kept, BUSHD_CROSSING_FINE).slots.empty());
    EXPECT_EQ(kept, remainder);
  }
}

TEST(SlotsFine, EveryDisplacementAndRemainderHasASlotForEachStep) {
  // All speeds at all phases, and near the limit of 16 bits every speed.
  for (const uint16_t slot_count : kSlotCounts) {
    for (int displacement = 1; displacement <= 32767;
         displacement += displacement < 32000 ? 37 : 1) {
      for (int start = -255; start <= 255; start += 15) {
        auto remainder = static_cast<int16_t>(start);
        const Tick tick = add(slot_count, displacement, &remainder, BUSHD_CROSSING_FINE);
        ASSERT_EQ(tick.slots.size(), static_cast<size_t>(tick.steps))
            << displacement << " from " << start << " in " << slot_count;
      }
    }
  }
}

}  // namespace
}  // namespace bushd::test::slots_test
