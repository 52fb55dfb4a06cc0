// What a master needs to know of moves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "bus/rs485/mcu_index.h"
#include "bus/rs485/tick.h"
#include "engine/run.h"

namespace bushd::link {

// What a motor does from some tick on: a run of its table, or its part of a line's run.
struct MotorPlan {
  bushd_run run;
  struct Line {
    std::uint32_t increment;  // engine/line.h
    std::uint32_t longest;
    std::uint32_t from;  // of the line's steps, where the run begins
    int direction;       // of the motor; that of the run says nothing
  };
  std::optional<Line> line;
};

class TickSource {
 public:
  virtual ~TickSource() = default;
  // Displacements of ticks first .. first+count-1 into out[0], out[stride], ...: fine ones as they
  // are, coarse ones as the byte's value. Returns the delay of the step running at the end, 0 when
  // the motor is at rest there for good. `first` may go back as far as the oldest tick that the MCU
  // has not reported as known.
  virtual std::uint16_t render(McuIndex mcu, std::uint8_t motor, Tick first, unsigned count,
                               std::int16_t* out, std::size_t stride) = 0;
  // The motor's run at the beginning of tick `first`, if it is one of its table and not over, and
  // for how many ticks (1 .. max_ticks) it gives what render() would.
  struct RunSegment {
    bushd_run run;
    unsigned ticks;
  };
  virtual std::optional<RunSegment> run_at(McuIndex mcu, std::uint8_t motor, Tick first,
                                           unsigned max_ticks) = 0;
  // The run as it is planned from the beginning of tick `at` on, or from its start, if that is
  // later; whatever it does then. Nothing: the motor has no plan, or one that is no run of its
  // table.
  virtual std::optional<bushd_run> plan_at(McuIndex, std::uint8_t, Tick) { return std::nullopt; }
  // As plan_at(), where the motor's run may be that of a line.
  virtual std::optional<MotorPlan> plan_on_line_at(McuIndex, std::uint8_t, Tick) {
    return std::nullopt;
  }
  // First tick after the motor's last step, as planned now.
  virtual Tick end_tick(McuIndex mcu, std::uint8_t motor) = 0;
};

}  // namespace bushd::link
