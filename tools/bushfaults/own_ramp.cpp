#include "own_ramp.h"

#include <algorithm>
#include <vector>

namespace bushfaults {

std::int64_t own_ramp_excess(const bushd_table& table, std::int64_t tick_ns) {
  const auto unit_ns = static_cast<std::int64_t>(table.time_unit_ns);
  const auto left_at = [&](std::int64_t delay) {  // the fewest steps to stop from there
    std::int64_t left = 0;
    while (left < table.decel.count && table.decel.code[left] > delay) ++left;
    return left;
  };
  // How long before the last step each one is made, by the steps that are left after it: those of
  // the ramp, and of the cruise before it as far as two ticks reach.
  std::vector<std::int64_t> before_end_ns{0};
  for (std::int64_t cruise_ns = 0; cruise_ns <= 2 * tick_ns;) {
    const std::size_t left = before_end_ns.size() - 1;
    const bool ramp = left < table.decel.count;
    const std::int64_t delay_ns =
        unit_ns * std::max(ramp ? table.decel.code[left] : table.cruise, table.cruise);
    before_end_ns.push_back(before_end_ns.back() + delay_ns);
    if (!ramp) cruise_ns += delay_ns;
  }
  std::int64_t most = 0;
  for (std::int64_t left = 0; left < table.decel.count; ++left) {
    const std::int64_t at_ns = before_end_ns[static_cast<std::size_t>(left)];
    const auto from = std::ranges::lower_bound(before_end_ns, at_ns - 2 * tick_ns);
    const auto to = std::ranges::upper_bound(before_end_ns, at_ns + 2 * tick_ns);
    const std::int64_t delay_ns = 4 * tick_ns / (to - from + 1);
    const std::int64_t delay = std::max<std::int64_t>(table.cruise, delay_ns / unit_ns);
    most = std::max(most, left_at(delay) - left);
  }
  // The tick may begin just before a step, and its steps are spaced anew.
  return most + 2;
}

}  // namespace bushfaults
