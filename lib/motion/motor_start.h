// The start of a motor's run where it does not come in time: the motor has missed it, or is not to
// begin at it since others of the same start cannot.
#pragma once

#include <string>

#include "engine/message.h"

namespace bushd::motion {

class Motor;

// To be used at once: the motor outlives it.
class MotorStart {
 public:
  explicit MotorStart(Motor& motor) : motor_(motor) {}

  // Its MCU did not get the first ticks in time. Whether it has missed its start by that: else the
  // next report says what has become of it.
  bool is_missed(const bushd_report& report) const;
  // It has missed its start. Whether it may have a new one: then it is late from now on, until it
  // is started, also while it is paused. On a line it stands where its run was to begin.
  bool awaits_new();
  // It should not begin at its start, and miss it: whether it can. If it begins all the same, it
  // goes on to its target; on a line it is stopped.
  bool withdraw();
  std::string missed_text() const;

 private:
  bool may_begin_anew() const;

  Motor& motor_;
};

}  // namespace bushd::motion
