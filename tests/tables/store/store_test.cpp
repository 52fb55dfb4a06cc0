// A directory of tables with its history, as two people at once use it.
#include "tables/store/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using tables::store::Store;
using testing::ElementsAre;
using testing::HasSubstr;

const char* const kText = "# mine\nname = \"t\"\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n";

std::string with_first_code(std::string text, const std::string& code) {
  return text.replace(text.find("[9") + 1, 1, code);
}

class TableStore : public testing::Test {
 protected:
  TempDirectory directory_;
  Store store_{directory_.path(), directory_.path() / "history.sqlite"};

  std::vector<std::string> notes() {
    std::vector<std::string> notes;
    const auto log = store_.log("t");
    for (const auto& revision : *log) {
      notes.push_back(std::to_string(revision.number) + " " + revision.note);
    }
    return notes;
  }
};

TEST_F(TableStore, EveryChangeIsARevision) {
  EXPECT_EQ(*store_.create("t", kText, "new"), 1U);
  const auto first = store_.read("t");
  EXPECT_EQ(first->text,
            "# mine\nname = \"t\"\nrevision = 1\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n");
  EXPECT_EQ(*store_.save("t", first->text, with_first_code(first->text, "8"), "set"), 2U);
  EXPECT_EQ(store_.read("t")->content.accel.front(), 8);
  EXPECT_EQ(store_.read("t")->content.revision, 2U);
  EXPECT_THAT(notes(), ElementsAre("2 set", "1 new"));
  EXPECT_EQ(store_.read("t", "1")->text, first->text);
}

TEST_F(TableStore, TableThatIsThereIsNotCreatedAgain) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  const auto again = store_.create("t", kText, "new");
  EXPECT_THAT(again.error().text(), HasSubstr("t.toml: is there already"));
}

TEST_F(TableStore, WhatIsNoTableIsNotSaved) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  const std::string before = store_.read("t")->text;
  EXPECT_FALSE(store_.save("t", before, with_first_code(before, "0"), "set"));
  EXPECT_EQ(store_.read("t")->text, before);
}

TEST_F(TableStore, ChangeOfAnOldTextIsRefused) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  const std::string old = store_.read("t")->text;
  ASSERT_TRUE(store_.save("t", old, with_first_code(old, "8"), "first"));
  const std::string now = store_.read("t")->text;
  const auto late = store_.save("t", old, with_first_code(old, "7"), "late");
  EXPECT_THAT(late.error().text(), HasSubstr("changed by someone else"));
  EXPECT_EQ(store_.read("t")->text, now);
  EXPECT_THAT(notes(), ElementsAre("2 first", "1 new"));
}

TEST_F(TableStore, OfManyAtOnceExactlyOneWins) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  const std::string old = store_.read("t")->text;
  std::atomic<int> won = 0;
  std::vector<std::jthread> writers;
  for (int i = 0; i < 8; ++i) {
    writers.emplace_back([&] {
      Store mine(directory_.path(), directory_.path() / "history.sqlite");
      if (mine.save("t", old, with_first_code(old, "8"), "set")) ++won;
    });
  }
  writers.clear();
  EXPECT_EQ(won, 1);
  EXPECT_EQ(store_.log("t")->size(), 2U);
}

TEST_F(TableStore, ChangesByOtherMeansAreRecordedBeforeTheNext) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  const std::string by_hand = with_first_code(store_.read("t")->text, "8");
  directory_.write("t.toml", by_hand);
  EXPECT_EQ(*store_.save("t", by_hand, with_first_code(kText, "7"), "set"), 3U);
  EXPECT_THAT(notes(), ElementsAre("3 set", "2 found", "1 new"));
  EXPECT_EQ(store_.read("t", "2")->text, by_hand);
}

// As that of a table made in another folder, from where only its file was copied.
TEST_F(TableStore, AFileWithoutHistoryIsTheRevisionThatItSays) {
  std::string text = kText;
  text.insert(text.find("time_unit"), "revision = 3\n");
  directory_.write("t.toml", text);
  ASSERT_TRUE(store_.read("t", "3"));
  EXPECT_EQ(store_.read("t", "3")->text, text);
  EXPECT_THAT(store_.read("t", "2").error().text(), HasSubstr("has no history, so no revision"));
  EXPECT_FALSE(std::filesystem::exists(directory_.path() / "history.sqlite"));
  ASSERT_TRUE(store_.create("another", kText, "new"));
  ASSERT_TRUE(store_.read("t", "3"));
  EXPECT_THAT(store_.read("t", "2").error().text(), HasSubstr("no revision 2"));
  // What the history has counts: the file may have been changed by hand.
  ASSERT_TRUE(store_.save("t", text, with_first_code(text, "8"), "set"));
  directory_.write("t.toml", with_first_code(text, "7"));
  EXPECT_EQ(store_.read("t", "3")->text, text);
}

TEST_F(TableStore, TagsNameRevisionsAndMayMove) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  const std::string text = store_.read("t")->text;
  ASSERT_TRUE(store_.save("t", text, with_first_code(text, "8"), "set"));
  EXPECT_EQ(*store_.tag("t", "good", "1"), 1U);
  EXPECT_EQ(store_.read("t", "good")->content.revision, 1U);
  EXPECT_EQ(*store_.tag("t", "good", ""), 2U);
  EXPECT_EQ(store_.read("t", "good")->content.revision, 2U);
  EXPECT_THAT(store_.log("t")->front().tags, ElementsAre("good"));
  for (const char* bad : {"", "7", "a@b", "a b", "a/b"}) EXPECT_FALSE(store_.tag("t", bad, "1"));
  EXPECT_THAT(store_.read("t", "none").error().text(), HasSubstr("no tag \"none\""));
  EXPECT_THAT(store_.read("t", "9").error().text(), HasSubstr("no revision 9"));
}

TEST_F(TableStore, PermissionsOfTheFileStay) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  namespace fs = std::filesystem;
  const fs::perms wanted = fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_write;
  fs::permissions(store_.path_of("t"), wanted);
  const std::string text = store_.read("t")->text;
  ASSERT_TRUE(store_.save("t", text, with_first_code(text, "8"), "set"));
  EXPECT_EQ(fs::status(store_.path_of("t")).permissions(), wanted);
}

TEST_F(TableStore, LinkedTableKeepsItsLinkOwnerAndMode) {
  const auto real = directory_.path() / "real";
  std::filesystem::create_directory(real);
  const auto file = real / "kept elsewhere.toml";
  std::ofstream(file) << kText;
  std::filesystem::permissions(file, std::filesystem::perms(0640));
  const bool root = geteuid() == 0;
  if (root) {
    ASSERT_EQ(chown(file.c_str(), 4321, 1234), 0);
  }
  std::filesystem::create_symlink("real/kept elsewhere.toml", store_.path_of("t"));
  ASSERT_TRUE(store_.save("t", kText, with_first_code(kText, "8"), "set"));
  EXPECT_TRUE(std::filesystem::is_symlink(store_.path_of("t")));
  EXPECT_EQ(store_.read("t")->content.accel.front(), 8);
  struct stat now{};
  ASSERT_EQ(stat(file.c_str(), &now), 0);
  EXPECT_EQ(now.st_mode & 07777, 0640U);
  EXPECT_EQ(now.st_uid, root ? 4321U : geteuid());
  EXPECT_EQ(now.st_gid, root ? 1234U : getegid());
}

TEST_F(TableStore, LinkToNothingIsLeftAlone) {
  std::filesystem::create_symlink("nowhere", store_.path_of("t"));
  EXPECT_THAT(store_.create("t", kText, "new").error().text(), HasSubstr("is a link to nothing"));
  EXPECT_TRUE(std::filesystem::is_symlink(store_.path_of("t")));
  EXPECT_THAT(notes(), testing::IsEmpty());
}

TEST_F(TableStore, LookingAtTheLogMakesNoHistory) {
  EXPECT_THAT(notes(), testing::IsEmpty());
  EXPECT_TRUE(std::filesystem::is_empty(directory_.path()));
}

TEST_F(TableStore, HistoryThatCannotBeWrittenChangesNothing) {
  ASSERT_TRUE(store_.create("t", kText, "new"));
  const std::string text = store_.read("t")->text;
  directory_.write("broken.sqlite",
                   "this is no database, and long enough to be told apart from one");
  Store broken(directory_.path(), directory_.path() / "broken.sqlite");
  const auto saved = broken.save("t", text, with_first_code(text, "8"), "set");
  EXPECT_THAT(saved.error().text(), HasSubstr("--history FILE"));
  EXPECT_EQ(store_.read("t")->text, text);
}

}  // namespace
}  // namespace bushd::test
