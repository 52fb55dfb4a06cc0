// The program of a board with a converter, against the board of lib/sim, which shares no code with
// it. Both have a converter that does the same.
#include "firmware/commutator/converter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "engine/properties.h"
#include "sim/commutator_board.h"

namespace bushd::converter_board_test {
namespace {

using sim::FrequencyConverter;
using sim::TimeNs;
using test::between;
using test::holds;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr TimeNs kMs = 1'000'000;
constexpr FrequencyConverter::Character kExact{.hz_per_code = 10};

// A port that loses no time. Its clock has units of a millisecond, and overflows soon.
class ConverterPort {
 public:
  explicit ConverterPort(const FrequencyConverter::Character& character) : converter(character) {
    bushd_converter_begin(&core, 999);
  }
  // Times are whole units.
  void receive(TimeNs now_ns, std::uint8_t byte) {
    advance(now_ns);
    const bool waited = core.board.counting;
    bushd_converter_receive(&core, ms(now_ns), pulses(), byte);
    converter.set_code(now_ns, core.code);
    if (!waited) watch_ns_ = now_ns + 1000 * kMs;
  }
  void receive_damaged(TimeNs now_ns) {
    advance(now_ns);
    bushd_converter_receive_damaged(&core);
    converter.set_code(now_ns, core.code);
  }
  void advance(TimeNs now_ns) {
    while (true) {
      TimeNs next_ns = converter.next_pulse_ns();
      if (core.board.counting) next_ns = std::min(next_ns, watch_ns_);
      if (next_ns > now_ns) break;
      converter.advance(next_ns);
      look(next_ns);
    }
    converter.advance(now_ns);
  }
  std::int64_t position(unsigned motor) const { return position_.at(motor); }

  bushd_converter core{};
  FrequencyConverter converter;
  bool supply = true;
  std::vector<std::uint8_t> answers;

 private:
  static std::uint16_t ms(TimeNs now_ns) { return static_cast<std::uint16_t>(now_ns / kMs - 500); }
  std::uint16_t pulses() const { return static_cast<std::uint16_t>(converter.pulses() - 3); }
  void look(TimeNs now_ns) {
    if (!bushd_converter_is_due(&core, ms(now_ns), pulses())) return;
    const std::uint8_t inputs = supply ? 0 : BUSHD_COMMUTATOR_SUPPLY_MISSING;
    const std::uint8_t made = bushd_converter_step(&core, pulses(), inputs);
    if ((made & BUSHD_COMMUTATOR_STEP_DONE) != 0) {
      position_.at(core.board.motor) += core.board.left ? -1 : 1;
    }
    converter.set_code(now_ns, core.code);
    answers.push_back(made | inputs);
  }

  TimeNs watch_ns_ = 0;  // when it is over, while a code waits
  std::array<std::int64_t, BUSHD_COMMUTATOR_MOTORS> position_{};
};

TEST(ConverterProgram, TheNextPulseIsTheStep) {
  ConverterPort port(kExact);
  port.receive(0, 0x80 | 5);
  EXPECT_EQ(port.core.code, 0);
  port.receive(0, 100);
  EXPECT_EQ(port.core.code, 100);
  port.advance(kMs - 1);
  EXPECT_THAT(port.answers, IsEmpty());
  port.advance(kMs);
  EXPECT_THAT(port.answers, ElementsAre(BUSHD_COMMUTATOR_STEP_DONE));
  EXPECT_EQ(port.core.code, 0) << "the converter stands while no code waits";
  EXPECT_EQ(port.position(5), 1);
  port.receive(kMs, 200);
  port.advance(2 * kMs);
  port.receive(2 * kMs, 0);
  port.receive(2 * kMs, 0x88 | 5);
  port.receive(2 * kMs, 50);
  port.advance(4 * kMs);
  EXPECT_EQ(port.position(5), 1);
}

TEST(ConverterProgram, PulsesForWhichNothingWaitsAreNoSteps) {
  ConverterPort port({.hz_per_code = 10, .offset_codes = 7});
  port.receive(0, 0x80);
  port.advance(1005 * kMs);
  EXPECT_EQ(port.converter.pulses(), 70u);
  EXPECT_THAT(port.answers, IsEmpty());
  port.receive(1005 * kMs, 1);
  port.receive(1006 * kMs, 255);
  EXPECT_EQ(port.core.code, 1) << "a code that comes while one waits is none";
  port.advance(1500 * kMs);
  EXPECT_THAT(port.answers, ElementsAre(BUSHD_COMMUTATOR_STEP_DONE));
  EXPECT_EQ(port.position(0), 1);
}

TEST(ConverterProgram, SaysThatNoPulseCame) {
  ConverterPort port({.hz_per_code = 10, .gives_pulses = false});
  port.receive(0, 0x80);
  port.receive(0, 255);
  port.advance(999 * kMs);
  EXPECT_THAT(port.answers, IsEmpty());
  port.advance(1000 * kMs);
  EXPECT_THAT(port.answers, ElementsAre(BUSHD_CONVERTER_NO_PULSE));
  EXPECT_EQ(port.core.code, 0);
  EXPECT_EQ(port.position(0), 0);
  // It is tried again with the next code.
  port.converter.set_character(1000 * kMs, kExact);
  port.receive(1000 * kMs, 100);
  port.advance(1001 * kMs);
  EXPECT_EQ(port.position(0), 1);
}

TEST(ConverterProgram, ZeroOrADamagedByteStopsTheConverter) {
  for (const bool damaged : {false, true}) {
    ConverterPort port(kExact);
    port.receive(0, 0x80);
    port.receive(0, 1);
    if (damaged) {
      port.receive_damaged(50 * kMs);
    } else {
      port.receive(50 * kMs, 0);
    }
    EXPECT_EQ(port.core.code, 0);
    port.advance(3000 * kMs);
    EXPECT_THAT(port.answers, IsEmpty());
    EXPECT_EQ(port.converter.pulses(), 0u);
  }
}

std::uint8_t random_byte() {
  switch (between(0, 4)) {
    case 0:
      return between<std::uint8_t>(0, 1) == 0 ? 0 : between<std::uint8_t>(0, 255);
    case 1:
      return between<std::uint8_t>(0x80, 0x8F);
    default:
      return between<std::uint8_t>(1, 250);
  }
}

TEST(ConverterProgram, DoesWhatTheModelDoesWhateverComes) {
  holds("same answers, positions and pulses", [] {
    const FrequencyConverter::Character character{.hz_per_code = between(2, 40) / 1.0,
                                                  .offset_codes = between(-30, 30) / 10.0,
                                                  .drift_per_s = between(-10, 10) / 1000.0};
    ConverterPort port(character);
    sim::CommutatorBoard model{FrequencyConverter(character)};
    std::vector<std::uint8_t> answers;
    TimeNs now_ns = 0;
    for (int left = between(1, 200); left > 0; --left) {
      now_ns += (between(0, 9) == 0 ? between<TimeNs>(0, 1500) : between<TimeNs>(0, 20)) * kMs;
      port.advance(now_ns);
      model.advance(now_ns);
      for (const std::uint8_t answer : model.take_answers()) answers.push_back(answer);
      RC_ASSERT(port.answers == answers);
      RC_ASSERT(port.core.code == model.converter().code());
      RC_ASSERT(port.converter.pulses() == model.converter().pulses());
      switch (between(0, 9)) {
        case 0:
          port.supply = model.supply = !port.supply;
          break;
        case 1:
          port.receive_damaged(now_ns);
          model.receive(now_ns, 0);
          break;
        default: {
          const std::uint8_t byte = random_byte();
          port.receive(now_ns, byte);
          model.receive(now_ns, byte);
        }
      }
    }
    for (unsigned motor = 0; motor < BUSHD_COMMUTATOR_MOTORS; ++motor) {
      RC_ASSERT(port.position(motor) == model.position(motor));
    }
  });
}

}  // namespace
}  // namespace bushd::converter_board_test
