#include "daemon/services/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "daemon/bench.h"
#include "tables/table_file.h"
#include "tables/temp_directory.h"

namespace bushd::daemon {
namespace {

using test::Bench;

TEST(Journal, AMoveAndItsEndHaveOneId) {
  Bench bench;
  Journal journal(bench.installation, bench);
  bench.installation[MotorId{2}].start(40, 100);
  journal.started({2}, 40, 100, 0, false);
  journal.changed({2}, {.at = 120, .target_steps = {}});
  journal.ended({2}, "stopped");
  ASSERT_EQ(bench.lines.size(), 3u);
  const auto begun = nlohmann::json::parse(bench.lines[0]);
  EXPECT_EQ(begun["event"], "move");
  EXPECT_EQ(begun["motor"], "m03");
  EXPECT_EQ(begun["address"], 2);
  EXPECT_EQ(begun["steps"], 40);
  EXPECT_GT(begun["id"], 1'000'000) << "another daemon's ids are not used again";
  EXPECT_EQ(nlohmann::json::parse(bench.lines[1])["event"], "stop");
  EXPECT_EQ(nlohmann::json::parse(bench.lines[2])["id"], begun["id"]);
}

// File names are bytes to Linux.
TEST(Journal, APathThatIsNoUtf8IsLogged) {
  Bench bench;
  Journal journal(bench.installation, bench);
  const test::TempDirectory directory;
  const auto path = directory.path() / "h\xe4ll.toml";
  std::filesystem::copy_file(bench.installation.table_of({0})->path(), path);
  const auto table = tables::load(path);
  ASSERT_TRUE(table) << table.error().text();
  bench.installation.put_in_service({0}, *table);
  bench.installation[MotorId{0}].start(40, 100);
  journal.started({0}, 40, 100, 0, false);
  const motion::Way way({{&(*table)->view(), 0, 10, 0}});
  journal.line_laid(way, {{.motor = {0}, .increment = 1, .shortest_delay = 0, .table = *table}});
  ASSERT_EQ(bench.lines.size(), 2u);
  const auto replaced = (directory.path() / "h\uFFFDll.toml").string();
  EXPECT_EQ(nlohmann::json::parse(bench.lines[0])["table_file"], replaced);
  EXPECT_EQ(nlohmann::json::parse(bench.lines[1])["motors"][0]["table_file"], replaced);
}

}  // namespace
}  // namespace bushd::daemon
