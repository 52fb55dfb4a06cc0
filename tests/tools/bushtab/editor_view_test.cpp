// What the editor shows, in windows of all sizes.
#include "tools/bushtab/editor_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tables/random_table.h"
#include "tools/bushtab/typing.h"
#include "tools/bushtab/utf8.h"

namespace bushtab::test {
namespace {

using bushd::test::random_in;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::vector<std::string> lines(const TableEditor& editor, const Window& window) {
  const CellGrid grid = render(editor, window);
  std::vector<std::string> all;
  for (int row = 0; row < grid.rows(); ++row) {
    std::string line;
    for (int column = 0; column < grid.columns(); ++column) {
      append_utf8(line, grid.at(row, column).character);
    }
    all.push_back(line.substr(0, line.find_last_not_of(' ') + 1));
  }
  return all;
}

std::string screen(const TableEditor& editor, const Window& window) {
  std::string all;
  for (const std::string& line : lines(editor, window)) all += line + "\n";
  return all;
}

int count_style(const CellGrid& grid, Style style) {
  int count = 0;
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      if (grid.at(row, column).style == style) ++count;
    }
  }
  return count;
}

TEST(EditorView, ShowsCurveCodesTimesAndCheck) {
  TableEditor editor = editor_of({90, 70, 50}, {{50, 80}});
  type(editor, std::u32string{key::kRight});
  const auto all = lines(editor, {24, 80, true});
  EXPECT_EQ(all.front(), " t  revision 7");
  EXPECT_THAT(all[1], StartsWith("    20000 │"));
  const std::string text = screen(editor, {24, 80, true});
  EXPECT_THAT(text, HasSubstr("accel[1]  code 70  70 us  14285.7 steps/s  step 2 of 6"
                              "  3.96825e+07 steps/s²\n"));
  EXPECT_THAT(text, HasSubstr("\naccel[0]        90    70    50\n"));
  EXPECT_THAT(text, HasSubstr("\ncruise          50\n"));
  EXPECT_THAT(text, HasSubstr("\ndecel[0]        50    80\n"));
  EXPECT_THAT(text, HasSubstr("\n5 steps 0.340 ms\n"));
  EXPECT_THAT(text, HasSubstr("\ncheck: nothing found\n"));
  EXPECT_THAT(all.back(), HasSubstr("q quit"));
}

TEST(EditorView, ShowsWhatTheCheckFinds) {
  TableEditor editor({.name = "t", .time_unit_ns = 1000, .accel = {90, 30}}, 1,
                     watching({}, 20000));
  const std::string text = screen(editor, {30, 80, true});
  EXPECT_THAT(text, HasSubstr("\nerror: max_speed: "));
  EXPECT_THAT(text, HasSubstr("\nwarning: speed_ratio: accel[1]: "));
  EXPECT_THAT(screen(editor, {14, 80, true}), HasSubstr("(1 more) "));
}

TEST(EditorView, WhatTheCheckFindsIsWrappedToTheWindow) {
  TableEditor editor({.name = "t", .time_unit_ns = 1000, .accel = {90, 30}}, 1,
                     watching({}, 20000));
  const auto& found = editor.diagnostics();
  ASSERT_EQ(found.size(), 2U);
  std::string joined;
  for (const std::string& line : lines(editor, {30, 60, true})) {
    EXPECT_LE(from_utf8(line).size(), 60U);
    joined += line + " ";
  }
  for (const auto& diagnostic : found) EXPECT_THAT(joined, HasSubstr(diagnostic.message));
}

TEST(EditorView, AsksBeforeErrorsAreSaved) {
  TableEditor editor({.name = "t", .time_unit_ns = 1000, .accel = {90, 30}}, 1,
                     watching({}, 20000));
  type(editor, U"-s");
  EXPECT_THAT(screen(editor, {24, 100, true}),
              HasSubstr("\nThe check finds an error in this table (above). y: save nevertheless"));
}

TEST(EditorView, TellsOfChangesAndMarks) {
  TableEditor editor = editor_of({90, 70, 50});
  EXPECT_THAT(screen(editor, {24, 80, true}), HasSubstr(" t  revision 7  (decel mirrors accel)\n"));
  type(editor, U"-");
  EXPECT_THAT(screen(editor, {24, 80, true}), HasSubstr("revision 7, changed"));
  EXPECT_THAT(screen(editor, {24, 80, true}), HasSubstr("\naccel[0]: codes -1\n"));
  const int plain = count_style(render(editor, {24, 80, true}), Style::kSelected);
  type(editor, std::u32string{U' ', key::kRight});
  EXPECT_THAT(screen(editor, {24, 100, true}), HasSubstr("  2 codes marked  "));
  EXPECT_GT(count_style(render(editor, {24, 80, true}), Style::kSelected), plain);
}

TEST(EditorView, CodeUnderTheCursorIsAlwaysInSight) {
  std::vector<std::uint16_t> codes;
  for (int code = 60000; code > 30000; --code) codes.push_back(static_cast<std::uint16_t>(code));
  TableEditor editor = editor_of(codes);
  for (const char32_t* to : {U"g0\n", U"g12345\n", U"g29999\n", U"gc\n", U"gd29999\n"}) {
    type(editor, to);
    for (const int rows : {2, 3, 6, 13, 24, 60}) {
      EXPECT_GE(count_style(render(editor, {rows, 80, true}), Style::kCursor), 5) << rows;
    }
  }
}

TEST(EditorView, ZoomDrawsTheStepsNearTheCursor) {
  std::vector<std::uint16_t> codes;
  for (int i = 0; i < 1000; ++i) codes.push_back(static_cast<std::uint16_t>(2000 - i));
  TableEditor editor = editor_of(codes);
  EXPECT_THAT(screen(editor, {30, 80, true}), HasSubstr("└─ step 1 ─"));
  type(editor, U"zg500\n");
  const std::string text = screen(editor, {30, 80, true});
  EXPECT_THAT(text, HasSubstr("└─ step 467 ─"));
  EXPECT_THAT(text, HasSubstr("─ 535 ─"));
}

TEST(EditorView, SmallWindowsKeepWhatMattersMost) {
  TableEditor editor = editor_of({90, 70, 50});
  EXPECT_THAT(lines(editor, {1, 80, true})[0], StartsWith("? keys"));
  EXPECT_EQ(lines(editor, {2, 80, true})[0], "accel[0]        90    70    50");
  EXPECT_THAT(lines(editor, {3, 80, true})[0], StartsWith("accel[0]  code 90"));
  EXPECT_EQ(lines(editor, {4, 80, true})[0], " t  revision 7  (decel mirrors accel)");
  type(editor, U"6");
  EXPECT_EQ(lines(editor, {1, 80, true})[0], "accel[0], code 1..65535: 6_");
  EXPECT_EQ(lines(editor, {2, 9, true})[0], "accel[0],");
}

TEST(EditorView, LongMessagesAreWrapped) {
  TableEditor editor = editor_of({90, 70, 50});
  editor.refused("one two three four five six seven eight nine ten eleven twelve");
  EXPECT_THAT(screen(editor, {24, 30, true}),
              HasSubstr("\none two three four five six\nseven eight nine ten eleven\ntwelve\n"));
}

TEST(EditorView, WithoutUnicodeAllIsAscii) {
  TableEditor editor({.name = "стол", .time_unit_ns = 1000, .accel = {90, 70, 50}}, 1,
                     watching({}));
  type(editor, std::u32string{key::kRight});
  EXPECT_THAT(lines(editor, {24, 80, true})[0], StartsWith(" стол"));
  const CellGrid grid = render(editor, {24, 80, false});
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      ASSERT_LT(grid.at(row, column).character, char32_t{0x7F});
    }
  }
  const std::string text = screen(editor, {24, 80, false});
  EXPECT_THAT(text, HasSubstr(" ????"));
  EXPECT_THAT(text, HasSubstr("steps/s2"));
  EXPECT_THAT(text, HasSubstr("****"));
}

TEST(EditorView, HelpListsEveryKeyAndGoesAway) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, U"?");
  const std::string text = screen(editor, {30, 80, true});
  for (const KeyHelp& help : key_help()) EXPECT_THAT(text, HasSubstr(help.what));
  type(editor, U"x");
  EXPECT_THAT(screen(editor, {30, 80, true}), Not(HasSubstr(key_help().front().what)));
}

TEST(EditorViewProperty, FitsEveryWindow) {
  EXPECT_TRUE(rc::check("random tables, keys and windows", [] {
    TableEditor editor(bushd::test::random_case(1000).content, 1, watching({100, 1000}));
    const std::u32string keys = std::u32string(U"> z-m?1gq") + key::kRight + key::kPageDown;
    for (int i = random_in(0, 30); i > 0; --i) {
      editor.press(keys[static_cast<std::size_t>(random_in(0, static_cast<int>(keys.size()) - 1))]);
      const Window window{random_in(1, 70), random_in(1, 200), random_in(0, 1) == 0};
      const CellGrid grid = render(editor, window);
      RC_ASSERT(grid.rows() == window.rows);
      RC_ASSERT(grid.columns() == window.columns);
    }
  }));
}

}  // namespace
}  // namespace bushtab::test
