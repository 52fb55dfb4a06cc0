#include "motion/pseudo/linear_axes.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace bushd::pseudo {
namespace {

// Rows of the same length, 1: an axis in mrad beside one in mm is no defect.
Result<void> check_independent(const Eigen::MatrixXd& matrix) {
  Eigen::MatrixXd rows = matrix;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const double length = rows.row(i).norm();
    if (!(length > 0)) {
      return fail(fmt::format("row {} of the matrix is zero: no motor moves that axis", i + 1));
    }
    rows.row(i) /= length;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> values(rows);
  const double least = values.singularValues().tail(1)(0);
  const double condition =
      least > 0 ? values.singularValues()(0) / least : std::numeric_limits<double>::infinity();
  if (condition <= LinearAxes::kMostCondition) return {};
  return fail(
      fmt::format("the rows of the matrix depend on each other: the {} axes can be set by "
                  "these motors only with a condition number of {:.3g}; allowed: up to {:g}",
                  rows.rows(), condition, LinearAxes::kMostCondition));
}

}  // namespace

Result<LinearAxes> LinearAxes::make(const std::vector<std::vector<double>>& matrix,
                                    std::vector<double> offset) {
  if (matrix.empty() || matrix.front().empty()) return fail("the matrix is empty");
  const std::size_t motors = matrix.front().size();
  if (matrix.size() != offset.size()) {
    return fail(fmt::format("{} offsets for {} axes", offset.size(), matrix.size()));
  }
  if (matrix.size() > motors) {
    return fail(fmt::format("the matrix has {} rows and {} columns: more axes than motors",
                            matrix.size(), motors));
  }
  Eigen::MatrixXd values(matrix.size(), motors);
  for (std::size_t i = 0; i < matrix.size(); ++i) {
    if (matrix[i].size() != motors) {
      return fail(fmt::format("row {} of the matrix has {} numbers; allowed: {}, as in row 1",
                              i + 1, matrix[i].size(), motors));
    }
    for (std::size_t j = 0; j < motors; ++j) {
      values(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = matrix[i][j];
    }
  }
  const bool finite =
      std::ranges::all_of(offset, [](double number) { return std::isfinite(number); });
  if (!finite || !values.allFinite()) return fail("a number that is not finite");
  if (auto independent = check_independent(values); !independent) return fail(independent.error());
  const Eigen::MatrixXd inverse = values.completeOrthogonalDecomposition().pseudoInverse();
  LinearAxes axes;
  axes.motors_ = motors;
  axes.offset_ = std::move(offset);
  for (const auto& row : matrix) axes.matrix_.insert(axes.matrix_.end(), row.begin(), row.end());
  for (Eigen::Index i = 0; i < inverse.rows(); ++i) {
    for (Eigen::Index j = 0; j < inverse.cols(); ++j) axes.inverse_.push_back(inverse(i, j));
  }
  return axes;
}

std::vector<double> LinearAxes::positions(std::span<const double> motors) const {
  std::vector<double> positions = offset_;
  for (std::size_t i = 0; i < axes(); ++i) {
    for (std::size_t j = 0; j < motors_; ++j) positions[i] += matrix_[i * motors_ + j] * motors[j];
  }
  return positions;
}

std::vector<double> LinearAxes::motors_for(std::span<const double> positions,
                                           std::span<const double> motors_now) const {
  const std::vector<double> now = this->positions(motors_now);
  std::vector<double> motors(motors_now.begin(), motors_now.end());
  for (std::size_t j = 0; j < motors_; ++j) {
    for (std::size_t i = 0; i < axes(); ++i) motors[j] += way(i, j) * (positions[i] - now[i]);
  }
  return motors;
}

Range LinearAxes::range(std::size_t axis, std::span<const double> motors_now,
                        std::span<const Range> motor_ranges) const {
  double down = -std::numeric_limits<double>::infinity();
  double up = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < motors_; ++j) {
    const double each = way(axis, j);
    if (each == 0) continue;
    const double to_low = (std::min(motor_ranges[j].low, motors_now[j]) - motors_now[j]) / each;
    const double to_high = (std::max(motor_ranges[j].high, motors_now[j]) - motors_now[j]) / each;
    down = std::max(down, std::min(to_low, to_high));
    up = std::min(up, std::max(to_low, to_high));
  }
  const double now = positions(motors_now)[axis];
  return {now + down, now + up};
}

}  // namespace bushd::pseudo
