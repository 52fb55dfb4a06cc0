// The eight motors of a commutator board, and what stands around them: rotors that follow their
// windings at once, limit switches, plugs, and the supply. What a motor does is seen from its
// windings alone.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "sim/edge.h"

namespace bushd::sim {

class BoardMotors {
 public:
  static constexpr unsigned kMotors = 8;

  // `edges` may be null and outlives them; steps are told as edges of STEP and DIR of `mcu`.
  explicit BoardMotors(EdgeSink* edges = nullptr, std::size_t mcu = 0);

  struct Motor {
    // The switches are active from these positions on.
    std::int64_t right_limit_at = std::numeric_limits<std::int64_t>::max();
    std::int64_t left_limit_at = std::numeric_limits<std::int64_t>::min();
    bool connected = true;
  };
  Motor& motor(unsigned number) { return motors_.at(number); }
  const Motor& motor(unsigned number) const { return motors_.at(number); }
  bool at_right_limit(unsigned number) const;
  bool at_left_limit(unsigned number) const;
  bool supply = true;
  bool keeps_steps = true;  // for steps()

  // Bit n is winding n; two of the four are on: 0011, 0110, 1100, 1001 going right. The rotor
  // stands at 0011 in the beginning. Throws std::runtime_error for windings that turn it nowhere:
  // others, or those of two steps away. Times never fall.
  void switch_windings(TimeNs now_ns, unsigned number, std::uint8_t windings);

  // Steps to the right since the beginning.
  std::int64_t position(unsigned number) const { return position_.at(number); }
  std::uint64_t travel(unsigned number) const { return travel_.at(number); }
  TimeNs last_edge_ns() const { return last_edge_ns_; }
  // All of them.
  struct Step {
    TimeNs time_ns;
    unsigned motor;
    bool left;
  };
  const std::vector<Step>& steps() const { return steps_; }

 private:
  void tell(TimeNs now_ns, unsigned number, Signal signal, bool level);

  EdgeSink* const edges_;
  const std::size_t mcu_;
  std::array<Motor, kMotors> motors_{};
  std::array<unsigned, kMotors> place_{};
  std::array<std::int64_t, kMotors> position_{};
  std::array<std::uint64_t, kMotors> travel_{};
  TimeNs last_edge_ns_ = 0;
  std::vector<Step> steps_;
};

}  // namespace bushd::sim
