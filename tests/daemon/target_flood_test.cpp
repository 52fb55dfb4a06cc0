// More requests than the line can carry out at once: the newest target of a motor counts, each
// older one has its result, and neither the link nor another motor suffers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <string>
#include <tuple>

#include "daemon/lab.h"

namespace bushd::test::target_flood_test {
namespace {

using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kMotors = 32;

class Client final : public api::Session {
 public:
  Client() : Session(api::Transport::kLcm, "flood", true) {}
  void answer(std::int64_t number, const api::Reply& reply) override {
    if (const auto* refused = std::get_if<api::Refused>(&reply))
      refusals.push_back(refused->reason);
    const auto* completed = std::get_if<api::Completed>(&reply);
    if (completed == nullptr) return;
    ++results[number];
    const bool planned = completed->outcome == api::Outcome::kReached ||
                         completed->outcome == api::Outcome::kStopped ||
                         completed->outcome == api::Outcome::kDone;
    if (!planned) failures.push_back(completed->reason);
  }
  std::map<std::int64_t, int> results;  // how many, by number of the request
  std::vector<std::string> refusals;
  std::vector<std::string> failures;
};

// 32 motors on two MCUs of one bus of 500 kbaud, and a client that does not wait.
class Flood : public testing::TestWithParam<std::tuple<const char*, int>> {
 protected:
  void SetUp() override {
    lab_ = std::make_unique<Lab>(hall(2, kMotors / 2, std::get<0>(GetParam())));
    lab_->connect();
  }
  static std::string name(int motor) {
    return (motor < 9 ? "m0" : "m") + std::to_string(motor + 1);
  }

  void send(const api::Request& request) {
    lab_->core().request(lab_->now_us(), {client_, ++number_}, request);
  }
  void move(int motor, std::int64_t target) {
    target_[motor] = target;
    send(api::Move{.kind = api::Move::Kind::kAbsolute, .motors = {{name(motor), target}}});
  }
  int random(int below) { return static_cast<int>(random_() % static_cast<unsigned>(below)); }
  // So many requests a second for three seconds.
  template <class Next>
  void flood(Next next) {
    const int rate = std::get<1>(GetParam());
    for (int i = 0; i < 3 * rate; ++i) {
      next();
      lab_->run_for(1.0 / rate);
    }
  }
  void expect_nothing_lost() {
    const auto answered = [this] { return client_->results.size() + client_->refusals.size(); };
    EXPECT_TRUE(
        lab_->run_until([&] { return answered() == static_cast<std::size_t>(number_); }, 60))
        << answered() << " of " << number_ << " requests are answered";
    EXPECT_THAT(client_->refusals, Each(HasSubstr("try again in a moment")));
    EXPECT_THAT(client_->failures, IsEmpty());
    EXPECT_THAT(lab_->errors(), IsEmpty());
    for (const auto& [number, count] : client_->results) EXPECT_EQ(count, 1) << number;
    lab_->run_for(0.5);
  }
  void expect_all_at_target() {
    for (const auto& [motor, target] : target_) {
      EXPECT_EQ(lab_->shaft_steps(name(motor)), target) << name(motor);
      EXPECT_EQ(lab_->motor(name(motor)).position_steps, target) << name(motor);
    }
  }

  std::unique_ptr<Lab> lab_;
  std::shared_ptr<Client> client_ = std::make_shared<Client>();
  std::mt19937 random_{7};
  std::int64_t number_ = 0;
  std::map<int, std::int64_t> target_;  // the newest
};

// Sanitizers see all in the least and the most.
#ifdef __SANITIZE_ADDRESS__
const auto kRates = testing::Values(60, 3000);
#else
const auto kRates = testing::Values(60, 300, 1000, 3000);
#endif

INSTANTIATE_TEST_SUITE_P(Rates, Flood,
                         testing::Combine(testing::Values("fine", "coarse", "fine_ticks",
                                                          "coarse_ticks", "fine_table"),
                                          kRates),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param)) + "_" +
                                  std::to_string(std::get<1>(test.param));
                         });

TEST_P(Flood, OfTargetsIsCoalesced) {
  flood([this] { move(random(kMotors), random(4001) - 2000); });
  expect_nothing_lost();
  EXPECT_THAT(client_->refusals, IsEmpty());
  expect_all_at_target();
}

TEST_P(Flood, OfSmallStepsBackAndForthIsCoalesced) {
  flood([this] { move(random(kMotors), random(41) - 20); });
  expect_nothing_lost();
  expect_all_at_target();
}

TEST_P(Flood, OfTargetsForOneMotorLeavesTheOthersAlone) {
  for (int motor = 1; motor < kMotors; ++motor) move(motor, 4000);
  flood([this] { move(0, random(4001) - 2000); });
  expect_nothing_lost();
  expect_all_at_target();
}

TEST_P(Flood, OfStopsAndTargetsEndsAtRestAsCounted) {
  flood([this] {
    if (random(2) == 0) {
      send(api::Stop{.motors = {name(random(kMotors))}});
    } else {
      move(random(kMotors), random(4001) - 2000);
    }
  });
  expect_nothing_lost();
  for (int motor = 0; motor < kMotors; ++motor) {
    EXPECT_EQ(lab_->shaft_steps(name(motor)), lab_->motor(name(motor)).position_steps);
  }
}

TEST_P(Flood, OfEnablesDisturbsNoMove) {
  for (int motor = 0; motor < kMotors; ++motor) move(motor, 3000);
  flood([this] { send(api::Enable{.motors = {name(random(kMotors))}}); });
  expect_nothing_lost();
  expect_all_at_target();
}

}  // namespace
}  // namespace bushd::test::target_flood_test
