// What BUSHD-2 wants of motors: the commutators behind its serial line. Whoever implements this
// makes the steps and tells the module about them (Bushd2::answer, ends); called from within the
// module's functions, it must not call back into the module.
#pragma once

#include <cstdint>
#include <vector>

namespace bushd::camac {

// What a commutator knows of a motor.
struct MotorStatus {
  bool right_limit = false;
  bool left_limit = false;
  bool supply_missing = false;
  bool not_connected = false;

  // Nothing can move in this direction.
  bool bars(bool left) const {
    return supply_missing || not_connected || (left ? left_limit : right_limit);
  }
  bool any() const { return right_limit || left_limit || supply_missing || not_connected; }
  friend bool operator==(const MotorStatus&, const MotorStatus&) = default;
};

// One motion of BUSHD-2: before step k (from 0) of N stands delay code min(k, N - 1 - k, 237).
struct Program {
  int page = 0;                       // of the memory, 0..3
  int motor = 0;                      // 0..31
  bool left = false;                  // in reverse
  std::uint32_t steps = 0;            // 1..65535
  std::vector<std::uint8_t> codes{};  // the page's 238, next to rest first; none is 0
};

class Motors {
 public:
  virtual ~Motors() = default;

  virtual MotorStatus status(int motor) = 0;
  // Precondition: the status does not bar it. False: it cannot be made, and nothing moves.
  virtual bool move(const Program& program) = 0;
  // Before its next step, or as soon as the motor can stop without losing any. To be answered by
  // Bushd2::ends.
  virtual void stop(int motor) = 0;
};

}  // namespace bushd::camac
