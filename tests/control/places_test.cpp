// Who gets a place when there are few: with users and processes that there are not.
#include "control/places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bushd::control {
namespace {

using testing::HasSubstr;

constexpr api::Credentials of(int pid, std::uint32_t uid) {
  return {.pid = pid, .uid = uid, .gid = 0};
}
const auto kNobodyWaits = [](Places::Connection) { return false; };

TEST(Places, AreBoundedOfAProcessOfAUserAndInAll) {
  Places places({.in_all = 6, .of_user = 4, .of_process = 2, .for_stops = 8});
  Places::Connection next = 1;
  const auto take = [&](api::Credentials who) { return places.take(next++, who); };
  EXPECT_EQ(take(of(10, 1)), "");
  EXPECT_EQ(take(of(10, 1)), "");
  EXPECT_THAT(take(of(10, 1)), HasSubstr("process 10 of user 1 has 2 connections"));
  EXPECT_EQ(take(of(10, 2)), "") << "that of another user, by the numbers of another container";
  EXPECT_EQ(take(of(11, 1)), "");
  EXPECT_EQ(take(of(12, 1)), "");
  EXPECT_THAT(take(of(13, 1)), HasSubstr("user 1 has 4 connections"));
  EXPECT_EQ(take(of(20, 3)), "");
  EXPECT_THAT(take(of(30, 4)), HasSubstr("there are 6 connections"));
  places.give_back(1);
  EXPECT_EQ(take(of(30, 4)), "");
}

// Connections are numbered as they came: 1, 2, ...
TEST(Places, ForStopsAreGivenUpByWhoHasMostAndForLongest) {
  Places places({.in_all = 0, .of_user = 4, .of_process = 2, .for_stops = 5});
  places.take(1, of(20, 2));
  places.take(2, of(10, 1));
  places.take(3, of(11, 1));
  EXPECT_TRUE(places.has_room());
  places.take(4, of(12, 1));
  places.take(5, of(11, 1));
  EXPECT_FALSE(places.has_room());
  EXPECT_EQ(places.who_goes(kNobodyWaits), 3u) << "of user 1, of process 11, the older one";
  places.give_back(3);
  places.take(6, of(13, 1));
  EXPECT_EQ(places.who_goes(kNobodyWaits), 2u) << "each process has one";
  EXPECT_EQ(places.who_goes([](Places::Connection c) { return c != 1; }), 1u);
  EXPECT_EQ(places.who_goes([](Places::Connection) { return true; }), std::nullopt);
}

}  // namespace
}  // namespace bushd::control
