#include "curve.h"

#include <algorithm>

namespace bushtab {

std::vector<CurveStep> curve_of(const bushd::tables::Table& table) {
  const bushd_table& view = table.view();
  std::vector<CurveStep> curve;
  curve.reserve(view.accel.count + view.decel.count + 1);
  std::uint64_t time_ns = 0;
  const auto add = [&](CurveStep::Part part, std::uint32_t index, std::uint16_t code) {
    const std::uint64_t delay_ns = std::uint64_t{std::max(code, view.cruise)} * view.time_unit_ns;
    time_ns += delay_ns;
    curve.push_back({part, index, delay_ns, time_ns, curve.size() + 1});
  };
  for (std::uint32_t i = 0; i < view.accel.count; ++i) {
    add(CurveStep::Part::kAccel, i, view.accel.code[i]);
  }
  add(CurveStep::Part::kCruise, 0, view.cruise);
  for (std::uint32_t i = 0; i < view.decel.count; ++i) {
    // A ramp counts from rest, its file from cruise.
    add(CurveStep::Part::kDecel, i, view.decel.code[view.decel.count - 1 - i]);
  }
  return curve;
}

double acceleration(const CurveStep& before, const CurveStep& step) {
  return (step.speed_hz() - before.speed_hz()) / (step.middle_s() - before.middle_s());
}

}  // namespace bushtab
