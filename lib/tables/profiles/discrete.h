// The profiles that are programs, not motions: they are run as their sources run them.
#pragma once

#include "tables/profiles/make.h"

namespace bushd::tables::profiles {

// Ivanov 2023, eq. 7-9: f_n = f_(n-1) + k T_(n-1) with T = 1 / f and k = df0 / T0, an acceleration,
// until the maximum is reached.
Result<std::vector<double>> recurrence(const SideSpec& side, double start_hz, double max_hz);

// The AVR loop: the speed VC = steps/s x 64 changes by A every 1/64 s (625 intervals of 25 us) from
// VMIN, the start, to the maximum; the delay of the next step is 2560000 / VC intervals, taken
// when a step is made. `published` rounds the division down, as the AVR does.
inline constexpr std::uint32_t kV64UnitNs = 25'000;
Result<std::vector<double>> v64(const SideSpec& side, double start_hz, double max_hz,
                                bool published);

// The serial port as controller (docs/heritage.md): a byte makes five steps of one speed. Speeding
// up takes n1 bytes, each df1 = (f_h - f_l) / n1 faster than the one before, the first one at f_l.
// Slowing down takes n3 bytes and a last one of dp = 1..4 steps, each df2 = (f_h - f_l) / (n3 + 1)
// slower, the last one at f_l. `side.codes` is 5 n1, or 5 n3 + dp; the cruise delay is one more.
Result<std::vector<double>> serial(const SideSpec& side, Side which, double start_hz,
                                   double max_hz);

}  // namespace bushd::tables::profiles
