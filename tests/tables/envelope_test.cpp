// The table of a line against what it is for: no two steps of a motor closer together than the
// motor's own table allows. Step times are exact rational numbers, by the definitions; only the
// codes of the envelope are the code's that is tested.
#include "tables/envelope.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/elementary.h"
#include "engine/table.h"
#include "engine/tables.h"

namespace bushd::test {
namespace {

using tables::Envelope;
using tables::LinePart;

// Delays by the rule of BUSHD.
std::vector<Wide> delays_of(const bushd_table& table, std::uint32_t steps,
                            std::uint16_t shortest_delay) {
  std::vector<Wide> delays;
  for (std::uint32_t j = 1; j <= steps; ++j) {
    delays.push_back(std::max(bushd_table_delay(&table, j, steps), shortest_delay));
  }
  return delays;
}

// From the beginning of step `at` on, counted from 0: that step, then the fewest steps k with D(k)
// <= its delay; not if it ramps down already.
void stop_at(std::vector<Wide>& delays, std::size_t at, const bushd_table& table,
             std::uint16_t shortest_delay) {
  const Wide delay = delays[at];
  const Wide at_end = bushd_table_decel(&table, static_cast<std::uint32_t>(delays.size() - 1 - at));
  const Wide speeding_up = std::max<Wide>(
      {bushd_table_accel(&table, static_cast<std::uint32_t>(at)), table.cruise, shortest_delay});
  if (at_end > speeding_up) return;
  std::uint32_t to_stop = 0;
  while (bushd_table_decel(&table, to_stop) > delay) ++to_stop;
  delays.resize(at + 1);
  while (to_stop > 0) delays.push_back(bushd_table_decel(&table, --to_stop));
}

struct Line {
  std::vector<std::unique_ptr<TestTable>> tables;
  std::vector<LinePart> parts;
  std::uint32_t longest = 1;
};

// `same_unit`: of all tables; the time of a step is judged in units then, as in all but a few
// lines.
Line any_line() {
  Line line;
  line.longest = between<std::uint32_t>(1, *rc::gen::element<std::uint32_t>(2, 10, 60, 400));
  const int motors = between(1, 4);
  const bool same_unit = between(0, 3) != 0;
  std::uint32_t unit_ns = 0;
  for (int i = 0; i < motors; ++i) {
    Law law = any_law();
    if (i == 0) unit_ns = law.unit_ns;
    if (same_unit) law.unit_ns = unit_ns;
    line.tables.push_back(std::make_unique<TestTable>(law, false));
    const auto increment = i == 0 ? line.longest : between<std::uint32_t>(0, line.longest);
    const std::uint16_t shortest_delay =
        between(0, 2) == 0 ? any_shortest_delay(law) : std::uint16_t{0};
    line.parts.push_back({line.tables.back()->view(), increment, shortest_delay});
  }
  return line;
}

// How closely in time the steps of one motor follow each other, in ns x 2 N.
void judge(const LinePart& part, std::uint32_t longest, const std::vector<Wide>& delays,
           std::uint32_t unit_ns) {
  const Wide n = part.increment;
  if (n == 0) return;
  std::vector<Wide> end{0};  // of the run's steps, in its time units
  for (const Wide delay : delays) end.push_back(end.back() + delay);
  std::vector<Wide> times;
  // Step j falls at s = ((2j - 1) L + N) / 2N, and the run's steps are of equal speed in
  // themselves.
  for (Wide j = 1; j <= n; ++j) {
    const Wide doubled = (2 * j - 1) * longest + n;
    const auto s = static_cast<std::size_t>(doubled / (2 * n));
    const Wide rest = doubled % (2 * n);
    if (s > delays.size() || (s == delays.size() && rest > 0)) break;
    times.push_back(end[s] * 2 * n + (rest > 0 ? delays[s] * rest : 0));
  }
  const auto made = static_cast<std::uint32_t>(times.size());
  for (std::uint32_t j = 2; j <= made; ++j) {
    const Wide between_steps = (times[j - 1] - times[j - 2]) * unit_ns;
    const Wide allowed =
        std::max<bushd_delay>(bushd_table_delay(part.table, j, made), part.shortest_delay);
    RC_ASSERT(between_steps >= allowed * part.table->time_unit_ns * 2 * n);
  }
}

TEST(Envelope, NoMotorStepsFasterThanItsOwnTable) {
  holds("intervals of every motor, with and without a stop", [] {
    const Line line = any_line();
    const Envelope envelope(line.parts, line.longest);
    const bushd_table& table = envelope.view();
    RC_ASSERT(bushd_table_check(&table, nullptr, nullptr) == BUSHD_OK);
    const std::vector<Wide> whole =
        delays_of(table, line.longest, static_cast<std::uint16_t>(envelope.shortest_delay()));
    for (int stops = 0; stops < 8; ++stops) {
      std::vector<Wide> delays = whole;
      if (stops > 0) {
        stop_at(delays, between<std::size_t>(0, delays.size() - 1), table,
                static_cast<std::uint16_t>(envelope.shortest_delay()));
      }
      for (const LinePart& part : line.parts) {
        judge(part, line.longest, delays, table.time_unit_ns);
      }
    }
  });
}

// Motors of a line by the elementary law, and of each the steps of the run that are its own.
struct ElementaryLine {
  Line line;
  std::vector<std::vector<std::size_t>> steps;
};

ElementaryLine any_elementary_line() {
  ElementaryLine of{.line = any_line(), .steps = {}};
  bushd_elementary printed;
  bushd_elementary_clear(&printed);
  for (std::size_t i = 0; i < of.line.parts.size(); ++i) {
    bushd_elementary_add(&printed, static_cast<std::uint8_t>(i), of.line.parts[i].increment);
  }
  of.line.longest = printed.sum;
  of.steps.resize(of.line.parts.size());
  for (std::size_t i = 0; i < of.line.parts.size(); ++i) {
    if (of.line.parts[i].increment == 0) continue;
    of.line.parts[i].apart = bushd_elementary_apart(&printed, static_cast<std::uint8_t>(i));
    of.line.parts[i].late = bushd_elementary_late(&printed, static_cast<std::uint8_t>(i));
  }
  for (std::size_t s = 1; s <= of.line.longest; ++s) {
    of.steps[bushd_elementary_step(&printed)].push_back(s);
  }
  return of;
}

void judge_elementary(const LinePart& part, const std::vector<std::size_t>& steps,
                      const std::vector<Wide>& delays, std::uint32_t unit_ns) {
  std::vector<Wide> end{0};
  for (const Wide delay : delays) end.push_back(end.back() + delay);
  std::vector<Wide> times;
  for (const std::size_t s : steps) {
    if (s < end.size()) times.push_back(end[s]);
  }
  const auto made = static_cast<std::uint32_t>(times.size());
  for (std::uint32_t j = 2; j <= made; ++j) {
    const Wide allowed =
        std::max<bushd_delay>(bushd_table_delay(part.table, j, made), part.shortest_delay);
    RC_ASSERT((times[j - 1] - times[j - 2]) * unit_ns >= allowed * part.table->time_unit_ns);
  }
}

TEST(Envelope, OfTheElementaryLawLetsNoMotorStepFasterThanItsOwnTable) {
  holds("intervals of every motor, with and without a stop", [] {
    const ElementaryLine of = any_elementary_line();
    const Envelope envelope(of.line.parts, of.line.longest);
    const bushd_table& table = envelope.view();
    RC_ASSERT(bushd_table_check(&table, nullptr, nullptr) == BUSHD_OK);
    const auto shortest_delay = static_cast<std::uint16_t>(envelope.shortest_delay());
    const std::vector<Wide> whole = delays_of(table, of.line.longest, shortest_delay);
    for (int stops = 0; stops < 8; ++stops) {
      std::vector<Wide> delays = whole;
      if (stops > 0) {
        stop_at(delays, between<std::size_t>(0, delays.size() - 1), table, shortest_delay);
      }
      for (std::size_t i = 0; i < of.line.parts.size(); ++i) {
        judge_elementary(of.line.parts[i], of.steps[i], delays, table.time_unit_ns);
      }
    }
  });
}

// Two equal ways: each step of the run may be half as long as a motor's own.
TEST(Envelope, OfTheElementaryLawHasTheDelaysOfElementarySteps) {
  const TestTable table(
      {.accel = {200, 100, 50}, .decel = {200, 100, 50}, .cruise = 50, .unit_ns = 1000}, false);
  const std::vector<LinePart> parts{{table.view(), 1000, 0, 2, 0}, {table.view(), 1000, 0, 2, 0}};
  const Envelope envelope(parts, 2000);
  EXPECT_EQ(envelope.view().cruise, 25);
  EXPECT_EQ(envelope.view().accel.code[0], 100);
  EXPECT_EQ(envelope.view().accel.code[1], 100);
  EXPECT_EQ(envelope.view().accel.code[2], 50);
}

TEST(Envelope, OfEqualMotorsAndWaysIsTheirTable) {
  holds("their own move", [] {
    const TestTable table(any_law(), false);
    const auto longest = between<std::uint32_t>(1, 300);
    std::vector<LinePart> parts{{table.view(), longest}};
    for (int i = between(0, 4); i > 0; --i) {
      parts.push_back({table.view(), between(0, 1) == 0 ? longest : 0});
    }
    const Envelope envelope(parts, longest);
    RC_ASSERT(envelope.view().time_unit_ns == table.view()->time_unit_ns);
    RC_ASSERT(delays_of(envelope.view(), longest, 0) == delays_of(*table.view(), longest, 0));
    RC_ASSERT(tables::limiting_part(parts, longest) == 0u);
  });
}

// The motor that starts slowly makes its second step after ten of the other.
TEST(Envelope, ASlowStartCostsOnlyWhereItActs) {
  const TestTable quick(
      {.accel = {200, 100, 50}, .decel = {200, 100, 50}, .cruise = 50, .unit_ns = 1000}, false);
  const TestTable slow({.accel = {4000, 50}, .decel = {4000, 50}, .cruise = 50, .unit_ns = 1000},
                       false);
  const std::vector<LinePart> parts{{quick.view(), 1000}, {slow.view(), 100}};
  const Envelope envelope(parts, 1000);
  EXPECT_EQ(envelope.view().accel.code[0], 400);
  EXPECT_EQ(envelope.view().accel.code[9], 400);
  EXPECT_EQ(envelope.view().accel.count, 10);
  EXPECT_EQ(envelope.view().cruise, 50);
  EXPECT_EQ(tables::limiting_part(parts, 1000), 0u);
}

TEST(Envelope, SidesThatWouldBeTooLongAreCutOff) {
  std::vector<std::uint16_t> codes;
  for (std::uint16_t code = 60000; code > 50000; code = static_cast<std::uint16_t>(code - 20)) {
    codes.push_back(code);
  }
  const TestTable slow({.accel = codes, .decel = codes, .cruise = 50000, .unit_ns = 100}, false);
  const TestTable quick({.accel = {1}, .decel = {1}, .cruise = 1, .unit_ns = 100}, false);
  const std::vector<LinePart> parts{{quick.view(), 1'000'000}, {slow.view(), 1'000}};
  const Envelope envelope(parts, 1'000'000);
  EXPECT_EQ(envelope.view().accel.count, Envelope::kMostCodes);
  EXPECT_EQ(bushd_table_check(&envelope.view(), nullptr, nullptr), BUSHD_OK);
  EXPECT_EQ(envelope.view().cruise, envelope.view().accel.code[Envelope::kMostCodes - 1]);
  EXPECT_EQ(envelope.view().cruise, 60);  // 60000 / 1000, and the first 33 of its steps' codes
}

TEST(Envelope, ASpeedLimitIsThatOfItsMotorTimesItsShare) {
  const TestTable table({.accel = {100, 50}, .decel = {100, 50}, .cruise = 50, .unit_ns = 1000},
                        false);
  const std::vector<LinePart> parts{{table.view(), 10}, {table.view(), 3, 501}};
  EXPECT_EQ(Envelope(parts, 10).shortest_delay(), 151U);
  EXPECT_EQ(tables::limiting_part(parts, 10), 1u);
}

// Where units differ the line has the shortest, unless its delays would not fit 16 bits.
TEST(Envelope, HasAUnitThatAllDelaysFit) {
  const TestTable fine({.accel = {100}, .decel = {100}, .cruise = 100, .unit_ns = 10}, false);
  const TestTable coarse({.accel = {60000}, .decel = {60000}, .cruise = 60000, .unit_ns = 1000},
                         false);
  const std::vector<LinePart> few{{fine.view(), 1000}, {coarse.view(), 1}};
  EXPECT_EQ(Envelope(few, 1000).view().time_unit_ns, 10u);
  EXPECT_EQ(Envelope(few, 1000).view().cruise, 6000);
  const std::vector<LinePart> many{{fine.view(), 1000}, {coarse.view(), 500}};
  const Envelope envelope(many, 1000);
  EXPECT_EQ(envelope.view().time_unit_ns, 458u);
  EXPECT_EQ(envelope.view().cruise, 65503);
}

}  // namespace
}  // namespace bushd::test
