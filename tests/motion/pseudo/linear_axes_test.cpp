// Sums of motors, against exact fractions.
#include "motion/pseudo/linear_axes.h"

#include <gmock/gmock.h>
#include <gmpxx.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace bushd::pseudo {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;
using testing::HasSubstr;
using Fractions = std::vector<std::vector<mpq_class>>;

LinearAxes slit() {
  return LinearAxes::make({{-1, 1}, {0.5, 0.5}}, {0, 0}).value();
}

TEST(LinearAxes, ASlitsGapAndCentre) {
  const LinearAxes axes = slit();
  const std::vector<double> blades{-1.5, 2.5};
  EXPECT_THAT(axes.positions(blades), ElementsAre(DoubleEq(4), DoubleEq(0.5)));
  const std::vector<double> wanted{1, 0.5};
  EXPECT_THAT(axes.motors_for(wanted, blades), ElementsAre(DoubleEq(0), DoubleEq(1)));
  EXPECT_THAT(axes.way(0, 0), DoubleEq(-0.5));
  EXPECT_THAT(axes.way(1, 0), DoubleEq(1));
}

TEST(LinearAxes, AnAxisGoesAsFarAsItsMotors) {
  const LinearAxes axes = slit();
  const std::vector<double> blades{0, 2};
  const std::vector<Range> ranges{{-5, 5}, {-1, 3}};
  // The gap is opened by both: the right one has 1 left, so each goes by 1.
  const Range gap = axes.range(0, blades, ranges);
  EXPECT_DOUBLE_EQ(gap.high, 4);
  EXPECT_DOUBLE_EQ(gap.low, 2 - 6) << "the right one may go back by 3, the left one by 5";
  const Range centre = axes.range(1, blades, ranges);
  EXPECT_DOUBLE_EQ(centre.low, 1 - 3);
  EXPECT_DOUBLE_EQ(centre.high, 1 + 1);
  // One that stands beyond may go back, and no further.
  const std::vector<double> beyond{0, 4};
  EXPECT_DOUBLE_EQ(axes.range(1, beyond, ranges).high, 2);
  EXPECT_DOUBLE_EQ(axes.range(1, beyond, ranges).low, 2 - 5);
}

TEST(LinearAxes, WhatCannotBeIsRefused) {
  const auto error = [](const std::vector<std::vector<double>>& matrix,
                        std::vector<double> offset) -> std::string {
    const auto made = LinearAxes::make(matrix, std::move(offset));
    return made ? "none" : made.error().text();
  };
  EXPECT_EQ(error({}, {}), "the matrix is empty");
  EXPECT_EQ(error({{}}, {0}), "the matrix is empty");
  EXPECT_EQ(error({{1, 0}}, {}), "0 offsets for 1 axes");
  EXPECT_THAT(error({{1}, {2}}, {0, 0}), HasSubstr("more axes than motors"));
  EXPECT_THAT(error({{1, 0}, {2}}, {0, 0}), HasSubstr("row 2 of the matrix has 1 numbers"));
  EXPECT_THAT(error({{1, 0}, {0, 0}}, {0, 0}), HasSubstr("row 2 of the matrix is zero"));
  EXPECT_THAT(error({{1, NAN}}, {0}), HasSubstr("not finite"));
  EXPECT_THAT(error({{1, 0}}, {INFINITY}), HasSubstr("not finite"));
  EXPECT_THAT(error({{1, 2}, {2, 4}}, {0, 0}), HasSubstr("depend on each other"));
  EXPECT_THAT(error({{1, 2}, {2, 4.000001}}, {0, 0}), HasSubstr("condition number of"));
  EXPECT_EQ(error({{1e-6, 0}, {0, 1e6}}, {0, 0}), "none") << "units may differ";
}

// x with a x = b, by elimination; none if a is singular.
std::optional<std::vector<mpq_class>> solution(Fractions a, std::vector<mpq_class> b) {
  const std::size_t n = b.size();
  for (std::size_t column = 0; column < n; ++column) {
    std::size_t pivot = column;
    while (pivot < n && a[pivot][column] == 0) ++pivot;
    if (pivot == n) return std::nullopt;
    std::swap(a[pivot], a[column]);
    std::swap(b[pivot], b[column]);
    for (std::size_t row = 0; row < n; ++row) {
      if (row == column) continue;
      const mpq_class factor = a[row][column] / a[column][column];
      for (std::size_t k = column; k < n; ++k) a[row][k] -= factor * a[column][k];
      b[row] -= factor * b[column];
    }
  }
  for (std::size_t row = 0; row < n; ++row) b[row] /= a[row][row];
  return b;
}

// The motors that lead from `now` to `wanted` with the least sum of squares: Lagrange's equations,
// by fractions: change = matrix^T y, with (matrix matrix^T) y = wanted - matrix now.
std::optional<std::vector<mpq_class>> least_change(const std::vector<std::vector<double>>& matrix,
                                                   const std::vector<double>& wanted,
                                                   const std::vector<double>& now) {
  const std::size_t axes = matrix.size();
  Fractions square(axes, std::vector<mpq_class>(axes));
  std::vector<mpq_class> rest(axes);
  for (std::size_t i = 0; i < axes; ++i) {
    rest[i] = mpq_class(wanted[i]);
    for (std::size_t j = 0; j < now.size(); ++j) {
      rest[i] -= mpq_class(matrix[i][j]) * mpq_class(now[j]);
      for (std::size_t k = 0; k < axes; ++k) {
        square[i][k] += mpq_class(matrix[i][j]) * mpq_class(matrix[k][j]);
      }
    }
  }
  const auto y = solution(square, rest);
  if (!y) return std::nullopt;
  std::vector<mpq_class> motors(now.begin(), now.end());
  for (std::size_t j = 0; j < now.size(); ++j) {
    for (std::size_t i = 0; i < axes; ++i) motors[j] += mpq_class(matrix[i][j]) * (*y)[i];
  }
  return motors;
}

struct Case {
  std::vector<std::vector<double>> matrix;
  std::vector<double> now;
  std::vector<double> wanted;
};

// Eighths, which doubles hold exactly.
Case arbitrary_case() {
  const auto eighths = [](int most) { return *rc::gen::inRange(-most, most + 1) / 8.0; };
  const int motors = *rc::gen::inRange(1, 7);
  const int axes = *rc::gen::inRange(1, motors + 1);
  Case made;
  for (int i = 0; i < axes; ++i) {
    made.matrix.emplace_back();
    for (int j = 0; j < motors; ++j) made.matrix.back().push_back(eighths(40));
    made.wanted.push_back(eighths(8000));
  }
  for (int j = 0; j < motors; ++j) made.now.push_back(eighths(8000));
  return made;
}

// By how much motors may be off that are worked out in doubles: an inverse is right to a digit
// times the condition, and goes with numbers of up to 1000 and what the matrix makes of them; a
// hundred for the operations on 6 by 6 numbers.
double motors_off(const LinearAxes& axes, const Case& a_case) {
  double matrix = 0;
  double inverse = 0;
  for (std::size_t i = 0; i < axes.axes(); ++i) {
    for (std::size_t j = 0; j < axes.motors(); ++j) {
      matrix += std::abs(a_case.matrix[i][j]);
      inverse += std::abs(axes.way(i, j));
    }
  }
  return 100 * 2.3e-16 * (matrix * inverse) * inverse * (1000 + matrix * 1000);
}

RC_GTEST_PROP(LinearAxesProperty, MovesAsLittleAsLeadsThere, ()) {
  const Case a_case = arbitrary_case();
  const auto expected = least_change(a_case.matrix, a_case.wanted, a_case.now);
  const auto axes = LinearAxes::make(a_case.matrix, std::vector<double>(a_case.matrix.size(), 0));
  if (!expected) RC_ASSERT(!axes.has_value());
  if (!axes) return;
  const std::vector<double> motors = axes->motors_for(a_case.wanted, a_case.now);
  const double off = motors_off(*axes, a_case);
  for (std::size_t j = 0; j < motors.size(); ++j) {
    RC_ASSERT(std::abs(motors[j] - (*expected)[j].get_d()) <= off);
  }
  // And there it is.
  const std::vector<double> there = axes->positions(motors);
  for (std::size_t i = 0; i < there.size(); ++i) {
    double matrix = 0;
    for (const double factor : a_case.matrix[i]) matrix += std::abs(factor);
    RC_ASSERT(std::abs(there[i] - a_case.wanted[i]) <= matrix * off);
  }
}

// Motors stand on steps. From the position that is told then, they are not asked to go anywhere.
RC_GTEST_PROP(LinearAxesProperty, ThePositionThatIsToldIsThatOfItsSteps, ()) {
  const Case a_case = arbitrary_case();
  const auto axes = LinearAxes::make(a_case.matrix, std::vector<double>(a_case.matrix.size(), 7));
  if (!axes) return;
  const double step = 1.0 / *rc::gen::element(1, 40, 400, 25'600);
  const double off = motors_off(*axes, a_case);
  if (off > step / 4) return;  // a matrix by which steps cannot be told apart in doubles
  std::vector<double> steps;
  for (const double motor : axes->motors_for(a_case.wanted, a_case.now)) {
    steps.push_back(std::round(motor / step) * step);
  }
  const std::vector<double> told = axes->positions(steps);
  const std::vector<double> again = axes->motors_for(told, steps);
  for (std::size_t j = 0; j < steps.size(); ++j) {
    RC_ASSERT(std::round(again[j] / step) == std::round(steps[j] / step));
  }
  for (std::size_t i = 0; i < told.size(); ++i) {
    double most = 0;
    for (const double factor : a_case.matrix[i]) most += std::abs(factor) * (step / 2 + off);
    RC_ASSERT(std::abs(told[i] - a_case.wanted[i]) <= most);
  }
}

}  // namespace
}  // namespace bushd::pseudo
