// The image of a board in simavr that has booted, and its answers.
#pragma once

#include <gmock/gmock.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "sim/avr/avr_board.h"

namespace bushd::sim {

constexpr std::uint32_t kFastBaud = 500'000;
constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kWatchdogNs = 130 * kMs;  // 120 ms, and the boot
constexpr std::uint8_t kDone = 0x10;       // an answer: the step is made

class BootedBoard {
 public:
  template <class... Arguments>
  explicit BootedBoard(Arguments&&... of_board) : board(std::forward<Arguments>(of_board)...) {
    pass(AvrBoard::kBootNs);
  }
  void pass(TimeNs ns) {
    for (const std::uint8_t byte : board.advance(board.advanced_to_ns() + ns)) {
      answers.push_back(byte);
    }
  }
  void send(const std::vector<std::uint8_t>& bytes) { board.send(board.advanced_to_ns(), bytes); }

  // One code after the other, each of a step that is over within a ms.
  void step(const std::vector<std::uint8_t>& bytes) {
    send(bytes);
    pass(kMs);
  }

  AvrBoard board;
  std::vector<std::uint8_t> answers;
};

inline void expect_first_phases(const BootedBoard& image) {
  for (unsigned motor = 0; motor < BoardMotors::kMotors; ++motor) {
    EXPECT_EQ(image.board.latch(motor), 0b0011) << motor;
    EXPECT_EQ(image.board.motors().position(motor), 0);
  }
  EXPECT_EQ(image.board.latched(), BoardMotors::kMotors);
}

// `code`: of a step that is over within a ms, here and below.
inline void expect_inputs_are_told(BootedBoard& image, std::uint8_t code) {
  BoardMotors& motors = image.board.motors();
  motors.motor(3).right_limit_at = 2;
  motors.motor(4).left_limit_at = 0;  // of another motor
  image.step({0, 0x83, code});
  image.step({code});
  motors.supply = false;
  image.step({code});
  motors.supply = true;
  motors.motor(3).connected = false;
  image.step({code});
  motors.motor(3).connected = true;
  image.step({0, 0x8B, code});
  EXPECT_THAT(image.answers, testing::ElementsAre(kDone, kDone | 1, 1 | 4, 1 | 8, kDone));
  EXPECT_EQ(motors.position(3), 1);
}

// A break while a step is awaited: it is not made, and what follows is a header.
inline void expect_a_break_is_a_zero(BootedBoard& image, std::uint8_t slow_code,
                                     std::uint8_t code) {
  image.step({0, 0x81, slow_code});
  image.board.send_break(image.board.advanced_to_ns());
  image.send({0x82, code});
  image.pass(10 * kMs);
  EXPECT_THAT(image.answers, testing::ElementsAre(kDone));
  EXPECT_EQ(image.board.motors().position(1), 0);
  EXPECT_EQ(image.board.motors().position(2), 1);
}

}  // namespace bushd::sim
