// The image of a board in simavr that has booted, and its answers.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "sim/avr/avr_board.h"

namespace bushd::sim {

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
