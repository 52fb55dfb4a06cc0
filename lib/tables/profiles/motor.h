// What a motor can do: pull-out torque against speed, inertia, friction, and a safety factor. From
// that the greatest acceleration at any speed:
//
//   speeding up   a(v) = (T(v) / s - F) / J * n / 2 pi      steps/s^2, n steps a turn
//   braking       a(v) = (T(v) / s + B) / J * n / 2 pi
//
// F is the friction that hinders, B the part of it that may be counted on when braking (0 unless
// told otherwise: friction can be less than measured).
//
// A jump of the field's speed by dw leaves the rotor behind. It catches up, even undamped, if what
// it lacks in energy is less than what the torque T sin d does before its last equilibrium (the
// equal-area criterion of synchronous machines, for a rotor that does not lag yet):
//
//     J dw^2 / 2  <=  T / p * (1 + cos s' - s (pi - s'))      s = F / T = sin s'
//
// with p = full steps of a turn / 4, the periods of d in a turn.
//
// The same criterion says why a safety factor s of 2: without damping a rotor follows a torque that
// comes suddenly, as at the start, up to 0.72 T, and one that is reversed, as where a short move
// turns from speeding up to braking, up to 2 / sqrt(pi^2 + 4) = 0.54 T.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tables/profiles/motion.h"

namespace bushd::tables::profiles {

struct TorquePoint {
  double speed_hz = 0;
  double torque_nm = 0;
};

// Linear between its points; below the first one it is the first's, beyond the last there is none.
using TorqueCurve = std::vector<TorquePoint>;

// CSV: a header `SPEED,TORQUE` with units (speed_hz, speed_steps_per_s or speed_rpm; torque_nm,
// torque_ncm or torque_mnm), then a line a point, speeds rising. Lines may be empty or comments
// (#). speed_hz and speed_steps_per_s are the same: steps of the table, so microsteps where the
// driver makes some. `steps_per_turn`, microsteps included, counts for speed_rpm alone. `path` is
// only what errors say.
Result<TorqueCurve> parse_torque_csv(std::string_view text, double steps_per_turn,
                                     const std::string& path);
Result<TorqueCurve> load_torque_csv(const std::string& path, double steps_per_turn);

// What a motor moves besides its rotor. Seen from the motor, with n turns of it for one of what it
// turns (screw, pulley or rotary load):
//
//   J = (m (d / 2 pi)^2 + J_load) / n^2      d: travel of the mass in a turn of screw or pulley
struct Load {
  double mass_kg = 0;
  double travel_per_turn_m = 0;  // lead of a screw; belt: teeth of the pulley times their pitch
  double inertia_kgm2 = 0;       // of what turns, at its own shaft
  double gear = 1;               // n, above 0
};
double inertia_at_motor_kgm2(const Load& load);

struct Motor {
  TorqueCurve torque{};
  double inertia_kgm2 = 0;  // rotor and load
  double friction_nm = 0;
  double brake_friction_nm = 0;
  double safety = 2;
  double steps_per_turn = 200;       // microsteps included
  double full_steps_per_turn = 200;  // more than steps_per_turn count as that many
};

Result<void> check(const Motor& motor);

enum class Side { kAccel, kDecel };

double torque_at(const Motor& motor, double speed_hz);
// The greatest one between two speeds. O(log points + points in between).
double greatest_torque(const Motor& motor, double low_hz, double high_hz);
// Preconditions of these two: the motor has no fault. May be negative; beyond the curve it is.
double acceleration_at(const Motor& motor, Side side, double speed_hz);
// The greatest jump of speed, steps/s, to `speed_hz` (from rest: the start) that the rotor can
// follow; braking counts on no friction. 0 where friction takes all the torque.
double greatest_jump_hz(const Motor& motor, Side side, double speed_hz);
// The fastest motion between two speeds, slow to fast; refused where the motor has no torque left.
Result<Motion> fastest(const Motor& motor, Side side, double from_hz, double to_hz);

}  // namespace bushd::tables::profiles
