// The editor without a terminal: keys in, state out.
#include "tools/bushtab/table_editor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tables/random_table.h"
#include "tools/bushtab/typing.h"

namespace bushtab::test {
namespace {

using bushd::tables::TableContent;
using bushd::test::random_in;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Optional;
using Wish = TableEditor::Wish;
using Mode = TableEditor::Mode;

const std::u32string kLeft(1, key::kLeft);
const std::u32string kRight(1, key::kRight);
const std::u32string kUp(1, key::kUp);
const std::u32string kDown(1, key::kDown);
const std::u32string kHome(1, key::kHome);
const std::u32string kEnd(1, key::kEnd);
const std::u32string kTab(1, key::kTab);
const std::u32string kEnter(1, key::kEnter);
const std::u32string kEscape(1, key::kEscape);

std::string place(const TableEditor& editor) {
  return place_text(editor.content(), editor.cursor());
}

TEST(TableEditorCursor, MovesOverAccelCruiseAndDecel) {
  TableEditor editor = editor_of({90, 70, 50}, {{50, 80}});
  EXPECT_EQ(place(editor), "accel[0]");
  type(editor, kLeft);
  EXPECT_EQ(place(editor), "accel[0]");
  type(editor, kRight + kRight + kRight);
  EXPECT_EQ(place(editor), "cruise");
  type(editor, kRight);
  EXPECT_EQ(place(editor), "decel[0]");
  type(editor, kEnd + kRight);
  EXPECT_EQ(place(editor), "decel[1]");
  type(editor, kHome + kTab);
  EXPECT_EQ(place(editor), "cruise");
  type(editor, kTab);
  EXPECT_EQ(place(editor), "decel[1]");
  type(editor, kTab);
  EXPECT_EQ(place(editor), "accel[0]");
}

TEST(TableEditorCursor, PageIsATwentiethOfTheTable) {
  TableEditor editor = editor_of(std::vector<std::uint16_t>(100, 50));
  editor.press(key::kPageDown);
  EXPECT_EQ(editor.cursor(), 10u);
  editor.press(key::kPageUp);
  editor.press(key::kPageUp);
  EXPECT_EQ(editor.cursor(), 0u);
}

TEST(TableEditorCursor, GoesToAnIndex) {
  TableEditor editor = editor_of({90, 70, 50}, {{50, 80}});
  type(editor, U"g2" + kEnter);
  EXPECT_EQ(place(editor), "accel[2]");
  type(editor, U"gd1" + kEnter);
  EXPECT_EQ(place(editor), "decel[1]");
  type(editor, U"gc" + kEnter);
  EXPECT_EQ(place(editor), "cruise");
  type(editor, U"g3" + kEnter);
  EXPECT_EQ(place(editor), "cruise");
  EXPECT_EQ(editor.message(), "\"3\" is nowhere; allowed: 0..2");
  type(editor, U"gd2" + kEnter);
  EXPECT_EQ(editor.message(), "\"d2\" is nowhere; allowed: d0..d1");
  type(editor, U"g1" + kEscape);
  EXPECT_EQ(place(editor), "cruise");
}

TEST(TableEditorCode, IsTyped) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, kRight + U"6");
  EXPECT_EQ(editor.mode(), Mode::kPrompt);
  EXPECT_EQ(editor.prompt_text(), "accel[1], code 1..65535: 6");
  type(editor, U"5" + kEnter);
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 65, 50));
  EXPECT_TRUE(editor.changed());
}

TEST(TableEditorCode, ThatMakesNoTableIsRefusedWithTheReason) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, kRight + U"95" + kEnter);
  EXPECT_THAT(editor.message(), HasSubstr("accel[1]: is 95 after 90; allowed: "));
  for (const char32_t* nonsense : {U"0", U"65536", U"6x", U"99999999999999999999"}) {
    type(editor, nonsense + kEnter);
    EXPECT_THAT(editor.message(), HasSubstr("is not a code; allowed: 1..65535"));
  }
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 70, 50));
  EXPECT_FALSE(editor.changed());
}

TEST(TableEditorCode, GoesUpAndDownBetweenItsNeighbours) {
  TableEditor editor = editor_of({52, 51, 50});
  type(editor, kRight + U"+");
  EXPECT_THAT(editor.content().accel, ElementsAre(52, 52, 50));
  type(editor, U"+");
  EXPECT_EQ(editor.message(), "accel[1]: held by the code beside it");
  type(editor, U"---");
  EXPECT_THAT(editor.content().accel, ElementsAre(52, 50, 50));
  type(editor, kDown);  // the third minus was not counted
  EXPECT_THAT(editor.content().accel, ElementsAre(52, 51, 50));
  type(editor, kUp);
  EXPECT_THAT(editor.content().accel, ElementsAre(52, 50, 50));
}

TEST(TableEditorMirror, EitherSideChangesBoth) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, kEnd + kLeft + U"65" + kEnter);
  EXPECT_EQ(place(editor), "decel[1]");
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 65, 50));
  EXPECT_FALSE(editor.content().decel.has_value());
}

TEST(TableEditorMirror, CanBeGivenUpAndTakenAgain) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, U"m" + kEnd + U"99" + kEnter);
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 70, 50));
  EXPECT_THAT(editor.content().decel, Optional(ElementsAre(50, 70, 99)));
  type(editor, U"m");
  EXPECT_FALSE(editor.content().decel.has_value());
  EXPECT_FALSE(editor.changed());
  type(editor, U"u");
  EXPECT_THAT(editor.content().decel, Optional(ElementsAre(50, 70, 99)));
}

TEST(TableEditorMirror, TableTooLongForTwoSidesStaysMirrored) {
  TableEditor editor = editor_of(std::vector<std::uint16_t>(40000, 50));
  type(editor, U"m");
  EXPECT_THAT(editor.message(), HasSubstr("makes 80000 codes in all"));
  EXPECT_FALSE(editor.content().decel.has_value());
}

TEST(TableEditorCruise, FollowsAccelUntilItIsGivenAndAgainWhenDeleted) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, U"g2" + kEnter + U"-" + U"gc" + kEnter);
  EXPECT_EQ(code_at(editor.content(), editor.cursor()), 49);
  EXPECT_FALSE(editor.content().cruise.has_value());
  type(editor, U"60" + kEnter);
  EXPECT_EQ(editor.content().cruise, 60);
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 70, 49));
  type(editor, U"d");
  EXPECT_FALSE(editor.content().cruise.has_value());
  type(editor, U"d");
  EXPECT_EQ(editor.message(), "cruise: goes with the last code of accel");
}

TEST(TableEditorRange, IsMarkedAndDraggedBySpeed) {
  TableEditor editor = editor_of({1000, 800, 600, 500, 400});
  type(editor, kRight + U" " + kRight + kRight);
  ASSERT_TRUE(editor.selection().has_value());
  EXPECT_EQ(editor.selection()->first, 1u);
  EXPECT_EQ(editor.selection()->last, 3u);
  type(editor, U">>");
  // by 1.01 squared, rounded up
  EXPECT_THAT(editor.content().accel, ElementsAre(1000, 785, 589, 491, 400));
  EXPECT_EQ(editor.message(), "accel[1] to accel[3]: speed +2.01 %");
  type(editor, U"<<");
  EXPECT_THAT(editor.content().accel, ElementsAre(1000, 800, 600, 500, 400));
  EXPECT_FALSE(editor.changed());
  type(editor, U"u");
  EXPECT_EQ(editor.message(), "nothing to undo");
}

TEST(TableEditorRange, DragIsOneChangeForUndo) {
  TableEditor editor = editor_of({1000, 800, 600, 500, 400});
  type(editor, U" " + kRight + kUp + kUp + kUp + U">" + U"u");
  EXPECT_THAT(editor.content().accel, ElementsAre(1000, 800, 600, 500, 400));
  type(editor, U"r");
  EXPECT_THAT(editor.content().accel, ElementsAre(988, 790, 600, 500, 400));
}

TEST(TableEditorRange, IsHeldByTheCodesBesideIt) {
  TableEditor editor = editor_of({1000, 800, 600, 500, 400});
  type(editor, kRight + U" " + kRight + U"%50" + kEnter);
  EXPECT_THAT(editor.content().accel, ElementsAre(1000, 534, 500, 500, 400));
  EXPECT_EQ(editor.message(), "accel[1] to accel[2]: speed +50 %, 1 code held by its neighbour");
  type(editor, U"%-90" + kEnter);
  EXPECT_THAT(editor.content().accel, ElementsAre(1000, 1000, 1000, 500, 400));
  EXPECT_THAT(editor.message(), HasSubstr("speed -90 %, 2 codes held by their neighbours"));
  for (const char32_t* nonsense : {U"", U"-100", U"nan", U"inf", U"5 %"}) {
    type(editor, U"%" + (nonsense + kEnter));
    EXPECT_THAT(editor.message(), HasSubstr("is not a number of percent; allowed: above -100"));
  }
}

TEST(TableEditorRange, OverCruiseOfAMirroredTableChangesBothSidesAlike) {
  TableEditor editor = editor_of({90, 70, 50, 40});
  type(editor, U"g2" + kEnter + U" " + U"gd2" + kEnter + U"-");
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 69, 49, 39));
  EXPECT_FALSE(editor.content().cruise.has_value());
}

TEST(TableEditorRange, OfBothSidesIsChangedOnBoth) {
  TableEditor editor = editor_of({90, 70, 50}, {{55, 80}}, 45);
  type(editor, U" " + kEnd + U"+");
  EXPECT_THAT(editor.content().accel, ElementsAre(91, 71, 51));
  EXPECT_THAT(editor.content().decel, Optional(ElementsAre(56, 81)));
  EXPECT_EQ(editor.content().cruise, 46);
}

TEST(TableEditorRange, SmallCodesChangeWhenThePercentsAddUp) {
  TableEditor editor = editor_of({12, 10});
  type(editor, kRight + U">>>>>>>>>>");
  EXPECT_THAT(editor.content().accel, ElementsAre(12, 10));
  EXPECT_EQ(editor.message(), "accel[1]: speed +10.5 %");
  type(editor, U">");
  EXPECT_THAT(editor.content().accel, ElementsAre(12, 9));
}

TEST(TableEditorRange, IsUnmarkedBySpaceAndEscape) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, U" " + kRight + U" ");
  EXPECT_FALSE(editor.selection().has_value());
  type(editor, U" " + kRight + kEscape);
  EXPECT_FALSE(editor.selection().has_value());
}

TEST(TableEditorCodes, AreInsertedAndDeleted) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, kRight + U"i");
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 70, 70, 50));
  type(editor, U" " + kRight + U"d");
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 50));
  EXPECT_FALSE(editor.selection().has_value());
  type(editor, kHome + U" " + kRight + U"d");
  EXPECT_THAT(editor.message(), HasSubstr("accel: is empty"));
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 50));
}

TEST(TableEditorUndo, GoesBackAndForth) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, kRight + U"65" + kEnter + kHome + U"100" + kEnter);
  type(editor, kEnd + U"u");
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 65, 50));
  EXPECT_EQ(place(editor), "accel[0]");  // where it happened
  EXPECT_EQ(editor.message(), "undo: accel[0]");
  type(editor, U"u");
  EXPECT_THAT(editor.content().accel, ElementsAre(90, 70, 50));
  EXPECT_FALSE(editor.changed());
  type(editor, U"rr");
  EXPECT_THAT(editor.content().accel, ElementsAre(100, 65, 50));
  type(editor, U"u");
  type(editor, U"gc" + kEnter + U"55" + kEnter);
  type(editor, U"r");
  EXPECT_EQ(editor.message(), "nothing to redo");
}

TEST(TableEditorSave, IsWishedForAndAnswered) {
  TableEditor editor = editor_of({90, 70, 50});
  EXPECT_EQ(type(editor, U"s"), Wish::kNone);
  EXPECT_EQ(editor.message(), "nothing to save");
  EXPECT_EQ(type(editor, kRight + U"65" + kEnter + U"s"), Wish::kSave);
  EXPECT_EQ(editor.note(), "accel[1]");
  editor.refused("the disk is full");
  EXPECT_EQ(editor.message(), "the disk is full");
  EXPECT_TRUE(editor.changed());
  EXPECT_EQ(type(editor, U"s"), Wish::kSave);
  editor.saved(8);
  EXPECT_EQ(editor.revision(), 8u);
  EXPECT_FALSE(editor.changed());
  type(editor, U"u");
  EXPECT_TRUE(editor.changed());
  EXPECT_EQ(type(editor, U"wother\n"), Wish::kSaveAs);
  EXPECT_EQ(editor.wished_name(), "other");
}

TEST(TableEditorQuit, AsksOnlyWithChanges) {
  TableEditor editor = editor_of({90, 70, 50});
  EXPECT_EQ(type(editor, U"q"), Wish::kQuit);
  type(editor, U"95" + kEnter);
  EXPECT_EQ(type(editor, U"q"), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kAskQuit);
  EXPECT_EQ(type(editor, U"x"), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kCodes);
  EXPECT_EQ(type(editor, U"qs"), Wish::kSaveAndQuit);
  EXPECT_EQ(type(editor, U"qd"), Wish::kQuit);
}

TEST(TableEditorQuit, InterruptLeavesAPromptOrAsks) {
  TableEditor editor = editor_of({90, 70, 50});
  type(editor, U"9");
  EXPECT_EQ(editor.interrupt(), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kCodes);
  type(editor, U"95" + kEnter);
  EXPECT_EQ(editor.interrupt(), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kAskQuit);
  EXPECT_EQ(editor.interrupt(), Wish::kNone);  // goes on
  EXPECT_FALSE(type(editor, U"u") == Wish::kQuit);
  EXPECT_EQ(editor.interrupt(), Wish::kQuit);
}

TEST(TableEditorLive, TimesAndDiagnosticsAreThoseOfTheCodes) {
  TableEditor editor({.name = "t", .time_unit_ns = 1000, .accel = {90, 70, 50}}, 1,
                     watching({5}, 20100));
  EXPECT_EQ(editor.times().at(0).move.time_ns, 370'000u);
  EXPECT_THAT(editor.diagnostics(), IsEmpty());
  type(editor, U"g2" + kEnter + U"-");
  EXPECT_EQ(editor.times().at(0).move.time_ns, 369'000u);
  ASSERT_FALSE(editor.diagnostics().empty());
  EXPECT_EQ(editor.diagnostics().at(0).rule, "max_speed");
  EXPECT_EQ(editor.curve().at(2).delay_ns, 49'000u);
}

TEST(TableEditorNote, TellsWhatChanged) {
  TableEditor editor = editor_of({90, 70, 60, 50});
  type(editor, kRight + U" " + kRight + U"+" + kEscape + U"gc" + kEnter + U"55" + kEnter);
  EXPECT_EQ(editor.note(), "accel[1..2], cruise");
  type(editor, kHome + U"im");
  EXPECT_EQ(editor.note(), "accel 4 to 5 codes, decel by itself, cruise");
}

// Whatever is typed, and however often.
TEST(TableEditorProperty, ContentIsAlwaysATableAndUndoLeadsBack) {
  EXPECT_TRUE(rc::check("random keys", [] {
    const TableContent content = bushd::test::random_case(1000).content;
    TableEditor editor(content, 1, watching({100}));
    const std::u32string keys = U"0123456789+-<>%gidmrz cd.\x08\x1b\n\n\n\n\t" +
                                std::u32string{key::kLeft,     key::kRight, key::kUp,  key::kDown,
                                               key::kPageDown, key::kHome,  key::kEnd, key::kRight};
    const auto count = random_in(0, 120);
    for (int i = 0; i < count; ++i) {
      editor.press(keys[static_cast<std::size_t>(random_in(0, static_cast<int>(keys.size()) - 1))]);
      RC_ASSERT(!bushd::tables::check(editor.content()).has_value());
      RC_ASSERT(editor.cursor() < code_count(editor.content()));
      RC_ASSERT(editor.curve().size() == code_count(editor.content()));
      if (const auto range = editor.selection()) RC_ASSERT(range->last < editor.curve().size());
    }
    const TableContent after = editor.content();
    type(editor, kEscape + kEscape);
    int undone = 0;
    while (editor.press(U'u'), editor.message() != "nothing to undo") ++undone;
    RC_ASSERT(editor.content() == content);
    for (int i = 0; i < undone; ++i) editor.press(U'r');
    RC_ASSERT(editor.content() == after);
  }));
}

// Faster than 20 kHz is an error here.
TEST(TableEditorSave, AsksBeforeATableWithErrorsIsSaved) {
  TableEditor editor({.name = "t", .time_unit_ns = 1000, .accel = {90, 30}}, 1,
                     watching({}, 20000));
  type(editor, U"-");
  ASSERT_EQ(editor.errors(), 1U);
  EXPECT_EQ(editor.press(U's'), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kAskSave);
  EXPECT_EQ(editor.press(U'n'), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kCodes);
  EXPECT_EQ(editor.press(key::kCtrlS), Wish::kNone);
  EXPECT_EQ(editor.press(U'y'), Wish::kSave);
  // On the way out as well, and under another name.
  EXPECT_EQ(editor.press(U'q'), Wish::kNone);
  EXPECT_EQ(editor.press(U's'), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kAskSave);
  EXPECT_EQ(editor.interrupt(), Wish::kNone);
  EXPECT_EQ(editor.mode(), Mode::kCodes);
  type(editor, U"wother");
  EXPECT_EQ(editor.press(key::kEnter), Wish::kNone);
  EXPECT_EQ(editor.press(U'y'), Wish::kSaveAs);
  EXPECT_EQ(editor.wished_name(), "other");
}

TEST(TableEditorSave, WarningsAreSavedAtOnce) {
  TableEditor editor({.name = "t", .time_unit_ns = 1000, .accel = {90, 30}}, 1, watching({}));
  type(editor, U"-");
  ASSERT_FALSE(editor.diagnostics().empty());
  EXPECT_EQ(editor.press(U's'), Wish::kSave);
}

}  // namespace
}  // namespace bushtab::test
