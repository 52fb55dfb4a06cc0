// The image of a board in simavr that has booted, and its answers.
#pragma once

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

  AvrBoard board;
  std::vector<std::uint8_t> answers;
};

}  // namespace bushd::sim
