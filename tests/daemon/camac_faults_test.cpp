// Programs of BUSHD-2 and BUSHD-1 with faults in between, as chance has it: whatever happens, the
// memory is there, each start ends in one request or the daemon has ended, motors make no step that
// nobody has asked for, and their positions are those of their shafts. With BUSHD_CAMAC_SEEDS as
// many seeds that nobody has tried before; BUSHD_CAMAC_SEED is one that has shown something.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "daemon/camac_lab.h"

namespace bushd::test::camac_faults_test {
namespace {

constexpr std::uint32_t kEnabled = 0x60;  // of BUSHD-2: fault and end of motion
constexpr std::uint32_t kLeft = 0x80;
constexpr int kLongerRamp = 12;
constexpr std::uint32_t kReactor = 0xC0 | 0x17;  // of BUSHD-1: automatic, synchronous, enabled

std::vector<std::uint32_t> seeds() {
  if (const char* one = std::getenv("BUSHD_CAMAC_SEED")) {
    return {static_cast<std::uint32_t>(std::stoul(one))};
  }
  const char* fresh = std::getenv("BUSHD_CAMAC_SEEDS");
  if (fresh == nullptr) return {1, 2, 3};
  std::vector<std::uint32_t> made(std::stoul(fresh));
  std::random_device device;
  for (std::uint32_t& seed : made) seed = device();
  return made;
}

enum class Fault { kNone, kUnplugged, kReset, kRestart, kLimit, kStop, kKinds };

class Chaos {
 public:
  explicit Chaos(std::uint32_t seed) : random_(seed) {
    lab_.keep_positions();
    settle();
    lab_.shutter().left_limit = -1'000'000;
    lab_.shutter().tell();
  }

  void round() {
    const int steps = below(2) == 0 ? 1 + below(60) : 100 + below(600);
    // What a limit has stopped goes the other way.
    const bool left = lab_.shaft_steps("m01") > 0 || limited_;
    load(steps);
    lab_.naf(kStation, 0, 10);
    const std::int64_t from = lab_.shaft_steps("m01");
    const std::size_t lams = lab_.lams().size();
    lab_.naf(kStation, 2, 16, kEnabled | (left ? kLeft : 0U));
    lab_.naf(kStation, 0, 26);
    const auto fault = static_cast<Fault>(below(static_cast<int>(Fault::kKinds)));
    limited_ = limited_ || (fault == Fault::kLimit && !left);
    SCOPED_TRACE("fault " + std::to_string(static_cast<int>(fault)));
    lab_.run_for(below(800) * 1e-3);
    strike(fault);
    const auto raised = [&] { return lab_.lams().size() > lams; };
    if (fault != Fault::kRestart) {
      EXPECT_TRUE(lab_.run_until(raised, 60)) << "no LAM is lost";
    }
    settle();
    lab_.run_for(1);
    EXPECT_LE(lab_.lams().size(), lams + 1) << "told once";
    const std::int64_t moved = (lab_.shaft_steps("m01") - from) * (left ? -1 : 1);
    if (left && moved > 5) limited_ = false;
    EXPECT_GE(moved, 0);
    // An MCU that ramps down a stream takes its speed from the last displacement
    // (docs/protocol.md).
    EXPECT_LE(moved, steps + (fault == Fault::kLimit ? kLongerRamp : 0)) << "none is made twice";
    if (fault == Fault::kNone) {
      EXPECT_EQ(moved, steps);
    }
    EXPECT_EQ(memory(), expected_);
    know_positions();
    const std::int64_t stands = lab_.shaft_steps("m01");
    lab_.run_for(1);
    EXPECT_EQ(lab_.shaft_steps("m01"), stands) << "nothing moves by itself";
  }

 private:
  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }

  void load(int steps) {
    expected_.assign(240, 0);
    expected_[0] = steps % 256;
    expected_[1] = steps / 256;
    int code = 200 + below(50);
    for (std::size_t i = 2; i < expected_.size(); ++i) {
      expected_[i] = code;
      code = std::max(code - below(3), 12);
    }
    lab_.naf(kStation, 1, 16, 0);
    camac::Block words{.mode = camac::BlockMode::kSingle};
    for (const int byte : expected_) {
      words.cycles.push_back({kStation, 0, 16, static_cast<std::uint32_t>(byte)});
    }
    words.count = static_cast<std::uint32_t>(words.cycles.size());
    lab_.block(words);
  }
  std::vector<int> memory() {
    lab_.naf(kStation, 1, 16, 0);
    camac::Block words{.mode = camac::BlockMode::kSingle};
    words.cycles.assign(expected_.size(), {kStation, 0, 0, 0});
    words.count = static_cast<std::uint32_t>(words.cycles.size());
    const Answer answer = lab_.block(words);
    std::vector<int> read;
    if (!answer.camac) return read;
    for (const camac::Response& response : answer.camac->block.responses) {
      read.push_back(static_cast<int>(response.data));
    }
    return read;
  }

  void strike(Fault fault) {
    switch (fault) {
      case Fault::kUnplugged:
        lab_.unplug(0);
        lab_.run_for(0.05 + below(1500) * 1e-3);
        return lab_.plug(0);
      case Fault::kReset:
        return lab_.bus(0).reboot(0, 50'000'000);
      case Fault::kRestart:
        return lab_.restart_daemon();
      case Fault::kLimit:
        lab_.shutter().others = 1U << 0;
        lab_.shutter().tell();
        lab_.run_for(0.1);
        lab_.shutter().others = 0;
        return lab_.shutter().tell();
      case Fault::kStop:
        lab_.send(Ask::kStop, {});
        return;
      default:
        return;
    }
  }

  // All MCUs are there, without faults, and nothing moves.
  void settle() {
    const auto online = [&] {
      return lab_.has_state("hall:1") && lab_.state_of("hall:1").state != api::McuState::kOffline &&
             !lab_.motor("m01").moving;
    };
    EXPECT_TRUE(lab_.run_until(online, 60));
    lab_.ask(Ask::kClearFaults, {});
    lab_.ask(Ask::kEnable, {});
    EXPECT_TRUE(lab_.run_until([&] { return lab_.all_ready(); }, 60));
  }
  // An MCU that was reset counts anew.
  void know_positions() {
    const api::MotorState motor = lab_.motor("m01");
    if (motor.trust == api::Trust::kKnown) {
      EXPECT_EQ(motor.position_steps, lab_.shaft_steps("m01"));
      return;
    }
    lab_.ask(Ask::kSetPosition, {"m01", "m03"}, {lab_.shaft_steps("m01"), lab_.shaft_steps("m03")});
  }

  std::mt19937 random_;
  ShutterLab lab_{"inputs = { positive = 3, negative = 4, step = 5 }\n", "limit = \"positive\"\n"};
  std::vector<int> expected_;
  bool limited_ = false;
};

TEST(CamacFaults, ProgramsOfBushd2AreAccountedFor) {
  for (const std::uint32_t seed : seeds()) {
    SCOPED_TRACE("BUSHD_CAMAC_SEED=" + std::to_string(seed));
    Chaos chaos(seed);
    for (int round = 0; round < 25; ++round) {
      SCOPED_TRACE("round " + std::to_string(round));
      chaos.round();
      if (testing::Test::HasFailure()) return;
    }
  }
}

// A shutter that follows reactor starts opens once for each of them, or a request says that it
// does not any more.
void follow_reactor(std::uint32_t seed) {
  SCOPED_TRACE("BUSHD_CAMAC_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  const std::vector<int> codes{400, 250, 120, 60, 60, 120, 250, 400};
  ShutterLab lab;
  lab.keep_positions();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  lab.load_codes(codes, 8000);
  for (int round = 0; round < 25; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    lab.naf(kShutterStation, 0, 10);
    lab.permit(kReactor);
    lab.run_for(0.3);
    const std::size_t before = lab.shutter().steps.size();
    lab.reactor_starts();
    lab.run_for(static_cast<double>(random() % 700) * 1e-3);
    const auto fault = random() % 4;
    if (fault == 1) lab.unplug(0);
    if (fault == 2) lab.bus(0).reboot(0, 50'000'000);
    if (fault == 3) lab.restart_daemon();
    lab.run_for(2);
    if (fault == 1) lab.plug(0);
    ASSERT_TRUE(lab.run_until([&] {
      return lab.has_state("hall:1") && lab.state_of("hall:1").state != api::McuState::kOffline;
    }));
    lab.run_for(1);
    if (fault == 1 || fault == 2) {
      EXPECT_NE(lab.requests() & 0x10U, 0U) << "no request is lost";
    }
    EXPECT_LE(lab.shutter().steps.size(), before + 2 * codes.size());
    if (fault == 0) {
      EXPECT_EQ(lab.shutter().steps.size(), before + 2 * codes.size());
    }
    lab.naf(kShutterStation, 0, 24);
    ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }));
    const std::size_t stands = lab.shutter().steps.size();
    lab.reactor_starts();
    lab.run_for(1);
    EXPECT_EQ(lab.shutter().steps.size(), stands) << "nothing moves by itself";
    // Back to its left limit.
    lab.ask(Ask::kClearFaults, {});
    lab.ask(Ask::kEnable, {});
    ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
    lab.ask(Ask::kSetPosition, {"m03"}, {lab.shutter().position});
    lab.ask(Ask::kMoveTo, {"m03"}, {3});  // off the limit that it has met
    lab.ask(Ask::kMoveTo, {"m03"}, {0});
    ASSERT_EQ(lab.shutter().position, 0);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(CamacFaults, TheShutterIsAccountedFor) {
  for (const std::uint32_t seed : seeds()) {
    follow_reactor(seed);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace bushd::test::camac_faults_test
