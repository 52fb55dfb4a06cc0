// Which moves are under way, and what became of each motor in them: a move that was accepted ends
// exactly once, when the last of its motors has.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/ids.h"
#include "words/words.h"

namespace bushd::motion {

using words::Outcome;

struct MotorOutcome {
  MotorId motor;
  Outcome outcome = Outcome::kFault;
  std::int64_t position_steps = 0;
  std::string reason;
};

struct MoveResult {
  std::uint64_t move = 0;
  Outcome outcome = Outcome::kFault;  // the worst of its motors', in the order of the enumeration
  std::string reason;                 // of the first motor with that outcome
  std::vector<MotorOutcome> motors;   // in the order given to open()
};

class MoveBook {
 public:
  // Precondition: no motor twice, none in a move that is open.
  std::uint64_t open(const std::vector<MotorId>& motors);

  // This motor's part has ended; returns the move's result if it was the last part. A motor without
  // an open move is ignored.
  std::optional<MoveResult> end(MotorOutcome outcome);

  // The open move of a motor.
  std::optional<std::uint64_t> move_of(MotorId motor) const;
  bool empty() const { return open_.empty(); }

 private:
  struct Open {
    MoveResult result;
    std::size_t left = 0;
  };
  std::unordered_map<std::uint64_t, Open> open_;
  struct Part {
    std::uint64_t move;
    std::size_t index;  // in its result
  };
  std::unordered_map<MotorId, Part> of_motor_;
  std::uint64_t last_ = 0;
};

}  // namespace bushd::motion
