#include "motion/pseudo/curved_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/printable.h"

namespace bushd::pseudo {
namespace {

Result<const csv::NumberColumn*> find(const csv::NumberTable& table, const std::string& name) {
  const auto found = std::ranges::find(table.columns, name, &csv::NumberColumn::name);
  if (found != table.columns.end()) return &*found;
  std::string names;
  for (const csv::NumberColumn& column : table.columns) {
    names += (names.empty() ? "" : ", ") + printable(column.name);
  }
  return fail(Error{.message = fmt::format("no column \"{}\"; there are: {}", name, names),
                    .file = table.file});
}

}  // namespace

Result<CurvedAxis> CurvedAxis::make(const csv::NumberTable& table, const std::string& axis,
                                    const std::vector<std::string>& motors) {
  if (motors.empty()) return fail("a calibration needs a motor");
  const auto x = find(table, axis);
  if (!x) return fail(x.error());
  std::vector<MonotoneCubic> curves;
  for (const std::string& motor : motors) {
    const auto y = find(table, motor);
    if (!y) return fail(y.error());
    if (const auto flaw = MonotoneCubic::flaw((*x)->numbers, (*y)->numbers)) {
      return fail(Error{.message = fmt::format("{} over {}: {}", motor, axis, flaw->message),
                        .file = table.file,
                        .line = table.lines[flaw->point]});
    }
    curves.emplace_back((*x)->numbers, (*y)->numbers);
  }
  return CurvedAxis(std::move(curves));
}

double CurvedAxis::position(std::span<const double> motors) const {
  return curves_.front().where(motors.front());
}

double CurvedAxis::beyond(std::span<const double> motors) const {
  const MonotoneCubic& first = curves_.front();
  const auto [low, high] = std::minmax({first.first_y(), first.last_y()});
  return std::max({low - motors.front(), motors.front() - high, 0.0});
}

std::vector<double> CurvedAxis::deviations(std::span<const double> motors) const {
  const double at = position(motors);
  std::vector<double> deviations{0};
  for (std::size_t i = 1; i < curves_.size(); ++i) {
    deviations.push_back(motors[i] - curves_[i].at(at));
  }
  return deviations;
}

Result<std::vector<double>> CurvedAxis::motors_for(double position) const {
  const Range within = range();
  if (!(position >= within.low && position <= within.high)) {
    return fail(fmt::format("{} is beyond the calibration; allowed: {} to {}", position, within.low,
                            within.high));
  }
  std::vector<double> motors;
  for (const MonotoneCubic& curve : curves_) motors.push_back(curve.at(position));
  return motors;
}

}  // namespace bushd::pseudo
