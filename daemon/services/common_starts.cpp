#include "daemon/services/common_starts.h"

#include <utility>

namespace bushd::daemon {

CommonStarts::CommonStarts(std::size_t motors) {
  while (of_.size() < motors) of_.add();
}

void CommonStarts::begin(const std::vector<MotorId>& motors) {
  const auto start = std::make_shared<Start>(Start{.motors = motors, .late = {}});
  for (const MotorId motor : motors) {
    leaves(motor);
    of_[motor] = start;
  }
}

void CommonStarts::misses(MotorId motor) {
  std::erase(of_[motor]->late, motor);
  of_[motor]->late.push_back(motor);
  heard_of_.push_back(of_[motor]);
}

void CommonStarts::begins(MotorId motor) {
  of_[motor]->begun = true;
  leaves(motor);
}

void CommonStarts::leaves(MotorId motor) {
  const auto start = std::exchange(of_[motor], nullptr);
  if (start == nullptr) return;
  std::erase(start->motors, motor);
  std::erase(start->late, motor);
  if (!start->late.empty()) heard_of_.push_back(start);
}

CommonStarts::Decision CommonStarts::decide() {
  Decision decision;
  for (const auto& start : std::exchange(heard_of_, {})) {
    if (start->late.empty()) continue;
    const bool all = start->late.size() == start->motors.size();
    if (!all && !start->begun) continue;
    const bool again = !start->begun && start->tries < kMostTries;
    std::vector<MotorId>& to = again ? decision.again : decision.end;
    to.insert(to.end(), start->late.begin(), start->late.end());
    start->late.clear();
    ++start->tries;
  }
  return decision;
}

}  // namespace bushd::daemon
