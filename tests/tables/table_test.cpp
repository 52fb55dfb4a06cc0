// Tables made from vectors, and those shipped.
#include "tables/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>
#include <vector>

#include "engine/run.h"
#include "tables/table_file.h"

namespace bushd::tables {
namespace {

static_assert(!std::is_copy_constructible_v<Table> && !std::is_move_constructible_v<Table>);

TEST(TableMake, FaultsAreNamedAsInAFile) {
  const auto table = make({.name = "t", .time_unit_ns = 1, .accel = {9, 5, 6}}, "t.toml");
  ASSERT_FALSE(table.has_value());
  EXPECT_EQ(table.error().file, "t.toml");
  EXPECT_EQ(table.error().key, "accel[2]");
}

TEST(TableMake, ZeroesAreRefused) {
  EXPECT_EQ(make({.name = "t", .time_unit_ns = 0, .accel = {9}}).error().key, "time_unit_ns");
  EXPECT_EQ(make({.name = "t", .time_unit_ns = 1, .accel = {9, 0}}).error().key, "accel[1]");
  EXPECT_EQ(make({.name = "t", .time_unit_ns = 1, .accel = {9}, .decel = {{0, 9}}}).error().key,
            "decel[0]");
  EXPECT_EQ(make({.name = "t", .time_unit_ns = 1, .accel = {9}, .cruise = 0}).error().key,
            "cruise");
}

class ShippedTable : public testing::TestWithParam<const char*> {
 protected:
  TablePtr table() const {
    const auto path = find(GetParam(), shipped_directories());
    return path ? load(*path).value_or(nullptr) : nullptr;
  }
};

class Bushd2Table : public ShippedTable {};

TEST_P(Bushd2Table, Has238CodesFromStartSpeedTo25TimesIt) {
  const TablePtr shipped = table();
  ASSERT_NE(shipped, nullptr);
  EXPECT_EQ(shipped->name(), GetParam());
  EXPECT_FALSE(shipped->description().empty());
  EXPECT_TRUE(shipped->symmetric());
  const bushd_table& view = shipped->view();
  EXPECT_EQ(view.time_unit_ns, 40000u);
  EXPECT_EQ(view.cruise, 10);
  ASSERT_EQ(view.accel.count, 238u);
  EXPECT_EQ(view.accel.code[0], 250);
  EXPECT_EQ(view.accel.code[237], 10);
}

INSTANTIATE_TEST_SUITE_P(All, Bushd2Table,
                         testing::Values("bushd2-constant", "bushd2-scurve", "bushd2-exponential",
                                         "bushd2-resonance"));

class MicrosteppingTable : public ShippedTable {};

TEST_P(MicrosteppingTable, IsSlowEnoughForTheUsualTick) {
  const TablePtr shipped = table();
  ASSERT_NE(shipped, nullptr);
  EXPECT_EQ(shipped->name(), GetParam());
  EXPECT_FALSE(shipped->description().empty());
  EXPECT_LE(bushd_table_max_steps_per_tick(&shipped->view(), 2'560'000), BUSHD_MAX_STEPS_PER_TICK);
}

INSTANTIATE_TEST_SUITE_P(All, MicrosteppingTable,
                         testing::Values("micro16-standard", "micro32-smooth"));

// Step k of x = v0 t + a t^2 / 2 falls at (sqrt(v0^2 + 2 a k) - v0) / a; a follows from the last
// delay. Rounding up makes every delay too long by less than one unit, and never too short.
TEST(ShippedTables, ConstantAccelerationIsTheExactLaw) {
  const auto table = load(find("bushd2-constant", shipped_directories()).value());
  ASSERT_TRUE(table.has_value());
  const bushd_ramp& side = (*table)->view().accel;
  const double start_hz = 100;
  const double top_delay_s = 400e-6;
  double acceleration = 1;
  const auto step_time = [&](double k) {
    return (std::sqrt(start_hz * start_hz + 2 * acceleration * k) - start_hz) / acceleration;
  };
  double low = 1000;
  double high = 100000;
  for (int i = 0; i < 100; ++i) {
    acceleration = (low + high) / 2;
    (step_time(237) - step_time(236) > top_delay_s ? low : high) = acceleration;
  }
  for (std::uint32_t k = 1; k < side.count; ++k) {
    const double units = (step_time(k) - step_time(k - 1)) / 40e-6;
    EXPECT_GE(side.code[k], units - 1e-5) << k;
    EXPECT_LT(side.code[k], units + 1) << k;
  }
}

}  // namespace
}  // namespace bushd::tables
