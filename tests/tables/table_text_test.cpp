// Table files as text: new ones, and changes that keep what people wrote.
#include "tables/table_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tables/random_table.h"
#include "tables/table_file.h"

namespace bushd::test {
namespace {

using tables::parse_content;
using tables::rewrite;
using tables::TableContent;
using tables::to_text;

const char* const kWritten =
    "# theta of the goniometer\n"
    "name = \"theta\"  # as in bushd.toml\n"
    "description = \"two\\nlines\"\n"
    "time_unit_ns = 1_000 # 1 us\n"
    "\n"
    "accel = [ # slow\n"
    "  900, # rubs here\n"
    "  700,\n"
    "  # the band\n"
    "  600, 500,\n"
    "] # fast\n"
    "cruise = 400 # no faster\n"
    "# end\n";

TableContent written() {
  return *parse_content(kWritten, "t.toml");
}

std::string changed(const TableContent& content) {
  const auto text = rewrite(kWritten, content, "t.toml");
  return text ? *text : text.error().text();
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  return text.replace(text.find(what), what.size(), with);
}

TEST(TableText, NothingChangedIsTheSameText) {
  EXPECT_EQ(changed(written()), kWritten);
}

TEST(TableText, OneCodeChangesInPlace) {
  TableContent content = written();
  content.accel[1] = 650;
  EXPECT_EQ(changed(content), replaced(kWritten, "700", "650"));
  content.cruise = 333;
  content.time_unit_ns = 2000;
  EXPECT_EQ(changed(content),
            replaced(replaced(replaced(kWritten, "700", "650"), "400", "333"), "1_000", "2000"));
}

TEST(TableText, InsertedCodesStandWhereTheyBelong) {
  TableContent content = written();
  content.accel.insert(content.accel.begin() + 3, 550);
  EXPECT_EQ(changed(content), replaced(kWritten, "600, 500", "600, 550, 500"));
  content = written();
  content.accel.push_back(450);
  EXPECT_EQ(changed(content), replaced(kWritten, "500", "500, 450"));
}

TEST(TableText, CommentsAmongDeletedCodesStay) {
  TableContent content = written();
  content.accel.erase(content.accel.begin() + 1, content.accel.begin() + 3);
  EXPECT_EQ(changed(content),
            replaced(kWritten, "700,\n  # the band\n  600, 500", "# the band\n  500"));
  content.accel = {900};
  EXPECT_EQ(changed(content), replaced(kWritten, ", # rubs here\n  700,\n  # the band\n  600, 500",
                                       "\n  # rubs here\n  # the band\n  "));
}

TEST(TableText, KeysComeAndGoInLinesOfTheirOwn) {
  TableContent content = written();
  content.revision = 3;
  content.decel = {{500, 800}};
  content.cruise.reset();
  EXPECT_EQ(changed(content), replaced(replaced(replaced(kWritten, "# as in bushd.toml\n",
                                                         "# as in bushd.toml\nrevision = 3\n"),
                                                "# fast\n", "# fast\ndecel = [500, 800]\n"),
                                       "cruise = 400 # no faster\n", "# no faster\n"));
}

TEST(TableText, TextsAreEscaped) {
  TableContent content = written();
  content.description = "quote \" backslash \\ tab \t";
  EXPECT_EQ(changed(content),
            replaced(kWritten, "\"two\\nlines\"", "\"quote \\\" backslash \\\\ tab \\u0009\""));
}

TEST(TableText, UmlautsBeforeACodeDoNotMoveIt) {
  const std::string text = "name = \"ä\"\ntime_unit_ns = 1\naccel = [9, 5] # Größe\n";
  TableContent content = *parse_content(text, "t");
  content.accel = {8, 5};
  content.name = "öö";
  EXPECT_EQ(*rewrite(text, content, "t"),
            "name = \"öö\"\ntime_unit_ns = 1\naccel = [8, 5] # Größe\n");
}

TEST(TableText, LastLineWithoutNewlineIsFinishedFirst) {
  TableContent content = *parse_content("name = \"a\"\ntime_unit_ns = 1\naccel = [9, 5]", "t");
  content.cruise = 4;
  EXPECT_EQ(*rewrite("name = \"a\"\ntime_unit_ns = 1\naccel = [9, 5]", content, "t"),
            "name = \"a\"\ntime_unit_ns = 1\naccel = [9, 5]\ncruise = 4\n");
}

TEST(TableText, AnyContentSurvivesBothWays) {
  EXPECT_TRUE(rc::check("new text, and any text made any other", [] {
    const TableContent from = random_case(1000).content;
    TableContent to = random_case(1000).content;
    to.revision = static_cast<std::uint32_t>(random_in(0, 3));
    const std::string text = to_text(from, {"why"});
    RC_ASSERT(*parse_content(text, "t") == from);
    const auto rewritten = rewrite(text, to, "t");
    RC_ASSERT(rewritten.has_value());
    RC_ASSERT(*parse_content(*rewritten, "t") == to);
    RC_ASSERT(rewritten->starts_with("# why\n"));
  }));
}

TEST(ContentHash, IsThatOfWhatMovesTheMotor) {
  TableContent content{.name = "a", .time_unit_ns = 1000, .accel = {9, 7, 5}};
  // printf '1000 5 3 9 7 5 5 7 9 ' | sha256sum
  EXPECT_EQ(tables::content_hash(content),
            "6af512d702a16fdd005c2486820a28c8d7ce86edbf2d995201bf24a1b3e0a7d0");
  TableContent same = content;
  same.name = "b";
  same.description = "x";
  same.revision = 7;
  same.decel = {{5, 7, 9}};
  same.cruise = 5;
  EXPECT_EQ(tables::content_hash(same), tables::content_hash(content));
  same.cruise = 4;
  EXPECT_NE(tables::content_hash(same), tables::content_hash(content));
}

TEST(ContentHash, TablesTellItWithTheirRevision) {
  const auto table =
      tables::parse("name = \"a\"\nrevision = 12\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n", "t");
  ASSERT_TRUE(table);
  EXPECT_EQ((*table)->revision(), 12U);
  EXPECT_EQ((*table)->content_hash().substr(0, 8), (*table)->short_hash());
  EXPECT_EQ((*table)->content_hash().size(), 64U);
}

}  // namespace
}  // namespace bushd::test
