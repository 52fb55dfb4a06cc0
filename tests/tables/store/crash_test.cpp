// A save that is killed before any one of its system calls leaves the old table or the new one, and
// a history that goes on.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "tables/killed_at.h"
#include "tables/store/store.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using tables::store::Store;

std::set<std::string> files_of(const TempDirectory& directory) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory.path())) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

TEST(TableStoreCrash, LeavesOldOrNewAtAnySystemCall) {
  const std::string old_text =
      "name = \"t\"\nrevision = 1\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n";
  const std::string new_text =
      "name = \"t\"\nrevision = 2\ntime_unit_ns = 1000\naccel = [8, 7, 5]\n";
  // What counts here is the order of the calls: a disk that syncs would only make it slow.
  if (access("/dev/shm", W_OK) == 0) setenv("TMPDIR", "/dev/shm", 1);
  int left_old = 0;
  int left_new = 0;
  for (int n = 1;; ++n) {
    const TempDirectory directory;
    Store store(directory.path(), directory.path() / "history.sqlite");
    ASSERT_TRUE(store.create("t", old_text, "new"));
    const End end =
        killed_at(n, [&] { return store.save("t", old_text, new_text, "set").has_value(); });
    if (end == End::kNotTraced) GTEST_SKIP() << "no tracing of children here";
    const auto found = store.read("t");
    ASSERT_TRUE(found) << "killed at stop " << n << ": " << found.error().text();
    ASSERT_TRUE(found->text == old_text || found->text == new_text) << found->text;
    (found->text == old_text ? left_old : left_new)++;
    // The next one is not hindered by what was left behind, and has the right number.
    const auto next = store.save("t", found->text, found->text + "# more\n", "next");
    ASSERT_TRUE(next) << "killed at stop " << n << ": " << next.error().text();
    ASSERT_EQ(*next, found->content.revision + 1);
    ASSERT_EQ(store.read("t", std::to_string(found->content.revision))->text, found->text);
    ASSERT_EQ(files_of(directory), (std::set<std::string>{".lock", "history.sqlite", "t.toml"}));
    if (end == End::kFinished) break;
  }
  EXPECT_GT(left_old, 10);
  EXPECT_GT(left_new, 2);
}

// Whoever is killed again and again may lose what was not in place yet, but no revision that was.
TEST(TableStoreCrash, NoRevisionThatWasInPlaceIsEverMissing) {
  if (access("/dev/shm", W_OK) == 0) setenv("TMPDIR", "/dev/shm", 1);
  const TempDirectory directory;
  Store store(directory.path(), directory.path() / "history.sqlite");
  ASSERT_TRUE(store.create("t", "name = \"t\"\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n", "new"));
  std::map<std::uint32_t, std::string> in_place;
  int finished = 0;
  for (int n = 1; finished < 3; ++n) {
    // Two saves in a row, each killed at the same place of its work.
    for (int i = 0; i < 2; ++i) {
      const std::string before = store.read("t")->text;
      const End end = killed_at(
          n, [&] { return store.save("t", before, before + "# more\n", "save").has_value(); });
      if (end == End::kNotTraced) GTEST_SKIP() << "no tracing of children here";
      if (end == End::kFinished) ++finished;
      const auto now = store.read("t");
      ASSERT_TRUE(now);
      in_place[now->content.revision] = now->text;
    }
  }
  std::map<std::uint32_t, std::string> known;
  const auto log = store.log("t");
  ASSERT_TRUE(log);
  for (const auto& revision : *log) {
    known[revision.number] = store.read("t", std::to_string(revision.number))->text;
    EXPECT_EQ(revision.note, revision.number == 1 ? "new" : "save");
  }
  EXPECT_EQ(known, in_place);
}

}  // namespace
}  // namespace bushd::test
