// A motor's part of a line whose other motors are at ports of their own (link/line_pace.h).
//
// The port makes the whole run's part of its motor, by times of the run, which the pace turns into
// times of the clock. Bytes keep the delays between steps, as of every run; here is that no byte
// begins before the time of its first step, or, while others are under way before it, not more than
// LinePace::kAheadNs before. What the motor's own table asks for at rest, its longest delay, is
// enough between two steps, so a step that has to wait for its time waits no longer than that
// behind the one before it.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "heritage/serial_pulse/master.h"

namespace bushd::serial_pulse {

using link::LinePace;
using link::Tick;

void SerialPulseMaster::begin_in_pace(link::McuIndex mcu, std::uint8_t motor, Tick start,
                                      LinePace::Place place) {
  const auto plan = source_.plan_on_line_at(mcu, motor, start);
  if (!plan || run_ || !status_) {
    events_.push_back(link::StartMissed{mcu, motor});
    return;
  }
  begin_run(base_us_, *plan, start, true);
  run_->pace.emplace(std::move(place));
  run_->pace->give_to(this);
  line_note_.clear();
  tell_note();
}

std::optional<link::MotorPlan> SerialPulseMaster::plan_from(Tick first) {
  if (run_->on_line) return source_.plan_on_line_at({0}, 0, first);
  const auto run = source_.plan_at({0}, 0, first);
  if (!run) return std::nullopt;
  return link::MotorPlan{.run = *run, .line = {}};
}

// The ticks of the line are those of its run's time, the same for all of its motors.
Tick SerialPulseMaster::line_clock(std::int64_t now_us) const {
  if (!run_->pace->begun()) return run_->start;
  return run_->start +
         std::max<std::int64_t>(run_->pace->run_ns(now_us * 1000), 0) / setup_.tick_ns;
}

// One that has made its last step waits until the run is over, so that its ticks are those of the
// others.
bool SerialPulseMaster::line_is_over(std::int64_t now_us) {
  Run& run = *run_;
  if (!run.pace) return true;
  advance_ticks(now_us, false);
  if (run.by_ticks.over()) return true;
  if (run.tick < run.start || run.tick >= line_clock(now_us)) return false;
  Ticks next = run.by_ticks;
  next.pass(setup_.tick_ns);
  return next.over();
}

// When its next step can be made, and whether it can at all.
void SerialPulseMaster::tell_line(std::int64_t now_us) {
  Run& run = *run_;
  if (run.ahead.left() == 0) {
    if (now_us >= run.not_before_us) run.pace->ready(now_us * 1000);
    return;
  }
  if (!run.pace->begun()) return;
  Steps next = run.ahead;
  next.take_ns();
  const std::int64_t earliest_ns =
      std::max({line_free_ns_, now_us * 1000, run.not_before_us * 1000});
  run.pace->cannot_be_before(earliest_ns, next.time_ns());
}

// Precondition: it could write its next byte.
bool SerialPulseMaster::waits_for_line(std::int64_t now_us) {
  Run& run = *run_;
  const std::int64_t now_ns = now_us * 1000;
  if (!run.pace->ready(now_ns)) {
    wake_at(now_us + LinePace::kAskUs);
    return true;
  }
  Steps next = run.ahead;
  next.take_ns();
  const std::int64_t due_ns = run.pace->due_ns(next.time_ns());
  const bool follows = line_free_ns_ > now_ns;  // bytes that are under way
  if (due_ns <= std::max(line_free_ns_, now_ns) + (follows ? LinePace::kAheadNs : 0)) return false;
  wake_at(us_of(due_ns));
  return true;
}

// Behind the last byte that was written another delay has to be kept than was planned then.
void SerialPulseMaster::keep_delay_of(const Steps& ahead) {
  if (!run_->on_line || run_->written == 0) return;
  Steps next = ahead;
  const std::uint64_t delay_ns = next.take_ns();
  if (delay_ns <= run_->kept_ns) return;
  run_->hold_us = std::max(run_->hold_us, hold_us_of(delay_ns, run_->kept_ns));
}

// From when the last byte has left for sure, `kept_ns` after its last step at the least.
std::int64_t SerialPulseMaster::hold_us_of(std::uint64_t delay_ns, std::uint64_t kept_ns) const {
  std::uint64_t least_ns = delay_ns;
  if (run_->pace) {
    const std::uint16_t longest = std::max(table().accel.code[0], table().decel.code[0]);
    least_ns = std::min(least_ns, std::uint64_t{longest} * table().time_unit_ns);
  }
  const std::uint64_t rest_ns = least_ns > kept_ns ? least_ns - kept_ns : 0;
  return std::max<std::int64_t>(us_of(static_cast<std::int64_t>(rest_ns)), 1);
}

// Within a byte steps are even.
link::RunProgress SerialPulseMaster::progress_at(std::int64_t now_ns) const {
  std::int64_t left_ns = run_->left_ns;
  for (const Sent& byte : sent_) {
    const std::int64_t begun_ns = byte.gone_ns - byte.takes_ns;
    if (now_ns < begun_ns) return {left_ns, byte.first_ns};
    left_ns = byte.last_ns;
    if (now_ns >= begun_ns + byte.last_step_ns) continue;
    const double share =
        static_cast<double>(now_ns - begun_ns) / static_cast<double>(byte.last_step_ns);
    const auto passed =
        static_cast<std::int64_t>(share * static_cast<double>(byte.last_ns - byte.first_ns));
    return {byte.first_ns + passed, byte.first_ns + passed};
  }
  if (run_->ahead.left() == 0) return {left_ns, INT64_MAX};
  Steps next = run_->ahead;
  next.take_ns();
  return {left_ns, next.time_ns()};
}

void SerialPulseMaster::measure_line(std::int64_t now_us) {
  if (!run_ || !run_->pace || !run_->pace->begun()) return;
  const std::int64_t ahead_ns = run_->pace->measure(now_us * 1000);
  health_.clock_offset_us = 1e-3 * static_cast<double>(ahead_ns);
  char text[96];
  std::snprintf(text, sizeof text,
                "on a line: %.1f ms ahead of the slowest port; ports were at most %.1f ms apart",
                1e-6 * static_cast<double>(ahead_ns),
                1e-6 * static_cast<double>(run_->pace->most_ahead_ns()));
  line_note_ = text;
  tell_note();
}

void SerialPulseMaster::tell_note() {
  view_.note = pauses_note_;
  if (!pauses_note_.empty() && !line_note_.empty()) view_.note += "; ";
  view_.note += line_note_;
}

}  // namespace bushd::serial_pulse
