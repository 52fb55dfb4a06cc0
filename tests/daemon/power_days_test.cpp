// Random hours of a whole lab whose PC and MCUs lose power at any moment: no motor at rest is ever
// called known or restored and stands elsewhere. tests/state/power_cut_test.cpp has the same for
// the store alone, with many more cuts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

class Days {
 public:
  explicit Days(std::uint64_t seed) : seed_(seed), random_(seed), lab_(hall(2, 2)) {
    lab_.keep_positions();
    lab_.connect();
  }

  void live(int events) {
    for (int i = 0; i < events && !testing::Test::HasFailure(); ++i) {
      happen();
      run(0.001 * static_cast<double>(1 + any(400)));
    }
  }

  int trusted = 0;
  int restored = 0;
  int uncertain = 0;

 private:
  std::uint64_t any(std::uint64_t below) { return random_() % below; }

  void run(double seconds) {
    lab_.run_until([this] { return !lab_.disk().has_power(); }, seconds);
    if (!lab_.disk().has_power()) lab_.cut_pc_power();
    look();
  }

  void happen() {
    const std::string motor = "m0" + std::to_string(1 + any(4));
    switch (any(12)) {
      case 0:
        lab_.bus(0).reboot(any(2), static_cast<std::int64_t>(any(3)) * 300'000'000);
        break;
      case 1:
        if (any(2) == 0) lab_.bus(0).reboot(any(2));
        lab_.cut_pc_power();
        break;
      case 2:
        lab_.disk().lose_power_after(UINT64_MAX);
        if (any(3) == 0) lab_.restart_daemon();
        break;
      case 3:
        lab_.disk().lose_power_after(1 + any(12));
        break;
      case 4:
        lab_.disk_us = static_cast<std::int64_t>(100 + any(50'000));
        break;
      case 5:
        lab_.send(Ask::kStop, {motor});
        break;
      case 6:
        say_where_they_stand();
        break;
      default:
        lab_.send(Ask::kMoveBy, {motor}, {static_cast<std::int64_t>(any(1200)) - 600});
        break;
    }
  }

  void say_where_they_stand() {
    for (const std::string motor : {"m01", "m02", "m03", "m04"}) {
      if (still(motor)) lab_.send(Ask::kSetPosition, {motor}, {lab_.shaft_steps(motor)});
    }
  }

  // The motor has not moved since somebody looked last, and does not intend to.
  bool still(const std::string& motor) const {
    const auto found = seen_.find(motor);
    return found != seen_.end() && found->second == lab_.shaft_steps(motor) &&
           lab_.has_state(motor < "m03" ? "hall:1" : "hall:2") && !lab_.motor(motor).moving;
  }

  void look() {
    for (const std::string motor : {"m01", "m02", "m03", "m04"}) {
      const bool stands = still(motor);
      seen_[motor] = lab_.shaft_steps(motor);
      if (!stands) continue;
      const api::MotorState state = lab_.motor(motor);
      uncertain += state.trust == api::Trust::kUncertain;
      if (state.trust != api::Trust::kKnown && state.trust != api::Trust::kRestored) continue;
      ++trusted;
      restored += state.trust == api::Trust::kRestored;
      ASSERT_EQ(state.position_steps, lab_.shaft_steps(motor))
          << motor << " is " << word(state.trust) << " at " << lab_.now_us()
          << " us, BUSHD_SEED=" << seed_;
    }
  }

  std::uint64_t seed_;
  std::mt19937_64 random_;
  Lab lab_;
  std::map<std::string, std::int64_t> seen_;
};

TEST(PowerDays, NoPositionIsTrustedAndWrong) {
  const char* const given = std::getenv("BUSHD_SEED");
  const std::uint64_t first = given != nullptr ? std::strtoull(given, nullptr, 10) : 1;
  const std::uint64_t count = given != nullptr ? 1 : 8;
  int trusted = 0;
  int restored = 0;
  int uncertain = 0;
  for (std::uint64_t seed = first; seed < first + count && !HasFailure(); ++seed) {
    Days days(seed);
    days.live(400);
    trusted += days.trusted;
    restored += days.restored;
    uncertain += days.uncertain;
  }
  std::printf("looked at motors at rest: trusted %d, of them restored %d; uncertain %d\n", trusted,
              restored, uncertain);
  EXPECT_GT(restored, given != nullptr ? -1 : 100);
  EXPECT_GT(uncertain, given != nullptr ? -1 : 100);
}

}  // namespace
}  // namespace bushd::test
