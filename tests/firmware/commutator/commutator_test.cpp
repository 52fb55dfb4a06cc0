// The program of a commutator board, against the board of lib/sim, which shares no code with it.
#include "firmware/commutator/commutator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/properties.h"
#include "heritage/commutator/exchange.h"
#include "sim/commutator_board.h"

namespace bushd::test {
namespace {

using sim::TimeNs;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint32_t kCountsPerS = 2'000'000;  // of the ATmega328P
constexpr TimeNs kCountNs = 500;
// unit is rounded up to a 256th of a count, so 255 codes of it to less than a count; their sum is
// rounded up to a count.
constexpr TimeNs kLatestNs = 2 * kCountNs;

struct Step {
  TimeNs time_ns;
  unsigned motor;
  bool left;
};

// A port that loses no time, and what stands around it: rotors that follow at once.
class Board {
 public:
  explicit Board(std::uint32_t start_hz) { bushd_commutator_begin(&core, start_hz, kCountsPerS); }

  struct Around {
    std::int64_t right_limit_at = INT64_MAX;
    std::int64_t left_limit_at = INT64_MIN;
    bool connected = true;
  };
  std::array<Around, BUSHD_COMMUTATOR_MOTORS> motors{};
  bool supply = true;

  // Times are whole counts.
  void receive(TimeNs now_ns, std::uint8_t byte) {
    advance(now_ns);
    bushd_commutator_receive(&core, counts(now_ns), byte);
  }
  void receive_damaged(TimeNs now_ns) {
    advance(now_ns);
    bushd_commutator_receive_damaged(&core);
  }
  void advance(TimeNs now_ns) {
    const auto left = static_cast<std::int32_t>(core.due - counts(now_ns));
    if (!bushd_commutator_is_due(&core, counts(now_ns))) {
      EXPECT_TRUE(!core.counting || left > 0);
      return;
    }
    const TimeNs due_ns = now_ns + left * kCountNs;
    EXPECT_FALSE(bushd_commutator_is_due(&core, counts(due_ns - kCountNs)));
    const unsigned motor = core.motor;
    const std::uint8_t before = bushd_commutator_windings(&core, core.motor);
    const bool done = bushd_commutator_step(&core, inputs(motor));
    turn(due_ns, motor, before);
    answers.push_back(bushd_commutator_status(done, inputs(motor)));
  }
  std::int64_t position(unsigned motor) const { return position_.at(motor); }

  bushd_commutator core{};
  std::vector<Step> steps;  // by what windings did
  std::vector<std::uint8_t> answers;

 private:
  // The clock is about to overflow when the board begins.
  static std::uint32_t counts(TimeNs ns) {
    return static_cast<std::uint32_t>(ns / kCountNs) - 1'000'000;
  }
  std::uint8_t inputs(unsigned motor) const {
    const Around& around = motors.at(motor);
    unsigned bits = 0;
    if (position_.at(motor) >= around.right_limit_at) bits |= BUSHD_COMMUTATOR_RIGHT_LIMIT;
    if (position_.at(motor) <= around.left_limit_at) bits |= BUSHD_COMMUTATOR_LEFT_LIMIT;
    if (!supply) bits |= BUSHD_COMMUTATOR_SUPPLY_MISSING;
    if (!around.connected) bits |= BUSHD_COMMUTATOR_NOT_CONNECTED;
    return static_cast<std::uint8_t>(bits);
  }
  // Right: the winding that was on alone beside the next one takes that one along, and the other
  // goes off: a rotation of the mask by one.
  void turn(TimeNs now_ns, unsigned motor, std::uint8_t before) {
    const std::uint8_t after = bushd_commutator_windings(&core, static_cast<std::uint8_t>(motor));
    if (after == before) return;
    const auto right = static_cast<std::uint8_t>((before << 1 | before >> 3) & 0xF);
    const auto left = static_cast<std::uint8_t>((before >> 1 | before << 3) & 0xF);
    ASSERT_TRUE(after == right || after == left) << int{before} << " to " << int{after};
    position_.at(motor) += after == right ? 1 : -1;
    steps.push_back({now_ns, motor, after == left});
  }

  std::array<std::int64_t, BUSHD_COMMUTATOR_MOTORS> position_{};
};

TEST(CommutatorProgram, CountsTheCodeAndTurnsTheMotorOfTheHeader) {
  Board board(100);
  board.receive(0, 0);
  board.receive(0, 0x80 | 5);
  board.receive(0, 250);
  board.advance(10'000'000 - kCountNs);
  EXPECT_THAT(board.answers, IsEmpty());
  board.advance(10'000'000);
  EXPECT_THAT(board.answers, ElementsAre(BUSHD_COMMUTATOR_STEP_DONE));
  EXPECT_EQ(board.position(5), 1);
  // Without a header the same motor goes on.
  board.receive(10'000'000, 10);
  board.advance(10'400'000);
  EXPECT_EQ(board.position(5), 2);
  board.receive(10'400'000, 0);
  board.receive(10'400'000, 0x80 | 8 | 5);
  board.receive(10'400'000, 10);
  board.advance(10'800'000);
  EXPECT_EQ(board.position(5), 1);
}

TEST(CommutatorProgram, MakesNoStepWithoutSupplyOrMotor) {
  Board board(100);
  board.receive(0, 0x81);
  board.supply = false;
  board.receive(0, 10);
  board.advance(400'000);
  board.supply = true;
  board.motors[1].connected = false;
  board.receive(400'000, 10);
  board.advance(800'000);
  EXPECT_THAT(board.steps, IsEmpty());
  EXPECT_THAT(board.answers,
              ElementsAre(BUSHD_COMMUTATOR_SUPPLY_MISSING, BUSHD_COMMUTATOR_NOT_CONNECTED));
}

// Both boards: whose motion was cut off begins anew with a zero, and what it was told before means
// nothing any more.
TEST(CommutatorProgram, ZeroDropsTheCodeThatIsCounted) {
  Board board(100);
  sim::CommutatorBoard model(100);
  for (const int sent : {0x81, 250, 0, 0x8A, 10}) {
    const auto byte = static_cast<std::uint8_t>(sent);
    board.receive(1'000'000, byte);
    model.receive(1'000'000, byte);
  }
  board.advance(20'000'000);
  model.advance(20'000'000);
  EXPECT_EQ(board.position(1), 0);
  EXPECT_EQ(board.position(2), -1);
  EXPECT_EQ(model.position(1), 0);
  EXPECT_EQ(model.position(2), -1);
  ASSERT_EQ(board.steps.size(), 1u);
  EXPECT_EQ(board.steps[0].time_ns, 1'400'000);
  EXPECT_EQ(model.steps().at(0).time_ns, 1'400'000);
}

// Else the header that follows a damaged zero would be a code of the motor before.
TEST(CommutatorProgram, TakesADamagedByteForAZero) {
  Board board(100);
  board.receive(0, 0x81);
  board.receive_damaged(0);
  board.receive(0, 0x82);
  board.receive(0, 10);
  board.advance(1'000'000);
  EXPECT_EQ(board.position(1), 0);
  EXPECT_EQ(board.position(2), 1);
}

TEST(CommutatorProgram, WaitsForNothingButAHeaderOfItsForm) {
  for (unsigned byte = 1; byte <= 255; ++byte) {
    Board board(100);
    board.receive(0, static_cast<std::uint8_t>(byte));
    board.receive(0, 10);
    board.advance(1'000'000);
    EXPECT_EQ(board.answers.size(), byte / 16 == 8 ? 1u : 0u) << byte;
  }
}

// Each code of each F_start, against the fraction that it stands for.
TEST(CommutatorProgram, NoCodeIsShorterThanItIsOrLongerByTwoCounts) {
  for (std::uint32_t start_hz = 1; start_hz <= BUSHD_COMMUTATOR_MAX_START_HZ; ++start_hz) {
    bushd_commutator board;
    bushd_commutator_begin(&board, start_hz, kCountsPerS);
    bushd_commutator_receive(&board, 0, 0x80);
    for (std::uint32_t code = 1; code <= 255; ++code) {
      board.counting = false;
      bushd_commutator_receive(&board, 0, static_cast<std::uint8_t>(code));
      const std::uint64_t codes_per_s = std::uint64_t{250} * start_hz;
      const std::uint64_t exact = std::uint64_t{code} * kCountsPerS;  // times codes_per_s
      ASSERT_GE(board.due * codes_per_s, exact) << start_hz << ' ' << code;
      ASSERT_LT(board.due * codes_per_s, exact + 2 * codes_per_s) << start_hz << ' ' << code;
    }
  }
}

std::uint8_t random_byte() {
  switch (between(0, 5)) {
    case 0:
      return 0;
    case 1:
      return between<std::uint8_t>(0x80, 0x8F);
    case 2:
    case 3:
      return between<std::uint8_t>(1, 250);
    case 4:
      return between<std::uint8_t>(1, 20);
    default:
      return between<std::uint8_t>(0, 255);
  }
}

TEST(CommutatorProgram, DoesWhatTheModelDoesWhateverComes) {
  holds("same steps, answers and positions, and times to two counts", [] {
    const std::uint32_t start_hz = between(1u, 100u);
    const TimeNs code_ns = 1'000'000'000 / (250 * static_cast<TimeNs>(start_hz));
    Board board(start_hz);
    sim::CommutatorBoard model(start_hz);
    std::vector<std::uint8_t> answers;
    TimeNs now_ns = 0;
    for (int left = between(1, 300); left > 0; --left) {
      now_ns += between<TimeNs>(0, 40 * code_ns) / kCountNs * kCountNs;
      // Which of the two is first, a step or what comes with it, is no matter of this test.
      const TimeNs due_ns = model.next_event_ns();
      if (now_ns + kCountNs >= due_ns && now_ns <= due_ns + kLatestNs) now_ns += 4 * kCountNs;
      board.advance(now_ns);
      model.advance(now_ns);
      const unsigned motor = between(0u, 7u);
      switch (between(0, 11)) {
        case 0:
          board.supply = model.supply = !board.supply;
          break;
        case 1:
          board.motors[motor].connected = model.motor(motor).connected =
              !board.motors[motor].connected;
          break;
        case 2:
          board.motors[motor].right_limit_at = model.motor(motor).right_limit_at =
              between<std::int64_t>(-3, 6);
          break;
        case 3:
          board.motors[motor].left_limit_at = model.motor(motor).left_limit_at =
              between<std::int64_t>(-6, 3);
          break;
        case 4:
          board.receive_damaged(now_ns);
          model.receive(now_ns, 0);
          break;
        default: {
          const std::uint8_t byte = random_byte();
          board.receive(now_ns, byte);
          model.receive(now_ns, byte);
        }
      }
    }
    now_ns += 300 * code_ns;
    board.advance(now_ns / kCountNs * kCountNs);
    model.advance(now_ns);
    RC_ASSERT(board.answers == model.take_answers());
    RC_ASSERT(board.steps.size() == model.steps().size());
    for (std::size_t i = 0; i < board.steps.size(); ++i) {
      const auto& made = board.steps[i];
      const auto& foretold = model.steps()[i];
      RC_ASSERT(made.motor == foretold.motor && made.left == foretold.left);
      RC_ASSERT(made.time_ns >= foretold.time_ns && made.time_ns - foretold.time_ns <= kLatestNs);
    }
    for (unsigned motor = 0; motor < BUSHD_COMMUTATOR_MOTORS; ++motor) {
      RC_ASSERT(board.position(motor) == model.position(motor));
    }
  });
}

// What the daemon sends, and how it reads the answers.
TEST(CommutatorProgram, UnderstandsTheExchangeOfTheDaemon) {
  holds("each step that is asked for is made, once, by the motor and in the direction", [] {
    const std::uint32_t start_hz = between(1u, 100u);
    commutator::Exchange exchange({.start_hz = start_hz, .baud = 500'000});
    Board board(start_hz);
    std::array<std::int64_t, BUSHD_COMMUTATOR_MOTORS> counted{};
    TimeNs now_ns = 0;
    for (int left = between(1, 50); left > 0; --left) {
      const unsigned motor = between(0u, 7u);
      const bool to_left = *rc::gen::arbitrary<bool>();
      const auto code = between<std::uint64_t>(1, 250);
      exchange.step(now_ns / 1000, motor, to_left, code * exchange.unit_ns());
      for (const std::uint8_t byte : exchange.take_bytes()) {
        board.receive(now_ns, byte);
        now_ns += 20'000;
      }
      now_ns += static_cast<TimeNs>((code + 1) * exchange.unit_ns()) / 1000 * 1000;
      board.answers.clear();
      board.advance(now_ns);
      RC_ASSERT(board.answers.size() == 1);
      const auto event = exchange.receive(now_ns / 1000, board.answers[0]);
      RC_ASSERT(event.answer && event.answer->status == commutator::Status{.step_done = true});
      counted.at(motor) += to_left ? -1 : 1;
    }
    for (unsigned motor = 0; motor < BUSHD_COMMUTATOR_MOTORS; ++motor) {
      RC_ASSERT(board.position(motor) == counted.at(motor));
    }
  });
}

}  // namespace
}  // namespace bushd::test
