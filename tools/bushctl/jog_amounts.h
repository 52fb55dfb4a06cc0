// How fast a motor is jogged by keys, and how long a step is: slow at first, by its table and unit.
#pragma once

#include <string>

#include "base/units/coordinates.h"
#include "tables/table.h"

namespace bushctl {

// In the motor's unit, and per second; or in steps.
struct JogAmounts {
  std::string unit;
  double speed = 0;  // as the table starts
  double least_speed = 0;
  double most_speed = 1e9;  // of the table's cruise
  double step = 0;          // about ten steps of the motor, a round number
  double least_step = 0;    // one of them

  // Doubled so often, or halved (negative), within these bounds. In steps a step stays whole.
  void change_speed(int doublings);
  void change_step(int doublings);
};

// `table`: the motor's, in which tables::check() finds nothing. Without it nothing is known of
// speeds: 0, and any is allowed.
JogAmounts jog_amounts(const bushd::tables::TableContent* table, const bushd::units::Scale& scale,
                       bool in_steps);

}  // namespace bushctl
