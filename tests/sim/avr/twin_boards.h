// The image of a board in simavr, and the board of lib/sim, which shares no code with it: both get
// the same.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/avr/avr_board.h"
#include "sim/board_line.h"

namespace bushd::sim {

struct TwinBoards {
  // `clock`: F_start in Hz, or a converter of which each has its own.
  template <class Clock>
  TwinBoards(const std::string& image, std::uint32_t baud, const Clock& clock)
      : board(image, baud, clock), model(baud, clock) {
    advance();
  }

  void advance() {
    for (const std::uint8_t byte : board.advance(now_ns)) answers.push_back(byte);
    for (const std::uint8_t byte : model.advance(now_ns)) foretold.push_back(byte);
  }
  // Until the last of them has arrived.
  void send(std::span<const std::uint8_t> bytes, TimeNs byte_ns) {
    board.send(now_ns, bytes);
    model.send(now_ns, bytes);
    now_ns += static_cast<TimeNs>(bytes.size()) * byte_ns;
    advance();
  }
  // Answers and steps are the same, but that the image makes step i so much later; how late it may
  // be says `lateness`.
  void expect_same(const std::function<void(std::size_t i, TimeNs late_ns)>& lateness) const {
    EXPECT_EQ(answers, foretold);
    const auto& made = board.motors().steps();
    const auto& expected = model.motors().steps();
    ASSERT_EQ(made.size(), expected.size());
    for (std::size_t i = 0; i < made.size() && !testing::Test::HasFatalFailure(); ++i) {
      ASSERT_EQ(made[i].motor, expected[i].motor) << i;
      ASSERT_EQ(made[i].left, expected[i].left) << i;
      lateness(i, made[i].time_ns - expected[i].time_ns);
    }
    for (unsigned motor = 0; motor < BoardMotors::kMotors; ++motor) {
      EXPECT_EQ(board.motors().position(motor), model.motors().position(motor)) << motor;
    }
  }

  AvrBoard board;
  BoardLine model;
  TimeNs now_ns = AvrBoard::kBootNs;
  std::vector<std::uint8_t> answers;
  std::vector<std::uint8_t> foretold;
};

// How late steps were.
struct Lateness {
  void note(TimeNs late_ns) {
    earliest_ns = std::min(earliest_ns, late_ns);
    latest_ns = std::max(latest_ns, late_ns);
    ++steps;
  }
  void print() const {
    std::printf("%zu steps, %lld to %lld ns late\n", steps, static_cast<long long>(earliest_ns),
                static_cast<long long>(latest_ns));
  }
  TimeNs earliest_ns = INT64_MAX;
  TimeNs latest_ns = INT64_MIN;
  std::size_t steps = 0;
};

}  // namespace bushd::sim
