// Tables asked for and set by other programs: the same files, checks and history as bushtab's.
#include "daemon/shell/table_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "bushd/set_table_t.hpp"
#include "bushd/table_answer_t.hpp"
#include "lcm/codec.h"
#include "lcm/oracle.h"
#include "tables/store/store.h"
#include "tables/temp_directory.h"

namespace bushd::test {
namespace {

using daemon::answer;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kText = "# mine\nname = \"own\"\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n";

class TableService : public testing::Test {
 protected:
  TableService() {
    std::filesystem::create_directories(store_.path_of("own").parent_path());
    EXPECT_TRUE(store_.create("own", kText, "new"));
  }

  static config::Config at(const std::filesystem::path& path) {
    config::Config config;
    config.path = path.string();
    return config;
  }
  // By way of the message, as clients send it.
  static api::Request set(const std::string& name, const table_t& table) {
    set_table_t message{};
    message.table = name;
    message.expected_hash = table.hash;
    message.content = table;
    message.content.accel_count = static_cast<std::int32_t>(table.accel.size());
    const auto heard = lcm::decode_client_message("SET_TABLE", bytes_of(message));
    return std::get<api::Request>(heard.value().content);
  }
  api::Reply ask(const api::Request& request) const { return answer(library_, request, "test"); }
  api::TableEntry entry(const api::Request& request) const {
    const api::Reply reply = ask(request);
    EXPECT_TRUE(std::holds_alternative<api::Completed>(reply));
    return std::get<api::TableList>(std::get<api::Completed>(reply).detail).entries.at(0);
  }
  bool done(const api::Request& request) const {
    return std::holds_alternative<api::Completed>(ask(request));
  }
  table_t get(const std::string& table) const {
    const auto packets = lcm::encode(0, {}, ask(api::GetTable{table}));
    return as<table_answer_t>(packets.value().front().payload).tables.at(0);
  }
  std::string refused(const api::Request& request) const {
    return std::get<api::Refused>(ask(request)).reason;
  }

  TempDirectory directory_;
  config::Config config_ = at(directory_.write("bushd.toml", "nonsense"));
  tables::store::Place place_ = tables::store::place_of(directory_.path() / "tables");
  tables::store::Store store_{place_.directory, place_.history};
  daemon::TableLibrary library_{config_, {}};
};

TEST_F(TableService, GetsWhatTheFileSaysAndEarlierRevisions) {
  table_t table = get("own");
  EXPECT_EQ(table.name, "own");
  EXPECT_EQ(table.revision, 1);
  EXPECT_EQ(table.hash.size(), 64u);
  EXPECT_EQ(table.time_unit_ns, 1000);
  EXPECT_EQ(table.cruise, 0) << "not written in the file";
  EXPECT_THAT(table.accel, ElementsAre(9, 7, 5));
  EXPECT_THAT(table.decel, IsEmpty());
  table.accel[0] = 8;
  EXPECT_TRUE(done(set("own", table)));
  EXPECT_THAT(get("own").accel, ElementsAre(8, 7, 5));
  EXPECT_THAT(get("own@1").accel, ElementsAre(9, 7, 5));
  EXPECT_THAT(refused(api::GetTable{"own@3"}), HasSubstr("has no revision 3"));
  EXPECT_THAT(refused(api::GetTable{"none"}), HasSubstr("no table \"none\""));
  EXPECT_THAT(refused(api::GetTable{"../own"}), HasSubstr("not a table's name"));
}

TEST_F(TableService, SetIsARevisionThatKeepsComments) {
  table_t table = get("own");
  table.decel = {6, 9};
  table.decel_count = 2;
  table.description = "slower to stop";
  const api::TableEntry now = entry(set("own", table));
  EXPECT_EQ(now.table.revision, 2u);
  EXPECT_EQ(now.codes, 5);
  EXPECT_EQ(store_.read("own")->text,
            "# mine\nname = \"own\"\ndescription = \"slower to stop\"\nrevision = 2\n"
            "time_unit_ns = 1000\naccel = [9, 7, 5]\ndecel = [6, 9]\n");
  EXPECT_EQ(store_.log("own")->front().note, "set by test");
}

TEST_F(TableService, RepeatedSetIsCarriedOutOnce) {
  table_t table = get("own");
  table.accel[0] = 8;
  EXPECT_TRUE(done(set("own", table)));
  EXPECT_EQ(entry(set("own", table)).table.revision, 2u);
  EXPECT_EQ(store_.log("own")->size(), 2u);
}

TEST_F(TableService, TableThatSomebodyElseChangedMeanwhileIsLeftAlone) {
  table_t mine = get("own");
  table_t theirs = mine;
  theirs.accel[0] = 8;
  ASSERT_TRUE(done(set("own", theirs)));
  mine.accel[0] = 10;
  EXPECT_THAT(refused(set("own", mine)), HasSubstr("is another table by now, revision 2"));
  mine.hash.clear();
  EXPECT_THAT(refused(set("own", mine)), HasSubstr("is another table by now")) << "not new";
  EXPECT_THAT(get("own").accel, ElementsAre(8, 7, 5));
}

TEST_F(TableService, NewTablesAreMadeInTheFolderOfTables) {
  table_t table = get("own");
  table.name = "other";
  table.hash.clear();
  EXPECT_TRUE(done(set("other", table)));
  EXPECT_TRUE(std::filesystem::exists(directory_.path() / "tables" / "other.toml"));
  EXPECT_EQ(get("other").revision, 1);
  EXPECT_THAT(refused(set("bushd", table)), HasSubstr("is the configuration"));
  EXPECT_THAT(refused(set("bushd2-constant", table)), HasSubstr("is a shipped table"));
  EXPECT_THAT(refused(set("../other", table)), HasSubstr("not a table's name"));
}

TEST_F(TableService, WhatIsNoTableIsRefusedWithItsPlace) {
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
  EXPECT_THAT(get("own").accel, ElementsAre(9, 7, 5));
}

TEST_F(TableService, ListsAllTablesAndWhatIsWrongWithBadOnes) {
  directory_.write("tables/bad.toml", "name = 3\n");
  const api::Reply reply = ask(api::ListTables{});
  std::vector<std::string> good;
  for (const auto& entry :
       std::get<api::TableList>(std::get<api::Completed>(reply).detail).entries) {
    EXPECT_THAT(entry.fault, HasSubstr(entry.name == "bad" ? "bad.toml:1:" : ""));
    if (entry.fault.empty()) good.push_back(entry.name);
    if (entry.name != "own") continue;
    EXPECT_EQ(entry.codes, 3);
    EXPECT_DOUBLE_EQ(entry.max_steps_per_s, 200'000);
  }
  EXPECT_THAT(good, testing::IsSupersetOf({"own", "bushd2-constant"}));
  EXPECT_THAT(good, testing::Not(testing::Contains("bushd")));
}

TEST_F(TableService, TableTooLongForAMessageIsRefused) {
  std::string text = "name = \"long\"\ntime_unit_ns = 1000\naccel = [";
  for (int i = 0; i < 20000; ++i) text += std::to_string(30000 - i) + ", ";
  directory_.write("tables/long.toml", text + "9]\n");
  const auto packet = lcm::encode(0, {}, ask(api::GetTable{"long"}));
  ASSERT_FALSE(packet);
  EXPECT_THAT(packet.error().text(), HasSubstr("use a table of fewer codes"));
}

}  // namespace
}  // namespace bushd::test
