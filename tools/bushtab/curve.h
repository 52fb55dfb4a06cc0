// The steps of a table's move that just comes to cruise: up one side, one step at cruise, down the
// other. What show, plot and the pictures tell of a table, and of an envelope.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tables/table.h"

namespace bushtab {

struct CurveStep {
  enum class Part { kAccel, kCruise, kDecel };
  Part part = Part::kAccel;
  std::uint32_t index = 0;     // of the code in its side, in the order of the file
  std::uint64_t delay_ns = 0;  // before the step; never shorter than the cruise delay
  std::uint64_t time_ns = 0;   // at which the step falls
  std::uint64_t step = 0;      // of the move, from 1

  double speed_hz() const { return 1e9 / static_cast<double>(delay_ns); }
  // The speed of a delay is that in its middle.
  double middle_s() const {
    return static_cast<double>(time_ns) * 1e-9 - static_cast<double>(delay_ns) * 0.5e-9;
  }
};

// What is drawn, with its name.
struct Curve {
  std::string legend;
  std::vector<CurveStep> steps;  // not empty
};

std::vector<CurveStep> curve_of(const bushd::tables::Table& table);

// From the middle of the delay before to that of the step itself, in steps/s^2.
double acceleration(const CurveStep& before, const CurveStep& step);

}  // namespace bushtab
