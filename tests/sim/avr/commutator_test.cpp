// The image of the commutator board in simavr, against the board of lib/sim, which shares no code
// with it, on lines whose bytes take their time.
//
//     BUSHD_STREAMS=10000 BUSHD_SEED=1 sim_avr_test --gtest_filter='CommutatorRandomStreams.*'
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "heritage/commutator/exchange.h"
#include "sim/avr/booted_board.h"
#include "sim/avr/twin_boards.h"
#include "sim/board_line.h"
#include "sim/random.h"
#include "sim/random_streams.h"

namespace bushd::sim::commutator_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::string image_of(std::uint32_t baud) {
  return COMMUTATOR_IMAGES "-" + std::to_string(baud) + ".elf";
}

// By how much the image is late, in cycles. Its loop passes between the end of a byte and its time,
// and again between the end of a delay and the look that finds it, then perhaps with a byte in it.
// From there to the strobe it is as far as from the look at the timer through what is due, the
// inputs and the phase. A delay in counts is up to two of them too long. All that is less than the
// shortest code, of 640 cycles.
constexpr TimeNs kLoop = 90;
constexpr TimeNs kByte = 110;
constexpr TimeNs kToStrobe = 190;
constexpr TimeNs kTwoCounts = 16;
constexpr TimeNs kLateNs = (kLoop + kLoop + kByte + kToStrobe + kTwoCounts) * 125 / 2;
static_assert(kLateNs < 40'000);

class Image : public BootedBoard {
 public:
  explicit Image(std::uint32_t start_hz, std::uint32_t baud = kFastBaud)
      : BootedBoard(image_of(baud), baud, start_hz) {}
};

TEST(CommutatorImage, SwitchesEachMotorToItsFirstPhaseWhenPowerComes) {
  expect_first_phases(Image(100));
}

TEST(CommutatorImage, TakesNoPartWithSwitchesThatAreNoStartFrequency) {
  for (const std::uint32_t start_hz : {0u, 101u, 127u}) {
    Image image(start_hz);
    image.send({0, 0x80, 10});
    image.pass(300 * kMs);
    EXPECT_THAT(image.answers, IsEmpty());
    EXPECT_EQ(image.board.latched(), 0u);
  }
}

TEST(CommutatorImage, TellsWhatItsInputsSay) {
  Image image(100);
  expect_inputs_are_told(image, 10);
}

TEST(CommutatorImage, TakesABrokenLineForAZero) {
  Image image(100);
  expect_a_break_is_a_zero(image, 100, 10);
}

// Windings stay as they are in a reset by the watchdog, and go on from there.
TEST(CommutatorImage, KeepsItsPhasesWhenItHangs) {
  Image image(100);
  image.step({0, 0x81, 10});
  image.step({0, 0x8E, 10});
  image.step({10});
  image.step({250});
  const auto latched = image.board.latched();
  image.board.node().hang();
  image.pass(kWatchdogNs);
  EXPECT_EQ(image.board.latched(), latched + BoardMotors::kMotors) << "it has not booted";
  EXPECT_EQ(image.board.motors().position(1), 1);
  EXPECT_EQ(image.board.motors().position(6), -2);
  EXPECT_EQ(image.answers.size(), 3u) << "the code that was counted is forgotten";
  image.step({0, 0x86, 10});
  EXPECT_EQ(image.board.motors().position(6), -1);
  EXPECT_EQ(image.answers.back(), kDone);
}

// Bytes, inputs and pauses at random: to both boards the same.
class CommutatorRandomStreams : public testing::Test {
 protected:
  CommutatorRandomStreams()
      : seed_(from_environment("BUSHD_SEED", std::random_device{}())), random_(seed_, 0) {}

  // As a daemon would, and whatever else.
  std::vector<std::uint8_t> some_bytes() {
    const auto code = static_cast<std::uint8_t>(random_.magnitude(1, 255));
    const auto header = static_cast<std::uint8_t>(random_.between(0x80, 0x8F));
    switch (random_.below(8)) {
      case 0:
        return {static_cast<std::uint8_t>(random_.below(256))};
      case 1:
        return {0, header};
      case 2:
      case 3:
        return {0, header, code};
      default:
        return {code};
    }
  }
  void change_surroundings(BoardMotors& a, BoardMotors& b) {
    const auto motor = static_cast<unsigned>(random_.below(BoardMotors::kMotors));
    switch (random_.below(4)) {
      case 0:
        a.supply = b.supply = !random_.one_in(4);
        break;
      case 1:
        a.motor(motor).connected = b.motor(motor).connected = !random_.one_in(4);
        break;
      case 2:
        a.motor(motor).right_limit_at = b.motor(motor).right_limit_at = random_.between(-3, 6);
        break;
      default:
        a.motor(motor).left_limit_at = b.motor(motor).left_limit_at = random_.between(-6, 3);
    }
  }

  const std::uint64_t seed_;
  Random random_;
};

TEST_F(CommutatorRandomStreams, AreTakenAsTheModelTakesThem) {
  constexpr std::array<std::uint32_t, 3> kBauds = {9600, 57'600, 500'000};
  const std::uint64_t streams = from_environment("BUSHD_STREAMS", 400);
  std::printf("%s\n", again(seed_, streams).c_str());
  SCOPED_TRACE(again(seed_, streams));
  Lateness lateness;
  for (std::uint64_t done = 0; done < streams && !HasFailure();) {
    const std::uint32_t baud = random_.pick(kBauds);
    const auto start_hz = static_cast<std::uint32_t>(random_.between(1, 100));
    const TimeNs code_ns = 4'000'000 / start_hz;
    SCOPED_TRACE("F_start " + std::to_string(start_hz) + " Hz, " + std::to_string(baud) + " baud");
    TwinBoards twins(image_of(baud), baud, start_hz);
    const auto go_on = [&](TimeNs until_ns) {
      // The same byte or change before a step here, and after it there, would be no difference that
      // anybody could call one.
      const TimeNs due_ns = twins.model.board.next_event_ns();
      if (until_ns + 1'000 >= due_ns && until_ns <= due_ns + kLateNs) until_ns += 2 * kLateNs;
      twins.now_ns = until_ns;
      twins.advance();
    };
    const TimeNs byte_ns = 10'000'000'000 / baud;
    for (int left = 40; left > 0; --left, ++done) {
      for (const std::uint8_t byte : some_bytes()) {
        // One at a time: when it ends is what must not be close to a step.
        const TimeNs due_ns = twins.model.board.next_event_ns();
        const TimeNs end_ns = twins.now_ns + byte_ns;
        if (end_ns + 1'000 >= due_ns && end_ns <= due_ns + kLateNs) {
          go_on(twins.now_ns + 2 * kLateNs);
        }
        twins.send({&byte, 1}, byte_ns);
      }
      if (random_.one_in(6)) {
        go_on(twins.now_ns);
        change_surroundings(twins.board.motors(), twins.model.motors());
      }
      go_on(twins.now_ns + random_.between(0, 20 * code_ns));
    }
    go_on(twins.now_ns + 300 * code_ns + 4 * byte_ns);
    twins.expect_same([&](std::size_t i, TimeNs late_ns) {
      ASSERT_GE(late_ns, 0) << i;
      ASSERT_LE(late_ns, kLateNs) << i;
      lateness.note(late_ns);
    });
  }
  lateness.print();
}

// The daemon's own exchange drives it: each step that is asked for is made once, and counted.
TEST(CommutatorImage, IsDrivenByTheExchangeOfTheDaemon) {
  for (const std::uint32_t start_hz : {1u, 7u, 100u}) {
    Image image(start_hz);
    commutator::Exchange exchange({.start_hz = start_hz, .baud = kFastBaud});
    std::array<std::int64_t, BoardMotors::kMotors> counted{};
    Random random(start_hz, 0);
    TimeNs before_ns = 0;
    for (int i = 0; i < 30; ++i) {
      const auto motor = static_cast<unsigned>(random.below(BoardMotors::kMotors));
      const bool left = random.one_in(2);
      const auto delay_ns = static_cast<std::uint64_t>(random.between(1, 30)) * exchange.unit_ns();
      const TimeNs asked_ns = image.board.advanced_to_ns();
      exchange.step(asked_ns / 1000, motor, left, delay_ns);
      image.send(exchange.take_bytes());
      for (image.answers.clear(); image.answers.empty();) {
        image.pass(10'000);
        ASSERT_LT(image.board.advanced_to_ns() / 1000, exchange.next_wake_us()) << i;
      }
      const auto event =
          exchange.receive(image.board.advanced_to_ns() / 1000, image.answers.front());
      ASSERT_TRUE(event.answer);
      EXPECT_EQ(event.answer->status, (commutator::Status{.step_done = true}));
      counted.at(motor) += left ? -1 : 1;
      const auto& made = image.board.motors().steps();
      ASSERT_EQ(made.size(), static_cast<std::size_t>(i) + 1);
      EXPECT_GE(made.back().time_ns - before_ns, static_cast<TimeNs>(delay_ns));
      // Three bytes, and a code more where that is what whole codes make of it.
      EXPECT_LE(made.back().time_ns - asked_ns,
                static_cast<TimeNs>(delay_ns + exchange.unit_ns()) + 3 * 20'000 + kLateNs);
      before_ns = made.back().time_ns;
    }
    for (unsigned motor = 0; motor < BoardMotors::kMotors; ++motor) {
      EXPECT_EQ(image.board.motors().position(motor), counted.at(motor));
    }
  }
}

}  // namespace
}  // namespace bushd::sim::commutator_test
