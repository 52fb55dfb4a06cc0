// Why no motion may begin now. A service that holds motions back adds its reason here, and no other
// service knows of it. It is asked twice: by who takes a request, and again where a run begins,
// which may be much later: homing whose turn has come, a leg, the next run of a line.
#pragma once

#include <functional>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

class Interlocks {
 public:
  explicit Interlocks(const Installation& installation) : installation_(installation) {}

  using ForAll = std::function<Result<void>()>;
  using ForMotor = std::function<Result<void>(MotorId)>;
  void add(ForAll check) { for_all_.push_back(std::move(check)); }
  void add(ForMotor check) { for_motor_.push_back(std::move(check)); }

  // Whatever is to move. Before motors are looked at: may_move(motor) asks this too.
  Result<void> may_move() const;
  // Any motion of this motor: what it does itself, its MCU, and whoever else holds it back. One
  // that moves may be given another target.
  Result<void> may_move(MotorId motor) const;
  // Whether it may be homed, which is what an MCU with `ready = "after-homing"` waits for.
  Result<void> may_home(MotorId motor) const;
  // A run of a motion that was taken, now: by Moves for all that has a plan, and by who has an MCU
  // move the motor by itself. What the motor does and who holds it back was asked when it was
  // taken.
  Result<void> may_begin(MotorId motor) const;

 private:
  Result<void> may_move_by(const Mcu& mcu) const;

  const Installation& installation_;
  std::vector<ForAll> for_all_;
  std::vector<ForMotor> for_motor_;
};

}  // namespace bushd::daemon
