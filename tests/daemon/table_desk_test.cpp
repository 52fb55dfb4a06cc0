// Tables asked for and set by other programs: the same files, checks and history as bushtab's.
#include "daemon/table_desk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "lcm/wire.h"
#include "tables/store/store.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using daemon::answer;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kText = "# mine\nname = \"own\"\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n";

class TableDesk : public testing::Test {
 protected:
  TableDesk() {
    std::filesystem::create_directories(store_.path_of("own").parent_path());
    EXPECT_TRUE(store_.create("own", kText, "new"));
  }

  static config::Config at(const std::filesystem::path& path) {
    config::Config config;
    config.path = path.string();
    return config;
  }
  static table_request_t request(std::int8_t kind, const std::string& table = {}) {
    table_request_t request{};
    request.client_id = "test";
    request.number = 7;
    request.kind = kind;
    request.table = table;
    return request;
  }
  static table_request_t set(const std::string& name, const table_t& table) {
    table_request_t set = request(table_request_t::SET, name);
    set.expected_hash = table.hash;
    set.content.push_back(table);
    set.content_count = 1;
    return set;
  }
  table_t get(const std::string& table) const {
    const table_reply_t reply = answer(library_, request(table_request_t::GET, table));
    EXPECT_EQ(reply.done, 1) << reply.reason;
    return reply.tables.at(0);
  }
  std::string refused(const table_request_t& request) const {
    const table_reply_t reply = answer(library_, request);
    EXPECT_EQ(reply.done, 0);
    EXPECT_TRUE(lcm::encode(reply));
    return reply.reason;
  }

  TempDirectory directory_;
  config::Config config_ = at(directory_.write("bushd.toml", "nonsense"));
  tables::store::Place place_ = tables::store::place_of(directory_.path() / "tables");
  tables::store::Store store_{place_.directory, place_.history};
  daemon::TableLibrary library_{config_, {}};
};

TEST_F(TableDesk, GetsWhatTheFileSaysAndEarlierRevisions) {
  table_t table = get("own");
  EXPECT_EQ(table.name, "own");
  EXPECT_EQ(table.revision, 1);
  EXPECT_EQ(table.hash.size(), 64u);
  EXPECT_EQ(table.time_unit_ns, 1000);
  EXPECT_EQ(table.cruise, 0) << "not written in the file";
  EXPECT_THAT(table.accel, ElementsAre(9, 7, 5));
  EXPECT_THAT(table.decel, IsEmpty());
  table.accel[0] = 8;
  EXPECT_EQ(answer(library_, set("own", table)).done, 1);
  EXPECT_THAT(get("own").accel, ElementsAre(8, 7, 5));
  EXPECT_THAT(get("own@1").accel, ElementsAre(9, 7, 5));
  EXPECT_THAT(refused(request(table_request_t::GET, "own@3")), HasSubstr("has no revision 3"));
  EXPECT_THAT(refused(request(table_request_t::GET, "none")), HasSubstr("no table \"none\""));
  EXPECT_THAT(refused(request(table_request_t::GET, "../own")), HasSubstr("not a table's name"));
}

TEST_F(TableDesk, SetIsARevisionThatKeepsComments) {
  table_t table = get("own");
  table.decel = {6, 9};
  table.decel_count = 2;
  table.description = "slower to stop";
  const table_reply_t reply = answer(library_, set("own", table));
  EXPECT_EQ(reply.done, 1) << reply.reason;
  EXPECT_EQ(reply.number, 7);
  ASSERT_EQ(reply.entries.size(), 1u);
  EXPECT_EQ(reply.entries[0].table.revision, 2);
  EXPECT_EQ(reply.entries[0].codes, 5);
  EXPECT_EQ(store_.read("own")->text,
            "# mine\nname = \"own\"\ndescription = \"slower to stop\"\nrevision = 2\n"
            "time_unit_ns = 1000\naccel = [9, 7, 5]\ndecel = [6, 9]\n");
  EXPECT_EQ(store_.log("own")->front().note, "set by test");
}

TEST_F(TableDesk, RepeatedSetIsCarriedOutOnce) {
  table_t table = get("own");
  table.accel[0] = 8;
  EXPECT_EQ(answer(library_, set("own", table)).done, 1);
  const table_reply_t again = answer(library_, set("own", table));
  EXPECT_EQ(again.done, 1);
  EXPECT_EQ(again.entries.at(0).table.revision, 2);
  EXPECT_EQ(store_.log("own")->size(), 2u);
}

TEST_F(TableDesk, TableThatSomebodyElseChangedMeanwhileIsLeftAlone) {
  table_t mine = get("own");
  table_t theirs = mine;
  theirs.accel[0] = 8;
  ASSERT_EQ(answer(library_, set("own", theirs)).done, 1);
  mine.accel[0] = 10;
  EXPECT_THAT(refused(set("own", mine)), HasSubstr("is another table by now, revision 2"));
  mine.hash.clear();
  EXPECT_THAT(refused(set("own", mine)), HasSubstr("is another table by now")) << "not new";
  EXPECT_THAT(get("own").accel, ElementsAre(8, 7, 5));
}

TEST_F(TableDesk, NewTablesAreMadeInTheFolderOfTables) {
  table_t table = get("own");
  table.name = "other";
  table.hash.clear();
  EXPECT_EQ(answer(library_, set("other", table)).done, 1);
  EXPECT_TRUE(std::filesystem::exists(directory_.path() / "tables" / "other.toml"));
  EXPECT_EQ(get("other").revision, 1);
  EXPECT_THAT(refused(set("bushd", table)), HasSubstr("is the configuration"));
  EXPECT_THAT(refused(set("bushd2-constant", table)), HasSubstr("is a shipped table"));
  EXPECT_THAT(refused(set("../other", table)), HasSubstr("not a table's name"));
}

TEST_F(TableDesk, WhatIsNoTableIsRefusedWithItsPlace) {
  const auto with = [this](const std::function<void(table_t&)>& spoil) {
    table_t table = get("own");
    spoil(table);
    return refused(set("own", table));
  };
  EXPECT_THAT(with([](table_t& t) { t.accel[1] = 70000; }), HasSubstr("own: accel[1]: "));
  EXPECT_THAT(with([](table_t& t) { t.accel[2] = 8; }), HasSubstr("own: accel[2]: is 8 after 7"));
  EXPECT_THAT(with([](table_t& t) { t.accel.clear(); }), HasSubstr("own: accel: "));
  EXPECT_THAT(with([](table_t& t) { t.time_unit_ns = -1; }), HasSubstr("time_unit_ns"));
  EXPECT_THAT(with([](table_t& t) { t.cruise = -3; }), HasSubstr("own: cruise: "));
  EXPECT_THAT(with([](table_t& t) { t.name = "a\nb"; }), HasSubstr("own: name: "));
  EXPECT_FALSE(daemon::table_of(request(table_request_t::SET, "own"))) << "without content";
  EXPECT_THAT(get("own").accel, ElementsAre(9, 7, 5));
}

TEST_F(TableDesk, ListsAllTablesAndWhatIsWrongWithBadOnes) {
  directory_.write("tables/bad.toml", "name = 3\n");
  const table_reply_t reply = answer(library_, request(table_request_t::LIST));
  EXPECT_EQ(reply.done, 1);
  std::vector<std::string> good;
  for (const table_entry_t& entry : reply.entries) {
    EXPECT_THAT(entry.fault, HasSubstr(entry.name == "bad" ? "bad.toml:1:" : ""));
    if (entry.fault.empty()) good.push_back(entry.name);
    if (entry.name != "own") continue;
    EXPECT_EQ(entry.codes, 3);
    EXPECT_DOUBLE_EQ(entry.max_steps_per_s, 200'000);
  }
  EXPECT_THAT(good, testing::IsSupersetOf({"own", "bushd2-constant"}));
  EXPECT_THAT(good, testing::Not(testing::Contains("bushd")));
}

TEST_F(TableDesk, TableTooLongForAMessageIsRefused) {
  std::string text = "name = \"long\"\ntime_unit_ns = 1000\naccel = [";
  for (int i = 0; i < 20000; ++i) text += std::to_string(30000 - i) + ", ";
  directory_.write("tables/long.toml", text + "9]\n");
  EXPECT_THAT(refused(request(table_request_t::GET, "long")), HasSubstr("too many codes"));
}

}  // namespace
}  // namespace bushd::test
