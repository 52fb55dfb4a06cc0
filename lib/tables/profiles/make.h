// From what is known of a motor to a table: acceleration profiles, pure functions.
//
// A table never makes a step faster than its profile asks: delays are rounded up to whole time
// units, except in the two profiles whose sources round down, and only if that is asked for
// (`published`).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "tables/profiles/motor.h"
#include "tables/table.h"

namespace bushd::tables::profiles {

// Codes of BUSHD-2: that of F_start, and the least; there one code more is 10 % slower.
inline constexpr double kBushdSlowest = 250;
inline constexpr double kBushdFastest = 10;

enum class Profile {
  kConstant,     // constant acceleration, exact
  kRecurrence,   // f_n = f_(n-1) + k / f_(n-1)          (Ivanov 2023, eq. 7-9)
  kV64,          // 64 speed updates a second, 25 us      (the AVR controller)
  kScurve,       // jerk limited
  kExponential,  // acceleration falls linearly with speed, so exponentially with time
  kPto,          // constant, from times, as PLC wizards ask
  kTorque,       // the fastest that a motor can follow
  kPiecewise,    // constant acceleration over each of several stretches of steps
  kSerial,       // another speed after each five steps   (a serial port, docs/heritage.md)
};
std::string_view name_of(Profile profile);
std::optional<Profile> profile_of(std::string_view name);

// Over `steps` steps the speed goes at constant acceleration to `to_hz`.
struct Leg {
  double steps = 0;
  double to_hz = 0;
};

struct SideSpec {
  Profile profile = Profile::kConstant;
  // One of these three says how steep; not for torque and piecewise.
  std::optional<double> acceleration{};  // steps/s^2, the greatest of the profile without `skip`
  std::optional<double> time_s{};        // from start to maximum speed
  std::optional<std::uint32_t> codes{};  // how many the side shall have
  std::optional<double> jerk{};          // steps/s^3, scurve with `acceleration` only
  double fall = 5;                       // exponential: acceleration at start / at the top, > 1
  std::vector<Leg> legs{};               // piecewise: in the order of the motion
};

// A band of speeds to be passed quickly. Without acceleration and factor: as quickly as the motor
// of the spec can.
struct Skip {
  double low_hz = 0;
  double high_hz = 0;
  std::optional<double> acceleration{};
  std::optional<double> factor{};  // times what the profile would do there
};

struct Spec {
  std::string name{};
  std::string description{};
  double start_hz = 0;
  double max_hz = 0;
  std::optional<double> stop_hz{};  // none: as start
  SideSpec accel{};
  std::optional<SideSpec> decel{};  // none: the mirror image; torque: what braking allows
  std::optional<Skip> skip{};
  std::optional<Motor> motor{};
  std::optional<std::uint32_t> time_unit_ns{};  // none: the finest that fits
  unsigned code_bits = 16;                      // 16, or 8: BUSHD
  bool published = false;  // recurrence, v64: divisions rounded down as in the source
};

// The exact delays of one side before rounding, slow to fast, in seconds. `published` tells the
// profiles that divide whole numbers to round as their sources do.
Result<std::vector<double>> side_delays_s(const Spec& spec, Side side);

Result<TableContent> make_content(const Spec& spec);

}  // namespace bushd::tables::profiles
