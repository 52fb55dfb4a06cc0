#include "sim/pace.h"

#include <algorithm>
#include <utility>

namespace bushd::sim {
namespace {

constexpr TimeNs kFaster = 63;  // 1/64 by sync and 50 ppm by the crystal are less than 1/63

// A side's delays in ns from slow to fast, the cruise delay at the end.
std::vector<TimeNs> delays(const bushd_table& table, const bushd_ramp& side) {
  std::vector<TimeNs> ns;
  for (std::uint32_t i = 0; i < side.count && side.code[i] > table.cruise; ++i) {
    ns.push_back(TimeNs{side.code[i]} * table.time_unit_ns);
  }
  ns.push_back(TimeNs{table.cruise} * table.time_unit_ns);
  return ns;
}

// E of every delay of a side in the fine format: of all ticks that contain a step, the worst. A
// tick that begins within delay s reaches as far as the delays after s sum up to it.
std::vector<TimeNs> fine_tolerances(const std::vector<TimeNs>& delay_ns, TimeNs tick_ns,
                                    std::uint16_t slots) {
  std::vector<TimeNs> tolerance(delay_ns.size(), 0);
  for (std::size_t s = 0; s < delay_ns.size(); ++s) {
    std::size_t e = s;
    for (TimeNs sum = 0; sum < tick_ns && e + 1 < delay_ns.size();) sum += delay_ns[++e];
    const auto slow = static_cast<double>(delay_ns[s]);
    const double change = 1.0 / static_cast<double>(delay_ns[e]) - 1.0 / slow;
    const double off = (change * static_cast<double>(tick_ns) / 4 + 1.0 / 256) * slow;
    const TimeNs worst = std::min(tick_ns, static_cast<TimeNs>(off) + 1) + tick_ns / slots + 1;
    for (std::size_t i = s; i <= e; ++i) tolerance[i] = std::max(tolerance[i], worst);
  }
  return tolerance;
}

std::vector<TimeNs> coarse_tolerances(const std::vector<TimeNs>& delay_ns, TimeNs tick_ns,
                                      std::uint16_t slots) {
  std::vector<TimeNs> tolerance;
  for (const TimeNs delay : delay_ns)
    tolerance.push_back(std::min(tick_ns, delay) + tick_ns / slots);
  return tolerance;
}

// For every delay of the accelerating side, how long a ramp-down from it or from a slower one takes
// at most. Just below D(n-1) the running step is longest of all that n steps follow.
// An MCU may take it for faster: by 1/256 step a tick in the fine format. In the coarse one it
// counts the steps of four ticks, at most one more than pass in that time, and adds one.
std::vector<TimeNs> ramp_downs(const std::vector<TimeNs>& delay_ns,
                               const std::vector<TimeNs>& stop_delay_ns, TimeNs window_ns,
                               TimeNs too_many) {
  std::vector<TimeNs> all;
  TimeNs longest_ns = std::max(delay_ns.front(), stop_delay_ns.front());
  TimeNs steps_ns = 0;
  std::size_t n = 0;
  for (const TimeNs delay : delay_ns) {
    const TimeNs taken_for = window_ns / (window_ns / delay + too_many);
    while (n < stop_delay_ns.size() && stop_delay_ns[n] > taken_for) {
      steps_ns += stop_delay_ns[n];
      longest_ns = std::max(longest_ns, stop_delay_ns[n++] + steps_ns);
    }
    all.push_back(longest_ns);
  }
  return all;
}

}  // namespace

PaceRules::PaceRules(const bushd_table& table, std::uint32_t tick_ns, std::uint16_t slots,
                     bushd_format format)
    : tick_ns_(tick_ns), longest_told_ns_(TimeNs{UINT16_MAX} * table.time_unit_ns) {
  const bool fine = format == BUSHD_FORMAT_FINE;
  const auto tolerances = fine ? fine_tolerances : coarse_tolerances;
  delay_ns_ = delays(table, table.accel);
  tolerance_ns_ = tolerances(delay_ns_, tick_ns_, slots);
  const std::vector<TimeNs> stop_delay_ns = delays(table, table.decel);
  const std::vector<TimeNs> stop_tolerance = tolerances(stop_delay_ns, tick_ns_, slots);
  // By delay, rising with it, whichever side the motor is on.
  std::size_t s = stop_delay_ns.size();
  TimeNs worst = 0;
  for (std::size_t k = delay_ns_.size(); k-- > 0;) {
    worst = std::max(worst, tolerance_ns_[k]);
    while (s > 0 && (k == 0 || stop_delay_ns[s - 1] <= delay_ns_[k])) {
      worst = std::max(worst, stop_tolerance[--s]);
    }
    tolerance_ns_[k] = worst;
  }
  rest_ns_ = std::max(delay_ns_.front(), stop_delay_ns.front()) + tick_ns_ + 2 * worst;
  rest_ns_ += rest_ns_ / kFaster;
  ramp_down_ns_ = fine ? ramp_downs(delay_ns_, stop_delay_ns, 256 * tick_ns_, 1)
                       : ramp_downs(delay_ns_, stop_delay_ns, 4 * tick_ns_, 2);
  for (TimeNs& ns : ramp_down_ns_) ns += ns / kFaster + 2 * worst + tick_ns_;
  stop_ns_.push_back(0);
  for (const TimeNs delay : stop_delay_ns) stop_ns_.push_back(stop_ns_.back() + delay);
  for (TimeNs& ns : stop_ns_) ns -= ns / kFaster;
  for (TimeNs& ns : delay_ns_) ns -= ns / kFaster;
}

void Pace::remember(TimeNs t_ns) {
  newest_ = (newest_ + 1) % kHistory;
  time_ns_[newest_] = t_ns;
  count_ = std::min(count_ + 1, kHistory);
}

void Pace::start(TimeNs t_ns, bool positive) {
  count_ = 0;
  remember(t_ns);
  positive_ = positive;
  excused_ = false;
  first_ns_ = t_ns;
  k_ = 0;
  cursor_ = 0;
  exact_ns_ = t_ns - rules_->tolerance_ns(0);
}

Jump Pace::step(TimeNs t_ns, bool positive) {
  const Jump jump = judged(t_ns, positive);
  if (std::exchange(begins_, false)) first_ns_ = t_ns;
  return jump;
}

Jump Pace::judged(TimeNs t_ns, bool positive) {
  end_line_if_over(t_ns);
  if (count_ == 0) {
    start(t_ns, positive);
    return Jump::kNone;
  }
  const TimeNs apart_ns = t_ns - last_ns();
  if (!on_line_ && apart_ns >= rules_->rest_ns()) {
    const Jump jump = come_to_rest();
    start(t_ns, positive);
    return jump;
  }
  if (positive != positive_) {
    const TimeNs least_ns = on_line_ ? rules_->delay_ns(0) / 2 : rules_->delay_ns(0);
    too_early_ns_ = least_ns - rules_->tick_ns() - 2 * rules_->tolerance_ns(0) - apart_ns;
    const TimeNs first_ns = first_ns_;
    const Jump jump = come_to_rest();
    start(t_ns, positive);
    if (on_line_) first_ns_ = first_ns;  // that was no rest
    return too_early_ns_ > 0 ? Jump::kTurned : jump;
  }
  while (cursor_ < rules_->last() && rules_->delay_ns(cursor_ + 1) >= 4 * apart_ns) ++cursor_;
  while (cursor_ > 0 && rules_->delay_ns(cursor_) < 4 * apart_ns) --cursor_;
  const TimeNs tolerance_ns = rules_->tolerance_ns(cursor_);
  k_ = std::min(k_ + 1, rules_->last());
  const TimeNs earliest_ns = exact_ns_ + rules_->delay_ns(k_);
  exact_ns_ = std::max(earliest_ns, t_ns - tolerance_ns);
  while (!on_line_ && k_ > 0 && rules_->delay_ns(k_) < apart_ns - 2 * tolerance_ns) --k_;
  remember(t_ns);
  too_early_ns_ = earliest_ns - tolerance_ns - t_ns;
  if (too_early_ns_ <= 0) return Jump::kNone;
  // Reported once; what follows is measured from here.
  exact_ns_ = t_ns;
  return Jump::kTooFast;
}

Jump Pace::come_to_rest() {
  const std::size_t known = std::min(count_ - 1, rules_->stop_steps());
  const TimeNs slack_ns = 2 * rules_->tolerance_ns(0);
  const TimeNs last = last_ns();
  count_ = 0;
  if (excused_) return Jump::kNone;
  for (std::size_t n = 1; n <= known; ++n) {
    const TimeNs took_ns = last - time_ns_[(newest_ + kHistory - n) % kHistory];
    if (took_ns + slack_ns < rules_->stop_ns(n)) return Jump::kStoppedDead;
  }
  return Jump::kNone;
}

}  // namespace bushd::sim
