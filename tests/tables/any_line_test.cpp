// The table of any line of some motors: no envelope of theirs is above it.
#include "tables/any_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "engine/elementary.h"
#include "engine/tables.h"
#include "tables/envelope.h"

namespace bushd::test {
namespace {

using tables::Envelope;
using tables::LinePart;

std::uint64_t accel_ns(const bushd_table& table, std::uint32_t k) {
  return std::uint64_t{std::max(bushd_table_accel(&table, k), table.cruise)} * table.time_unit_ns;
}
std::uint64_t decel_ns(const bushd_table& table, std::uint32_t k) {
  return std::uint64_t{std::max(bushd_table_decel(&table, k), table.cruise)} * table.time_unit_ns;
}

// Tables of some motors, in one time unit: else each would round in its own.
class AnyMotors {
 public:
  explicit AnyMotors(int motors) {
    const std::uint32_t unit_ns = any_law().unit_ns;
    for (int i = 0; i < motors; ++i) {
      Law law = any_law();
      law.unit_ns = unit_ns;
      tables_.push_back(std::make_unique<TestTable>(law, false));
      views.push_back(tables_.back()->view());
    }
  }

  std::vector<const bushd_table*> views;

 private:
  std::vector<std::unique_ptr<TestTable>> tables_;
};

void no_slower(const bushd_table& envelope, const bushd_table& table) {
  RC_ASSERT(envelope.time_unit_ns == table.time_unit_ns);
  const std::uint32_t codes = 2u + std::max(envelope.accel.count, table.accel.count) +
                              std::max(envelope.decel.count, table.decel.count);
  for (std::uint32_t k = 0; k < codes; ++k) {
    RC_ASSERT(accel_ns(table, k) >= accel_ns(envelope, k));
    RC_ASSERT(decel_ns(table, k) >= decel_ns(envelope, k));
  }
}

TEST(AnyLine, NoEnvelopeIsAboveIt) {
  const bool holds = rc::check("any motors, any shares", [] {
    const AnyMotors motors(between(1, 4));
    const auto any = tables::any_line_table(motors.views, "any");
    if (!any) return;  // a side of 2^31 time units, such as no table may have
    const auto longest =
        between<std::uint32_t>(1, *rc::gen::element<std::uint32_t>(2, 10, 60, 400, 100'000));
    std::vector<LinePart> parts;
    for (const bushd_table* view : motors.views) {
      parts.push_back({view, parts.empty() ? longest : between<std::uint32_t>(0, longest)});
    }
    no_slower(Envelope(parts, longest).view(), (*any)->view());
  });
  EXPECT_TRUE(holds);
}

TEST(AnyLine, NoEnvelopeOfTheElementaryLawIsAboveIt) {
  const bool holds = rc::check("any motors, any ways", [] {
    const auto count = between<std::uint8_t>(2, 5);
    const AnyMotors motors(count);
    const auto any = tables::any_line_table(motors.views, "any", count);
    if (!any) return;
    const auto most = *rc::gen::element<std::uint32_t>(2, 10, 60, 400, 100'000);
    bushd_elementary line;
    bushd_elementary_clear(&line);
    std::vector<LinePart> parts;
    for (std::uint8_t i = 0; i < count; ++i) {
      parts.push_back({motors.views[i], between<std::uint32_t>(i == 0 ? 1 : 0, most)});
      bushd_elementary_add(&line, i, parts.back().increment);
    }
    for (std::uint8_t i = 0; i < count; ++i) {
      if (parts[i].increment == 0) continue;
      parts[i].apart = bushd_elementary_apart(&line, i);
      parts[i].late = bushd_elementary_late(&line, i);
    }
    no_slower(Envelope(parts, line.sum).view(), (*any)->view());
  });
  EXPECT_TRUE(holds);
}

TEST(AnyLine, IsNoSlowerThanItMustBe) {
  Law law;
  law.accel = law.decel = {100, 90, 50};
  law.cruise = 40;
  law.unit_ns = 1000;
  const TestTable own(law, false);
  const bushd_table* const views[] = {own.view()};
  const auto any = tables::any_line_table(views, "any");
  ASSERT_TRUE(any);
  const bushd_table& table = (*any)->view();
  // 100; max(90, 1 x 100 / 1); max(50, 2 x 90 / 2); 3 x 50 or 180, / 3; 180 / 4; then below 40.
  const std::vector<std::uint16_t> accel(table.accel.code, table.accel.code + table.accel.count);
  EXPECT_EQ(accel, (std::vector<std::uint16_t>{100, 100, 90, 60, 45}));
  // 1 x 100; 2 x 100 / 2; 3 x 90 / 3; 4 x 50 or 270, / 4; 270 / 5; / 6.
  const std::vector<std::uint16_t> decel(table.decel.code, table.decel.code + table.decel.count);
  EXPECT_EQ(decel, (std::vector<std::uint16_t>{100, 100, 100, 90, 68, 54, 45}));
  EXPECT_EQ(table.cruise, 40);
}

}  // namespace
}  // namespace bushd::test
