// Pseudo axes that are sums of motors, such as a slit's gap and centre:
//
//     positions = matrix * motors + offset
//
// with a row for each axis and a column for each motor, all in user units. Where there are more
// motors than axes, a move changes the motors as little as leads there: the least sum of squares.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"

namespace bushd::pseudo {

// Both inclusive.
struct Range {
  double low = 0;
  double high = 0;
  friend bool operator==(const Range&, const Range&) = default;
};

class LinearAxes {
 public:
  // The largest ratio of an axis' effect to another's, for axes of like size. With more, moves of
  // motors by a step would be moves of an axis by what nobody can tell.
  static constexpr double kMostCondition = 1e6;

  //   matrix  rows of one length, finite; no more rows than columns
  //   offset  one number for each row, finite
  // Errors: other shapes; axes that depend on each other, or all but do.
  static Result<LinearAxes> make(const std::vector<std::vector<double>>& matrix,
                                 std::vector<double> offset);

  std::size_t axes() const { return offset_.size(); }
  std::size_t motors() const { return motors_; }

  // Precondition: as many numbers as motors.
  std::vector<double> positions(std::span<const double> motors) const;
  // Where the motors go so that the axes come to `positions`.
  std::vector<double> motors_for(std::span<const double> positions,
                                 std::span<const double> motors_now) const;
  // How far each motor goes when one axis goes by 1 and the others stay.
  double way(std::size_t axis, std::size_t motor) const { return inverse_[motor * axes() + axis]; }
  // What an axis can be moved to by itself, with the others where they are, if its motors keep
  // within their ranges. A motor that stands beyond its range may go back, and no further.
  Range range(std::size_t axis, std::span<const double> motors_now,
              std::span<const Range> motor_ranges) const;

 private:
  std::size_t motors_ = 0;
  std::vector<double> matrix_;   // row by row
  std::vector<double> inverse_;  // the pseudo-inverse, row by row: motors by axes
  std::vector<double> offset_;
};

}  // namespace bushd::pseudo
