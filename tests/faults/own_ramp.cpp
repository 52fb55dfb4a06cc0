#include "own_ramp.h"

#include <algorithm>
#include <vector>

#include "engine/message_base.h"

namespace bushfaults {
namespace {

// How long before the last step each one is made, by the steps that are left after it: those of
// the ramp, and of the cruise before it as far as two ticks reach.
std::vector<std::int64_t> times_before_end(const bushd_table& table, std::int64_t tick_ns) {
  std::vector<std::int64_t> times_ns{0};
  for (std::int64_t cruise_ns = 0; cruise_ns <= 2 * tick_ns;) {
    const std::size_t left = times_ns.size() - 1;
    const bool ramp = left < table.decel.count;
    const std::int64_t delay_ns =
        std::int64_t{table.time_unit_ns} *
        std::max(ramp ? table.decel.code[left] : table.cruise, table.cruise);
    times_ns.push_back(times_ns.back() + delay_ns);
    if (!ramp) cruise_ns += delay_ns;
  }
  return times_ns;
}

// What the steps of two ticks before and two ticks after `at_ns` tell.
std::int64_t coarse_delay(const std::vector<std::int64_t>& times_ns, std::int64_t at_ns,
                          std::int64_t tick_ns, std::int64_t unit_ns) {
  const auto from = std::ranges::lower_bound(times_ns, at_ns - 2 * tick_ns);
  const auto to = std::ranges::upper_bound(times_ns, at_ns + 2 * tick_ns);
  return 4 * tick_ns / (to - from + 1) / unit_ns;
}

// What the way in the tick before `at_ns` tells, in 1/256 step, where a step has just been made:
// later in a step that way is shorter. It may be rounded up, and so may the position be at its end:
// a step that is about to be made is taken as made then. The MCU rounds the delay up.
std::int64_t fine_delay(const std::vector<std::int64_t>& times_ns, std::int64_t at_ns,
                        std::int64_t tick_ns, std::int64_t unit_ns) {
  const auto next = std::ranges::upper_bound(times_ns, at_ns + tick_ns);
  const std::int64_t share = 256 * (at_ns + tick_ns - *(next - 1)) / (*next - *(next - 1));
  const auto way = 256 * (next - 1 - std::ranges::lower_bound(times_ns, at_ns)) + share + 2;
  return (256 * tick_ns - 1) / (way * unit_ns) + 1;
}

}  // namespace

std::int64_t own_ramp_excess(const bushd_table& table, std::int64_t tick_ns, bushd_format format) {
  const std::vector<std::int64_t> times_ns = times_before_end(table, tick_ns);
  const bool fine = format == BUSHD_FORMAT_FINE;
  const std::int64_t unit_ns = table.time_unit_ns;
  std::int64_t most = 0;
  for (std::size_t left = 0; left < table.decel.count; ++left) {
    const std::int64_t told = fine ? fine_delay(times_ns, times_ns[left + 1], tick_ns, unit_ns)
                                   : coarse_delay(times_ns, times_ns[left], tick_ns, unit_ns);
    const std::int64_t delay = std::max<std::int64_t>(table.cruise, told);
    std::int64_t taken = 0;  // the fewest steps to stop from there
    while (taken < table.decel.count && table.decel.code[taken] > delay) ++taken;
    most = std::max(most, taken - static_cast<std::int64_t>(left));
  }
  // In the coarse format the tick may begin just before a step, and its steps are spaced anew.
  return fine ? most : most + 2;
}

}  // namespace bushfaults
