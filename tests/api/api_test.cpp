#include <gtest/gtest.h>

#include <set>
#include <string>

#include "api/introduction.h"
#include "api/reply.h"
#include "api/request.h"
#include "api/session.h"
#include "api/snapshot.h"
#include "base/ids.h"

namespace bushd::api {
namespace {

class Silent : public Session {
 public:
  using Session::Session;
  void answer(std::int64_t number, const Reply&) override { answered.insert(number); }
  std::set<std::int64_t> answered;
};

template <std::size_t I = 0>
void collect_names(std::multiset<std::string>& names) {
  if constexpr (I < std::variant_size_v<Request::variant>) {
    names.insert(std::string(name_of(Request(std::in_place_index<I>))));
    collect_names<I + 1>(names);
  }
}

TEST(Request, EachTypeHasANameOfItsOwn) {
  std::multiset<std::string> names;
  collect_names(names);
  EXPECT_EQ(names.size(), std::variant_size_v<Request::variant>);
  EXPECT_EQ(std::set(names.begin(), names.end()).size(), names.size());
  EXPECT_EQ(name_of(Move{}), "move");
  EXPECT_EQ(name_of(PositionCompare{}), "position compare");
  EXPECT_EQ(name_of(SetTable{}), "set table");
}

TEST(Request, OnlyWhatEndsMotionGoesFirst) {
  EXPECT_TRUE(ends_motion(Stop{}));
  EXPECT_TRUE(ends_motion(EmergencyStop{}));
  EXPECT_TRUE(ends_motion(Pause{}));
  EXPECT_TRUE(ends_motion(Hold{}));
  EXPECT_TRUE(ends_motion(Disarm{}));
  EXPECT_TRUE(ends_motion(Jog{.motor = "theta", .per_s = 0}));
  EXPECT_FALSE(ends_motion(Jog{.motor = "theta", .per_s = -1}));
  EXPECT_FALSE(ends_motion(Jog{.motor = "theta", .renew = true}));
  EXPECT_FALSE(ends_motion(Move{}));
  EXPECT_FALSE(ends_motion(Resume{}));
  EXPECT_FALSE(ends_motion(Disable{}));
}

TEST(Request, WhatMovesOrChangesIsNotRepeatable) {
  EXPECT_TRUE(is_repeatable(Stop{}));
  EXPECT_TRUE(is_repeatable(EmergencyStop{}));
  EXPECT_TRUE(is_repeatable(ListTables{}));
  EXPECT_FALSE(is_repeatable(Move{}));
  EXPECT_FALSE(is_repeatable(SetTable{}));
  EXPECT_FALSE(is_repeatable(ClearFaults{}));
}

TEST(Words, EachIsReadBack) {
  for (const auto outcome : {Outcome::kDone, Outcome::kReached, Outcome::kStopped, Outcome::kLimit,
                             Outcome::kLink, Outcome::kFault}) {
    EXPECT_EQ(outcome_of(word(outcome)), outcome);
  }
  for (const auto activity : {Activity::kResting, Activity::kMoving, Activity::kArming,
                              Activity::kArmed, Activity::kHoming, Activity::kLocal}) {
    EXPECT_EQ(activity_of(word(activity)), activity);
  }
  for (const auto state : {McuState::kOffline, McuState::kBusy, McuState::kReady,
                           McuState::kRunning, McuState::kFault}) {
    EXPECT_EQ(mcu_state_of(word(state)), state);
  }
  for (const auto trust : {Trust::kUnknown, Trust::kKnown, Trust::kStale, Trust::kUncertain}) {
    EXPECT_EQ(trust_of(word(trust)), trust);
  }
  for (const bool positive : {false, true}) {
    for (const bool negative : {false, true}) {
      const Directions directions{.positive = positive, .negative = negative};
      EXPECT_EQ(directions_of(word(directions)), directions);
    }
  }
  EXPECT_FALSE(outcome_of("Reached"));
  EXPECT_FALSE(trust_of(""));
}

TEST(Session, ClientIdsAreShortAndPrintable) {
  EXPECT_TRUE(is_client_id("bushctl@hall-4711-0badcafe"));
  EXPECT_TRUE(is_client_id(std::string(64, 'x')));
  EXPECT_FALSE(is_client_id(std::string(65, 'x')));
  EXPECT_FALSE(is_client_id(""));
  EXPECT_FALSE(is_client_id("a b"));
  EXPECT_FALSE(is_client_id("a\x1b[2J"));
}

TEST(Session, ClientIdsTellProgramAndHostIfTheyHaveThem) {
  const auto of = [](std::string_view id) {
    const auto introduction = introduction_of(id);
    return introduction
               ? std::string(introduction->program) + " on " + std::string(introduction->host)
               : "nobody";
  };
  EXPECT_EQ(of("bushctl@hall-4711-0badcafe"), "bushctl on hall");
  EXPECT_EQ(of("my-scan@lab-pc-3.local-4711-0badcafe"), "my-scan on lab-pc-3.local");
  EXPECT_EQ(of("scan@a@b-1-2"), "scan on a@b");
  for (const char* other : {"scan", "", "@", "@-", "--", "@a-1-2", "scan@-1-2", "scan@a-1",
                            "a-1-2@b", "a-1@b-2", "scan@", "-@-"}) {
    EXPECT_EQ(of(other), "nobody") << other;
  }
}

TEST(Session, TextNamesTheProcessIfTheKernelKnowsIt) {
  const Silent network(Transport::kLcm, "scan", true);
  EXPECT_EQ(network.text(), "scan");
  const Silent local(Transport::kSocket, "scan", true,
                     Credentials{.pid = 7, .uid = 1000, .gid = 5});
  EXPECT_EQ(local.text(), "scan (uid 1000, pid 7)");
}

TEST(Session, AnswersGoToWhoAsked) {
  const auto session = std::make_shared<Silent>(Transport::kLcm, "scan", true);
  const Asker asker{.session = session, .number = 3};
  asker.answer(Accepted{});
  EXPECT_TRUE(session->answered.contains(3));
  Asker{}.answer(Accepted{});
}

TEST(Reply, OnlyAcceptedIsFollowedByAnother) {
  EXPECT_FALSE(is_final(Accepted{}));
  EXPECT_TRUE(is_final(Refused{"no"}));
  EXPECT_TRUE(is_final(Completed{}));
}

TEST(Reply, MemoryGrowsWithWhatItHolds) {
  const std::size_t small = memory_of(Completed{});
  Completed motors{.outcome = Outcome::kReached, .reason = "stands", .detail = {}};
  motors.detail = std::vector<MotorResult>(100);
  EXPECT_GE(memory_of(motors), small + 100 * sizeof(MotorResult));
  Completed table{};
  table.detail = TableFile{.content = {.accel = std::vector<std::uint16_t>(30000)}};
  EXPECT_GE(memory_of(table), 60000u);
}

TEST(Ids, DifferByType) {
  EXPECT_FALSE((std::is_convertible_v<McuId, MotorId>));
  EXPECT_EQ(MotorId{3}, MotorId{3});
  EXPECT_LT(McuId{1}, McuId{2});
}

}  // namespace
}  // namespace bushd::api
