// The motors behind the virtual MCUs' pins: they turn by STEP, DIR (or the common one) and EN alone
// and know nothing of the firmware's counters. Every step is checked against its motor's table
// (sim/pace.h).
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/edge.h"
#include "sim/pace.h"
#include "sim/rotor.h"

namespace bushd::sim {

class Plant final : public EdgeSink {
 public:
  explicit Plant(std::size_t mcus);

  // The motor at an output; `rules` outlive the plant. Steps at outputs without one are violations.
  void attach(std::size_t mcu, std::size_t output, const PaceRules& rules);

  // A motion of the motor begins with its next step (sim/pace.h).
  void begin(std::size_t mcu, std::size_t output) { motor_of_[mcu].at(output)->pace.begin(); }
  // The motor's next motion, from rest, is one of a line; and it rests after that (sim/pace.h).
  void begin_on_line(TimeNs now_ns, std::size_t mcu, std::size_t output) {
    motor_of_[mcu].at(output)->pace.begin_on_line(now_ns);
  }
  void forget_line(std::size_t mcu, std::size_t output) {
    motor_of_[mcu].at(output)->pace.forget_line();
  }
  void rest_on_line(TimeNs now_ns, std::size_t mcu, std::size_t output, bool rests);

  // Puts a rotor on that motor; `rules` outlive the plant. It slips where the torque does not hold
  // it, which is a violation. Its driver is taken to be on all the time.
  void couple(std::size_t mcu, std::size_t output, const RotorRules& rules);

  // Something that must never happen.
  std::function<void(TimeNs time_ns, std::size_t mcu, std::size_t output, const std::string& what)>
      on_violation;

  // A step has been made.
  std::function<void(TimeNs time_ns, std::size_t mcu, std::size_t output, bool positive)> on_step;

  // A motor that an emergency stop has stopped immediately in motion: a real one may have overrun.
  std::function<void(TimeNs time_ns, std::size_t mcu, std::size_t output)> on_cut_off;

  void edge(const Edge& edge) override;
  void settled(TimeNs until_ns) override;

  // The MCU was reset: whatever moved was cut off, and is excused until it starts again.
  void cut(std::size_t mcu);

  // An emergency stop has reached the MCU. From two ticks later on its motors make no step
  // (`immediate`), or ramp down; none starts until release(). Drivers may be off from the start of
  // an immediate one on: the steps of these two ticks turn nothing, and are counted.
  void halt(std::size_t mcu, TimeNs now_ns, bool immediate);
  void release(std::size_t mcu);

  // Where the motor stands, by its pulses since the beginning.
  std::int64_t position_steps(std::size_t mcu, std::size_t output) const {
    return motor_of_[mcu].at(output)->position_steps;
  }
  // The same, by the pulses before t_ns. Precondition: that was at most a tick ago.
  std::int64_t position_steps_before(std::size_t mcu, std::size_t output, TimeNs t_ns) const;
  // Precondition: coupled.
  const Rotor& rotor(std::size_t mcu, std::size_t output) const {
    return *motor_of_[mcu].at(output)->rotor;
  }
  // The first pulse of its present or last motion.
  TimeNs first_step_ns(std::size_t mcu, std::size_t output) const {
    return motor_of_[mcu].at(output)->pace.first_ns();
  }
  // And the last one, so far.
  TimeNs last_step_ns(std::size_t mcu, std::size_t output) const {
    return motor_of_[mcu].at(output)->pace.last_ns();
  }
  // Pulses of all motors.
  std::uint64_t steps_made() const { return steps_made_; }

 private:
  struct Halt {
    TimeNs from_ns;
    bool immediate;
    // The longest ramp-down from what it has been seen to do: while the stop takes effect it may
    // still speed up.
    TimeNs ramp_down_ns;
    bool seen = false;  // a step after from_ns
  };
  // No motor makes more steps in a tick (docs/protocol.md, TICKS).
  static constexpr std::size_t kLatest = 128;
  struct Step {
    TimeNs time_ns;
    int direction;
  };
  struct Motor {
    explicit Motor(const PaceRules& motor_rules) : rules(&motor_rules), pace(motor_rules) {}
    void count(TimeNs time_ns);
    const PaceRules* rules;
    Pace pace;
    std::int64_t position_steps = 0;
    std::array<Step, kLatest> latest{};  // a ring
    std::size_t steps_made = 0;
    bool forward = false;
    std::optional<Halt> halt;
    std::optional<Rotor> rotor;
    bool slipped = false;
  };

  void report(TimeNs time_ns, std::size_t mcu, std::size_t output, const Motor& motor, Jump jump);
  void check_rotor(TimeNs until_ns, std::size_t mcu, std::size_t output, Motor& motor);
  void check_halt(TimeNs time_ns, std::size_t mcu, std::size_t output, Motor& motor);
  void violated(TimeNs time_ns, std::size_t mcu, std::size_t output, const std::string& what);

  std::vector<std::vector<std::unique_ptr<Motor>>> motor_of_;  // by MCU and output
  std::vector<bool> enabled_;                                  // by MCU
  std::uint64_t steps_made_ = 0;
};

}  // namespace bushd::sim
