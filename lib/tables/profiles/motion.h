// One side of a table as a continuous motion from its slow end to its fast end.
//
// Every continuous profile says how the acceleration depends on the speed; a motion is a chain of
// segments in which that dependence has a closed form:
//
//   linear   a(v) = a0 + b (v - v0)       v(t) = v0 + a0 (e^(b t) - 1) / b    (b = 0: constant)
//   jerk     a(v)^2 = a0^2 + 2 j (v - v0) v(t) = v0 + a0 t + j t^2 / 2
//   hold     a = 0 for a number of steps
//
// The time of step k is found by Newton's method on the closed form of x(t), so no error adds up
// along a ramp. Speeds in steps/s, accelerations in steps/s^2.
#pragma once

#include <cstddef>
#include <vector>

namespace bushd::tables::profiles {

struct Segment {
  enum class Kind { kLinear, kJerk, kHold };
  Kind kind = Kind::kLinear;
  double from_hz = 0;
  double to_hz = 0;
  double from_acceleration = 0;
  double to_acceleration = 0;
  double time_s = 0;
  double steps = 0;

  double position(double time_s) const;  // 0 <= time_s <= this->time_s
  double speed(double time_s) const;
  double time_at(double position) const;  // 0 <= position <= steps
  double acceleration_at(double speed_hz) const;
};

// Preconditions: to_hz > from_hz > 0; the accelerations are > 0, in a jerk segment one may be 0.
Segment linear(double from_hz, double to_hz, double from_acceleration, double to_acceleration);
Segment jerk(double from_hz, double to_hz, double from_acceleration, double to_acceleration);
Segment hold(double speed_hz, double steps);

using Motion = std::vector<Segment>;  // each begins at the speed at which the one before ends

double steps_of(const Motion& motion);
double time_of(const Motion& motion);

// The same speeds in `factor` times the time, so over `factor` times as many steps.
Motion stretched(const Motion& motion, double factor);

// The part of a motion between two speeds; holds at the border speeds are not in it.
Motion between(const Motion& motion, double low_hz, double high_hz);

// The delays before the steps, in seconds, never rising: the first step is made at the start speed,
// from then on step k falls where the motion has come k steps far, and the last one here is the
// first that begins or ends beyond the motion, at its end speed. Empty if there would be more than
// `most`. O(steps).
std::vector<double> delays_s(const Motion& motion, std::size_t most);

}  // namespace bushd::tables::profiles
