#include "motion/way.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "base/bound_text.h"

namespace bushd::motion {

Way::Way(std::vector<Motor> motors, Law law) : motors_(std::move(motors)) {
  if (law == Law::kElementary) {
    bushd_elementary line;
    bushd_elementary_clear(&line);
    for (std::size_t i = 0; i < motors_.size(); ++i) {
      bushd_elementary_add(&line, motors_[i].output, increment(i));
    }
    longest_ = line.sum;
    elementary_ = std::make_shared<const bushd_elementary>(line);
  } else {
    for (std::size_t i = 0; i < motors_.size(); ++i) longest_ = std::max(longest_, increment(i));
  }
  if (longest_ == 0) return;
  table_ = std::make_shared<const tables::Envelope>(parts(), longest_);
  shortest_delay_ = table_->shortest_delay();
  limiting_ = tables::limiting_part(parts(), longest_);
}

std::uint32_t Way::increment(std::size_t motor) const {
  return static_cast<std::uint32_t>(std::abs(motors_[motor].to - motors_[motor].from));
}

std::vector<tables::LinePart> Way::parts() const {
  std::vector<tables::LinePart> parts;
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    tables::LinePart part{motors_[i].table, increment(i), motors_[i].shortest_delay};
    if (elementary_ && part.increment != 0) {
      part.apart = bushd_elementary_apart(elementary_.get(), motors_[i].output);
      part.late = bushd_elementary_late(elementary_.get(), motors_[i].output);
    }
    parts.push_back(part);
  }
  return parts;
}

double Way::duration_ns(bushd_delay shortest_delay) const {
  if (longest_ == 0) return 0;
  if (!bushd_delay_is_code(
          shortest_delay)) {  // the delay of all, maybe longer than units are counted
    return static_cast<double>(longest_) * static_cast<double>(shortest_delay) *
           table_->view().time_unit_ns;
  }
  bushd_run run;
  bushd_run_start(&run, &table_->view(), longest_, 1, shortest_delay);
  return static_cast<double>(bushd_run_units_left(&run)) * table_->view().time_unit_ns;
}

double Way::most_steps_per_s(std::size_t motor) const {
  if (longest_ == 0) return 0;
  const bushd_delay delay =
      std::max<bushd_delay>(bushd_table_fastest(&table_->view()), shortest_delay_);
  const double run = 1e9 / (static_cast<double>(delay) * table_->view().time_unit_ns);
  return run * increment(motor) / longest_;
}

std::int64_t Way::position_at(std::size_t motor, std::uint32_t step) const {
  const auto& [table, from, to, shortest_delay, output] = motors_[motor];
  if (longest_ == 0) return from;
  if (elementary_) {
    const std::int64_t made = bushd_elementary_made(elementary_.get(), output, step);
    return to < from ? from - made : from + made;
  }
  bushd_line line;
  bushd_line_start(&line, increment(motor), longest_);
  bushd_line_go_to(&line, step);
  return to < from ? from - line.made : from + line.made;
}

LineShare Way::share(std::size_t motor, std::uint32_t from, std::uint32_t to) const {
  return {.way = number_,
          .table = table_,
          .blocks = blocks_,
          .elementary = elementary_,
          .coordinate = motors_[motor].output,
          .increment = increment(motor),
          .longest = longest_,
          .direction = motors_[motor].to < motors_[motor].from ? -1 : 1,
          .from = from,
          .to = to};
}

void Way::set_shortest_delays(std::span<const bushd_delay> shortest_delays) {
  for (std::size_t i = 0; i < motors_.size(); ++i) motors_[i].shortest_delay = shortest_delays[i];
  shortest_delay_ = table_->shortest_delay_of(parts(), longest_);
}

// With a shortest delay that this table's units would need more than 16 bits for they are longer.
void Way::make_slower(double step_ns) {
  const std::vector<tables::LinePart> all = parts();
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    const bool tells_all = elementary_ ? all[i].increment != 0 : all[i].increment == longest_;
    if (!tells_all) continue;
    const double own_ns = step_ns * std::max(all[i].apart, 1u);
    motors_[i].shortest_delay =
        static_cast<bushd_delay>(std::ceil(own_ns / motors_[i].table->time_unit_ns));
    break;
  }
  table_ = std::make_shared<const tables::Envelope>(parts(), longest_);
  shortest_delay_ = table_->shortest_delay();
}

// Not one more for the last digit of a quotient.
bushd_delay Way::units_of(double step_ns, std::uint32_t unit_ns) {
  return static_cast<bushd_delay>(std::ceil(step_ns / unit_ns * (1 - 1e-12)));
}

void Way::slow_down_to(double step_ns, bool under_way) {
  if (longest_ == 0) return;
  const double asked_ns = std::min<double>(step_ns, BUSHD_LONGEST_DELAY_NS);
  const bushd_delay units = units_of(asked_ns, table_->view().time_unit_ns);
  if (units <= shortest_delay_) return;
  if (under_way || bushd_delay_is_code(units)) {
    shortest_delay_ = units;
  } else {
    make_slower(asked_ns);
  }
}

Result<void> Way::take(double duration_s, double longest_ns) {
  if (!std::isfinite(duration_s) || duration_s <= 0) {
    return fail(fmt::format("duration of {} s; allowed: above 0", duration_s));
  }
  const double wanted_ns = duration_s * 1e9;
  const double least_ns = duration_ns();
  // What a dry run has told must not be refused for its last digit.
  if (wanted_ns < least_ns * (1 - 1e-6)) {
    return fail(
        fmt::format("duration of {:.6g} s: the line takes at least {} s; ask for that or more",
                    duration_s, text_of_least(least_ns * 1e-9)));
  }
  const double most_ns =
      std::min(static_cast<double>(longest_) * BUSHD_LONGEST_DELAY_NS, longest_ns);
  if (wanted_ns > most_ns) {
    return fail(
        fmt::format("duration of {:.6g} s: the line takes at most {} s; ask for that or less",
                    duration_s, text_of_most(most_ns * 1e-9)));
  }
  if (wanted_ns > duration_ns(UINT16_MAX)) {
    make_slower(wanted_ns / longest_);
    return {};
  }
  // The least value by which it is so long: the longer the shortest delay, the longer the line.
  bushd_delay low = shortest_delay_;
  bushd_delay high = UINT16_MAX;
  while (low < high) {
    const bushd_delay middle = low + (high - low) / 2;
    if (duration_ns(middle) >= wanted_ns) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  shortest_delay_ = low;
  return {};
}

}  // namespace bushd::motion
