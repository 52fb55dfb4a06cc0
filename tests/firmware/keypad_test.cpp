// LOCAL by a keypad: bytes that begin, slow down and end motion, and what goes back for the
// display.
#include "firmware/streams.h"
#include "keypad_bytes.h"

namespace bushd::test {
namespace {

constexpr std::uint16_t kMotors = 0b0110;

// Steps of a table run whose delays are `shortest_delay` at least, from rest.
Law limited(const Law& law, std::uint32_t shortest_delay_ns) {
  Law slower = law;
  const auto shortest_delay =
      static_cast<std::uint16_t>((shortest_delay_ns + law.unit_ns - 1) / law.unit_ns);
  for (auto* codes : {&slower.accel, &slower.decel}) {
    for (std::uint16_t& code : *codes) code = std::max(code, shortest_delay);
  }
  slower.cruise = std::max(slower.cruise, shortest_delay);
  return slower;
}

class Keypad : public Streams {
 protected:
  // 0.5 s and a tick: a key that is held would have been repeated.
  static constexpr int kUntilReleased = 197;

  void SetUp() override {
    ASSERT_EQ(rig.local(0, kMotors), BUSHD_OK);
    rig.pass(kUntilReleased);
    rig.forget_history();
  }
  void press(std::uint8_t key, int ticks) {
    rig.keypad(key);
    rig.pass(ticks);
  }
  // The key is pressed in the tick before; it is seen in the third that is prepared then, and made
  // in the one after.
  void expect_steps(std::uint32_t delay_ns, int direction, std::size_t ticks) {
    std::vector<int> expected =
        steps_by_tick(Reference::move(limited(law, delay_ns), 1000), Rig::kTickNs);
    expected.resize(ticks);
    for (int& n : expected) n *= direction;
    ASSERT_GE(rig.history(1).size(), ticks + 4);
    const auto begin = rig.history(1).begin() + 4;
    EXPECT_EQ(std::vector<int>(begin, begin + static_cast<std::ptrdiff_t>(ticks)), expected);
    EXPECT_EQ(rig.history(1), rig.history(2));
    EXPECT_EQ(rig.pulses(0), 0) << "not one of these";
  }
  void expect_counted_after_stop() {
    press(kKeyStop, 1);
    expect_rest_as_counted();
  }
};
BUSHD_IN_BOTH_FORMATS(Keypad);

TEST_P(Keypad, ADirectionCountsUntilTheNextKeyWithTheFirstSpeed) {
  for (const auto& [key, direction] : {std::pair{kKeyForward, 1}, std::pair{kKeyReverse, -1}}) {
    rig.forget_history();
    press(key, 200);
    EXPECT_EQ(rig.poll().autonomous, kMotors);
    EXPECT_EQ(rig.poll().running, 0) << "not for a master to end";
    EXPECT_EQ(rig.keypad_display(), "0300\n");
    expect_steps(3'000'000, direction, 190);
    expect_counted_after_stop();
    EXPECT_EQ(rig.keypad_display(), "0300\n");
  }
}

TEST_P(Keypad, SlowerAddsTheSameUntilItBeginsAgain) {
  for (int times = 1; times <= 90; ++times) {
    press(kKeySlower, 1);
    char expected[6];
    std::snprintf(expected, sizeof expected, "%04d\n", 300 + 30 * times);
    EXPECT_EQ(rig.keypad_display(), expected);
  }
  rig.forget_history();
  press(kKeyForward, 300);
  expect_steps(30'000'000, 1, 190);
  press(kKeyStop, 30);
  press(kKeySlower, 1);
  EXPECT_EQ(rig.keypad_display(), "0300\n");
  expect_rest_as_counted();
}

TEST_P(Keypad, SlowerInMotionIsARampDownAndANewBeginning) {
  press(kKeyForward, 50);
  rig.keypad_display();
  rig.forget_history();
  press(kKeySlower, 200);
  EXPECT_EQ(rig.keypad_display(), "0330\n");
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  // Pulses of a constant speed: 3.3 ms each.
  int steps = 0;
  for (std::size_t i = 100; i < 199; ++i) steps += rig.history(1)[i];
  EXPECT_NEAR(steps, 99 * 2.56 / 3.3, 1.0);
  expect_counted_after_stop();
}

// The period of the loop is in 25 us: 3 ms are 120 of them, 3.3 ms 132.
TEST_P(Keypad, AMotorWithVelocityTakesTheSpeedUpInMotion) {
  ASSERT_EQ(rig.local(0, 0b0010), BUSHD_OK);
  ASSERT_EQ(rig.velocity({1, 100 * 64, 1000 * 64, 5000}), BUSHD_OK);
  rig.pass(kUntilReleased);
  const auto steps_in_60_ticks = [this] {
    const std::int64_t before = rig.pulses(1);
    rig.pass(60);
    return static_cast<double>(rig.pulses(1) - before);
  };
  press(kKeyForward, 100);
  EXPECT_NEAR(steps_in_60_ticks(), 60 * 2.56 / 3.0, 1.0);
  press(kKeySlower, 1);
  for (int i = 0; i < 20; ++i) {
    EXPECT_NE(rig.poll().autonomous, 0) << "it need not come to rest";
    rig.pass(1);
  }
  rig.pass(20);
  EXPECT_NEAR(steps_in_60_ticks(), 60 * 2.56 / 3.3, 1.0);
  press(kKeyReverse, 200);
  EXPECT_NEAR(steps_in_60_ticks(), -60 * 2.56 / 3.3, 1.0);
  expect_counted_after_stop();
}

TEST_P(Keypad, AKeyThatIsNotRepeatedCountsForAWhileWhereThatIsSet) {
  ASSERT_EQ(rig.local(0, kMotors, 20), BUSHD_OK);
  rig.pass(kUntilReleased);
  press(kKeyForward, 19);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  press(kKeyForward, 19);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  rig.pass_until_rest(60);
  EXPECT_EQ(rig.poll().autonomous, 0);
  EXPECT_EQ(rig.keypad_display(), "0300\n") << "not refused";
  expect_rest_as_counted();
}

TEST_P(Keypad, ABrokenLineEndsMotionUntilAKeyIsPressed) {
  press(kKeyForward, 60);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  rig.keypad_break();
  rig.pass_until_rest(100);
  rig.pass(100);
  EXPECT_EQ(rig.poll().autonomous, 0);
  press(kKeyForward, 60);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  expect_counted_after_stop();
}

TEST_P(Keypad, OtherBytesMeanNothing) {
  for (int byte = 1; byte < 0xFD; ++byte) press(static_cast<std::uint8_t>(byte), 1);
  EXPECT_EQ(rig.poll().autonomous, 0);
  EXPECT_EQ(rig.keypad_display(), "");
  EXPECT_EQ(rig.pulses(1), 0);
}

TEST_P(Keypad, AFaultForgetsTheKey) {
  press(kKeyForward, 60);
  rig.keypad_display();
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass(100);
  EXPECT_EQ(rig.poll().autonomous, 0);
  EXPECT_EQ(rig.keypad_display(), "----\n");
  press(kKeyForward, 10);
  EXPECT_EQ(rig.keypad_display(), "----\n");
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  for (int n = 0; n < 10; ++n) press(kKeyForward, 39);
  EXPECT_EQ(rig.poll().autonomous, 0) << "held all the time";
  rig.pass(kUntilReleased);
  EXPECT_EQ(rig.poll().autonomous, 0) << "it has to be pressed again";
  press(kKeyForward, 60);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  expect_counted_after_stop();
}

TEST_P(Keypad, NothingMovesWhileAHostHasDisabledTheDrivers) {
  ASSERT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_OK);
  press(kKeyForward, 60);
  EXPECT_EQ(rig.keypad_display(), "----\n");
  ASSERT_EQ(rig.control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  rig.pass(60);
  EXPECT_EQ(rig.pulses(1), 0);
}

TEST_P(Keypad, ALimitForgetsTheKeyWhenItInhibitsAllMotors) {
  ASSERT_EQ(rig.set_inputs({.limit_positive = kMotors}), BUSHD_OK);
  ASSERT_EQ(rig.local(0, kMotors), BUSHD_OK);
  rig.pass(kUntilReleased);
  press(kKeyForward, 60);
  rig.keypad_display();
  rig.pins({1 << 1, 0});
  rig.pass(60);
  EXPECT_EQ(rig.poll().autonomous, 1 << 2) << "the other one goes on";
  rig.pins({kMotors, 0});
  rig.pass(60);
  EXPECT_EQ(rig.poll().autonomous, 0);
  EXPECT_EQ(rig.keypad_display(), "----\n");
  rig.pins({0, 0});
  rig.pass(60);
  EXPECT_EQ(rig.poll().autonomous, 0) << "it has to be pressed again";
  press(kKeyReverse, 60);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  expect_counted_after_stop();
}

TEST_P(Keypad, PeopleAtTheInputsComeFirst) {
  ASSERT_EQ(rig.local(0b0001, kMotors), BUSHD_OK);
  press(kKeyForward, 60);
  rig.keypad_display();
  rig.pins({0, BUSHD_INPUT_FORWARD});
  rig.pass(60);
  EXPECT_EQ(rig.keypad_display(), "----\n");
  EXPECT_EQ(rig.poll().autonomous, 0b0001);
  rig.pins({0, 0});
  rig.pass_until_rest();
  rig.pass(60);
  EXPECT_EQ(rig.poll().autonomous, 0) << "it has to be pressed again";
  expect_rest_as_counted();
}

TEST_P(Keypad, AHostsMotorIsNotItsUntilThatRests) {
  const Plan plan = plan_move(law, 400, Rig::kTickNs, format);
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(rig.part(plan, start, 0, 20, 1)), BUSHD_OK);
  press(kKeyForward, 8);
  EXPECT_EQ(rig.poll().autonomous, 1 << 2);
  press(kKeyStop, 1);
  rig.pass_until_rest();
  press(kKeyForward, 60);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  EXPECT_EQ(rig.take(rig.part(plan, rig.first_open(), 0, 20, 1)), BUSHD_E_STATE);
  expect_counted_after_stop();
}

// The node repeats a key that is held, ten times a second.
TEST_P(Keypad, AMasterEndsItAndTheKeyMustBeReleasedFirst) {
  constexpr std::uint16_t kCounts = 195;
  constexpr int kRepeat = 39;  // 0.1 s
  const auto hold_for = [this](std::uint8_t key, int ticks) {
    for (int n = 0; n < ticks; n += kRepeat) press(key, kRepeat);
  };
  for (const std::uint16_t counts : {kCounts, std::uint16_t{0}}) {
    ASSERT_EQ(rig.local(0, kMotors, counts), BUSHD_OK);
    rig.pass(kUntilReleased);
    hold_for(kKeyForward, 10 * kRepeat);
    ASSERT_EQ(rig.poll().autonomous, kMotors);
    ASSERT_EQ(rig.local(0, 0b0010, counts), BUSHD_OK);
    hold_for(kKeyForward, 10 * kRepeat);
    EXPECT_EQ(rig.poll().moving, 0) << "of the other one too it was another key";
    ASSERT_EQ(rig.local(0, kMotors, counts), BUSHD_OK);
    hold_for(kKeyForward, 30 * kRepeat);
    EXPECT_EQ(rig.poll().moving, 0) << "held all the time";
    rig.pass(kUntilReleased);
    hold_for(kKeyForward, 2 * kRepeat);
    EXPECT_EQ(rig.poll().autonomous, kMotors);
    ASSERT_EQ(rig.local(0, 0, counts), BUSHD_OK);
    rig.pass_until_rest();
    ASSERT_EQ(rig.local(0, kMotors, counts), BUSHD_OK);
    hold_for(kKeyReverse, 4 * kRepeat);
    EXPECT_EQ(rig.poll().moving, 0);
    press(kKeyStop, 5);
    hold_for(kKeyReverse, 2 * kRepeat);
    EXPECT_EQ(rig.poll().autonomous, kMotors) << "a stop is a release";
    expect_counted_after_stop();
    ASSERT_EQ(rig.local(0), BUSHD_OK);
  }
}

TEST_P(Keypad, SettingsAreRefusedThatDoNotFit) {
  EXPECT_EQ(rig.local(0, 0b1'0000), BUSHD_E_FORMAT);
  press(kKeyForward, 60);
  EXPECT_EQ(rig.local(1, kMotors), BUSHD_E_STATE) << "its stuck inputs could not be told";
  EXPECT_EQ(rig.local(0, kMotors), BUSHD_OK) << "a host that connects says the same";
  rig.pass(10);
  EXPECT_EQ(rig.poll().autonomous, kMotors);
  expect_counted_after_stop();
  Rig without({.disabled_capabilities = BUSHD_CAN_KEYPAD});
  EXPECT_EQ(without.local(0, 1), BUSHD_E_FORMAT);
  EXPECT_EQ(without.identify().capabilities & BUSHD_CAN_KEYPAD, 0u);
}

TEST_P(Keypad, TheSettingsOutliveAReset) {
  ASSERT_EQ(rig.local(0, kMotors, 200), BUSHD_OK);
  rig.restart_with_nvm();
  rig.pass(3);
  rig.forget_history();
  press(kKeyForward, 150);
  EXPECT_TRUE(rig.enabled()) << "no host has set it up";
  expect_steps(3'000'000, 1, 100);
}

}  // namespace
}  // namespace bushd::test
