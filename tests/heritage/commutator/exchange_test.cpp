// The exchange with a board, byte by byte, and against a board that shares no code with it.
#include "heritage/commutator/exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "engine/properties.h"
#include "sim/commutator_board.h"

namespace bushd::test {
namespace {

using commutator::Exchange;
using commutator::Status;
using sim::CommutatorBoard;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint64_t kUnitNs = 40'000;  // 1 / (250 x 100 Hz)
constexpr Exchange::Setup kFast{.start_hz = 100, .baud = 1'000'000};

TEST(Exchange, HeaderOnceThenACodePerStep) {
  Exchange exchange(kFast);
  exchange.step(0, 3, false, 250 * kUnitNs);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(0, 0x83, 250));
  EXPECT_FALSE(exchange.free());
  const auto answered = exchange.receive(20'000, 0x10);
  ASSERT_TRUE(answered.answer);
  EXPECT_EQ(answered.answer->status, (Status{.step_done = true}));
  ASSERT_TRUE(exchange.free());
  exchange.step(20'000, 3, false, 10 * kUnitNs);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(10));
  exchange.receive(20'400, 0x10);
  exchange.step(20'400, 3, true, 10 * kUnitNs);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(0, 0x8B, 10));
}

// The last answer comes a second time, or something else that nobody has sent.
TEST(Exchange, NoAnswerComesBeforeHalfOfItsDelay) {
  Exchange exchange(kFast);
  exchange.step(0, 0, false, 100 * kUnitNs);
  const auto early = exchange.receive(1'999, 0x10);
  EXPECT_TRUE(early.stray);
  EXPECT_FALSE(early.answer);
  EXPECT_FALSE(exchange.free());
  EXPECT_TRUE(exchange.receive(2'001, 0x10).answer);
}

TEST(Exchange, StatusHasAMeaningForEachOfFiveBits) {
  EXPECT_EQ(commutator::status_of(0x01), (Status{.right_limit = true}));
  EXPECT_EQ(commutator::status_of(0x02), (Status{.left_limit = true}));
  EXPECT_EQ(commutator::status_of(0x04), (Status{.supply_missing = true}));
  EXPECT_EQ(commutator::status_of(0x08), (Status{.not_connected = true}));
  EXPECT_EQ(commutator::status_of(0x10), (Status{.step_done = true}));
  for (unsigned byte = 0x20; byte <= 0xFF; ++byte) {
    EXPECT_FALSE(commutator::status_of(static_cast<std::uint8_t>(byte))) << byte;
  }
}

TEST(Exchange, DelaysAreRoundedUpToCodesAndLongOnesAreHeldBack) {
  Exchange exchange(kFast);
  exchange.step(0, 0, false, 10 * kUnitNs + 1);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(0, 0x80, 11));
  exchange.receive(440, 0x10);
  exchange.step(1000, 0, false, 1);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(1));
  exchange.receive(1100, 0x10);
  // 1255 codes: 1000 of them, 40 ms, are waited here.
  exchange.step(2000, 0, false, 1255 * kUnitNs);
  EXPECT_THAT(exchange.take_bytes(), IsEmpty());
  EXPECT_EQ(exchange.next_wake_us(), 42'000);
  exchange.advance(41'999);
  EXPECT_THAT(exchange.take_bytes(), IsEmpty());
  EXPECT_FALSE(exchange.free());
  exchange.advance(42'000);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(255));
}

TEST(Exchange, StepIsCancelledAsLongAsItsCodeIsHere) {
  Exchange exchange(kFast);
  EXPECT_FALSE(exchange.cancel());
  exchange.step(0, 0, false, 1000 * kUnitNs);
  EXPECT_TRUE(exchange.cancel());
  EXPECT_TRUE(exchange.free());
  exchange.step(0, 0, false, 100 * kUnitNs);
  EXPECT_FALSE(exchange.cancel());
  EXPECT_FALSE(exchange.free());
}

TEST(Exchange, AnswerIsOverdueAfterTwiceTheDelayAnd100Ms) {
  Exchange exchange(kFast);
  exchange.step(0, 0, false, 250 * kUnitNs);
  // Four bytes on the bus, 40 us; twice 10 ms; 100 ms; each rounded up by a microsecond or two.
  EXPECT_EQ(exchange.next_wake_us(), 40 + 1 + 2 * 10'001 + 100'000);
  EXPECT_FALSE(exchange.advance(exchange.next_wake_us() - 1).lost);
  const auto overdue = exchange.advance(exchange.next_wake_us());
  ASSERT_TRUE(overdue.lost);
  EXPECT_EQ(overdue.lost->cause, "the board did not answer");
  EXPECT_TRUE(exchange.free());
  // What comes now answers nothing, and the next step selects the motor anew.
  EXPECT_TRUE(exchange.receive(200'000, 0x10).stray);
  exchange.take_bytes();
  exchange.step(200'000, 0, false, kUnitNs);
  EXPECT_THAT(exchange.take_bytes(), ElementsAre(0, 0x80, 1));
}

TEST(Exchange, ByteThatIsNoStatusLeavesTheStepUnknown) {
  Exchange exchange(kFast);
  exchange.step(0, 0, false, kUnitNs);
  const auto event = exchange.receive(100, 0xFF);
  ASSERT_TRUE(event.lost);
  EXPECT_EQ(event.lost->cause, "the board answered with 0xff, which is no status");
}

TEST(CommutatorBoard, TakesACodeForAHeaderOnlyAfterZero) {
  CommutatorBoard board(100);
  // It waits for a code of some motion that was never finished.
  board.receive(0, 0x80);
  board.receive(1'000, 0x85);
  board.advance(1'000'000'000);
  EXPECT_EQ(board.position(0), 1);
  board.receive(1'000'000'001, 0);
  board.receive(1'000'000'002, 0x85);
  board.receive(1'000'000'003, 10);
  board.advance(2'000'000'000);
  EXPECT_EQ(board.position(0), 1);
  EXPECT_EQ(board.position(5), 1);
  EXPECT_THAT(board.take_answers(), ElementsAre(0x10, 0x10));
}

// Who begins anew does not know that something is being counted: it would be a step of the motor
// that is named now, and its answer would be taken for that to the code.
TEST(CommutatorBoard, DropsTheCodeThatIsCountedWithZero) {
  CommutatorBoard board(100);
  for (const int byte : {0x81, 250, 0, 0x8A, 10}) board.receive(0, static_cast<std::uint8_t>(byte));
  board.advance(400'000);
  EXPECT_THAT(board.take_answers(), ElementsAre(0x10));
  board.advance(20'000'000);
  EXPECT_THAT(board.take_answers(), IsEmpty());
  EXPECT_EQ(board.position(1), 0);
  EXPECT_EQ(board.position(2), -1);
}

TEST(CommutatorBoard, WaitsForNothingButAHeaderOfItsForm) {
  for (unsigned byte = 1; byte <= 255; ++byte) {
    CommutatorBoard board(100);
    board.receive(0, static_cast<std::uint8_t>(byte));
    board.receive(0, 10);
    board.advance(1'000'000);
    EXPECT_EQ(board.take_answers().size(), byte / 16 == 8 ? 1u : 0u) << byte;
  }
}

// Exchange and board on a line whose bytes take their time.
class Line {
 public:
  explicit Line(Exchange::Setup setup)
      : exchange(setup), board(setup.start_hz), byte_ns_(10'000'000'000 / setup.baud) {}

  // Until the step asked for has been answered or given up. Answers reach the exchange rounded up
  // to a microsecond, as clocks of programs tell them.
  Exchange::Event finish() {
    while (true) {
      send();
      Exchange::Event event;
      if (board.next_event_ns() <= exchange.next_wake_us() * 1000 - byte_ns_) {
        now_us = (board.next_event_ns() + byte_ns_ + 999) / 1000;
        board.advance(now_us * 1000);
        for (const std::uint8_t byte : board.take_answers()) {
          event = exchange.receive(now_us, garbles ? static_cast<std::uint8_t>(byte | 0x40) : byte);
        }
      } else {
        now_us = exchange.next_wake_us();
        event = exchange.advance(now_us);
      }
      if (event.answer || event.lost) return event;
    }
  }

  Exchange exchange;
  CommutatorBoard board;
  std::int64_t now_us = 0;
  bool garbles = false;
  std::vector<std::uint8_t> codes;  // without zeros and headers

 private:
  void send() {
    std::int64_t at_ns = now_us * 1000;
    const auto bytes = exchange.take_bytes();
    for (const std::uint8_t byte : bytes) board.receive(at_ns += byte_ns_, byte);
    if (!bytes.empty()) codes.push_back(bytes.back());
  }

  const std::int64_t byte_ns_;
};

TEST(Exchange, StepsAreMadeAtTheirDelaysAndNeverEarlier) {
  holds("a step is as far from the one before as asked for, or farther by code, line and clock",
        [] {
          const std::uint32_t start_hz = between(1u, 100u);
          const std::uint32_t baud =
              *rc::gen::elementOf(std::vector<std::uint32_t>{300, 9600, 1'000'000});
          Line line({.start_hz = start_hz, .baud = baud});
          const std::uint64_t unit_ns = line.exchange.unit_ns();
          const std::int64_t byte_ns = 10'000'000'000 / baud;
          std::array<std::int64_t, 8> counted{};
          for (int i = between(1, 30); i > 0; --i) {
            const unsigned motor = between(0u, 7u);
            const bool left = *rc::gen::arbitrary<bool>();
            const std::uint64_t delay_ns =
                between<std::uint64_t>(1, 400) * unit_ns + between(0u, 999u);
            const std::int64_t asked_ns = line.now_us * 1000;
            line.exchange.step(line.now_us, motor, left, delay_ns);
            const auto event = line.finish();
            RC_ASSERT(event.answer && event.answer->status == Status{.step_done = true});
            counted.at(motor) += left ? -1 : 1;
            const auto& step = line.board.steps().back();
            RC_ASSERT(step.motor == motor && step.left == left);
            const auto taken_ns = static_cast<std::uint64_t>(step.time_ns - asked_ns);
            RC_ASSERT(taken_ns >= delay_ns);
            // A code more, three bytes, and a clock of whole microseconds.
            RC_ASSERT(taken_ns <=
                      delay_ns + unit_ns + 3 * static_cast<std::uint64_t>(byte_ns) + 2000);
          }
          for (unsigned motor = 0; motor < 8; ++motor) {
            RC_ASSERT(line.board.position(motor) == counted.at(motor));
          }
        });
}

TEST(Exchange, WhatIsLostIsOneStepEachAndSaid) {
  holds("counts differ by what was said to be lost at the most", [] {
    Line line({.start_hz = 50, .baud = 9600});
    std::int64_t counted = 0;
    std::int64_t lost = 0;
    std::int64_t refused = 0;
    for (int i = between(1, 60); i > 0; --i) {
      const int fault = between(0, 9);
      line.board.cut = fault == 0;
      line.board.loses_answers = fault == 1;
      line.garbles = fault == 2;
      line.board.supply = fault != 3;
      line.board.motor(2).connected = fault != 4;
      line.exchange.step(line.now_us, 2, false, between<std::uint64_t>(1, 250) * 80'000);
      const auto event = line.finish();
      RC_ASSERT(event.lost.has_value() == (fault <= 2));
      if (event.lost) ++lost;
      if (!event.answer) continue;
      counted += event.answer->status.step_done ? 1 : 0;
      refused += event.answer->status.step_done ? 0 : 1;
      RC_ASSERT(event.answer->status.supply_missing == (fault == 3));
      RC_ASSERT(event.answer->status.not_connected == (fault == 4));
    }
    RC_ASSERT(line.board.position(2) >= counted);
    RC_ASSERT(line.board.position(2) <= counted + lost);
  });
}

TEST(Exchange, AnyBytesAtAnyTimeEndEachStepOnce) {
  holds("one answer or loss for each step, whatever comes", [] {
    Exchange exchange({.start_hz = between(1u, 100u), .baud = 9600});
    std::int64_t now_us = 0;
    int asked = 0;
    int ended = 0;
    for (int i = between(1, 200); i > 0; --i) {
      now_us += between(0, 300'000);
      Exchange::Event event;
      switch (between(0, 3)) {
        case 0:
          event = exchange.receive(now_us, between<std::uint8_t>(0, 255));
          break;
        case 1:
          event = exchange.advance(now_us);
          break;
        case 2:
          if (exchange.cancel()) ++ended;
          break;
        default:
          if (!exchange.free()) break;
          exchange.step(now_us, between(0u, 7u), *rc::gen::arbitrary<bool>(),
                        between<std::uint64_t>(0, 65'535'000'000'000));
          ++asked;
      }
      if (event.answer || event.lost) ++ended;
      RC_ASSERT(!(event.answer && event.lost));
      RC_ASSERT(asked - ended == (exchange.free() ? 0 : 1));
      exchange.take_bytes();
    }
  });
}

}  // namespace
}  // namespace bushd::test
