#include "motion/move_book.h"

#include <algorithm>

namespace bushd::motion {

std::uint64_t MoveBook::open(const std::vector<MotorId>& motors) {
  const std::uint64_t id = ++last_;
  Open move;
  move.result.move = id;
  move.left = motors.size();
  for (const MotorId motor : motors) {
    of_motor_[motor] = {.move = id, .index = move.result.motors.size()};
    move.result.motors.push_back({.motor = motor, .reason = {}});
  }
  open_.emplace(id, std::move(move));
  return id;
}

std::optional<MoveResult> MoveBook::end(MotorOutcome outcome) {
  const auto of_motor = of_motor_.find(outcome.motor);
  if (of_motor == of_motor_.end()) return std::nullopt;
  const auto found = open_.find(of_motor->second.move);
  Open& move = found->second;
  move.result.motors[of_motor->second.index] = std::move(outcome);
  of_motor_.erase(of_motor);
  if (--move.left != 0) return std::nullopt;
  MoveResult result = std::move(move.result);
  open_.erase(found);
  const auto worst = std::max_element(
      result.motors.begin(), result.motors.end(),
      [](const MotorOutcome& a, const MotorOutcome& b) { return a.outcome < b.outcome; });
  result.outcome = worst->outcome;
  result.reason = worst->reason;
  return result;
}

std::optional<std::uint64_t> MoveBook::move_of(MotorId motor) const {
  const auto found = of_motor_.find(motor);
  if (found == of_motor_.end()) return std::nullopt;
  return found->second.move;
}

}  // namespace bushd::motion
