// What a stepping motor makes of its steps: a rotor with a load, drawn along by the field.
//
// Each step turns the field on by 1/n of a turn. The rotor lags behind it by the electrical angle d
// (a turn of the field is four full steps) and is pulled by
//
//     J dw/dt  =  T(f) / r * sin d  +  D (w_field - w)  -  F
//
//     T(f)  pull-out torque at f steps/s, as data sheets show it: the greatest mean torque at a
//           constant speed (Acarnley, Stepping Motors, chapters 3 and 4)
//     r     that mean over the peak: over a step the lag goes on by h = pi / 2m (m steps to a full
//           step) around its middle, so r = sin(h/2) / (h/2); 0.9 for full steps
//     D     damping against the field, by eddy currents and the windings, as in the swing equation
//           of synchronous machines. At constant speed it vanishes, so T(f) stays what was measured
//     F     dry friction and load, against the motion; it holds a rotor that stands
//
// A rotor that lags or leads by more than two full steps is beyond its last equilibrium: it slips
// to the next one, four full steps on, or stalls. f and w_field are those of the last two steps.
//
// Semi-implicit Euler, friction last, with steps of 2 us (periods of such motors are milliseconds),
// shorter where an edge lies between: time is whole ns, so the same edges give the same motion.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/edge.h"

namespace bushd::sim {

struct RotorRules {
  struct Point {
    double speed_steps_per_s;
    double torque_nm;
  };
  // Pull-out torque: speeds rising, linear in between; none beyond the last.
  std::vector<Point> pull_out{};
  double inertia_kgm2 = 0;  // of rotor and load
  double friction_nm = 0;
  // D over that of critical damping, for small swings at rest. Data sheets are silent about it;
  // with 0.1 a single full step overshoots by 73 %, which is what motors without a damper do.
  double damping_ratio = 0.1;
  double steps_per_turn = 200;  // of STEP, microsteps included
  double full_steps_per_turn = 200;
};

class Rotor {
 public:
  // `rules` outlive the rotor. It is at rest, without lag.
  explicit Rotor(const RotorRules& rules);

  // A step at t_ns, not before the time reached.
  void step(TimeNs t_ns, bool forward);
  void advance_to(TimeNs t_ns);

  // How far the field is beyond the rotor, full steps.
  double lag_full_steps() const;
  double greatest_lag_full_steps() const;
  // When it was beyond two full steps for the first time.
  std::optional<TimeNs> slipped_ns() const { return slipped_ns_; }
  // What the rotor is short of (or ahead: negative) once it has come to rest: a multiple of four.
  std::int64_t lost_full_steps() const;
  // Where the rotor itself is, to the nearest.
  std::int64_t position_full_steps() const;

 private:
  void turn_field_every(TimeNs interval_ns);
  void integrate(double dt_s);

  const RotorRules* rules_;
  double step_rad_;     // of the field, electrical
  double pole_pairs_;   // electrical angle per mechanical one
  double peak_factor_;  // 1 / r
  double damping_nms_;
  TimeNs now_ns_ = 0;
  std::optional<TimeNs> last_step_ns_{};
  TimeNs interval_ns_ = 0;      // of the last two steps; 0: none
  double field_rad_per_s_ = 0;  // mechanical
  double peak_nm_ = 0;
  bool forward_ = true;
  std::int64_t steps_ = 0;
  double lag_rad_ = 0;  // electrical
  double speed_rad_per_s_ = 0;
  double greatest_lag_rad_ = 0;
  std::optional<TimeNs> slipped_ns_{};
};

}  // namespace bushd::sim
