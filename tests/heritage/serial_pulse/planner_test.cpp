// Runs of tables as bytes, judged by the levels on the line and exact fractions: no interval is
// shorter than its delay, and no step more or less is made, whatever the driver makes of rates and
// wherever a run is ended.
#include "heritage/serial_pulse/planner.h"

#include <cstdio>

#include "engine/properties.h"
#include "heritage/serial_pulse/line.h"

namespace bushd::serial_pulse {
namespace {

using test::falls_of;
using test::Fraction;

TEST(Patterns, FallAsTheirTableSays) {
  const auto check = [](const Pattern& pattern, bool last) {
    const auto falls = falls_of(pattern.byte);
    ASSERT_EQ(falls.size(), pattern.steps);
    EXPECT_EQ(falls.front(), 0u);
    for (std::size_t i = 1; i < falls.size(); ++i) {
      EXPECT_GE(falls[i] - falls[i - 1], pattern.between_bits) << unsigned{pattern.byte};
    }
    EXPECT_EQ(kBitsPerByte - falls.back(), pattern.after_bits) << last;
  };
  for (const Pattern& pattern : kAny) check(pattern, false);
  for (const Pattern& pattern : kLast) check(pattern, true);
}

TEST(Patterns, TheBytesOfTheSource) {
  EXPECT_EQ(kAny[0].byte, 0x55);
  EXPECT_EQ(kAny[3].byte, 0xF0);
  EXPECT_EQ(kLast[0].byte, 0xFF);
  EXPECT_EQ(kLast[1].byte, 0xFB);
  EXPECT_EQ(kLast[2].byte, 0xF5);
  EXPECT_EQ(kLast[3].byte, 0xD5);
}

// Makes a run byte by byte, on a driver that may make a little more of a rate than it is asked;
// `end_after` bytes it is ramped down.
struct Made {
  std::uint64_t steps = 0;
  unsigned changes = 0;
};
Made make(bushd_run run, Planner planner, std::uint32_t per_mille_more,
          std::uint64_t end_after = UINT64_MAX) {
  Made made;
  std::uint32_t asked = 0;
  std::uint32_t real = 0;
  bool began = false;
  bool waits = false;
  Fraction since_last;  // from the last fall to the end of the byte that it is in
  for (std::uint64_t bytes = 0; !bushd_run_done(&run); ++bytes) {
    if (bytes == end_after) bushd_run_ramp_down(&run);
    const auto delays = delays_ahead(Steps(run), planner.horizon_ns(), Planner::kLookAhead);
    const Ahead ahead{.delays_ns = delays,
                      .to_the_end = delays.size() == bushd_run_steps_left(&run)};
    const auto [rate, pattern, then_wait] = planner.choose(ahead, asked);
    if (rate.ask != asked) {
      if (asked != 0) ++made.changes;
      asked = rate.ask;
      real = asked + asked / 1000 * per_mille_more;
      planner.learn(asked, real);
      continue;  // as the master does: it chooses again when it knows what was made
    }
    const auto falls = falls_of(pattern.byte);
    for (std::size_t i = 0; i < falls.size(); ++i) {
      const Fraction interval = i == 0 ? since_last : Fraction(falls[i] - falls[i - 1], real);
      const std::uint64_t delay = bushd_run_take_step(&run);
      if (delay == 0) throw std::runtime_error("a step too many");
      const Fraction wanted(static_cast<__int128_t>(delay) * run.table->time_unit_ns,
                            1'000'000'000);
      if (began && !(i == 0 && waits) && interval < wanted)
        throw std::runtime_error("a step too early");
      began = true;
      ++made.steps;
    }
    since_last = Fraction(10 - falls.back(), real);
    waits = then_wait;
  }
  return made;
}

struct Profile {
  std::vector<std::uint16_t> accel;
  std::vector<std::uint16_t> decel;
  bushd_table table{};
};

// From 100 Hz to about 5 kHz, as shipped tables go.
Profile ramp(unsigned codes) {
  Profile profile;
  for (unsigned i = 0; i < codes; ++i) {
    const double hz = 100 + 4900.0 * i / codes;
    profile.accel.push_back(static_cast<std::uint16_t>(100'000 / hz));
  }
  profile.decel = profile.accel;
  profile.table.cruise = 20;
  profile.table.time_unit_ns = 10'000;
  return profile;
}

bushd_run run_of(Profile& profile, std::uint32_t steps) {
  profile.table.accel = {.code = profile.accel.data(),
                         .count = static_cast<std::uint16_t>(profile.accel.size()),
                         .sum = nullptr,
                         .bucket = nullptr,
                         .bucket_shift = 0};
  profile.table.decel = profile.table.accel;
  profile.table.decel.code = profile.decel.data();
  profile.table.decel.count = static_cast<std::uint16_t>(profile.decel.size());
  bushd_run run;
  bushd_run_start(&run, &profile.table, steps, 1, 0);
  return run;
}

std::vector<Rate> rates_of(const Rates& driver, const Profile& profile) {
  const std::uint64_t unit = profile.table.time_unit_ns;
  const std::uint64_t longest = std::max(profile.accel[0], profile.decel[0]);
  return rates_for(driver, profile.table.cruise * unit, longest * unit);
}

TEST(Planner, CruisesAtTheRateOfTheTable) {
  Profile profile = ramp(300);
  const auto rates = rates_of({.any = true}, profile);
  ASSERT_FALSE(rates.empty());
  EXPECT_EQ(rates.front().ask, 10'000u);  // f = baud / 2
  const Made made = make(run_of(profile, 20'000), Planner(rates, 2'000'000), 0);
  EXPECT_EQ(made.steps, 20'000u);
}

TEST(Planner, PrintsWhatRatesAndPausesCost) {
  Profile profile = ramp(600);
  for (const bool any : {true, false}) {
    for (const std::uint64_t change_ns : {500'000u, 2'000'000u, 22'000'000u}) {
      const Planner planner(rates_of({.any = any}, profile), change_ns);
      const Survey made = survey(run_of(profile, 4000), planner);
      EXPECT_GE(made.made_ns, made.table_ns);
      std::printf(
          "  %s, %4.1f ms a change: table %.3f s, made %.3f s (+%.1f %%), %u changes of "
          "rate, an interval at most %.2f of its delay\n",
          any ? "any rate    " : "fixed rates ", static_cast<double>(change_ns) / 1e6,
          static_cast<double>(made.table_ns) / 1e9, static_cast<double>(made.made_ns) / 1e9,
          100.0 * static_cast<double>(made.made_ns - made.table_ns) /
              static_cast<double>(made.table_ns),
          made.rates, made.longest_ratio);
      if (!any) continue;
      EXPECT_LT(static_cast<double>(made.made_ns), 1.5 * static_cast<double>(made.table_ns));
    }
  }
}

TEST(Planner, DividesTheClockOfAnUart) {
  for (const Rate& rate : rates_for({.any = true, .base = 115'200}, 200'000, 10'000'000)) {
    const std::uint32_t n = (115'200 + rate.ask / 2) / rate.ask;  // as Linux rounds it
    EXPECT_LE(115'200.0 / n, rate.most);
    EXPECT_GT(115'200.0 / n, rate.most - 1.001);
  }
}

TEST(Planner, WaitsWhereNoRateIsSlowEnough) {
  const std::vector<std::uint64_t> slow(12, 201'000'000);
  const std::vector<std::uint64_t> bearable(12, 200'000'000);
  for (const bool any : {true, false}) {
    const Planner planner(rates_for({.any = any}, slow[0], slow[0]), 1'000'000);
    const Choice choice = planner.choose({.delays_ns = slow, .to_the_end = false}, 0);
    EXPECT_TRUE(choice.then_wait);
    EXPECT_EQ(choice.pattern.byte, 0xF0);
    EXPECT_EQ(choice.rate.ask, 50u);
    EXPECT_FALSE(planner.choose({.delays_ns = bearable, .to_the_end = false}, 0).then_wait);
  }
}

// What delays_ahead and the master go by.
TEST(TakeStep, HasTheDelaysOfTheRule) {
  Profile profile = ramp(50);
  for (const std::uint32_t steps : {1u, 2u, 7u, 80u, 99u, 100u, 101u, 500u}) {
    bushd_run run = run_of(profile, steps);
    for (std::uint32_t j = 1; j <= steps; ++j) {
      ASSERT_EQ(bushd_run_take_step(&run), bushd_table_delay(&profile.table, j, steps));
    }
    EXPECT_EQ(bushd_run_take_step(&run), 0U);
    EXPECT_EQ(run.steps_done, steps);
  }
}

void no_step_comes_early_and_none_is_lost() {
  Profile profile;
  const auto side = [](std::uint16_t cruise) {
    std::vector<std::uint16_t> codes(test::between<std::size_t>(1, 80));
    for (std::uint16_t& code : codes) {
      code = static_cast<std::uint16_t>(cruise + test::between<unsigned>(0, 2000));
    }
    std::sort(codes.rbegin(), codes.rend());
    return codes;
  };
  profile.table.cruise = test::between<std::uint16_t>(3, 200);
  profile.table.time_unit_ns = test::between<std::uint32_t>(1000, 20'000);
  profile.accel = side(profile.table.cruise);
  profile.decel = side(profile.table.cruise);
  const auto steps = test::between<std::uint32_t>(1, 600);
  const Rates driver{.any = test::between<int>(0, 2) > 0,
                     .base = test::between<int>(0, 1) > 0 ? 115'200u : 0u};
  const auto rates = rates_of(driver, profile);
  const Planner planner(rates, test::between<std::uint64_t>(100'000, 25'000'000));
  const std::uint32_t more = test::between<std::uint32_t>(0, 20);
  RC_ASSERT(make(run_of(profile, steps), planner, more).steps == steps);
  const auto ended =
      make(run_of(profile, steps), planner, more, test::between<std::uint64_t>(1, 60));
  RC_ASSERT(ended.steps <= steps);
}

TEST(Planner, NoStepComesEarlyAndNoneIsLost) {
  test::holds("no step comes early and none is lost", no_step_comes_early_and_none_is_lost);
}

}  // namespace
}  // namespace bushd::serial_pulse
