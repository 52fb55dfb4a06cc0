// In which order requests reach the core, and how many may wait.
#include "daemon/reception.h"

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
  std::int64_t number_ = 0;
  Reception reception_{
      [this](const api::Asker& asker, const api::Request& request) {
        carried_out_.push_back(asker.session->client_id() + " " +
                               std::string(api::name_of(request)));
      },
      {.requests_per_client = 3, .bytes_per_client = 1000, .requests = 5, .bytes = 2000}};
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
