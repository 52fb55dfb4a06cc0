// Random days of a lab whose motors are given other names, while its PC and MCUs lose power at any
// moment: no motor is ever trusted under a name that was not the last one to use its output, and
// none at rest is trusted and stands elsewhere.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

constexpr int kMcus = 2;
constexpr int kOutputs = 2;  // of each
constexpr std::size_t kMotors = kMcus * kOutputs;

class RenamingDays {
 public:
  explicit RenamingDays(std::uint64_t seed) : random_(seed), lab_(named()) {
    lab_.keep_positions();
    lab_.connect();
    for (std::size_t i = 0; i < kMotors; ++i) used_by_[i] = names_[i];
  }

  void live(int events) {
    for (int i = 0; i < events && !testing::Test::HasFailure(); ++i) {
      happen();
      run(0.001 * static_cast<double>(1 + any(600)));
    }
  }

  int trusted = 0;
  int named_back = 0;  // of these, motors that had another name in between
  int uncertain = 0;

 private:
  // What makes an output the name's, once it is accepted or done.
  struct Use {
    std::int64_t number;
    std::string phase;  // of the answer
    std::size_t output;
    std::string name;
  };

  std::uint64_t any(std::uint64_t below) { return random_() % below; }

  // Six names for four outputs.
  std::string named() const {
    std::string toml = hall(kMcus, kOutputs);
    for (std::size_t i = kMotors; i-- > 0;) {
      const std::string was = "name = \"m0" + std::to_string(i + 1) + "\"";
      toml.replace(toml.find(was), was.size(), "name = \"" + names_[i] + "\"");
    }
    return toml;
  }

  void happen() {
    const std::size_t output = any(kMotors);
    switch (any(16)) {
      case 0:
        return rename([this] { std::swap(names_[any(kMotors)], names_[any(names_.size())]); });
      case 1:
        return rename([this] { names_ = kNames; });
      case 2:
        lab_.bus(0).reboot(any(kMcus), static_cast<std::int64_t>(any(3)) * 300'000'000);
        return;
      case 3:
        return lab_.cut_pc_power();
      case 4:
        return lab_.disk().lose_power_after(1 + any(12));
      case 5:
      case 6:
      case 7:
        if (!stands(output) || lab_.motor(names_[output]).position_steps != shaft(output)) return;
        return ask(output, "result", lab_.send(api::Confirm{{names_[output]}}));
      case 8:
        if (!stands(output)) return;
        return ask(output, "result",
                   lab_.send(Ask::kSetPosition, {names_[output]}, {shaft(output)}));
      default:
        const auto steps = static_cast<std::int64_t>(any(1200)) - 600;
        return ask(output, "accepted", lab_.send(Ask::kMoveBy, {names_[output]}, {steps}));
    }
  }

  void rename(const std::function<void()>& change) {
    follow();
    uses_.clear();
    lab_.disk().lose_power_after(UINT64_MAX);
    change();
    lab_.use_configuration(named());
  }

  void ask(std::size_t output, const std::string& phase, std::int64_t number) {
    uses_.push_back({number, phase, output, names_[output]});
  }

  void follow() {
    std::erase_if(uses_, [this](const Use& use) {
      for (const Answer& answer : lab_.replies(use.number)) {
        const bool done = answer.phase == Answer::kResult && answer.result == "done";
        if (use.phase == "accepted" ? answer.phase != Answer::kAccepted : !done) continue;
        used_by_[use.output] = use.name;
        return true;
      }
      return false;
    });
  }

  void run(double seconds) {
    lab_.run_until([this] { return !lab_.disk().has_power(); }, seconds);
    follow();
    if (!lab_.disk().has_power()) lab_.cut_pc_power();
    look();
  }

  std::int64_t shaft(std::size_t output) const { return lab_.shaft_steps(names_[output]); }

  // It has not moved since somebody looked last, and does not intend to.
  bool stands(std::size_t output) const {
    return seen_[output] == shaft(output) &&
           lab_.has_state("hall:" + std::to_string(1 + output / kOutputs)) &&
           !lab_.motor(names_[output]).moving;
  }

  void look() {
    for (std::size_t output = 0; output < kMotors; ++output) {
      const bool still = stands(output);
      seen_[output] = shaft(output);
      if (!still) continue;
      const std::string& name = names_[output];
      const api::MotorState state = lab_.motor(name);
      uncertain += state.trust == api::Trust::kUncertain;
      if (state.trust != api::Trust::kKnown && state.trust != api::Trust::kRestored) continue;
      ++trusted;
      named_back += trusted_name_[output] != name;
      trusted_name_[output] = name;
      ASSERT_EQ(name, used_by_[output]) << "output " << output << " is " << word(state.trust);
      ASSERT_EQ(state.position_steps, shaft(output)) << name << " is " << word(state.trust);
    }
  }

  const std::array<std::string, 6> kNames{"a", "b", "c", "d", "e", "f"};
  std::array<std::string, 6> names_ = kNames;  // of the outputs; those behind are not in use
  std::mt19937_64 random_;
  Lab lab_;
  std::vector<Use> uses_;
  std::array<std::string, kMotors> used_by_;
  std::array<std::string, kMotors> trusted_name_;
  std::array<std::int64_t, kMotors> seen_{};
};

TEST(RenamingDays, NoNameIsTrustedWithWhatAnotherHasUsed) {
  const std::uint64_t fresh = std::random_device{}();
  int trusted = 0;
  int named_back = 0;
  int uncertain = 0;
  for (const std::uint64_t seed : {std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{3}, fresh}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RenamingDays days(seed);
    days.live(400);
    trusted += days.trusted;
    named_back += days.named_back;
    uncertain += days.uncertain;
    if (HasFailure()) return;
  }
  std::printf("motors at rest: trusted %d times, %d times under a new name, uncertain %d times\n",
              trusted, named_back, uncertain);
  EXPECT_GT(trusted, 100);
  EXPECT_GT(named_back, 20);
  EXPECT_GT(uncertain, 100);
}

}  // namespace
}  // namespace bushd::test
