// The image of the board with a voltage-to-frequency converter in simavr, against the board of
// lib/sim, which shares no code with it. Each has a converter of its own, of the same character.
//
//     BUSHD_STREAMS=10000 BUSHD_SEED=1 sim_avr_test --gtest_filter='ConverterRandomStreams.*'
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "sim/avr/booted_board.h"
#include "sim/avr/twin_boards.h"
#include "sim/board_line.h"
#include "sim/random.h"
#include "sim/random_streams.h"

namespace bushd::sim::converter_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Character = FrequencyConverter::Character;

constexpr std::uint8_t kNoPulse = 0x20;
constexpr Character kPlain{.hz_per_code = 10};

// Between the end of a byte and its K: a loop, and what it does with the byte. Between a pulse and
// its step: the counter's synchroniser, a loop with a byte in it, and the way to the strobe.
constexpr TimeNs kLoop = 90;
constexpr TimeNs kByte = 150;
constexpr TimeNs kToStrobe = 230;
constexpr TimeNs kToCodeNs = (kLoop + kByte) * 125 / 2;
constexpr TimeNs kToStepNs = (3 + kLoop + kByte + kToStrobe) * 125 / 2;
constexpr TimeNs kLateNs = kToCodeNs + kToStepNs;
// From a pulse to K = 0 the converter goes on; what it gains by that is less than the two bytes
// take on the fastest line, before the next K.
constexpr TimeNs kToRestNs = (3 + kLoop + kByte) * 125 / 2;
static_assert(kToRestNs < 40'000);

std::string image_of(std::uint32_t baud) {
  return COMMUTATOR_IMAGES "-converter-" + std::to_string(baud) + ".elf";
}

class Image : public BootedBoard {
 public:
  explicit Image(const Character& character = kPlain, std::uint32_t baud = kFastBaud)
      : BootedBoard(image_of(baud), baud, FrequencyConverter(character)) {}
};

TEST(ConverterImage, SwitchesEachMotorToItsFirstPhaseWhenPowerComes) {
  Image image;
  expect_first_phases(image);
  EXPECT_EQ(image.board.converter().code(), 0);
}

TEST(ConverterImage, EachCodeGoesOutWholeAndItsPulseIsTheStep) {
  Image image;
  image.send({0, 0x83});
  for (int code = 255; code > 0; --code) {
    image.send({static_cast<std::uint8_t>(code)});
    image.pass(3 * 20'000 + kToCodeNs);
    ASSERT_EQ(image.board.converter().code(), code);
    const TimeNs begin_ns = image.board.advanced_to_ns();
    image.answers.clear();
    while (image.answers.empty() && image.board.advanced_to_ns() < begin_ns + 200 * kMs) {
      image.pass(100'000);
    }
    ASSERT_THAT(image.answers, ElementsAre(kDone)) << code;
    ASSERT_EQ(image.board.converter().code(), 0);
    ASSERT_EQ(image.board.motors().position(3), 256 - code);
    ASSERT_EQ(image.board.converter().pulses(), static_cast<std::uint64_t>(256 - code));
  }
}

TEST(ConverterImage, TellsWhatItsInputsSay) {
  Image image;
  expect_inputs_are_told(image, 250);
}

TEST(ConverterImage, SaysAfterASecondThatNoPulseCame) {
  Image image({.hz_per_code = 10, .gives_pulses = false});
  image.send({0, 0x83, 250});
  image.pass(1016 * kMs);
  EXPECT_THAT(image.answers, IsEmpty());
  EXPECT_EQ(image.board.converter().code(), 250);
  image.pass(17 * kMs);
  EXPECT_THAT(image.answers, ElementsAre(kNoPulse));
  EXPECT_EQ(image.board.converter().code(), 0);
  EXPECT_EQ(image.board.motors().position(3), 0);
  image.board.set_converter(kPlain);
  image.step({250});
  EXPECT_THAT(image.answers, ElementsAre(kNoPulse, kDone));
}

TEST(ConverterImage, AHundredHzOfItsOwnMoveNothing) {
  Image image({.hz_per_code = 10, .offset_codes = 10});
  image.send({0, 0x81});
  image.pass(1000 * kMs);
  EXPECT_THAT(image.answers, IsEmpty());
  EXPECT_GE(image.board.converter().pulses(), 99u);
  image.send({50});
  image.pass(30 * kMs);
  EXPECT_THAT(image.answers, ElementsAre(kDone));
  EXPECT_EQ(image.board.motors().position(1), 1);
}

// Windings stay as they are in a reset by the watchdog; K is 0 after it.
TEST(ConverterImage, StandsAfterItHasHung) {
  Image image;
  image.step({0, 0x86, 250});
  image.step({1});
  EXPECT_EQ(image.board.converter().code(), 1);
  image.board.node().hang();
  image.pass(kWatchdogNs);
  EXPECT_EQ(image.board.converter().code(), 0);
  EXPECT_EQ(image.board.motors().position(6), 1);
  image.pass(200 * kMs);
  EXPECT_THAT(image.answers, ElementsAre(kDone));
  image.step({0, 0x86, 250});
  EXPECT_EQ(image.board.motors().position(6), 2);
  EXPECT_THAT(image.answers, ElementsAre(kDone, kDone));
}

TEST(ConverterImage, TakesABrokenLineForAZero) {
  Image image;
  expect_a_break_is_a_zero(image, 5, 250);
}

TEST(ConverterImage, RestsAfterABreak) {
  Image image;
  image.step({0, 0x81, 5});
  image.board.send_break(image.board.advanced_to_ns());
  image.pass(kMs);
  EXPECT_EQ(image.board.converter().code(), 0);
}

// Bytes, inputs and pauses at random: to both boards the same.
TEST(ConverterRandomStreams, AreTakenAsTheModelTakesThem) {
  constexpr std::array<std::uint32_t, 3> kBauds = {9600, 57'600, 500'000};
  const std::uint64_t seed = from_environment("BUSHD_SEED", std::random_device{}());
  const std::uint64_t streams = from_environment("BUSHD_STREAMS", 400);
  std::printf("%s\n", again(seed, streams).c_str());
  SCOPED_TRACE(again(seed, streams));
  Random random(seed, 0);
  Lateness lateness;
  for (std::uint64_t done = 0; done < streams && !testing::Test::HasFailure();) {
    const std::uint32_t baud = random.pick(kBauds);
    // No offset: what goes on while the image is late to set K is a period that is shorter there.
    const Character character{.hz_per_code = static_cast<double>(random.between(2, 40)),
                              .drift_per_s = static_cast<double>(random.between(-20, 20)) / 1000};
    TwinBoards twins(image_of(baud), baud, FrequencyConverter(character));
    std::vector<double> ratios;  // of the steps: the code of the pulse before, to theirs
    double before = 0;
    const TimeNs byte_ns = 10'000'000'000 / baud;
    for (int left = 20; left > 0; --left, ++done) {
      // What comes while a pulse is awaited is another test's.
      const bool begins = random.one_in(3);
      const auto header = static_cast<std::uint8_t>(random.between(0x80, 0x8F));
      const auto code = static_cast<std::uint8_t>(random.magnitude(1, 255));
      std::vector<std::uint8_t> bytes;
      if (begins) bytes = {0, header};
      bytes.push_back(code);
      if (random.one_in(4)) {
        twins.board.motors().supply = twins.model.motors().supply = !random.one_in(2);
      }
      twins.send(bytes, byte_ns);
      const TimeNs due_ns = twins.model.board.next_event_ns();
      if (due_ns == CommutatorBoard::kNever) continue;
      // The watch of the image has a coarse clock.
      twins.now_ns = due_ns + (due_ns - twins.now_ns > 990 * kMs ? 40 * kMs : 0) + kLateNs +
                     2 * byte_ns + random.between(0, 5) * kMs;
      twins.advance();
      ratios.resize(twins.model.board.steps().size(), before / code);
      before = code;
    }
    twins.expect_same([&](std::size_t i, TimeNs late_ns) {
      ASSERT_LE(late_ns, kLateNs) << i;
      // What the converter has gained before K = 0, at the speed of the pulse before, is a part of
      // a period of this one. Its drift between both is less than a tenth.
      ASSERT_GE(late_ns, -static_cast<TimeNs>(1.1 * ratios[i] * kToRestNs)) << i;
      lateness.note(late_ns);
    });
    EXPECT_EQ(twins.board.converter().code(), twins.model.board.converter().code());
  }
  lateness.print();
}

}  // namespace
}  // namespace bushd::sim::converter_test
