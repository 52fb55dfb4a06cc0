// In which order requests reach the core, and how many may wait.
#include "daemon/fronts/reception.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace bushd::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Client : public api::Session {
 public:
  explicit Client(const std::string& id, bool may_command = true)
      : Session(api::Transport::kLcm, id, may_command) {}
  void answer(std::int64_t, const api::Reply& reply) override {
    if (const auto* refused = std::get_if<api::Refused>(&reply))
      refusals.push_back(refused->reason);
  }
  std::vector<std::string> refusals;
};

class ReceptionTest : public testing::Test {
 protected:
  void take(const std::shared_ptr<Client>& client, const api::Request& request,
            std::size_t bytes = 100) {
    reception_.take({.session = client, .number = ++number_}, request, bytes);
  }
  void carry_out_all() {
    while (!reception_.idle()) reception_.carry_out_next();
  }

  std::vector<std::string> carried_out_;
  std::vector<std::uint64_t> after_;  // so many stops, as they were carried out
  std::int64_t number_ = 0;
  std::int64_t now_us_ = 0;
  StopCount stops_;
  Reception reception_{
      stops_,
      [this](const api::Asker& asker, const api::Request& request) {
        carried_out_.push_back(asker.session->client_id() + " " +
                               std::string(api::name_of(request)));
        after_.push_back(asker.after_stops);
      },
      {.requests_per_client = 3, .bytes_per_client = 1000, .requests = 5, .bytes = 2000},
      [this] { return now_us_; }};
  std::shared_ptr<Client> a_ = std::make_shared<Client>("a");
  std::shared_ptr<Client> b_ = std::make_shared<Client>("b");
};

TEST_F(ReceptionTest, StopsAreCarriedOutBeforeAllThatWaits) {
  take(a_, api::Move{});
  take(a_, api::Home{});
  take(b_, api::EmergencyStop{});
  take(a_, api::Stop{});
  EXPECT_THAT(carried_out_, ElementsAre("b emergency stop", "a stop"));
  carry_out_all();
  EXPECT_THAT(carried_out_, ElementsAre("b emergency stop", "a stop", "a move", "a home"));
}

TEST_F(ReceptionTest, WhateverEndsMotionHasTheWayOfAStop) {
  for (const api::Request& request :
       {api::Request(api::Stop{}), api::Request(api::EmergencyStop{}), api::Request(api::Pause{}),
        api::Request(api::Hold{}), api::Request(api::Disarm{}),
        api::Request(api::Jog{.motor = "m"})}) {
    carried_out_.clear();
    take(a_, api::Move{});
    take(b_, request);
    EXPECT_THAT(carried_out_, ElementsAre("b " + std::string(api::name_of(request))));
    carry_out_all();
  }
  carried_out_.clear();
  take(a_, api::Jog{.motor = "m", .per_s = 5});
  take(a_, api::Jog{.motor = "m", .renew = true});
  take(a_, api::Resume{});
  EXPECT_TRUE(carried_out_.empty());
}

// However much waits, of its client and of all.
TEST_F(ReceptionTest, WhatEndsMotionIsNotRefusedByAFullQueue) {
  for (int i = 0; i < 5; ++i) take(i < 3 ? a_ : b_, api::Move{});
  take(a_, api::Move{}, 5000);
  EXPECT_EQ(a_->refusals.size(), 1u);
  take(a_, api::Jog{.motor = "m"}, 5000);
  take(a_, api::Pause{}, 5000);
  take(b_, api::Disarm{}, 5000);
  take(b_, api::Hold{}, 5000);
  EXPECT_EQ(a_->refusals.size(), 1u);
  EXPECT_TRUE(b_->refusals.empty());
  EXPECT_THAT(carried_out_, ElementsAre("a jog", "a pause", "b disarm", "b hold"));
}

TEST_F(ReceptionTest, EachIsToldAfterHowManyStopsItArrived) {
  take(a_, api::Move{});
  take(b_, api::Stop{});
  take(a_, api::Home{});
  take(a_, api::Pause{});
  take(b_, api::Arm{});
  EXPECT_THAT(after_, ElementsAre(1u, 2u)) << "a stop is among those that have arrived";
  carry_out_all();
  EXPECT_THAT(carried_out_, ElementsAre("b stop", "a pause", "a move", "b arm", "a home"));
  EXPECT_THAT(after_, ElementsAre(1u, 2u, 0u, 2u, 1u));
}

// Stops are read first; what tells is when the kernel got them.
TEST_F(ReceptionTest, WhatIsReadAfterAStopMayHaveArrivedBeforeIt) {
  const auto take_at = [this](const auto& client, const api::Request& request,
                              const Arrival& arrival) {
    reception_.take({.session = client, .number = ++number_}, request, 1, arrival);
  };
  take_at(a_, api::Stop{}, {.earliest_ns = 1000, .latest_ns = 1000, .stream = 1});
  take_at(b_, api::Stop{}, {.earliest_ns = 2000, .latest_ns = 2000, .stream = 2});
  take_at(b_, api::Move{}, {.earliest_ns = 999, .latest_ns = 999, .stream = 3});
  take_at(b_, api::Move{}, {.earliest_ns = 1500, .latest_ns = 1500, .stream = 3});
  take_at(b_, api::Move{}, {.earliest_ns = 2000, .latest_ns = 2000, .stream = 3});
  carry_out_all();
  EXPECT_THAT(after_, ElementsAre(1u, 2u, 0u, 1u, 2u));
  // It may have arrived before, or not; of the same connection it has not.
  after_.clear();
  take_at(a_, api::Move{}, {.earliest_ns = 500, .latest_ns = 3000, .stream = 3});
  take_at(a_, api::Move{}, {.earliest_ns = 500, .latest_ns = 3000, .stream = 1});
  carry_out_all();
  EXPECT_THAT(after_, ElementsAre(0u, 1u));
}

TEST_F(ReceptionTest, HoweverLongItStoodStillTheStopWins) {
  constexpr std::int64_t kHourNs = 3600'000'000'000;
  const auto move_at = [this](std::int64_t ns) {
    after_.clear();
    reception_.take({.session = b_, .number = ++number_}, api::Move{}, 1,
                    Arrival{.earliest_ns = ns, .latest_ns = ns, .stream = 2});
    carry_out_all();
    return after_.at(0);
  };
  reception_.take({.session = a_, .number = 1}, api::Stop{}, 1,
                  Arrival{.earliest_ns = kHourNs, .latest_ns = kHourNs, .stream = 1});
  EXPECT_EQ(move_at(1), 0u) << "both waited for an hour";
  EXPECT_EQ(move_at(kHourNs + 1), 1u);
  now_us_ += Arrivals::kMostUnreadUs;
  EXPECT_EQ(move_at(1), 0u);
  ++now_us_;
  EXPECT_EQ(move_at(1), 1u) << "the clock was set back";
}

TEST_F(ReceptionTest, AFloodOfStopsMakesNoneOfThemForgotten) {
  const auto at = [](std::int64_t ns) { return Arrival{.earliest_ns = ns, .latest_ns = ns}; };
  const std::int64_t many = 10 * static_cast<std::int64_t>(Arrivals::kMost);
  for (std::int64_t i = 1; i <= many; ++i) {
    reception_.take({.session = b_, .number = i}, api::Stop{}, 1, at(1000 * i));
  }
  after_.clear();
  reception_.take({.session = a_, .number = 1}, api::Move{}, 1, at(999));
  reception_.take({.session = a_, .number = 2}, api::Move{}, 1, at(1000 * many - 1));
  reception_.take({.session = a_, .number = 3}, api::Move{}, 1, at(1000 * many));
  carry_out_all();
  EXPECT_THAT(after_, ElementsAre(0u, many - 1, many));
}

TEST_F(ReceptionTest, ClientsTakeTurns) {
  for (int i = 0; i < 3; ++i) take(a_, api::Move{});
  take(b_, api::Home{});
  take(b_, api::Arm{});
  carry_out_all();
  EXPECT_THAT(carried_out_, ElementsAre("a move", "b home", "a move", "b arm", "a move"));
  EXPECT_EQ(reception_.requests(), 0u);
  EXPECT_EQ(reception_.bytes(), 0u);
}

TEST_F(ReceptionTest, AClientThatSendsTooManyIsRefusedAndOthersAreNot) {
  for (int i = 0; i < 10; ++i) take(a_, api::Move{});
  EXPECT_EQ(a_->refusals.size(), 7u);
  EXPECT_THAT(a_->refusals[0], HasSubstr("3 requests of this client wait already"));
  take(b_, api::Move{});
  EXPECT_TRUE(b_->refusals.empty());
  take(a_, api::Stop{});
  EXPECT_THAT(carried_out_, ElementsAre("a stop"));
  carry_out_all();
  take(a_, api::Move{});
  EXPECT_EQ(a_->refusals.size(), 7u);
}

TEST_F(ReceptionTest, BytesAreBoundedToo) {
  take(a_, api::Move{}, 900);
  take(a_, api::Move{}, 200);
  EXPECT_EQ(a_->refusals.size(), 1u);
  take(b_, api::Move{}, 1001);
  EXPECT_EQ(b_->refusals.size(), 1u);
  EXPECT_EQ(reception_.bytes(), 900u);
  carry_out_all();
  EXPECT_THAT(carried_out_, ElementsAre("a move"));
}

TEST_F(ReceptionTest, ManyClientsTogetherAreBounded) {
  std::vector<std::shared_ptr<Client>> clients;
  for (int i = 0; i < 100; ++i) {
    clients.push_back(std::make_shared<Client>("c" + std::to_string(i)));
    take(clients.back(), api::Move{});
    EXPECT_LE(reception_.requests(), 5u);
  }
  EXPECT_THAT(clients.back()->refusals.at(0), HasSubstr("accepts no more now"));
}

TEST_F(ReceptionTest, WhoMayNotCommandIsRefusedEvenAStop) {
  const auto guest = std::make_shared<Client>("guest", false);
  take(guest, api::Move{});
  take(guest, api::Stop{});
  EXPECT_EQ(guest->refusals.size(), 2u);
  EXPECT_TRUE(reception_.idle());
  EXPECT_TRUE(carried_out_.empty());
}

}  // namespace
}  // namespace bushd::daemon
