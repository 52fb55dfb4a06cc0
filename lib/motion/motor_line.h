// A motor on a line with others: as start(), aim() and arm() of it, for its share of the line.
#pragma once

#include <cstdint>

#include "engine/table.h"
#include "motion/axis.h"

namespace bushd::motion {

class Motor;
struct OnLine;

// To be used at once: the motor outlives it. Shortest delays are those of Axis, in the line's time
// units.
class MotorLine {
 public:
  explicit MotorLine(Motor& motor) : motor_(motor) {}

  void start(const OnLine& on_line, LineShare share, Tick start, bushd_delay shortest_delay);
  void aim(const OnLine& on_line, std::uint32_t line_step, bushd_delay shortest_delay);
  void arm(std::uint8_t number, const OnLine& on_line, LineShare share, bushd_delay shortest_delay);

 private:
  Motor& motor_;
};

}  // namespace bushd::motion
