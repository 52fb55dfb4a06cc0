// A pseudo axis that its motors follow by a measured curve each, such as a monochromator's energy:
// a column of the axis and one for each motor, in user units.
//
//   energy, theta,   gap
//   5000,   23.2956, 15.32
//   6000,   19.2376, 14.90
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/csv/number_csv.h"
#include "base/result.h"
#include "motion/pseudo/linear_axes.h"
#include "motion/pseudo/monotone_cubic.h"

namespace bushd::pseudo {

class CurvedAxis {
 public:
  // The columns `axis` and `motors` of the table, in any order; the axis rises from row to row, and
  // each motor rises or falls. Errors name the file, the line where there is one, and the column.
  static Result<CurvedAxis> make(const csv::NumberTable& table, const std::string& axis,
                                 const std::vector<std::string>& motors);

  std::size_t motors() const { return curves_.size(); }
  // The range of the calibration.
  Range range() const { return {curves_.front().first_x(), curves_.front().last_x()}; }

  // That of the first motor; beyond the calibration: its end.
  double position(std::span<const double> motors) const;
  // How far the first motor stands beyond the calibration; 0 within.
  double beyond(std::span<const double> motors) const;
  // How far the others stand from where the first one says that they should; 0 for the first.
  std::vector<double> deviations(std::span<const double> motors) const;
  // Error: beyond the calibration, with its ends.
  Result<std::vector<double>> motors_for(double position) const;

 private:
  explicit CurvedAxis(std::vector<MonotoneCubic> curves) : curves_(std::move(curves)) {}

  std::vector<MonotoneCubic> curves_;  // motor over axis
};

}  // namespace bushd::pseudo
