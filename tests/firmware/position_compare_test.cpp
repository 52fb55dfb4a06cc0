// POSITION_COMPARE: a pulse at the position compare output when a motor arrives at a position.
#include <cstdlib>
#include <random>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr std::int64_t kSlotNs = kTick / kSlots;
constexpr std::uint8_t kBoth = BUSHD_ARRIVES_POSITIVE | BUSHD_ARRIVES_NEGATIVE;

struct Pulse {
  std::int64_t rises;  // slots since tick 0
  std::int64_t falls;
  bool operator==(const Pulse&) const = default;
};

class PositionCompare : public Streams {
 protected:
  // Lets ticks pass, watches the output, and the slots in which motor 0 arrives at each position.
  void watch(int ticks) {
    for (int i = 0; i < ticks; ++i, rig.pass()) {
      const bushd_slot_buffer& slot_buffer = rig.slot_buffer();
      const std::int64_t first = rig.tick() * kSlots;
      for (std::int64_t slot = 0; slot < kSlots; ++slot) {
        if (slot_buffer.compare_rise == slot + 1) pulses_.push_back({first + slot, -1});
        if (slot_buffer.compare_fall == slot + 1) pulses_.back().falls = first + slot;
        if (slot_buffer.step[slot] & 1) {
          position_ += slot_buffer.direction & 1 ? 1 : -1;
          arrivals_.push_back({position_, first + slot});
        }
      }
    }
  }
  void watch_until_rest() {
    while (rig.poll().moving != 0) watch(1);
  }
  std::vector<std::int64_t> arrivals_at(std::int64_t position) const {
    std::vector<std::int64_t> slots;
    for (const auto& [at, slot] : arrivals_) {
      if (at == position) slots.push_back(slot);
    }
    return slots;
  }
  bushd_status run(std::int32_t steps) {
    const bushd_table_run_entry entry = {0, 0, static_cast<std::int8_t>(steps < 0 ? -1 : 1),
                                         static_cast<std::uint32_t>(std::abs(steps)), 0};
    return rig.take(BUSHD_MSG_TABLE_RUN, table_run_payload(0, rig.first_open(), entry));
  }

  std::vector<Pulse> pulses_;
  std::vector<std::pair<std::int64_t, std::int64_t>> arrivals_;
  std::int64_t position_ = 0;
};
BUSHD_IN_BOTH_FORMATS(PositionCompare);

TEST_P(PositionCompare, FollowsTheArrivalAfterItsDelayWithinASlot) {
  std::mt19937 random(5);
  const auto below = [&random](std::uint32_t n) {
    return static_cast<std::uint32_t>(random() % n);
  };
  for (int i = 0; i < 120; ++i) {
    const std::int32_t steps = (i % 2 ? -1 : 1) * static_cast<std::int32_t>(1 + below(150));
    const std::int32_t at =
        static_cast<std::int32_t>(position_) +
        (steps < 0 ? -1 : 1) *
            static_cast<std::int32_t>(1 + below(static_cast<std::uint32_t>(std::abs(steps))));
    const std::uint32_t delay_us = i % 4 == 0 ? 0 : below(i % 9 == 0 ? 1'500'001 : 12'000);
    const std::uint32_t width_us = 1 + below(i % 5 == 0 ? 1'000'000 : 3000);
    ASSERT_EQ(rig.position_compare({0, kBoth, at, delay_us, width_us}), BUSHD_OK);
    pulses_.clear();
    arrivals_.clear();
    if (i % 3 == 0) {
      ASSERT_EQ(run(steps), BUSHD_OK);
      watch_until_rest();
    } else {
      const Plan moves = plan(steps);
      const std::uint32_t start = rig.first_open();
      for (std::size_t from = 0; from < moves.ticks(); from += 10) {
        ASSERT_EQ(rig.take(rig.part(moves, start, from, 10)), BUSHD_OK);
        while (start + static_cast<std::uint32_t>(from) - rig.tick() > 3) watch(1);
      }
      watch_until_rest();
    }
    for (int n = 0; n < 1000 && (pulses_.empty() || pulses_[0].falls < 0); ++n) watch(1);
    const auto arrived = arrivals_at(at);
    ASSERT_EQ(arrived.size(), 1u);
    ASSERT_EQ(pulses_.size(), 1u) << at << " of " << steps;
    const std::int64_t late_ns =
        (pulses_[0].rises - arrived[0]) * kSlotNs - std::int64_t{delay_us} * 1000;
    EXPECT_LE(std::abs(late_ns), kSlotNs / 2) << delay_us;
    const std::int64_t wide_ns = (pulses_[0].falls - pulses_[0].rises) * kSlotNs;
    EXPECT_LE(std::abs(wide_ns - std::int64_t{width_us} * 1000), kSlotNs) << width_us;
    EXPECT_GT(wide_ns, 0);
  }
}

TEST_P(PositionCompare, LooksAtItsDirectionAndItsMotor) {
  const auto pulses_of = [this](std::uint8_t arrivals, std::uint8_t motor) {
    pulses_.clear();
    EXPECT_EQ(rig.position_compare({motor, arrivals, 5, 100, 50}), BUSHD_OK);
    for (const std::int32_t steps : {10, -10}) {
      EXPECT_EQ(run(steps), BUSHD_OK);
      watch_until_rest();
    }
    watch(5);
    return pulses_.size();
  };
  EXPECT_EQ(pulses_of(BUSHD_ARRIVES_POSITIVE, 0), 1u);
  EXPECT_EQ(pulses_of(BUSHD_ARRIVES_NEGATIVE, 0), 1u);
  EXPECT_EQ(pulses_of(kBoth, 0), 2u);
  EXPECT_EQ(pulses_of(kBoth, 1), 0u);
  EXPECT_EQ(pulses_of(0, 0), 0u) << "switched off";
}

TEST_P(PositionCompare, DepartureIsNoArrival) {
  ASSERT_EQ(rig.set_position(0, 100), BUSHD_OK);
  ASSERT_EQ(rig.position_compare({0, kBoth, 100, 0, 50}), BUSHD_OK);
  ASSERT_EQ(run(10), BUSHD_OK);
  watch_until_rest();
  EXPECT_TRUE(pulses_.empty());
  ASSERT_EQ(run(-10), BUSHD_OK);
  watch_until_rest();
  EXPECT_EQ(pulses_.size(), 1u);
}

TEST_P(PositionCompare, OneAtATime) {
  ASSERT_EQ(rig.position_compare({0, kBoth, 5, 1'400'000, 1000}), BUSHD_OK);
  for (const std::int32_t steps : {10, -10}) {
    ASSERT_EQ(run(steps), BUSHD_OK);
    watch_until_rest();
  }
  watch(1000);
  ASSERT_EQ(pulses_.size(), 1u);
  ASSERT_EQ(run(10), BUSHD_OK);
  watch_until_rest();
  watch(1000);
  EXPECT_EQ(pulses_.size(), 2u);
}

TEST_P(PositionCompare, SwitchedOffOneThatWaitsIsNotMadeAndOneThatIsOutEnds) {
  ASSERT_EQ(rig.position_compare({0, kBoth, 5, 200'000, 100'000}), BUSHD_OK);
  ASSERT_EQ(run(5), BUSHD_OK);
  watch_until_rest();
  ASSERT_EQ(rig.position_compare({0, 0, 0, 0, 1}), BUSHD_OK);
  watch(200);
  EXPECT_TRUE(pulses_.empty());
  ASSERT_EQ(rig.position_compare({0, kBoth, 0, 0, 100'000}), BUSHD_OK);
  ASSERT_EQ(run(-5), BUSHD_OK);
  while (pulses_.empty()) watch(1);
  ASSERT_EQ(rig.position_compare({0, 0, 0, 0, 1}), BUSHD_OK);
  watch(100);
  ASSERT_EQ(pulses_.size(), 1u);
  EXPECT_EQ((pulses_[0].falls - pulses_[0].rises) * kSlotNs, 100'000'000);
}

TEST_P(PositionCompare, AnotherTickSwitchesItOff) {
  ASSERT_EQ(rig.position_compare({0, kBoth, 2, 0, 50}), BUSHD_OK);
  ASSERT_EQ(rig.configure(format, 2 * Rig::kTickNs), BUSHD_OK);
  rig.make_ready(law, format, 9000);
  ASSERT_EQ(run(5), BUSHD_OK);
  watch_until_rest();
  EXPECT_TRUE(pulses_.empty());
}

TEST(PositionCompareRequest, IsForMotorsThatExist) {
  Rig rig;
  EXPECT_EQ(rig.position_compare({4, kBoth, 0, 0, 1}), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.position_compare({0, 4, 0, 0, 1}), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.position_compare({0, kBoth, 0, 0, 0}), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.position_compare({0, kBoth, 0, 1'500'001, 1}), BUSHD_E_FORMAT);
  EXPECT_EQ(rig.position_compare({0, kBoth, 0, 0, 1'000'001}), BUSHD_E_FORMAT);
}

}  // namespace
}  // namespace bushd::test
