// The power stage of a unipolar motor with chopper, and its four windings: a transistor each, sense
// resistors of windings 0 and 2 and of 1 and 3, comparators, diodes. By "Stepper motor controller,
// part 3": the sense resistor sees the current of a winding only while its transistor is on.
//
// A winding is L di/dt = v - R i - e, with v the supply less what falls at transistor and sense
// resistor while it is on; while it is off, -diode_v (slow decay) or -(supply_v + 2 diode_v)
// (fast). Current flows in one direction only. Its two halves are not coupled. The rotor turns on
// evenly from one change of the phases to the next, a quarter of an electrical turn behind them:
//
//     e = back_emf_v_per_hz * f * sin(angle of the winding - angle of the rotor)
//
// All times in ns, as in sim/edge.h; they never fall from call to call.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "sim/edge.h"

namespace bushd::sim {

struct PowerStageRules {
  double supply_v = 24;
  double resistance_ohm = 2.5;  // of a winding
  double inductance_h = 8e-3;
  double switch_ohm = 0.15;  // two transistors of 0.3 ohm side by side
  double sense_ohm = 0.1;
  double diode_v = 0.8;
  double back_emf_v_per_hz = 0.008;  // of steps a second
  int full_steps_per_turn = 4;       // electrical: as many windings
};

class PowerStage {
 public:
  static constexpr std::size_t kWindings = 4;
  static constexpr std::size_t kPairs = 2;  // winding w is of pair w % 2

  explicit PowerStage(const PowerStageRules& rules) : rules_(rules) {}

  // From now on these transistors are on, bit per winding.
  void set_outputs(TimeNs now_ns, std::uint8_t outputs);
  void set_fast_decay(TimeNs now_ns, bool fast);
  // What the comparators compare with, in A.
  void set_reference(TimeNs now_ns, double reference_a);

  void advance(TimeNs now_ns);
  // After advance: the current is at the reference or above.
  bool trips(std::size_t pair) const;
  // When the comparator of this pair will trip if nothing else changes, within `horizon_ns`.
  std::optional<TimeNs> next_trip_ns(std::size_t pair, TimeNs horizon_ns) const;

  double current_a(std::size_t winding) const { return current_a_[winding]; }
  std::uint8_t outputs() const { return outputs_; }
  bool fast_decay() const { return fast_; }
  double reference_a() const { return reference_a_; }

 private:
  void follow_phase();
  void take_step(std::uint8_t windings);
  double back_emf_v(std::size_t winding, TimeNs at_ns) const;
  // The current after `ns` from `current_a`, with the back EMF of now.
  double after(std::size_t winding, double current_a, TimeNs at_ns, TimeNs ns) const;
  std::optional<std::size_t> winding_on(std::size_t pair) const;

  PowerStageRules rules_;
  TimeNs now_ns_ = 0;
  std::uint8_t outputs_ = 0;
  std::uint8_t phase_ = 0;  // windings of the present step, whether cut or not
  std::array<TimeNs, kWindings> last_on_ns_{-1, -1, -1, -1};
  std::optional<TimeNs> changes_at_ns_{};  // another phase is on the way
  bool fast_ = false;
  double reference_a_ = 0;
  std::array<double, kWindings> current_a_{};
  TimeNs stepped_ns_ = 0;  // the last change of phase
  TimeNs step_ns_ = 0;     // from the one before; 0: at rest
  double angle_ = 0;       // of the present phase, in turns
  double turn_ = 0;        // from the one before
};

}  // namespace bushd::sim
