// A flood of the largest dry runs: a stop is dealt with after at most one slice of their work.
// Work is counted, not timed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/fronts/reception.h"
#include "daemon/lab.h"

namespace bushd::test::slices_test {
namespace {

using daemon::DryRuns;
using testing::HasSubstr;

constexpr int kBuses = 8;
constexpr int kMotorsOfBus = 256;
constexpr int kMotors = kBuses * kMotorsOfBus;

// As hall() names them.
std::string name(int motor) {
  return (motor < 9 ? "m0" : "m") + std::to_string(motor + 1);
}

// Buses of 16 MCUs with 16 motors each.
std::string large_hall(int buses) {
  std::string toml = "[[group]]\nname = \"axes\"\ntable = \"bushd2-constant\"\n";
  for (int b = 0; b < buses; ++b) {
    toml += "[[bus]]\nname = \"hall" + std::to_string(b) + "\"\nport = \"/dev/null" +
            std::to_string(b) + "\"\nbaud = 4000000\ntick_us = 10240\nformat = \"coarse\"\n";
  }
  for (int m = 0; m < 16 * buses; ++m) {
    const std::string bus = "hall" + std::to_string(m / 16);
    const std::string address = std::to_string(m % 16 + 1);
    toml += "[[mcu]]\nbus = \"" + bus + "\"\naddress = " + address + "\n";
    for (int output = 0; output < 16; ++output) {
      toml += "[[motor]]\nname = \"" + name(16 * m + output) + "\"\nmcu = \"" + bus + ":" +
              address + "\"\noutput = " + std::to_string(output) + "\ngroup = \"axes\"\n";
    }
  }
  return toml;
}

// Which answers came, in their order.
class Client final : public api::Session {
 public:
  Client(std::string id, std::vector<std::string>& log)
      : Session(api::Transport::kSocket, std::move(id), true), log_(log) {}
  void answer(std::int64_t number, const api::Reply& reply) override {
    const auto* refused = std::get_if<api::Refused>(&reply);
    const auto* completed = std::get_if<api::Completed>(&reply);
    log_.push_back(client_id() + " " + std::to_string(number) +
                   (refused != nullptr     ? " refused: " + refused->reason
                    : completed != nullptr ? " completed: " + completed->reason
                                           : " accepted"));
    if (completed == nullptr) return;
    if (const auto* plan = std::get_if<api::MovePlan>(&completed->detail)) plans.push_back(*plan);
  }
  std::vector<api::MovePlan> plans;

 private:
  std::vector<std::string>& log_;
};

class Slices : public testing::Test {
 protected:
  void open(const std::string& toml, int motors) {
    lab_ = std::make_unique<Lab>(toml);
    lab_->read_period_us = 400;  // until 128 MCUs have connected, two million bytes arrive
    motors_ = motors;
    lab_->connect();
    reception_.emplace(lab_->core().counted_stops(),
                       [this](const api::Asker& asker, const api::Request& request) {
                         lab_->core().request(lab_->now_us(), asker, request);
                       });
  }
  std::shared_ptr<Client> client(const std::string& id) {
    return std::make_shared<Client>(id, log_);
  }
  api::Move dry_run_of_all(std::int64_t steps) const {
    api::Move move{.dry_run = true};
    for (int m = 0; m < motors_; ++m) move.motors.push_back({name(m), steps});
    return move;
  }
  void send(const std::shared_ptr<Client>& from, const api::Request& request) {
    reception_->take({.session = from, .number = ++number_}, request, 1);
  }
  // What the event loop does between two looks at what has arrived.
  void one_round() {
    lab_->core().keep_up(lab_->now_us());
    if (!reception_->idle() && !lab_->core().begins_moves()) reception_->carry_out_next();
    lab_->core().work();
  }
  bool answered(const std::string& text) const {
    return testing::Value(log_, testing::Contains(HasSubstr(text)));
  }

  auto answers_like(const std::string& text) const {
    return std::ranges::count_if(
        log_, [&](const std::string& answer) { return answer.find(text) != std::string::npos; });
  }

  std::unique_ptr<Lab> lab_;
  int motors_ = 0;
  std::vector<std::string> log_;
  std::int64_t number_ = 0;
  std::optional<daemon::Reception> reception_;  // of an open lab
};

TEST_F(Slices, AStopUnderAFloodOfDryRunsWaitsForOneSliceAtMost) {
  open(large_hall(kBuses), kMotors);
  for (int i = 0; i < 100; ++i) {
    send(client("flood" + std::to_string(i)), dry_run_of_all(20'000));
  }
  const auto operator_client = client("operator");
  std::uint64_t before = lab_->core().units_of_work();
  std::uint64_t most = 0;
  for (int round = 0; round < 1200; ++round) {
    one_round();
    const std::uint64_t now = lab_->core().units_of_work();
    most = std::max(most, now - before);
    before = now;
    if (round % 200 != 199) continue;
    // It has arrived while this round was at work; the next look at the sources takes it.
    const std::size_t answers = log_.size();
    send(operator_client, round % 400 == 199 ? api::Request(api::Stop{}) : api::EmergencyStop{});
    EXPECT_EQ(lab_->core().units_of_work(), now) << "no work comes before it";
    ASSERT_GT(log_.size(), answers);
    EXPECT_THAT(log_[answers], HasSubstr("operator"));
    EXPECT_THAT(log_[answers], HasSubstr("accepted"));
  }
  EXPECT_LE(most, DryRuns::kUnitsPerSlice);
  EXPECT_GT(answers_like("accepted"), answers_like("completed") + 10) << "the flood is there still";
}

TEST_F(Slices, AMoveOfAllMotorsIsBegunInSlicesThatAStopComesBetween) {
  open(large_hall(1), kMotorsOfBus);
  api::Move move = dry_run_of_all(2'000);
  move.dry_run = false;
  const auto mover = client("mover");
  send(mover, move);
  send(client("other"), api::Enable{});
  std::uint64_t before = lab_->core().units_of_work();
  for (int round = 0; round < 4; ++round) {
    one_round();
    const std::uint64_t now = lab_->core().units_of_work();
    EXPECT_LE(now - before, daemon::Moves::kBeginsPerSlice);
    EXPECT_GT(now, before);
    before = now;
  }
  EXPECT_TRUE(answered("mover 1 accepted"));
  EXPECT_EQ(answers_like("other"), 0) << "it waits until all have begun";
  send(client("operator"), api::Stop{});
  EXPECT_EQ(lab_->core().units_of_work(), before) << "no work comes before it";
  EXPECT_THAT(log_.back(), HasSubstr("operator 3 accepted"));
  ASSERT_TRUE(lab_->run_until([&] { return answered("mover 1 completed: "); }, 10));
  EXPECT_THAT(log_, testing::Contains(HasSubstr("stopped")));
  EXPECT_EQ(lab_->shaft_steps(name(kMotorsOfBus - 1)), 0) << "it has not begun";
  while (!reception_->idle() || lab_->core().begins_moves()) one_round();
  EXPECT_TRUE(answered("other 2 "));
}

TEST_F(Slices, AMoveBegunInSlicesStartsInOneTickAndArrives) {
  open(large_hall(1), kMotorsOfBus);
  api::Move move = dry_run_of_all(50);
  move.dry_run = false;
  send(client("mover"), move);
  while (!reception_->idle() || lab_->core().begins_moves()) {
    one_round();
    lab_->run_for(0.002);
  }
  ASSERT_TRUE(lab_->run_until([&] { return answered("mover 1 completed: "); }, 10));
  EXPECT_THAT(log_.back(), HasSubstr("stands at its target"));
  EXPECT_EQ(lab_->shaft_steps(name(0)), 50);
  EXPECT_EQ(lab_->shaft_steps(name(kMotorsOfBus - 1)), 50);
}

TEST_F(Slices, AnEmergencyStopLetsNoOtherMotorBegin) {
  open(large_hall(1), kMotorsOfBus);
  api::Move move = dry_run_of_all(2'000);
  move.dry_run = false;
  send(client("mover"), move);
  for (int round = 0; round < 3; ++round) one_round();
  send(client("operator"), api::EmergencyStop{});
  while (!reception_->idle() || lab_->core().begins_moves()) one_round();
  ASSERT_TRUE(lab_->run_until([&] { return answered("mover 1 completed: "); }, 10));
  EXPECT_EQ(lab_->shaft_steps(name(kMotorsOfBus - 1)), 0);
}

TEST_F(Slices, ADryRunIsOfTheStateAtItsAcceptance) {
  open(hall(2, 16), 32);
  const auto first = client("first");
  send(first, dry_run_of_all(20'000));
  reception_->carry_out_next();
  // Meanwhile a motor moves: that is no concern of it.
  const auto other = client("other");
  send(other, api::Move{.motors = {{name(0), 500}}});
  reception_->carry_out_next();
  lab_->run_until([&] { return !first->plans.empty(); }, 10);
  ASSERT_EQ(first->plans.size(), 1u);
  const api::MovePlan& plan = first->plans[0];
  EXPECT_EQ(plan.motors.size(), 32u);
  EXPECT_EQ(plan.motors[0].steps, 20'000);
  ASSERT_TRUE(plan.traffic);
  EXPECT_GT(plan.traffic->frames, 20);
  EXPECT_TRUE(answered("planned from the state at its acceptance"));
  lab_->run_until([&] { return answered("other 2 completed"); }, 10);
  EXPECT_EQ(lab_->shaft_steps(name(0)), 500);
}

TEST_F(Slices, DryRunsAreBoundedPerClientAndInAll) {
  open(hall(2, 16), 32);
  const auto one = client("one");
  for (int i = 0; i < 3; ++i) send(one, dry_run_of_all(100));
  while (!reception_->idle()) reception_->carry_out_next();
  EXPECT_TRUE(answered("one 3 refused: 2 dry runs of this client wait already"));
  for (std::size_t i = 0; i < DryRuns::kMax; ++i) {
    send(client("c" + std::to_string(i)), dry_run_of_all(100));
  }
  while (!reception_->idle()) reception_->carry_out_next();
  EXPECT_TRUE(answered("dry runs wait already; try again in a moment"));
  lab_->run_until([&] { return answered("one 2 completed"); }, 10);
  send(one, dry_run_of_all(100));
  reception_->carry_out_next();
  EXPECT_THAT(log_.back(), HasSubstr("one " + std::to_string(number_) + " accepted"));
}

}  // namespace
}  // namespace bushd::test::slices_test
