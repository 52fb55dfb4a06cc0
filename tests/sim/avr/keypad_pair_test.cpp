// The node pair of the source document: the image of the keypad node, wired to the second line of
// the image for the ATmega2560, both in simavr, and no host. keypad_pair.py judges what is written
// here: BUSHD_KEYPAD_TRACE names the file.
//
//   tick NS               of the motor's MCU
//   delays NS NS N        of a step: the first, what "slower" adds to it, and how many there are
//   key NS BYTE           a byte of the keypad has ended at the motor's MCU
//   break NS              a framing error has ended there
//   silent NS             a key that is to be repeated has been released
//   step NS SIGN          an edge of STEP, with DIR
//   end NS
#include <cstdlib>
#include <deque>
#include <fstream>
#include <map>

#include "sim/avr/avr_fixture.h"
#include "sim/avr/avr_keypad.h"

namespace bushd::sim::keypad_pair_test {
namespace {

constexpr std::uint8_t kMotor = 3;
constexpr TimeNs kByteNs = 16'000'000;
constexpr TimeNs kMs = 1'000'000;
enum Key : std::uint8_t { kForward = 1, kReverse = 2, kSlower = 4, kStop = 8 };
constexpr const char* kZ = "   2";

struct Kind {
  const char* node;
  const char* motor;
  const char* delays;
};
constexpr Kind kFourKeys{KEYPAD_IMAGE, "-", "3000000 300000 91"};
constexpr Kind kSwitchAndKey{KEYPAD_SWITCH_IMAGE, "-switch-", "250000000 -50000000 5"};

class KeypadPair : public AvrAlone {
 protected:
  explicit KeypadPair(const Kind& kind = kFourKeys) : AvrAlone(kBaud, 6, kind.motor), kind_(kind) {
    if (const char* path = std::getenv("BUSHD_KEYPAD_TRACE")) {
      out_.open(path, std::ios::app);
      EXPECT_TRUE(out_);
    }
  }

  // A host sets the MCU up, and it restarts when its EEPROM has that. The host is silent from then
  // on.
  void set_up(std::uint16_t keypad_ticks, const bushd_set_inputs& inputs = {}) {
    ASSERT_NO_FATAL_FAILURE(make_ready());
    ASSERT_EQ(master_.acknowledged(kAddress, inputs), BUSHD_OK);
    ASSERT_EQ(master_.acknowledged(kAddress, bushd_local{0, 1 << kMotor, keypad_ticks}), BUSHD_OK);
    pass(1'500 * kMs);
    for (std::uint64_t before = 0; before != avr_->eeprom_writes();) {
      before = avr_->eeprom_writes();
      pass(100 * kMs);
    }
    reboot();
    recorder_.edges.clear();
    out_ << "tick " << kTickNs << "\ndelays " << kind_.delays << '\n';
    node_0_ns_ = bus_.now_ns();
    node_ = std::make_unique<AvrKeypad>(kind_.node);
    node_->on_byte = [this](TimeNs end_ns, std::uint8_t byte) {
      if (plugged_) to_motor_.push_back({node_0_ns_ + end_ns, byte});
    };
    avr_->on_keypad_display = [this](TimeNs end_ns, std::uint8_t byte) {
      if (plugged_) to_keypad_.push_back({end_ns, byte});
    };
    run(100);
  }

  void run(int ms) {
    for (const TimeNs end_ns = bus_.now_ns() + ms * kMs; bus_.now_ns() < end_ns;) {
      TimeNs next_ns = std::min(end_ns, bus_.now_ns() + kMs);
      for (const auto* line : {&to_motor_, &to_keypad_}) {
        if (!line->empty())
          next_ns = std::min(next_ns, std::max(line->front().end_ns, bus_.now_ns()));
      }
      bus_.advance_to(next_ns);
      node_->advance(next_ns - node_0_ns_);
      deliver();
    }
  }
  void deliver() {
    while (!to_motor_.empty() && to_motor_.front().end_ns <= bus_.now_ns()) {
      const auto [end_ns, byte] = to_motor_.front();
      to_motor_.pop_front();
      out_ << "key " << end_ns << ' ' << int{byte} << '\n';
      ++bytes_;
      avr_->keypad_byte(byte, bus_.now_ns());
    }
    while (!to_keypad_.empty() && to_keypad_.front().end_ns <= bus_.now_ns()) {
      node_->receive(to_keypad_.front().byte);
      to_keypad_.pop_front();
    }
  }
  void hold(std::uint8_t keys, int ms) {
    node_->hold(keys);
    run(ms);
  }
  void press(Key key, int ms) {
    hold(key, 50);
    hold(0, ms - 50);
  }
  // A resistor draws the line to ground from now on. What was under way is lost.
  void pull_cable() {
    plugged_ = false;
    to_motor_.clear();
    to_keypad_.clear();
    const TimeNs end_ns = bus_.now_ns() + kByteNs;
    run(16);
    out_ << "break " << end_ns << '\n';
    avr_->keypad_break(bus_.now_ns());
  }
  void plug_in() { plugged_ = true; }

  std::size_t steps() const { return steps_made(kMotor); }

  // Asks the MCU for the first time since it restarted.
  void end() {
    std::map<int, bool> positive;
    std::int64_t made = 0;
    for (const Edge& edge : recorder_.edges) {
      if (edge.signal == Signal::kDir) positive[edge.index] = edge.level;
      if (edge.signal != Signal::kStep || !edge.level) continue;
      EXPECT_EQ(edge.index, kMotor);
      const int sign = positive[edge.index] ? 1 : -1;
      made += sign;
      out_ << "step " << edge.time_ns << ' ' << sign << '\n';
    }
    out_ << "end " << bus_.now_ns() << '\n';
    const bushd_report report = master_.poll(kAddress);
    EXPECT_EQ(report.moving, 0);
    EXPECT_EQ(report.faults, 0);
    EXPECT_EQ(report.motor[kMotor].position_steps, made);
    EXPECT_EQ(avr_->overruns(), 0u);
  }

  const Kind kind_;
  struct Byte {
    TimeNs end_ns;
    std::uint8_t byte;
  };
  std::deque<Byte> to_motor_;
  std::deque<Byte> to_keypad_;
  bool plugged_ = true;
  int bytes_ = 0;
  TimeNs node_0_ns_ = 0;
  std::unique_ptr<AvrKeypad> node_;
  std::ofstream out_;
};

TEST_F(KeypadPair, MovesTheMotorAsInTheDocument) {
  ASSERT_NO_FATAL_FAILURE(set_up(0));
  EXPECT_EQ(node_->shown(), "    ");
  press(kForward, 300);
  EXPECT_EQ(node_->shown(), kZ);
  run(300);
  EXPECT_EQ(node_->shown(), "0300");
  press(kSlower, 500);
  EXPECT_EQ(node_->shown(), "0330");
  press(kSlower, 500);
  EXPECT_EQ(node_->shown(), "0360");
  press(kReverse, 300);
  EXPECT_EQ(node_->shown(), "   F");
  run(300);
  EXPECT_EQ(node_->shown(), "0360");
  press(kStop, 300);
  EXPECT_EQ(node_->shown(), "----");
  run(300);
  EXPECT_EQ(node_->shown(), "0360");
  EXPECT_EQ(bytes_, 5);
  const std::size_t made = steps();
  EXPECT_GT(made, 400u);
  press(kSlower, 300);
  EXPECT_EQ(node_->shown(), "0390");
  EXPECT_EQ(steps(), made);
  press(kForward, 400);
  pull_cable();
  run(500);
  const std::size_t pulled = steps();
  press(kReverse, 200);
  plug_in();
  run(300);
  EXPECT_EQ(steps(), pulled) << "a key has to be pressed again";
  press(kReverse, 400);
  EXPECT_GT(steps(), pulled + 50);
  press(kStop, 300);
  end();
}

TEST_F(KeypadPair, TwoKeysAtOnceStop) {
  ASSERT_NO_FATAL_FAILURE(set_up(0));
  press(kForward, 300);
  hold(kForward | kReverse, 200);
  const std::size_t made = steps();
  hold(kForward, 200);
  EXPECT_EQ(steps(), made) << "the rest of two keys is none";
  hold(0, 200);
  EXPECT_EQ(steps(), made);
  end();
}

TEST(KeypadNode, SendsNothingForAKeyThatIsHeldWhenItGetsPower) {
  AvrKeypad node(KEYPAD_IMAGE);
  int bytes = 0;
  node.on_byte = [&](TimeNs, std::uint8_t) { ++bytes; };
  node.hold(kForward);
  node.advance(300 * kMs);
  EXPECT_EQ(bytes, 0);
  node.hold(0);
  node.advance(350 * kMs);
  // Contacts bounce.
  for (int ms = 350; ms < 358; ++ms) {
    node.hold(ms % 2 == 0 ? kSlower : 0);
    node.advance(ms * kMs);
  }
  EXPECT_EQ(bytes, 0);
  node.hold(kSlower);
  node.advance(600 * kMs);
  EXPECT_EQ(bytes, 1);
}

TEST_F(KeypadPair, StopsWithTheKeyWhereThatIsSet) {
  ASSERT_NO_FATAL_FAILURE(set_up(100));
  hold(kForward, 900);
  out_ << "silent " << bus_.now_ns() << '\n';
  hold(0, 600);
  EXPECT_GE(bytes_, 8);
  const std::size_t made = steps();
  run(300);
  EXPECT_EQ(steps(), made);
  EXPECT_EQ(node_->shown(), "0300");
  end();
}

TEST_F(KeypadPair, ShowsThatALimitForbidsIt) {
  bushd_set_inputs inputs{};
  inputs.limit_positive = 1 << kMotor;
  ASSERT_NO_FATAL_FAILURE(set_up(0, inputs));
  press(kForward, 700);
  EXPECT_EQ(node_->shown(), "0300");
  avr_->set_inputs({1 << kMotor, 0});
  run(300);
  EXPECT_EQ(node_->shown(), "----");
  const std::size_t made = steps();
  press(kForward, 300);
  EXPECT_EQ(steps(), made);
  EXPECT_EQ(node_->shown(), "----");
  press(kReverse, 700);
  EXPECT_GT(steps(), made + 20);
  EXPECT_EQ(node_->shown(), "0300");
  press(kStop, 300);
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.moving, 0);
}

// What the MCU refuses is never shown as if it had been taken.
TEST_F(KeypadPair, ShowsNoWordForAKeyThatIsRefused) {
  bushd_set_inputs inputs{};
  inputs.limit_positive = 1 << kMotor;
  ASSERT_NO_FATAL_FAILURE(set_up(0, inputs));
  avr_->set_inputs({1 << kMotor, 0});
  node_->hold(kForward);
  for (int i = 0; i < 60; ++i) {
    run(10);
    EXPECT_NE(node_->shown(), kZ);
    if (i == 5) node_->hold(0);
  }
  EXPECT_EQ(node_->shown(), "----");
}

// The document's other keypad, with the delays that belong to it.
class KeypadSwitchPair : public KeypadPair {
 protected:
  static constexpr std::uint8_t kSwitch = 1;
  static constexpr std::uint8_t kSpeed = 2;

  KeypadSwitchPair() : KeypadPair(kSwitchAndKey) {}

  void turn_switch(int ms) {
    switched_ ^= kSwitch;
    hold(switched_, ms);
  }
  void press_speed(int key_ms, int ms) {
    hold(switched_ | kSpeed, key_ms);
    hold(switched_, ms - key_ms);
  }

 private:
  std::uint8_t switched_ = 0;
};

TEST_F(KeypadSwitchPair, MovesTheMotorAsInTheDocument) {
  ASSERT_NO_FATAL_FAILURE(set_up(0));
  run(500);
  EXPECT_EQ(bytes_, 0) << "power alone moves nothing";
  press_speed(60, 300);
  EXPECT_EQ(node_->shown(), kZ);
  run(1'000);
  EXPECT_EQ(node_->shown(), "2500");
  for (const char* delay : {"2000", "1500", "1000", "0500", "2500"}) {
    press_speed(60, 2'000);
    EXPECT_EQ(node_->shown(), delay);
  }
  turn_switch(300);
  EXPECT_EQ(node_->shown(), "   F");
  run(1'700);
  EXPECT_EQ(node_->shown(), "2500");
  turn_switch(2'000);
  press_speed(1'200, 1'300);
  EXPECT_EQ(node_->shown(), "----") << "held for a second: it stops";
  run(700);
  EXPECT_EQ(node_->shown(), "2500");
  const std::size_t made = steps();
  EXPECT_GT(made, 80u);
  run(1'000);
  EXPECT_EQ(steps(), made);
  press_speed(60, 1'500);
  EXPECT_GT(steps(), made + 2);
  pull_cable();
  run(500);
  end();
}

TEST(KeypadSwitchNode, SendsNothingUntilSomebodyTouchesIt) {
  for (std::uint8_t held = 0; held < 4; ++held) {
    AvrKeypad node(KEYPAD_SWITCH_IMAGE);
    std::vector<int> bytes;
    node.on_byte = [&](TimeNs, std::uint8_t byte) { bytes.push_back(byte); };
    node.hold(held);
    node.advance(1'100 * kMs);
    EXPECT_TRUE(bytes.empty()) << int{held};
    node.hold(held & 1);
    node.advance(1'200 * kMs);
    EXPECT_TRUE(bytes.empty()) << int{held} << ": a key that was stuck is none";
    node.hold(held ^ 1);
    node.advance(1'450 * kMs);
    ASSERT_FALSE(bytes.empty());
    EXPECT_EQ(bytes.front(), (held & 1) == 0 ? 0xFF : 0x00);
    EXPECT_EQ(bytes.size(), 3u) << "repeated every 100 ms";
  }
}

}  // namespace
}  // namespace bushd::sim::keypad_pair_test
