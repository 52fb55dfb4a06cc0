// A keypad in the lab: bytes in, jogs of a motor, and what it shows.
#include "daemon/fronts/keypad.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "daemon/lab.h"
#include "keypad_bytes.h"

namespace bushd::test {
namespace {

class KeypadLab : public Lab {
 public:
  explicit KeypadLab(const std::string& keypad_keys, const std::string& motor_keys = "")
      : Lab(hall(1, 1) + motor_keys),
        config_(parsed(hall(1, 1) + motor_keys +
                       "[[keypad]]\nport = \"/dev/keypad\"\nmotor = \"m01\"\n" + keypad_keys)),
        keypad(config_.keypads.at(0), "m01",
               [this](const api::Asker& asker, const api::Request& request) {
                 ++asked;
                 core().request(now_us(), asker, request);
               }) {
    connect();
    keypad.port_opened();
    EXPECT_EQ(keypad.take_display(), "0300\n");
  }

  // Presses a key once, and returns what it shows.
  std::string press(std::uint8_t key) {
    keypad.receive(now_us(), std::vector<std::uint8_t>{key});
    return keypad.take_display();
  }
  // Keeps it pressed: its byte is repeated ten times a second.
  void hold(std::uint8_t key, double seconds) {
    for (double t = 0; t < seconds; t += 0.1) {
      press(key);
      run_for(0.1);
    }
  }
  // As the event loop does.
  void live(double seconds) {
    const std::int64_t until_us = now_us() + static_cast<std::int64_t>(seconds * 1e6);
    while (now_us() < until_us) {
      keypad.step(now_us());
      run_for(std::min(20'000, static_cast<int>(until_us - now_us())) * 1e-6);
    }
  }
  bool rests() { return motor("m01").activity == api::Activity::kResting; }
  // Steps a second, over half a second.
  double speed() {
    const std::int64_t before = shaft_steps("m01");
    live(0.5);
    return static_cast<double>(shaft_steps("m01") - before) / 0.5;
  }

 private:
  static config::Config parsed(const std::string& toml) {
    auto config = config::parse(toml, "keypad.toml");
    if (!config) throw std::runtime_error(config.error().text());
    return std::move(*config);
  }
  const config::Config config_;

 public:
  daemon::Keypad keypad;
  int asked = 0;
};

// A delay is rounded up to a code of 40 us, and half a second begins and ends between two steps.
bool is_speed(double speed, double asked) {
  const double delay_us = 1e6 / std::abs(asked);
  const double slowest = 1e6 / (delay_us + 40) - 4;
  return speed * asked > 0 && std::abs(speed) >= slowest && std::abs(speed) <= std::abs(asked) + 4;
}

TEST(Keypads, LatchedKeyCountsUntilTheNextOne) {
  KeypadLab lab("mode = \"latch\"\n");
  EXPECT_EQ(lab.press(kKeyForward), "0300\n");
  lab.live(1);
  // 3 ms a step.
  EXPECT_PRED2(is_speed, lab.speed(), 333.3);
  EXPECT_EQ(lab.press(kKeyReverse), "0300\n");
  lab.live(2);
  EXPECT_PRED2(is_speed, lab.speed(), -333.3);
  lab.press(kKeyStop);
  lab.live(1);
  EXPECT_TRUE(lab.rests());
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

// To the microsecond: 3 ms are 75 codes of 40 us, and not 76. A step more or less at either end.
TEST(Keypads, ADelayOfWholeCodesIsThatDelay) {
  KeypadLab lab("mode = \"latch\"\n");
  lab.press(kKeyForward);
  lab.live(1);
  for (int delay_us = 3000; delay_us <= 4200; delay_us += 300) {
    SCOPED_TRACE(std::to_string(delay_us) + " us");
    const std::int64_t before = lab.shaft_steps("m01");
    lab.live(6);
    const double code_us = 40 * std::ceil(delay_us / 40.0);
    EXPECT_NEAR(static_cast<double>(lab.shaft_steps("m01") - before), 6e6 / code_us, 1.01);
    lab.press(kKeySlower);
    lab.live(0.5);
  }
}

TEST(Keypads, SlowerIsShownAndTurnsRoundAtTheSlowest) {
  KeypadLab lab("mode = \"latch\"\n");
  EXPECT_EQ(lab.press(kKeySlower), "0330\n");
  EXPECT_EQ(lab.asked, 0);  // nothing jogs
  lab.press(kKeyForward);
  lab.live(1);
  EXPECT_PRED2(is_speed, lab.speed(), 303);
  // 300 + 30 n of the source; its 3000 is still one, then it is the first again.
  for (int delay = 360; delay <= 3000; delay += 30) {
    std::string expected = std::to_string(delay) + "\n";
    if (expected.size() < 5) expected.insert(0, "0");
    EXPECT_EQ(lab.press(kKeySlower), expected);
  }
  lab.live(1);
  EXPECT_PRED2(is_speed, lab.speed(), 33.3);
  EXPECT_EQ(lab.press(kKeySlower), "0300\n");
  lab.live(1);
  EXPECT_PRED2(is_speed, lab.speed(), 333.3);
}

TEST(Keypads, HeldKeyMovesAsLongAsItIsRepeated) {
  KeypadLab lab("");
  lab.hold(kKeyForward, 2);
  EXPECT_FALSE(lab.rests());
  const std::int64_t at = lab.shaft_steps("m01");
  EXPECT_GT(at, 500);
  // The cable is pulled: half a second, and the ramp.
  lab.live(1);
  EXPECT_TRUE(lab.rests());
  EXPECT_LE(lab.shaft_steps("m01") - at, 333 / 2 + 30);
  lab.hold(kKeyReverse, 1);
  EXPECT_LT(lab.shaft_steps("m01"), at + 100);
  lab.press(kKeyStop);
  lab.live(0.3);
  EXPECT_TRUE(lab.rests());
}

TEST(Keypads, PortThatIsLostStopsWhatIsLatched) {
  KeypadLab lab("mode = \"latch\"\n");
  lab.press(kKeyForward);
  lab.live(1);
  const std::int64_t at = lab.shaft_steps("m01");
  lab.keypad.port_lost();
  lab.live(1);
  EXPECT_TRUE(lab.rests());
  EXPECT_LE(lab.shaft_steps("m01") - at, 20);  // at once
  lab.keypad.port_opened();
  EXPECT_EQ(lab.keypad.take_display(), "0300\n");
  lab.live(1);
  EXPECT_TRUE(lab.rests());
  EXPECT_EQ(lab.press(kKeyForward), "0300\n");
  lab.live(1);
  EXPECT_FALSE(lab.rests());
}

TEST(Keypads, LimitsAndOtherClientsEndItsJog) {
  KeypadLab lab("mode = \"latch\"\n", "soft_limits = [-100, 400]\n");
  lab.press(kKeyForward);
  lab.live(3);
  EXPECT_TRUE(lab.rests());
  EXPECT_EQ(lab.shaft_steps("m01"), 400);
  const int asked = lab.asked;
  lab.live(2);
  EXPECT_EQ(lab.asked, asked);  // it is not renewed any more
  EXPECT_EQ(lab.press(kKeyForward), "----\n");
  EXPECT_EQ(lab.press(kKeyReverse), "0300\n");
  lab.live(0.3);
  lab.ask(Ask::kStop, {"m01"});
  lab.live(2);
  EXPECT_TRUE(lab.rests());
  EXPECT_GT(lab.shaft_steps("m01"), -100);
}

TEST(Keypads, OtherBytesDoNothing) {
  KeypadLab lab("mode = \"latch\"\n");
  for (unsigned byte = 1; byte < 0xFD; ++byte) {
    EXPECT_EQ(lab.press(static_cast<std::uint8_t>(byte)), "");
  }
  EXPECT_EQ(lab.asked, 0);
  lab.live(0.5);
  EXPECT_TRUE(lab.rests());
}

}  // namespace
}  // namespace bushd::test
