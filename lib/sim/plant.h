// The motors behind the virtual MCUs' pins: they turn by STEP, DIR and EN alone and know nothing of
// the firmware's counters. Every step is checked against its motor's table (sim/pace.h).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sim/edge.h"
#include "sim/pace.h"

namespace bushd::sim {

class Plant final : public EdgeSink {
 public:
  explicit Plant(std::size_t mcus);

  // The motor at an output; `rules` outlive the plant. Steps at outputs without one are violations.
  void attach(std::size_t mcu, std::size_t output, const PaceRules& rules);

  // Something that must never happen.
  std::function<void(TimeNs time_ns, std::size_t mcu, std::size_t output, const std::string& what)>
      on_violation;

  void edge(const Edge& edge) override;
  void settled(TimeNs until_ns) override;

  // The MCU was reset: whatever moved was cut off, and is excused until it starts again.
  void cut(std::size_t mcu);

  // Where the motor stands, by its pulses since the beginning.
  std::int64_t position_steps(std::size_t mcu, std::size_t output) const {
    return motor_of_[mcu].at(output)->position_steps;
  }
  // The first pulse of its present or last movement.
  TimeNs first_step_ns(std::size_t mcu, std::size_t output) const {
    return motor_of_[mcu].at(output)->pace.first_ns();
  }
  // Pulses of all motors.
  std::uint64_t steps_made() const { return steps_made_; }

 private:
  struct Motor {
    explicit Motor(const PaceRules& rules) : pace(rules) {}
    Pace pace;
    std::int64_t position_steps = 0;
    bool forward = false;
  };

  void report(TimeNs time_ns, std::size_t mcu, std::size_t output, const Motor& motor, Jump jump);
  void violated(TimeNs time_ns, std::size_t mcu, std::size_t output, const std::string& what);

  std::vector<std::vector<std::unique_ptr<Motor>>> motor_of_;  // by MCU and output
  std::vector<bool> enabled_;                                  // by MCU
  std::uint64_t steps_made_ = 0;
};

}  // namespace bushd::sim
