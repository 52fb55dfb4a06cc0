#include "daemon/services/tables_in_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config.h"
#include "daemon/live_bench.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

struct TablesBench : LiveBench {
  TablesBench() { connect(tables); }
  void use(std::int64_t number, const std::string& group, const std::string& table) {
    tables.request(asker(number), api::UseTable{.group = group, .table = table});
  }
  // The table of the group, without its slowest code.
  bushd::tables::TablePtr changed_table() const {
    const bushd_table& now = installation.tables()[GroupId{0}]->view();
    bushd::tables::TableContent content{.name = "mine", .time_unit_ns = now.time_unit_ns};
    content.accel.assign(now.accel.code + 1, now.accel.code + now.accel.count);
    return bushd::tables::make(std::move(content)).value();
  }
  TablesInService tables{installation, interlocks, *this};
};

TEST(TablesInService, ATableIsReadUploadedAndKept) {
  TablesBench bench;
  bench.use(1, "axes", "mine@2");
  ASSERT_EQ(bench.to_read.size(), 1u);
  EXPECT_EQ(bench.to_read[0].second, std::vector<std::string>{"mine@2"});
  EXPECT_TRUE(bench.replies(1).empty()) << "it is not read yet";
  const auto before = bench.installation.tables()[GroupId{0}];
  const auto table = bench.changed_table();
  bench.tables.read(bench.now_us(), bench.to_read[0].first, {table});
  ASSERT_TRUE(bench.run_until([&] { return !bench.to_keep.empty(); }));
  EXPECT_EQ(bench.to_keep[0].second, std::vector<std::string>{"mine@2"});
  EXPECT_EQ(bench.installation.tables()[GroupId{0}], table);
  EXPECT_NE(bench.installation.tables()[GroupId{0}], before);
  bench.tables.kept(bench.to_keep[0].first, {});
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kDone);
  bench.move(2, "m01", 50);
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kReached);
}

TEST(TablesInService, AMoveUnderWayKeepsItsTable) {
  TablesBench bench;
  bench.move(1, "m01", 2000);
  bench.run_for(0.3);
  bench.use(2, "axes", "mine");
  bench.tables.read(bench.now_us(), bench.to_read.at(0).first, {bench.changed_table()});
  bench.run_for(0.3);
  EXPECT_TRUE(bench.to_keep.empty()) << "it waits for the motor";
  EXPECT_THAT(bench.interlocks.may_move(bench.motor("m02")).error().text(),
              HasSubstr("is about to get another table, for group axes"));
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kReached);
  EXPECT_TRUE(bench.run_until([&] { return !bench.to_keep.empty(); }));
}

TEST(TablesInService, ABadTableIsRefusedAndTheOldOneStays) {
  TablesBench bench;
  const auto before = bench.installation.tables()[GroupId{0}];
  bench.use(1, "axes", "gone");
  bench.tables.read(bench.now_us(), bench.to_read.at(0).first, {fail("gone.toml: cannot be read")});
  EXPECT_THAT(bench.refusal(1), HasSubstr("gone.toml: cannot be read"));
  EXPECT_EQ(bench.installation.tables()[GroupId{0}], before);
  bench.use(2, "nobody", "mine");
  EXPECT_THAT(bench.refusal(2), HasSubstr("there is no group \"nobody\""));
  bench.use(3, "axes", "");
  EXPECT_THAT(bench.refusal(3), HasSubstr("no table is named"));
  EXPECT_TRUE(bench.interlocks.may_move(bench.motor("m01")));
}

// Looking at the codes of a large table takes long, so it is done elsewhere and once: what was
// found there counts, whatever the table is.
TEST(TablesInService, ContentIsCheckedByItsReviewAlone) {
  TablesBench bench;
  const config::Config& config = bench.installation.config();
  TableReview review(config, bench.changed_table());
  ASSERT_EQ(review.by_tick_ns.size(), 1u) << "once for each tick, however many buses have it";
  EXPECT_TRUE(bench.tables.check_content(config.groups[0].table_name, review));
  review.by_tick_ns.begin()->second = fail("it is too fast");
  const auto refused = bench.tables.check_content(config.groups[0].table_name, review);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), HasSubstr("too fast"));
  EXPECT_TRUE(bench.tables.check_content("nobody's", review)) << "no motor would move by it";
}

}  // namespace
}  // namespace bushd::daemon
