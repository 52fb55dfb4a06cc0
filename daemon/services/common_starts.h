// Runs that begin together, each at the same tick of its bus: all of them, or none. A motor misses
// its start when its first ticks come too late at its MCU. Reports tell of motors one after the
// other; when it is known of all, they begin anew, or those that have missed the start end.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "base/by_id.h"
#include "base/ids.h"

namespace bushd::daemon {

class CommonStarts {
 public:
  // A start is tried so often at most.
  static constexpr unsigned kMostTries = 6;

  explicit CommonStarts(std::size_t motors);

  // These are to begin, for the first time.
  void begin(const std::vector<MotorId>& motors);
  // Nobody has heard yet whether it has begun.
  bool waits(MotorId motor) const { return of_[motor] != nullptr; }
  // Its start has not been tried before.
  bool is_first(MotorId motor) const { return waits(motor) && of_[motor]->tries == 1; }
  // What is heard of a motor for which waits() holds: it has missed the start, or it has begun.
  void misses(MotorId motor);
  void begins(MotorId motor);
  // It does not begin with the others, which go on without it.
  void leaves(MotorId motor);

  // What follows from all that was heard since.
  struct Decision {
    std::vector<MotorId> again{};  // together with those of the same start
    std::vector<MotorId> end{};
  };
  Decision decide();

 private:
  struct Start {
    std::vector<MotorId> motors;  // that have not begun, or of which nobody has heard
    std::vector<MotorId> late;    // those of them that have missed it
    bool begun = false;           // by one
    unsigned tries = 1;
  };

  ById<MotorId, std::shared_ptr<Start>> of_;
  std::vector<std::shared_ptr<Start>> heard_of_;  // since decide()
};

}  // namespace bushd::daemon
