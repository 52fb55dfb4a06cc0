#include "base/csv/number_csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace bushd::csv {
namespace {

using testing::ElementsAre;

Result<NumberTable> parse(std::string_view text, std::size_t most_rows = 10) {
  return parse_numbers(text, "energy.csv", most_rows);
}

std::string error_of(std::string_view text, std::size_t most_rows = 10) {
  const auto table = parse(text, most_rows);
  return table ? "none" : table.error().text();
}

TEST(NumberCsv, ColumnsHaveNames) {
  const auto table = parse("energy,theta\n5000,23.5\n6000,-1e-3\n");
  ASSERT_TRUE(table.has_value()) << table.error().text();
  ASSERT_EQ(table->columns.size(), 2u);
  EXPECT_EQ(table->columns[0].name, "energy");
  EXPECT_THAT(table->columns[0].numbers, ElementsAre(5000, 6000));
  EXPECT_EQ(table->columns[1].name, "theta");
  EXPECT_THAT(table->columns[1].numbers, ElementsAre(23.5, -0.001));
  EXPECT_THAT(table->lines, ElementsAre(2, 3));
}

TEST(NumberCsv, AsSpreadsheetsAndPeopleWriteThem) {
  const auto table =
      parse("\xEF\xBB\xBF# of Monday\r\n\r\n energy\t, theta \r\n# keV\r\n +5 ,\t7.\r\n\r\n6,8");
  ASSERT_TRUE(table.has_value()) << table.error().text();
  EXPECT_THAT(table->columns[0].numbers, ElementsAre(5, 6));
  EXPECT_THAT(table->columns[1].numbers, ElementsAre(7, 8));
  EXPECT_THAT(table->lines, ElementsAre(5, 7));
}

TEST(NumberCsv, WhatIsNoNumberIsToldWithItsPlace) {
  EXPECT_EQ(error_of("a,b\n1, 2 x\n"),
            "energy.csv:2:4: \"2 x\", as b; allowed: a decimal number such as -12.5");
  for (const char* bad : {"", "nan", "inf", "1e999", "0x10", "1;2", "--1", "+-1", "1 2"}) {
    EXPECT_THAT(error_of("a,b\n1," + std::string(bad) + "\n"),
                testing::StartsWith("energy.csv:2:3: \"" + std::string(bad) + "\", as b;"));
  }
  EXPECT_THAT(error_of("a\n\x1b[2J\n"), testing::Not(testing::HasSubstr("\x1b")));
}

TEST(NumberCsv, WhatNobodyCanReadIsShortened) {
  EXPECT_EQ(error_of("a\n" + std::string(400, '1') + "x\n"),
            "energy.csv:2:1: \"" + std::string(40, '1') +
                "...\", as a; allowed: a decimal number such as -12.5");
  EXPECT_LT(error_of(std::string(1000, 'a') + "\nx\n").size(), 200u);
}

// Each name is looked for once, not in all names before: with as many columns as a file may have
// that would be 10^10 comparisons.
TEST(NumberCsv, ManyColumns) {
  constexpr int kColumns = 100'000;
  std::string names;
  std::string numbers;
  for (int i = 0; i < kColumns; ++i) {
    names += (i > 0 ? ",c" : "c") + std::to_string(i);
    numbers += i > 0 ? ",1" : "1";
  }
  const auto table = parse(names + "\n" + numbers + "\n");
  ASSERT_TRUE(table.has_value()) << table.error().text();
  EXPECT_EQ(table->columns.size(), std::size_t{kColumns});
  EXPECT_THAT(error_of(names + ",c7\n"), testing::HasSubstr("\"c7\" is there twice"));
}

TEST(NumberCsv, RowsAndNames) {
  EXPECT_EQ(error_of(""), "energy.csv: is empty; its first line names the columns: a,b");
  EXPECT_EQ(error_of("# nothing\n"),
            "energy.csv:1: is empty; its first line names the columns: a,b");
  EXPECT_EQ(error_of("a,b\n"), "energy.csv:1: has no row of numbers below the names");
  EXPECT_EQ(error_of("a,,b\n"), "energy.csv:1:3: a column without a name");
  EXPECT_EQ(error_of("a,b, a\n"), "energy.csv:1:6: the column \"a\" is there twice");
  EXPECT_EQ(error_of("a,b\n1,2\n3\n"),
            "energy.csv:3: 1 numbers; allowed: 2, one for each name above");
  EXPECT_EQ(error_of("a,b\n1,2,\n"),
            "energy.csv:2: 3 numbers; allowed: 2, one for each name above");
  EXPECT_EQ(error_of("a\n1\n2\n3\n", 2), "energy.csv:4: more than 2 rows");
  EXPECT_EQ(error_of("a\n1\n2\n", 2), "none");
}

}  // namespace
}  // namespace bushd::csv
