#include "state/rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bushd::state::rules_test {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kFriday = 1'795'194'000'000'000;  // 2026-11-20 17:00:00 UTC

Record a_record() {
  return {.steps = 1200,
          .steps_per_unit = "400",
          .trust = Trust::kKnown,
          .utime_us = kFriday,
          .unique_id = "0123456789abcdef",
          .boot_number = 7,
          .output = 2,
          .at_rest = true,
          .motion = 5};
}

Seen a_sight() {
  return {.mcu = "hall:1",
          .unique_id = "0123456789abcdef",
          .boot_number = 7,
          .output = 2,
          .steps_per_unit = "400"};
}

TEST(Rules, NothingKeptIsAsOnTheFirstDay) {
  const Verdict verdict = on_connecting({}, a_sight());
  EXPECT_EQ(verdict.trust, Trust::kUnconfirmed);
  EXPECT_FALSE(verdict.set_steps);
}

TEST(Rules, RestoredSaysWhereItStoodAndWhen) {
  Seen seen = a_sight();
  seen.boot_number = 8;
  const Verdict verdict = on_connecting({.record = a_record(), .motion = 5}, seen);
  EXPECT_EQ(verdict.trust, Trust::kRestored);
  EXPECT_EQ(verdict.set_steps, 1200);
  EXPECT_THAT(verdict.reason, HasSubstr("1200 steps"));
  EXPECT_THAT(verdict.reason, HasSubstr("2026-11-20 17:00:00 UTC"));
}

TEST(Rules, UncertainSaysWhatWasKnownLast) {
  Seen seen = a_sight();
  seen.boot_number = 8;
  const Verdict verdict = on_connecting({.record = a_record(), .motion = 6}, seen);
  EXPECT_EQ(verdict.trust, Trust::kUncertain);
  EXPECT_EQ(verdict.reason,
            "MCU hall:1 restarted while it moved; last known: 1200 steps at 2026-11-20 17:00:00 "
            "UTC");
}

TEST(Rules, ASwitchThatStopsImmediatelyMakesTheSameBootUncertain) {
  Seen seen = a_sight();
  seen.may_have_overrun = true;
  EXPECT_EQ(on_connecting({.record = a_record(), .motion = 5}, seen).trust, Trust::kKnown);
  EXPECT_EQ(on_connecting({.record = a_record(), .motion = 6}, seen).trust, Trust::kUncertain);
}

// Its own record may say what it likes.
TEST(Rules, AnOutputThatWasAnotherMotorsIsUncertainAndItsCounterGoesOn) {
  for (const bool has_own : {false, true}) {
    for (const bool other_boot : {false, true}) {
      Kept kept{.motion = 5};
      if (has_own) kept.record = a_record();
      Seen seen = a_sight();
      seen.before = Owner{"phi", a_record()};
      seen.before->record.steps = -70;
      if (other_boot) seen.boot_number = 8;
      const Verdict verdict = on_connecting(kept, seen);
      EXPECT_EQ(verdict.trust, Trust::kUncertain);
      EXPECT_EQ(verdict.set_steps, other_boot ? std::optional<std::int64_t>(-70) : std::nullopt);
      EXPECT_EQ(verdict.reason,
                "output 2 of MCU hall:1 was motor \"phi\" before; last known: -70 steps at "
                "2026-11-20 17:00:00 UTC");
    }
  }
}

TEST(Rules, WhoGivesUpItsOutputSaysToWhom) {
  Record record = a_record();
  give_up_output(record, "phi");
  EXPECT_EQ(record.trust, Trust::kUncertain);
  EXPECT_FALSE(same_counter(record, a_record()));
  const Verdict verdict = on_connecting({.record = record, .motion = 5}, a_sight());
  EXPECT_EQ(verdict.trust, Trust::kUncertain);
  EXPECT_THAT(verdict.reason, HasSubstr("its output has become that of motor \"phi\"; last known: "
                                        "1200 steps"));
  // What was said before is said still.
  give_up_output(record, "chi");
  EXPECT_THAT(record.reason, HasSubstr("phi"));
}

// Every combination of what can differ, against the rules as they are said.
TEST(Rules, EveryCombination) {
  int combinations = 0;
  for (const Trust trust :
       {Trust::kUnconfirmed, Trust::kKnown, Trust::kRestored, Trust::kUncertain}) {
    for (unsigned bits = 0; bits < 1u << 8; ++bits) {
      const auto bit = [bits](unsigned at) { return (bits >> at & 1) != 0; };
      const bool other_mcu = bit(0), other_output = bit(1), other_boot = bit(2),
                 other_scale = bit(3), local = bit(4), marked = bit(5), seen_in_motion = bit(6),
                 mark_lost = bit(7);
      Kept kept{.record = a_record(), .motion = marked ? 6u : 5u, .mark_lost = mark_lost};
      kept.record->trust = trust;
      if (trust == Trust::kUncertain) kept.record->reason = "steps were lost";
      kept.record->at_rest = !seen_in_motion;
      Seen seen = a_sight();
      if (other_mcu) seen.unique_id = "fedcba9876543210";
      if (other_output) seen.output = 3;
      if (other_boot) seen.boot_number = 8;
      if (other_scale) seen.steps_per_unit = "800";
      seen.local = local;
      const Verdict verdict = on_connecting(kept, seen);
      ++combinations;

      const bool same_counter = !other_mcu && !other_output;
      const bool counts = same_counter && !other_boot;
      const bool stood_there = !marked && !seen_in_motion && !mark_lost;
      Trust expected = trust;
      if (!same_counter || other_scale || (!counts && (!stood_there || local))) {
        expected = Trust::kUncertain;
      } else if (!counts && trust == Trust::kKnown) {
        expected = Trust::kRestored;
      }
      EXPECT_EQ(verdict.trust, expected) << bits;
      EXPECT_EQ(verdict.set_steps.has_value(), same_counter && other_boot) << bits;
      const bool has_reason =
          expected == Trust::kUncertain || (!counts && expected == Trust::kRestored);
      EXPECT_TRUE(!has_reason || !verdict.reason.empty()) << bits;
    }
  }
  EXPECT_EQ(combinations, 1024);
}

}  // namespace
}  // namespace bushd::state::rules_test
